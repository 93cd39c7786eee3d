"""What a particle learns from its neighbours: exact gradients of linear fields, density 0 on a lattice."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import block, tank_walls
from oilsim.gradients.gradient_correction import CorrectionShares
from oilsim.gradients.particle_sums import sum_over_neighbors
from oilsim.gradients.relaxation_time import GRADIENT, LIQUID, WEIGHT
from oilsim.neighborhood.neighbor_search import fill_rows
from oilsim.neighborhood.smoothing_kernels import lattice_moment
from tests.oilsim.conftest import disturbed, search

EPSILON = float(np.finfo(np.float32).eps)
SPACING = 0.1


def fields(fluid):
    """e (N,), g (3, N), flow (N, 16), matrix (N, 6) of a fluid at its present positions."""
    context, arrays, state = fluid.context, fluid.arrays, fluid.state
    search(fluid)
    count = state.count
    compression, gradient = np.empty(count, np.float32), np.empty((3, count), np.float32)
    flow, matrix = np.zeros((count, 16), np.float32), np.empty((count, 8), np.float32)
    fill_rows(0, count, state.velocity, arrays.neighbors.weight, flow)
    flow[:, LIQUID] = state.phase
    shares = CorrectionShares(
        context.constants.moment, context.constants.exact.take(state.phase), context.constants.plane
    )
    sum_over_neighbors(0, count, arrays.neighbors.neighborhood, shares, compression, gradient, flow, matrix)
    return compression, gradient, flow, matrix[:, :6]


def gradients(flow):
    """G (N, 3, 3) of a flow."""
    return flow[:, GRADIENT:].reshape(-1, 3, 4)[:, :, :3]


def linear_field(dimension, seed):
    """A velocity gradient (3, 3) of order 1 / s."""
    matrix = np.random.default_rng(seed).normal(size=(3, 3))
    if dimension == 2:
        matrix[1] = matrix[:, 1] = 0.0
    return matrix


def cloud(dimension, seed, arrangement):
    """Particles at uniformly random places, as many as fill the box, or a lattice disturbed by a fifth of its spacing."""
    points = block((0.5, 0.5, 0.5), (1.5, 1.5, 1.5), SPACING, dimension)
    if arrangement == "random":
        points = np.random.default_rng(seed).uniform(0.5, 1.5, points.shape)
    else:
        points = disturbed(points, 0.2 * SPACING, seed)
    if dimension == 2:
        points[:, 1] = 0.0
    return points


@pytest.mark.parametrize("arrangement", ["random", "disturbed"])
@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("seed", range(2))
def test_gradient_of_a_linear_field_is_exact(make_fluid, dimension, seed, arrangement):
    fluid = make_fluid(dimension=dimension)
    points, slope = cloud(dimension, seed, arrangement), linear_field(dimension, seed)
    fluid.add_particles(points, phase="water", velocity=(points - 1.0) @ slope.T)
    _, _, flow, _ = fields(fluid)
    found = gradients(flow)
    taken = np.abs(found).max(axis=(1, 2)) > 0.0
    # all but lone particles and those on edges of the cloud, whose neighbours hardly span space
    assert taken.mean() > 0.85
    # velocities of order 1 m/s hold EPSILON of it, differences over a spacing EPSILON / d; the inverse of a moment with a
    # determinant of 0.01 and entries up to 1 multiplies that by 100 at most
    bound = 8.0 * EPSILON / SPACING
    assert np.abs(found[taken] - slope).max() < 100.0 * bound
    assert np.median(np.abs(found[taken] - slope)) < bound
    assert flow[:, :3] == pytest.approx(fluid.state.velocity.T)
    assert (flow[:, WEIGHT] == 1.0).all()


@pytest.mark.parametrize("dimension", [2, 3])
def test_lattice_has_no_compression_and_its_own_moment(make_fluid, dimension):
    fluid = make_fluid(dimension=dimension, lower=(0.0,) * 3, upper=(1.0,) * 3, periodic=(True, dimension == 3, True))
    fluid.add_particles(block((0, 0, 0), (1, 1, 1), SPACING, dimension), phase="water")
    compression, gradient, _, matrix = fields(fluid)
    # sums of 20 or 80 terms of order 1 of positions near 1 m, known to EPSILON of that, a spacing's tenth
    bound = 80 * EPSILON
    assert np.abs(compression).max() < bound
    assert np.abs(gradient).max() * SPACING < bound
    moment = lattice_moment(dimension)
    read = [0, 1, 2, 3, 4, 5] if dimension == 3 else [0, 2, 5]  # in two dimensions nothing reads the y of Y
    expected = np.array([1, 0, 0, 1, 0, 1]) / moment
    assert np.abs(matrix - expected)[:, read].max() < bound


@pytest.mark.parametrize("dimension", [2, 3])
def test_walls_complete_the_moment_of_a_lattice(make_fluid, dimension):
    fluid = make_fluid(dimension=dimension, lower=(-0.5,) * 3, upper=(1.5,) * 3)
    sides = ("-x", "+x", "-z", "+z") + (("-y", "+y") if dimension == 3 else ())
    fluid.add_boundary(tank_walls((0, 0, 0), (1, 1, 1), SPACING, sides=sides, dimension=dimension))
    fluid.add_particles(block((0, 0, 0), (1, 1, 1), SPACING, dimension), phase="water")
    compression, gradient, _, matrix = fields(fluid)
    bound = 80 * EPSILON
    assert np.abs(compression).max() < bound
    assert np.abs(gradient).max() * SPACING < bound
    assert np.abs(matrix[:, [0, 5]] - 1.0 / lattice_moment(dimension)).max() < 2 * bound


def test_gradients_are_summed_over_the_liquid_only(make_fluid):
    # walls have no velocity to tell: a linear field is exact beside them too
    slope = linear_field(3, 4)
    fluid = make_fluid(lower=(-0.5,) * 3, upper=(1.5,) * 3)
    fluid.add_boundary(tank_walls((0, 0, 0), (1, 1, 1), SPACING))
    points = disturbed(block((0, 0, 0), (1, 1, 1), SPACING), 0.01, 3)
    fluid.add_particles(points, phase="water", velocity=points @ slope.T)
    _, _, flow, _ = fields(fluid)
    found = gradients(flow)
    taken = np.abs(found).max(axis=(1, 2)) > 0.0
    # corner particles of three walls see an eighth of space: 1 / 8^3 of the determinant is below REGULAR
    assert (~taken).sum() <= 8 + 12 * 8
    assert np.abs(found[taken] - slope).max() < 800.0 * EPSILON / SPACING
