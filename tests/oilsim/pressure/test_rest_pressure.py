"""The pressure of liquid at rest acts by its slope: it is the sums' own within their error, and what they add by noise is gone."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import block, tank_walls
from oilsim.core.config import swing_head, swing_time_step
from oilsim.gradients.free_surface import FreeSurface
from oilsim.pressure.rest_pressure import FADE, SHARE, RestLaw, needed_share, top_of_rest
from tests.oilsim.conftest import disturbed, operator_of, prepare

KICK = 0.0981  # g dt [m/s]


def test_the_slope_is_the_derivative() -> None:
    spacing, step = 0.1, 1e-3
    height = np.linspace(-1.0, 0.2, 241).astype(np.float32)
    below = RestLaw(0.0, spacing, KICK).of(height - np.float32(step))
    above, here = (RestLaw(0.0, spacing, KICK).of(height + np.float32(add)) for add in (step, 0.0))
    np.testing.assert_allclose((below.impulse - above.impulse) / (2.0 * step), here.slope, atol=2e-3 * KICK)
    assert not here.impulse[height >= 0.0].any()
    deep = height < -FADE * spacing
    np.testing.assert_allclose(here.slope[deep], SHARE * KICK, rtol=1e-6)
    np.testing.assert_allclose(here.impulse[deep], SHARE * KICK * (-height[deep] - 0.5 * FADE * spacing), rtol=1e-5)


def test_the_share_is_what_the_step_needs() -> None:
    assert needed_share(10.0, 8.0, 12.0) == 0.0
    assert needed_share(10.0, 8.0, 6.0) == pytest.approx(0.5)
    assert needed_share(10.0, 8.0, 1.0) == SHARE
    assert needed_share(10.0, 0.0, 1.0) == 0.0
    assert swing_time_step(0.1, 3, swing_head(0.1, 3, 0.05)) == pytest.approx(0.05)


def test_the_top_is_the_upper_side_of_the_deepest_free_surface() -> None:
    height = np.array([-0.9, -0.5, -0.1, -0.4], np.float32)
    surface = np.array(
        [FreeSurface.INSIDE, FreeSurface.INSIDE, FreeSurface.AT_SURFACE, FreeSurface.NEAR_SURFACE], np.uint8
    )
    none, pressed = np.zeros(4, np.float32), KICK * np.array([0.9, 0.5, 0.07, 0.4], np.float32)
    assert top_of_rest(height, surface, none, 0.1, KICK) == pytest.approx(-0.35)
    assert top_of_rest(height, surface, pressed, 0.1, KICK) == pytest.approx(-0.05)  # the other is pressed
    assert top_of_rest(height, np.zeros(4, np.uint8), none, 0.1, KICK) == -np.inf


def column(make_fluid, spacing):
    """A disordered column of water 1 m deep between periodic sides in the plane, and the operator of its step."""
    fluid = make_fluid(
        particle_spacing=spacing,
        well_balanced=True,
        dimension=2,
        periodic=(True, False, False),
        lower=(0, 0, -2 * spacing),
        upper=(1, 1, 1.5),
    )
    lower, upper = (0.0, 0.0, 0.0), (1.0, 0.0, 1.0)
    fluid.add_boundary(tank_walls(lower, upper, spacing, sides=("-z",), periodic=(True, False, False), dimension=2))
    points = disturbed(block(lower, upper, spacing, 2), 0.15 * spacing, 3) * (1, 0, 1)
    fluid.add_particles(np.clip(points, (0, 0, 0.2 * spacing), (1 - 1e-6, 0, 1)), phase="water")
    for _ in range(30):  # until it has its density
        fluid.advance(0.01)
    fluid.finish_step()
    prepare(fluid)
    return fluid, operator_of(fluid)


def rise(fluid, operator, *pressures):
    """Return the velocities (3, N) [m/s] that pressures give, in float64."""
    fluid.state.velocity[:] = 0.0
    operator.accelerate(*pressures)
    return fluid.state.velocity.astype(np.float64)


@pytest.mark.parametrize("particles", [16, 32, 64])
def test_sums_and_slope_agree_but_for_noise(make_fluid, particles) -> None:
    """The mean of the sums is the slope within a per cent, and water at rest is left alone but for half of the sums' noise."""
    spacing = 1.0 / particles
    fluid, operator = column(make_fluid, spacing)
    state, arrays = fluid.state, fluid.arrays
    whole = (np.float32(KICK) * (1.0 - state.position[2])).astype(np.float32)
    top = top_of_rest(state.position[2], arrays.sums.surface, whole, spacing, KICK)
    rest = RestLaw(top, spacing, KICK).of(state.position[2])
    by_sums, balanced = rise(fluid, operator, whole), rise(fluid, operator, whole, rest)
    below = (state.position[2] < top - FADE * spacing) & (state.position[2] > 4.0 * spacing)
    assert by_sums[2, below].mean() == pytest.approx(balanced[2, below].mean(), rel=0.01)
    assert balanced[2].sum() == pytest.approx(by_sums[2].sum(), rel=0.01)  # the weight that the floor bears
    left = balanced[:, below] - np.array([[0.0], [0.0], [KICK]])
    noise = by_sums[:, below] - np.array([[0.0], [0.0], [KICK]])
    assert np.sqrt((left**2).mean()) < np.sqrt((noise**2).mean()) / 2.0


def test_deep_water_takes_longer_steps(make_fluid) -> None:
    """Water 16 spacings deep takes steps a third longer, or more, and the bottom bears its weight."""
    steps = []
    for balanced in (False, True):
        fluid = make_fluid(
            dimension=2, well_balanced=balanced, periodic=(True, False, False), lower=(0, 0, -0.2), upper=(1, 1, 2.5),
            maximum_time_step=1.0,
        )  # fmt: skip
        lower, upper = (0.0, 0.0, 0.0), (1.0, 0.0, 1.6)
        fluid.add_boundary(tank_walls(lower, upper, 0.1, sides=("-z",), periodic=(True, False, False), dimension=2))
        fluid.add_particles(disturbed(block(lower, upper, 0.1, 2), 0.002, 1) * (1, 0, 1), phase="water")
        for _ in range(10):  # so that no step is longer before pressures are known
            fluid.advance(0.02)
        report = fluid.advance(4.0)
        steps.append(4.0 / report.sub_steps)
        assert fluid.pressure_at([(0.5, 0.0, 0.1)])[0] == pytest.approx(9810.0 * 1.5, rel=0.01)
        assert np.sqrt((fluid.state.velocity**2).sum(axis=0).mean()) < 0.005 * np.sqrt(9.81 * 1.6)
    assert steps[1] > 4.0 / 3.0 * steps[0]
