"""Drops that are faster than walls are thick stay inside, and water does not throw them back faster than they came."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit

from oilsim import block, tank_walls
from oilsim.boundaries.boundary_particles import wall_coverage
from oilsim.boundaries.wall_contact import DISTANCES, PLACES, flat_wall
from oilsim.fluid.time_step import REACH

SPACING = 0.1
STILL = (0.0, 0.0, 0.0)


@njit
def flat_wall_of(coverage, coverages):
    return flat_wall(coverage, coverages)


@pytest.mark.parametrize("dimension", [2, 3])
def test_coverage_tells_the_distance_from_a_flat_wall(dimension):
    coverages = np.array([wall_coverage(float(h), dimension) for h in np.linspace(*DISTANCES, PLACES)], np.float32)
    for distance in (-0.4, 0.0, 0.26, 0.77, 1.5, 2.0):
        found, steepness = flat_wall_of(np.float32(wall_coverage(distance, dimension)), coverages)
        # linear between places 0.05 apart, over which the coverage bends by a few per cent of its slope
        assert found == pytest.approx(distance, abs=3e-3)
        change = wall_coverage(distance - 1e-3, dimension) - wall_coverage(distance + 1e-3, dimension)
        assert steepness == pytest.approx(change / 2e-3, rel=0.2, abs=1e-3)
    assert flat_wall_of(np.float32(0.0), coverages)[0] == pytest.approx(float(DISTANCES[1]))
    assert flat_wall_of(np.float32(9.0), coverages)[0] == pytest.approx(float(DISTANCES[0]))


@pytest.mark.parametrize("dimension", [2, 3])
def test_drops_cross_no_wall_however_fast(make_fluid, dimension):
    # 200 drops in a closed tank, each step REACH spacings of the fastest
    rng = np.random.default_rng(4)
    sides = ("-x", "+x", "-z", "+z") + (("-y", "+y") if dimension == 3 else ())
    fluid = make_fluid(dimension=dimension, gravity=STILL, lower=(-0.5,) * 3, upper=(2.5,) * 3, maximum_time_step=1.0)
    fluid.add_boundary(tank_walls((0, 0, 0), (2, 2, 2), SPACING, sides=sides, dimension=dimension))
    points = rng.uniform(0.1, 1.9, (60 if dimension == 2 else 200, 3))
    velocity = rng.normal(0.0, 5.0, points.shape)
    if dimension == 2:
        points[:, 1] = velocity[:, 1] = 0.0
    fluid.add_particles(points, phase="water", velocity=velocity)
    fluid.advance(1e-6)
    before = fluid.energy().kinetic
    for _ in range(40):
        fastest = float(np.linalg.norm(fluid.state.velocity, axis=0).max())
        fluid.advance(REACH * SPACING / max(fastest, 0.5))
        used = fluid.state.position[[0, 2] if dimension == 2 else [0, 1, 2]]
        # a particle that walls press lies at half a spacing; none is a quarter into them
        assert used.min() > -0.25 * SPACING and used.max() < 2.0 + 0.25 * SPACING
    assert fluid.energy().kinetic < 0.9 * before


@pytest.mark.parametrize("speed", [3.0, 10.0, 30.0])
def test_a_drop_is_not_thrown_back_faster_than_it_came(make_fluid, speed):
    fluid = make_fluid(lower=(-0.5,) * 3, upper=(1.5, 1.5, 3.0), gravity=STILL)
    fluid.add_boundary(tank_walls((0, 0, 0), (1, 1, 1), SPACING, sides=("-x", "+x", "-y", "+y", "-z"), dimension=3))
    fluid.add_particles(block((0, 0, 0), (1, 1, 0.5), SPACING), phase="water")
    fluid.add_particles([(0.52, 0.47, 0.9)], phase="water", velocity=(0.0, 0.0, -speed))
    fastest = []
    for _ in range(60):
        fluid.advance(0.25 * SPACING / speed * 4)
        fastest.append(float(np.linalg.norm(fluid.state.velocity, axis=0).max()))
    assert max(fastest) < 1.01 * speed
    assert fastest[-1] < 0.5 * speed


@pytest.mark.parametrize("speed", [-0.1, 0.1])
def test_water_midway_between_floor_and_keel_is_not_thrown_out(make_fluid, speed):
    # the slopes of both walls' coverage cancel in the middle layer: a particle there has no side on which to stop
    gap = 3.0 * SPACING
    fluid = make_fluid(
        dimension=2, gravity=STILL, lower=(-1.0, -1.0, -1.0), upper=(3.0, 1.0, 2.0), maximum_time_step=0.01
    )
    fluid.add_boundary(tank_walls((0, 0, 0), (2, 0, gap), SPACING, sides=("-z",), dimension=2))
    keel = fluid.add_boundary(tank_walls((0, 0, 0), (2, 0, gap), SPACING, sides=("+z",), dimension=2))
    fluid.set_boundary_motion(keel, STILL, (0, 0, 0, 1), (0, 0, speed), STILL, inverse_mass=0.01 * np.eye(6))
    fluid.add_particles(block((0.5, 0, 0), (1.5, 0, gap), SPACING, 2), phase="water")
    for _ in range(10):
        fluid.advance(0.01)
        # what is squeezed out from under a keel leaves at (half its length / gap) times the keel's speed
        assert np.linalg.norm(fluid.state.velocity, axis=0).max() < 4.0 * abs(speed)
        assert np.abs(fluid.boundary_twist(keel)[:3]).max() < 1.01 * abs(speed)
