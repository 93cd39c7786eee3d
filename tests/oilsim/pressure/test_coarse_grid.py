"""The coarse grid: the operator's inverse in what is smooth, symmetric, blind to where a period begins, and what solves owe to it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from oilsim import Phase, block, tank_walls
from oilsim.pressure.coarse_grid import CELL, LEFT
from oilsim.stages.explicit import wrap_periodic
from tests.oilsim.conftest import disturbed, operator_of

WATER = Phase(name="water", rest_density=1000.0)
OIL = Phase(name="oil", rest_density=800.0)


def pool(make_fluid, length, depth, spacing, dimension=2, periodic=False, phase="water", **options):
    """Water, or oil, in a tank, or between periodic sides, as wide as long in three dimensions."""
    width = length if dimension == 3 else 0.0
    room = 4 * spacing
    fluid = make_fluid(
        1, particle_spacing=spacing, dimension=dimension, periodic=(periodic, False, False), phases=(WATER, OIL),
        lower=(0.0 if periodic else -room, -1.0, -room), upper=(length + (0.0 if periodic else room), width + 1.0, 2 * depth + room),
        **options,
    )  # fmt: skip
    sides = ("-z", *(() if periodic else ("-x", "+x")), *(("-y", "+y") if dimension == 3 else ()))
    fluid.add_boundary(tank_walls((0, 0, 0), (length, width, 2 * depth), spacing, sides=sides, dimension=dimension))
    fluid.add_particles(block((0, 0, 0), (length, width, depth), spacing, dimension), phase=phase)
    return fluid


def laid(fluid):
    """The operator of the last step, begun on a disordered lattice, and the coarse grid laid over its particles."""
    context, arrays, state = fluid.context, fluid.arrays, fluid.state
    state.position[:] = disturbed(state.position.T, 0.02 * fluid.config.particle_spacing, 1).T
    if fluid.config.dimension == 2:
        state.position[1] = 0.0
    wrap_periodic(state.position, fluid.config.lower, fluid.context.constants.period)
    fluid.advance(1e-3)
    context.coarse.lay(state.position, arrays.neighbors.points, arrays.pairs.sums.openness)
    return operator_of(fluid)


def corrected(fluid, residual):
    """The correction of a residual, in float64."""
    correction = np.zeros_like(residual)
    fluid.context.coarse.correct(residual, np.ones_like(residual), correction)
    return correction.astype(np.float64)


@pytest.mark.parametrize("mode", [0, 1, 2])
@pytest.mark.parametrize(
    ("layers", "dimension", "phase"), [(16, 2, "water"), (32, 2, "water"), (64, 2, "water"), (32, 2, "oil"), (16, 3, "water")]
)  # fmt: skip
def test_what_is_smooth_is_all_but_solved_for(make_fluid, layers, dimension, phase, mode):
    # 0 at the surface, no slope across walls; trilinear shares are of second order, where the surface cuts cells of first
    fluid = pool(make_fluid, 1.0, 1.0, 1.0 / layers, dimension, phase=phase)
    operator = laid(fluid)
    x, _, z = fluid.state.position.astype(np.float64)
    pressure = np.cos(mode * math.pi * x) * np.cos(0.5 * math.pi * z)
    residual = np.empty(fluid.state.count, np.float32)
    operator.apply(pressure.astype(np.float32), residual)
    cell, square = CELL / layers, math.pi**2 * (mode**2 + 0.25)
    error = np.linalg.norm(corrected(fluid, residual) - pressure) / np.linalg.norm(pressure)
    assert error < 0.5 * cell + 0.1 * square * cell**2


def test_correction_is_symmetric_and_positive(make_fluid):
    fluid = pool(make_fluid, 1.0, 0.6, 0.05)
    laid(fluid)
    one, other = np.random.default_rng(3).standard_normal((2, fluid.state.count)).astype(np.float32)
    to_one, to_other = corrected(fluid, one), corrected(fluid, other)
    size = math.sqrt((one @ to_one) * (other @ to_other))
    assert one @ to_one > 0.0
    assert other @ to_one == pytest.approx(one @ to_other, abs=3 * LEFT * size)


def test_a_period_may_begin_anywhere(make_fluid):
    fluid = pool(make_fluid, 40 * 0.05, 0.6, 0.05, periodic=True)
    laid(fluid)
    context, arrays, state = fluid.context, fluid.arrays, fluid.state
    residual = np.random.default_rng(3).standard_normal(state.count).astype(np.float32)
    before = corrected(fluid, residual)
    state.position[0] = (state.position[0] + 3 * CELL * 0.05) % 2.0
    context.coarse.lay(state.position, arrays.neighbors.points, arrays.pairs.sums.openness)
    after = corrected(fluid, residual)
    assert np.linalg.norm(after - before) < 3 * LEFT * np.linalg.norm(before)


def rms(fluid, steps):
    """Rms speed [m/s] over so many tenths of a second."""
    squares = []
    for _ in range(steps):
        fluid.advance(0.1)
        squares.append(float(np.square(fluid.state.velocity.astype(np.float64)).sum(axis=0).mean()))
    return math.sqrt(np.mean(squares))


def test_still_water_lies_still(make_fluid):
    # what solves leave errs the same way over the whole depth without the grid: 0.19 %
    fluid = pool(make_fluid, 1.0, 1.0, 1.0 / 32, maximum_time_step=1e-2)
    rms(fluid, 50)
    assert rms(fluid, 20) < 5e-4 * math.sqrt(9.81)


@pytest.mark.slow
def test_a_loose_solve_does_not_feed_waves(make_fluid):
    # a wave as long as two basins; with the last step's pressure alone to begin with it came late, and the wave grew by a half
    length, depth = 2.01, 0.3
    fluid = pool(make_fluid, length, depth, 0.03, maximum_time_step=0.04, divergence_tolerance=7e-4)
    x, _, z = math.pi / length * fluid.state.position
    fluid.state.velocity[0], fluid.state.velocity[2] = 0.2 * np.sin(x), -0.2 * z * np.cos(x)
    first = rms(fluid, 50)
    rms(fluid, 200)
    assert 0.7 * first < rms(fluid, 50) < 0.95 * first
