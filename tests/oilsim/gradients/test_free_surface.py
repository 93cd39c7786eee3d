"""The state of every particle at a free surface, against sums over all pairs in double precision."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import block, tank_walls
from oilsim.gradients.free_surface import SPRAY, SURFACE, FreeSurface
from oilsim.neighborhood.smoothing_kernels import SUPPORT, kernel, kernel_slope_over_q, normalisation
from tests.oilsim.conftest import disturbed, search, sum_up

SPACING = 0.1


def states(fluid):
    """The state (N,) of each particle at the present positions."""
    search(fluid)
    sum_up(fluid, 1e-3)
    return fluid.arrays.sums.surface


def expected(position, dimension):
    """The same of particles (N, 3) without walls, from their sums and slopes."""
    x = position.astype(np.float64) / SPACING
    apart = x[:, None] - x[None]
    q = np.linalg.norm(apart, axis=2) / SUPPORT
    sigma = normalisation(1.0, dimension)
    density = kernel(q, sigma).sum(axis=1)
    slope = np.linalg.norm((kernel_slope_over_q(q, sigma)[:, :, None] * apart).sum(axis=1), axis=1) / SUPPORT**2
    exposed = np.where(slope > SURFACE, FreeSurface.AT_SURFACE, FreeSurface.INSIDE)
    exposed[density < SPRAY] = FreeSurface.IN_SPRAY
    near = ((q < 1.0) & (exposed > 0)[None]).any(axis=1)
    return np.maximum(exposed, near)


@pytest.mark.parametrize("dimension", [2, 3])
def test_states_follow_from_density_and_slope(make_fluid, dimension):
    fluid = make_fluid(dimension=dimension)
    points = disturbed(block((0.3,) * 3, (1.7,) * 3, SPACING, dimension), 0.1 * SPACING, 0)
    points = np.concatenate([points, [(0.1, 0.1, 0.05)]])  # a drop
    if dimension == 2:
        points[:, 1] = 0.0
    fluid.add_particles(points, phase="water")
    found = states(fluid)
    assert np.array_equal(found, expected(fluid.state.position.T, dimension))
    assert set(found) == set(FreeSurface)


@pytest.mark.parametrize("dimension", [2, 3])
def test_layers_of_a_pool_lie_at_near_and_inside(make_fluid, dimension):
    fluid = make_fluid(dimension=dimension, lower=(-0.5,) * 3, upper=(1.5,) * 3)
    sides = ("-x", "+x", "-z") + (("-y", "+y") if dimension == 3 else ())
    fluid.add_boundary(tank_walls((0, 0, 0), (1, 1, 1), SPACING, sides=sides, dimension=dimension))
    fluid.add_particles(block((0, 0, 0), (1, 1, 0.8), SPACING, dimension), phase="water")
    found = states(fluid)
    # the side walls, which go on above the water, are out of the kernel's reach of 2.75 spacings; the floor counts like liquid
    sides = fluid.state.position[[0, 1] if dimension == 3 else [0]]
    away = (np.abs(sides - 0.5) < 0.2).all(axis=0)
    found, depth = found[away], np.round((0.75 - fluid.state.position[2, away]) / SPACING)
    assert (found[depth == 0] == FreeSurface.AT_SURFACE).all()
    assert (found[(depth == 1) | (depth == 2)] == FreeSurface.NEAR_SURFACE).all()
    assert (found[depth > 2] == FreeSurface.INSIDE).all()
    assert np.count_nonzero(depth > 2) > 0
