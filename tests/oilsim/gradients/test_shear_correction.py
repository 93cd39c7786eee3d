"""Moments of pair vectors are repaired where the liquid shears, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import block, tank_walls
from oilsim.gradients.gradient_correction import LARGEST
from tests.oilsim.conftest import cache, disturbed, search, sum_up

SPACING = 0.1


def moments(fluid):
    """sum_j G_ij x_ij^T (N, dim, dim) from the pair vectors of a fluid, by its lists; and which particles are inside."""
    context, arrays, state = fluid.context, fluid.arrays, fluid.state
    search(fluid)
    sum_up(fluid, 1e-3)
    cache(fluid)
    axes = [0, 2] if context.constants.plane else [0, 1, 2]
    found = np.zeros((state.count, len(axes), len(axes)))
    length = np.array(fluid.config.upper, float) - np.array(fluid.config.lower, float)
    for i in range(state.count):
        listed = slice(
            arrays.neighbors.neighborhood.fluid.start[i],
            arrays.neighbors.neighborhood.fluid.start[i] + arrays.neighbors.neighborhood.fluid.number[i],
        )
        apart = (
            state.position[:, arrays.neighbors.neighborhood.fluid.neighbor[listed]].astype(float)
            - state.position[:, i, None]
        )
        apart -= length[:, None] * np.round(apart / length[:, None])
        vectors = float(arrays.pairs.gradient.quantum) * arrays.pairs.gradient.whole[:, listed].astype(float)
        found[i] = (vectors @ apart.T)[np.ix_(axes, axes)]
    return found


def sheared(make_fluid, dimension, rate, gravity=(0.0, 0.0, -9.81)):
    """A disordered periodic box whose layers pass each other at `rate` [1/s], or not, as a wave of its length."""
    fluid = make_fluid(
        dimension=dimension, lower=(0.0,) * 3, upper=(1.0,) * 3, periodic=(True, dimension == 3, True), gravity=gravity
    )
    points = disturbed(block((0, 0, 0), (1, 1, 1), SPACING, dimension), 0.1 * SPACING, 3) % 1.0
    if dimension == 2:
        points[:, 1] = 0.0
    speed = rate / (2 * np.pi) * np.sin(2 * np.pi * points[:, 2])
    fluid.add_particles(points, phase="water", velocity=speed[:, None] * (1.0, 0.0, 0.0))
    return fluid


@pytest.mark.parametrize("dimension", [2, 3])
def test_moments_are_nearer_to_one_where_layers_pass_each_other(make_fluid, dimension):
    unit = np.eye(dimension)
    rest, flow = (moments(sheared(make_fluid, dimension, rate)) - unit for rate in (0.0, 1e3))
    # shear is strong, s = 1, but where the wave turns; of errors without any order between neighbours a half is an own one
    before, after = (np.abs(m + m.transpose(0, 2, 1)).max(axis=(1, 2)) for m in (rest, flow))
    assert np.median(before) > 0.01
    assert np.median(after) < 0.8 * np.median(before)


def test_liquid_at_rest_keeps_its_matrices(make_fluid):
    fluid = sheared(make_fluid, 3, 0.0)
    moments(fluid)
    kept = fluid.arrays.pairs.repaired[:, :6]
    assert np.array_equal(kept, fluid.arrays.sums.matrix[:, :6])


def test_beside_walls_and_surfaces_nothing_is_mended(make_fluid):
    fluid = make_fluid(lower=(-0.5,) * 3, upper=(1.5,) * 3)
    fluid.add_boundary(tank_walls((0, 0, 0), (1, 1, 1), SPACING, sides=("-x", "+x", "-y", "+y", "-z")))
    points = disturbed(block((0, 0, 0), (1, 1, 1), SPACING), 0.1 * SPACING, 5)
    fluid.add_particles(points, phase="water", velocity=50.0 * points[:, [2, 0, 1]])
    moments(fluid)
    arrays = fluid.arrays
    changed = (arrays.pairs.repaired[:, :6] != arrays.sums.matrix[:, :6]).any(axis=1)
    by_walls = arrays.neighbors.neighborhood.walls.number[: fluid.particle_count] > 0
    assert changed.sum() > 20
    assert not changed[by_walls].any()
    assert not changed[arrays.sums.surface.astype(bool)].any()
    assert np.abs(arrays.pairs.repaired - arrays.sums.matrix).max() <= LARGEST * (1 + 1e-5)
