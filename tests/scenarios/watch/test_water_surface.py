"""The surface of water that consists of particles: its height, waves and dry places, and how a window's passes into the sea's."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import Phase
from oilsim.sea import RegularWaves, Sea, SeaDescription
from oilsim.window.settings import WindowSettings
from oilsim.window.window import Window
from scenarios.watch.sea_surface import INNER_LINES, OUTER_LINES
from scenarios.watch.water_surface import WINDOW_CELLS, lines_with_window, sea_with_windows, tank_surface, water_height

SPACING = 0.05


def block(top: float, *, seed: int | None = None) -> np.ndarray:
    """Return the particles (N, 3) [m] of water in a tank of 1 m by 0.8 m; a seed puts them off their lattice by up to a quarter."""
    axes = [np.arange(0.5 * SPACING, side, SPACING) for side in (1.0, 0.8, top)]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return places if seed is None else places + np.random.default_rng(seed).uniform(-0.25, 0.25, places.shape) * SPACING


def test_still_water_is_level_to_a_round_off_on_a_lattice_and_to_a_tenth_of_a_spacing_off_it():
    for seed, within in ((None, 1e-6), (0, 0.1 * SPACING)):
        surface = tank_surface(block(0.5, seed=seed), SPACING, (0.0, 0.0, 0.0), (1.0, 0.8, 1.0))
        assert surface.is_clear
        height = surface.height[1:-1, 1:-1]  # within the water's sides
        assert height.mean() == pytest.approx(0.5, abs=within)
        assert np.abs(height - 0.5).max() <= 4.0 * within
        assert (surface.height[[0, -1], :] == 0.0).all()
        assert surface.brightness == pytest.approx(0.86, abs=1e-6 if seed is None else 0.3)


def test_a_wave_has_its_height():
    """Layers of particles that follow a wave of 20 spacings' length, as water does: z = q + a cos kx."""
    places = block(0.5)
    places[:, 2] += 0.04 * np.cos(2.0 * np.pi * places[:, 0])
    x = np.linspace(0.0, 1.0, 11)
    height = water_height(places, x, np.linspace(0.0, 0.8, 9), SPACING)
    assert np.abs(height - 0.5 - 0.04 * np.cos(2.0 * np.pi * x)[:, None]).max() < 0.3 * SPACING


def test_a_dry_floor_is_shown_and_drops_are_left_out():
    places = np.concatenate([block(0.5)[block(0.5)[:, 0] < 0.4], [[0.2, 0.4, 0.95], [0.9, 0.4, 0.6]]])
    surface = tank_surface(places, SPACING, (0.0, 0.0, -0.1), (1.0, 0.8, 1.0))
    x, height = surface.x[1:-1], surface.height[1:-1, 1:-1]
    assert np.isnan(water_height(places, x, surface.y[1:-1], SPACING)[x > 0.5]).all()
    assert height[x > 0.7] == pytest.approx(-0.1, abs=1e-3)
    assert height[x < 0.2] == pytest.approx(0.5, abs=0.02 * SPACING)


@pytest.mark.parametrize(("first", "last"), [(-8.0, 8.0), (90.0, 106.0), (-70.0, 110.0)])
def test_the_grid_is_fine_across_a_window_and_has_as_many_lines_wherever_it_is(first: float, last: float):
    lines = lines_with_window(-60.0, 100.0, first, last)
    assert len(lines) == INNER_LINES + 2 * OUTER_LINES + WINDOW_CELLS
    steps = np.diff(lines)
    assert (steps > 0.0).all()
    inside = (lines[1:] > first) & (lines[:-1] < last)
    assert steps[inside][1:-1].max() <= (last - first) / WINDOW_CELLS + 1e-9


def test_a_window_shows_its_own_water_in_the_sea():
    """An undisturbed window is the sea; a mound of its particles is seen in the middle, and not at the rim."""
    sea = Sea(SeaDescription(depth=30.0, waves=RegularWaves(height=0.2, period=3.0)))
    water = Phase(name="water", rest_density=1027.0, dynamic_viscosity=1.05e-3)
    window = Window(WindowSettings(size=(8.0, 8.0), depth=1.5, spacing=0.25), sea, (water,))
    window.follow(np.zeros(2), 1.0)
    around = np.array([[-20.0, -20.0], [20.0, 20.0]])

    def difference() -> np.ndarray:
        surface = sea_with_windows(sea, 1.0, around, [window])
        return surface.height - sea.grid_elevation(surface.x, surface.y, 1.0)

    assert np.abs(difference()).max() < 0.15 * 0.25  # of a spacing
    place = window.fluid.particles.position.T + np.array([0.0, 0.0, 0.2])
    window.fluid.remove_particles(np.ones(len(place), bool))
    window.fluid.add_particles(place, phase="water")
    mound = difference()
    assert mound.max() == pytest.approx(0.2, abs=0.02)
    assert np.abs(mound[[0, -1], :]).max() == 0.0
