"""A window in an outer one: the outer water's motion by cells, and what the window's rim and its surface make of it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from oilsim import Phase
from oilsim.sea import CurrentProfile, Sea, SeaDescription, SteadyFlow
from oilsim.window.settings import WindowSettings
from oilsim.window.water_motion import WaterMotion
from oilsim.window.window import Window

WATER = (Phase(name="water", rest_density=1027.0, dynamic_viscosity=1e-3),)
CURRENT = Sea(SeaDescription(depth=30.0, current=CurrentProfile(flow=SteadyFlow(speed=0.4))))
SPEED = 0.1  # m/s of the outer water beyond the sea's


@pytest.fixture
def windows() -> Iterator[tuple[Window, Window]]:
    """A window and its outer one."""
    outer = Window(WindowSettings(size=(8.0, 8.0), depth=1.0, spacing=0.25), CURRENT, WATER, 1)
    window = Window(
        WindowSettings(size=(3.0, 3.0), depth=1.0, spacing=0.125), CURRENT, WATER, 1, WaterMotion(outer, whole=True)
    )
    yield window, outer
    window.fluid.close()
    outer.fluid.close()


def test_the_motion_by_cells_is_that_of_a_linear_flow(windows: tuple[Window, Window]) -> None:
    _, outer = windows
    gradient = np.array([[0.02, -0.03, 0.05], [0.04, 0.01, 0.02], [0.0, 0.06, -0.03]])
    outer.fluid.set_velocities((gradient @ outer.fluid.particles.position).astype(np.float32))
    motion = WaterMotion(outer, whole=True)
    motion.measure(0.0)
    places = np.random.default_rng(1).uniform((-3.0, -3.0, -0.7), (3.0, 3.0, -0.3), (50, 3))
    assert motion.at_rest(places) == pytest.approx(places @ gradient.T, abs=1e-6)
    assert motion.at_rest(places + np.array([9.0, 0.0, 0.0])) == pytest.approx(0.0, abs=1e-8)


def test_the_window_comes_to_the_motion_of_the_outer_water(windows: tuple[Window, Window]) -> None:
    """An even flow passes through sides that repeat; what is brought to rest instead would keep none of it."""
    window, outer = windows
    outer.fluid.set_velocities(
        np.array([[SPEED], [0.0], [0.0]], np.float32) * np.ones(outer.fluid.particle_count, np.float32)
    )
    assert window.around is not None
    window.around.measure(0.0)
    window.fluid.advance(5.0)
    velocity = window.fluid.particles.velocity
    assert velocity[0].mean() == pytest.approx(SPEED, rel=0.02)
    assert velocity.std(axis=1).max() < 0.05 * SPEED


def test_an_outer_window_at_rest_changes_nothing() -> None:
    """The water of the window is then the same, to the last bit, as without it."""
    found = []
    for is_nested in (False, True):
        outer = [Window(WindowSettings(size=(8.0, 8.0), depth=1.0, spacing=0.25), CURRENT, WATER, 1)] * is_nested
        window = Window(
            WindowSettings(size=(3.0, 3.0), depth=1.0, spacing=0.125),
            CURRENT,
            WATER,
            1,
            *[WaterMotion(one, whole=True) for one in outer],
        )
        x, y, z = window.fluid.particles.position
        window.fluid.set_velocities(0.1 * np.stack([np.sin(y), np.cos(x), 0.0 * z]).astype(np.float32))
        window.fluid.advance(0.5)
        found.append(window.fluid.particles.position.tobytes())
        for one in (window, *outer):
            one.fluid.close()
    assert found[0] == found[1]


def test_oil_beside_the_window_drifts_with_the_outer_water(windows: tuple[Window, Window]) -> None:
    window, outer = windows
    x = outer.fluid.particles.position[0]
    outer.fluid.set_velocities(np.stack([0.0 * x, 0.02 * x, 0.0 * x]).astype(np.float32))
    surface = WaterMotion(window)
    for motion in (window.around, surface):
        assert motion is not None
        motion.measure(10.0)  # in which the current has carried both windows along
    across = surface.at_surface(np.column_stack([4.0 + np.array([0.0, 2.0, -2.0, 5.0]), np.zeros(4)]))[:, 1]
    assert across == pytest.approx([0.0, 0.04, -0.04, 0.0], abs=1e-6)
