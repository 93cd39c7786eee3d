"""Eq. 30 and 31; and the step of liquid that moves without deforming, shears, meets a wall, or flies as spray."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import BoundaryParticles, block, tank_walls
from oilsim.core.config import STABLE
from oilsim.fluid.time_step import (
    REACH,
    cfl_time_step,
    equal_steps,
    largest_relative_speed,
    relative_time_step,
    stable_time_step,
)
from oilsim.neighborhood.smoothing_kernels import lattice_moment, lattice_stiffness
from tests.oilsim.conftest import cache, operator_of, search

SPACING, LIMITS = 0.1, (0.4, 1e-4, 1e-2)
STILL = (0.0, 0.0, 0.0)


def relative_speed(fluid, fastest):
    """u_most [m/s] at the fluid's present positions."""
    search(fluid)
    return largest_relative_speed(fluid.context, fluid.arrays.neighbors.neighborhood, fluid.state, fastest)


def test_eq_30_and_31():
    assert cfl_time_step(SPACING, 0.0, *LIMITS) == 1e-2
    assert cfl_time_step(SPACING, 8.0, *LIMITS) == pytest.approx(0.4 * SPACING / 8.0)
    assert cfl_time_step(SPACING, 1e9, *LIMITS) == 1e-4
    assert equal_steps(0.01, 0.004) == pytest.approx(0.01 / 3)


@pytest.mark.parametrize(
    ("fastest", "relative", "expected"),
    [
        (1.0, 0.0, 1e-2),  # the largest step, 0.1 d
        (20.0, 0.0, REACH * 0.1 / 20.0),  # moves as one: all that it could not see is still a spacing off
        (20.0, 16.0, 0.4 * 0.1 / 16.0),  # deforms: cfl spacings a step, relative to each other
        (20.0, 40.0, 0.4 * 0.1 / 20.0),  # never shorter than Eq. 30
        (1e9, 0.0, 1e-4),  # the shortest
    ],
)
def test_relative_step(fastest, relative, expected):
    assert relative_time_step(SPACING, fastest, relative, *LIMITS) == pytest.approx(expected)


def test_block_in_free_fall_takes_the_longest_step(make_fluid):
    fluid = make_fluid()
    fluid.add_particles(block((0.5, 0.5, 0.5), (1.5, 1.5, 1.5), 0.1), phase="water", velocity=(0.0, 0.0, -6.0))
    assert relative_speed(fluid, 6.0) < 1e-5
    fluid.advance(1e-4)
    # a spacing a step would be 0.0167 s: the largest step is allowed, where Eq. 30 allows 0.0067 s
    assert fluid.advance(0.01).sub_steps == 1


def test_shear_layer_is_limited_by_its_relative_speed(make_fluid):
    fluid = make_fluid()
    points = block((0.1, 0.1, 0.1), (1.9, 1.9, 1.9), 0.1)
    rate = 10.0
    speeds = np.outer(rate * (points[:, 2] - 1.0), (1.0, 0.0, 0.0))
    fluid.add_particles(points, phase="water", velocity=speeds)
    # u^2 = rate^2 <z^2>, the mean over the lattice within H by the weights 1 - r / H
    steps = np.arange(-2, 3)
    offsets = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    weights = np.maximum(1.0 - np.linalg.norm(offsets, axis=1) / 2.75, 0.0)
    weights[np.linalg.norm(offsets, axis=1) == 0.0] = 0.0
    expected = rate * 0.1 * np.sqrt((weights * offsets[:, 2] ** 2).sum() / weights.sum())
    assert relative_speed(fluid, 9.0) == pytest.approx(expected, rel=0.1)  # at edges half of the neighbours are missing


def test_spray_does_not_count(make_fluid):
    fluid = make_fluid(maximum_time_step=1.0)
    fluid.add_particles(block((0.5, 0.5, 0.5), (1.5, 1.5, 1.0), 0.1), phase="water")
    fluid.add_particles([(0.2, 0.2, 1.8), (0.25, 0.2, 1.8)], phase="water", velocity=[(9.0, 0, 0), (-9.0, 0, 0)])
    assert relative_speed(fluid, 9.0) == 0.0


def test_approach_to_a_wall_counts_and_sliding_along_it_does_not(make_fluid):
    for velocity, expected in (((0.0, 0.0, -3.0), 3.0), ((3.0, 0.0, 0.0), 0.0), ((0.0, 0.0, 3.0), 0.0)):
        fluid = make_fluid(lower=(-0.3,) * 3, maximum_time_step=1.0)
        fluid.add_boundary(tank_walls((0, 0, 0), (2, 2, 2), 0.1, sides=("-z",)))
        fluid.add_particles([(1.0, 1.0, 0.08)], phase="water", velocity=velocity)
        assert relative_speed(fluid, 3.0) == pytest.approx(expected, abs=0.2)  # points of the wall lie unevenly


def test_approach_of_a_body_that_turns_counts(make_fluid):
    fluid = make_fluid(maximum_time_step=1.0)
    fluid.add_particles([(1.2, 1.0, 1.1)], phase="water")
    plate = np.stack(np.meshgrid(np.arange(-8, 9), np.arange(-8, 9), [0]), axis=-1).reshape(-1, 3) * 0.06
    handle = fluid.add_boundary(
        BoundaryParticles(name="plate", position=plate, volume=np.full(len(plate), 1e-4), area=np.zeros(len(plate)))
    )
    fluid.set_boundary_motion(handle, (1.0, 1.0, 1.0), (0, 0, 0, 1), STILL, (0.0, -4.0, 0.0))
    # 0.2 m from its axis, a plate that turns at 4 rad/s rises by 0.8 m/s
    assert relative_speed(fluid, 2.0) == pytest.approx(0.8, rel=0.05)


@pytest.mark.parametrize("begins", [False, True])
def test_no_body_that_jumps_goes_further_than_it_would_in_the_first_step(make_fluid, begins):
    fluid, speed = make_fluid(maximum_time_step=0.0141), 12.0
    fluid.add_particles(block((0.8, 0.8, 0.8), (1.4, 1.2, 1.2), 0.1), phase="water")
    plate = block((-0.1, -0.3, -0.3), (0.0, 0.3, 0.3), 0.1)
    handle = fluid.add_boundary(
        BoundaryParticles(name="plate", position=plate, volume=np.full(len(plate), 1e-3), area=np.zeros(len(plate)))
    )
    motion = handle, (0.8, 1.0, 1.0), (0, 0, 0, 1)
    for _ in range(2):
        if not begins:
            fluid.set_boundary_motion(*motion, STILL, STILL)
        fluid.advance(0.0141)
    fluid.set_boundary_motion(*motion, (speed, 0.0, 0.0), STILL)
    assert speed * fluid.advance(0.0141).time_step <= 1.001 * fluid.config.cfl * 0.1


def test_largest_relative_speed_does_not_depend_on_threads(make_fluid):
    found = []
    for threads in (1, 2):
        fluid = make_fluid(threads=threads)
        rng = np.random.default_rng(5)
        fluid.add_particles(rng.uniform(0.1, 1.9, (7000, 3)), phase="water", velocity=rng.normal(0.0, 2.0, (7000, 3)))
        found.append(relative_speed(fluid, 8.0))
    assert found[0] == found[1] > 0.0


def test_paper_scheme_keeps_eq_30(make_fluid):
    fluid = make_fluid(scheme="paper", gravity=STILL)
    fluid.add_particles(block((0.5, 0.5, 0.5), (1.5, 1.5, 1.5), 0.1), phase="water", velocity=(0.0, 0.0, -6.0))
    fluid.advance(1e-4)
    assert fluid.advance(0.01).sub_steps == 2


def test_momentum_of_a_falling_block_is_exact_in_long_steps(make_fluid):
    fluid = make_fluid()
    fluid.add_particles(block((0.5, 0.5, 1.2), (1.5, 1.5, 1.9), 0.1), phase="water")
    mass = fluid.particle_count * 1000.0 * 1e-3
    steps = [fluid.advance(0.01).sub_steps for _ in range(40)]
    assert steps == [1] * 40
    assert fluid.momentum()[2] == pytest.approx(-9.81 * 0.4 * mass, rel=1e-4)


@pytest.mark.parametrize("dimension", [2, 3])
def test_pressed_layers_swing_as_stiffly_as_their_lattice(make_fluid, dimension):
    # layers moved by +-e along x or z under kappa = 1: u = H kappa = c kappa / d^2 times the displacement, for the stiffer of the two
    stiffness = []
    for axis in (0, 2):
        fluid = make_fluid(
            dimension=dimension,
            lower=(0.0,) * 3,
            upper=(1.0,) * 3,
            periodic=(True, dimension == 3, True),
            gravity=STILL,
        )
        points = block((0, 0, 0), (1, 1, 1), SPACING, dimension)
        displacement = 0.01 * SPACING * (-1.0) ** np.round(points[:, 2] / SPACING - 0.5)
        points[:, axis] += displacement
        fluid.add_particles(points, phase="water")
        arrays, state = fluid.arrays, fluid.state
        search(fluid)
        arrays.sums.matrix[:] = 0.0
        arrays.sums.matrix[:, [0, 3, 5]] = 1.0 / lattice_moment(dimension)
        cache(fluid)
        operator_of(fluid).accelerate(np.ones(state.count, np.float32))
        # apply takes u off velocities that were 0
        pushed = state.velocity[axis].astype(np.float64)[np.argsort(state.id)]
        stiffness.append(-float((pushed * displacement).sum() / (displacement**2).sum()) * SPACING**2)
    # twice a sum of vectors, each off by q / sqrt(12) of a quantum q, over a displacement of 1e-2 d: within three deviations
    terms = float(arrays.neighbors.neighborhood.fluid.number[: state.count].mean())
    rounding = 2.0 * np.sqrt(terms / 12.0) * float(arrays.pairs.gradient.quantum) * SPACING / 0.01
    assert max(stiffness) == pytest.approx(lattice_stiffness(dimension), abs=3.0 * rounding)
    assert rounding < 0.003


def test_stable_step_is_that_of_the_pressure(make_fluid):
    head = np.full(1000, 4.0, np.float32)
    head[:5] = 1e6  # 5 in 1000 are not asked
    expected = STABLE * 2.0 * SPACING / (2.0 * np.sqrt(lattice_stiffness(3)))
    assert stable_time_step(SPACING, 3, head) == pytest.approx(expected)
    assert stable_time_step(SPACING, 3, -head) == np.inf
    assert stable_time_step(SPACING, 3, head[:0]) == np.inf
    # 20 layers of 0.1 m: p / rho = 19.6 m2/s2 at the floor, sqrt(2.3 * 19) = 6.6 m/s
    fluid = make_fluid(lower=(-0.5,) * 3, upper=(1.5, 1.5, 3.0), maximum_time_step=0.1)
    fluid.add_boundary(tank_walls((0, 0, 0), (0.4, 0.4, 2.5), SPACING, sides=("-x", "+x", "-y", "+y", "-z")))
    fluid.add_particles(block((0, 0, 0), (0.4, 0.4, 2.0), SPACING), phase="water")
    fluid.advance(0.02)
    longest = STABLE * 2.0 * SPACING / np.sqrt(lattice_stiffness(3) * 9.81 * 1.95)  # of the lowest layer
    assert fluid.advance(0.2).time_step == pytest.approx(longest, rel=0.02)
