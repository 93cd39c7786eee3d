"""Walls at rest hold the water's edge up, and nothing else."""

from __future__ import annotations

import math

import numpy as np
import pytest

from oilsim import block, tank_walls
from oilsim.neighborhood.neighbor_search import Pairs
from oilsim.pressure.wall_extrapolation import hold_waterline

SPACING, GRAVITY = 0.05, 9.81


def test_pressure_in_a_narrow_pool_is_that_of_its_depth(make_fluid):
    side, depth = 8 * SPACING, 10 * SPACING
    fluid = make_fluid(particle_spacing=SPACING, lower=(-0.2, -0.2, -0.2), upper=(side + 0.2, side + 0.2, 2.0 * depth))
    fluid.add_boundary(tank_walls((0, 0, 0), (side, side, 1.6 * depth), SPACING, sides=("-x", "+x", "-y", "+y", "-z")))
    fluid.add_particles(block((0, 0, 0), (side, side, depth), SPACING), phase="water")
    middle = np.array([[0.5 * side, 0.5 * side, z] for z in (0.2, 0.3)])
    heads = []
    for step in range(120):
        fluid.advance(0.01)
        if step >= 60:
            heads.append(np.mean(middle[:, 2] + fluid.pressure_at(middle) / (1000.0 * GRAVITY)))
    # walls that do not hold the edge press the head up by 0.15 spacings here
    assert np.mean(heads) == pytest.approx(depth, abs=0.06 * SPACING)


@pytest.mark.parametrize("thickness", [1, 3])
def test_sheet_falls_freely_along_a_wall(make_fluid, thickness):
    fluid = make_fluid(
        particle_spacing=SPACING, dimension=2, lower=(-0.2, -1.0, -4.0), upper=(1.0, 1.0, 1.0), maximum_time_step=0.005
    )
    fluid.add_boundary(tank_walls((0, 0, -3.5), (0.8, 0, 0.9), SPACING, sides=("-x",), dimension=2))
    fluid.add_particles(block((0, 0, 0), (thickness * SPACING, 0, 0.8), SPACING, 2), phase="water")
    fluid.advance(0.2)
    assert fluid.state.velocity[2].mean() == pytest.approx(-GRAVITY * 0.2, rel=0.01)


@pytest.mark.parametrize("layers", [1, 2, 4])
def test_liquid_slides_freely_down_a_slope(make_fluid, layers):
    slope = math.radians(20.0)
    fluid = make_fluid(
        particle_spacing=SPACING, dimension=2, lower=(0.0, -1.0, -0.2), upper=(1.0, 1.0, 1.0), periodic=(True, False, False),
        gravity=(GRAVITY * math.sin(slope), 0.0, -GRAVITY * math.cos(slope)), maximum_time_step=0.005,
    )  # fmt: skip
    floor = tank_walls((0, 0, 0), (1, 0, 0.8), SPACING, sides=("-z",), periodic=(True, False, False), dimension=2)
    fluid.add_boundary(floor)
    fluid.add_particles(block((0, 0, 0), (1, 0, layers * SPACING), SPACING, 2), phase="water")
    fluid.advance(0.3)
    assert fluid.state.velocity[0].mean() == pytest.approx(GRAVITY * math.sin(slope) * 0.3, rel=0.01)


def test_walls_hold_nothing_where_a_filled_box_is_under_suction():
    one = np.ones(4, np.uint32)
    velocity, waterline = np.zeros((3, 4), np.float32), np.ones((3, 4), np.float32)
    kappa = np.array([-3.0, 0.0, 0.5, 7.0], np.float32)
    hold_waterline(0, 4, Pairs(np.arange(4), one, one), waterline, kappa, np.float32(1.0), np.float32(0.1), velocity)
    np.testing.assert_allclose(velocity, np.tile([0.0, 0.0, 0.05, 0.1], (3, 1)))
