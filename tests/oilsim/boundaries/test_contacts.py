"""Pairs of particles and moving bodies: each once, in the order of the lists; contacts: their sums by particle and body."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import block, solid_box, tank_walls
from oilsim.boundaries.contacts import NO_BODY_PAIRS
from tests.oilsim.conftest import prepare

SPACING = 0.1


@pytest.fixture
def pool(make_fluid):
    """Function (bodies) -> a pool with so many boxes that stand side by side in the water, ready for a step's solves."""

    def build(bodies):
        fluid = make_fluid(lower=(-0.3,) * 3)
        fluid.add_boundary(tank_walls((0, 0, 0), (1.2, 0.8, 1), SPACING, sides=("-x", "+x", "-y", "+y", "-z")))
        points = block((0, 0, 0), (1.2, 0.8, 0.5), SPACING)
        for n in range(bodies):
            place = np.array([0.35 + 0.4 * n, 0.4, 0.3])
            points = points[(np.abs(points - place) > 0.15).any(axis=1)]
            handle = fluid.add_boundary(solid_box((0.2, 0.2, 0.2), SPACING))
            fluid.set_boundary_motion(handle, place, (0, 0, 0, 1), (0, 0, 0), (0, 0, 0))
        fluid.add_particles(points, phase="water")
        prepare(fluid)
        return fluid

    return build


def test_every_pair_with_a_moving_body_is_listed_once_and_in_order(pool):
    fluid = pool(2)
    walls, lists, pairs = (
        fluid.context.walls,
        fluid.arrays.neighbors.neighborhood.walls,
        fluid.arrays.neighbors.body_pairs,
    )
    expected = [
        (i, k, lists.neighbor[k])
        for i in range(fluid.particle_count)
        for k in range(lists.start[i], lists.start[i] + int(lists.number[i]))
        if lists.neighbor[k] >= walls.resting
    ]
    assert len(expected) > 500
    particle, pair, point = np.array(expected, np.int64).T
    np.testing.assert_array_equal(pairs.particle, particle)
    np.testing.assert_array_equal(pairs.pair, pair)
    np.testing.assert_array_equal(pairs.point, point)
    np.testing.assert_array_equal(pairs.body, walls.owner[point - walls.resting])
    np.testing.assert_array_equal(pairs.arm, walls.arm[:, point - walls.resting])
    np.testing.assert_array_equal(fluid.arrays.neighbors.touching, np.unique(particle))
    np.testing.assert_array_equal(np.flatnonzero(fluid.arrays.neighbors.by_body), np.unique(particle))


def test_contacts_sum_the_pairs_of_a_particle_and_a_body(pool):
    fluid = pool(2)
    pairs, contacts, gradient = (
        fluid.arrays.neighbors.body_pairs,
        fluid.arrays.pairs.contacts,
        fluid.arrays.pairs.wall_gradient[:, :],
    )
    between = np.intersect1d(contacts.particle[contacts.body == 0], contacts.particle[contacts.body == 1])
    assert between.size  # some particles touch both boxes
    assert len(set(zip(contacts.particle.tolist(), contacts.body.tolist(), strict=True))) == contacts.particle.size
    np.testing.assert_array_equal(contacts.particle[contacts.of_pair], pairs.particle)
    np.testing.assert_array_equal(contacts.body[contacts.of_pair], pairs.body)
    force = gradient[:, pairs.pair].T.astype(np.float64)
    expected = np.zeros(contacts.jacobian.shape)
    np.add.at(expected, contacts.of_pair, np.hstack([force, np.cross(pairs.arm.T, force)]))
    # sums of some 20 float32
    np.testing.assert_allclose(contacts.jacobian, expected, atol=1e-5 * np.abs(expected).max())


def test_nothing_is_listed_where_no_body_moves(pool):
    fluid = pool(0)
    assert fluid.arrays.neighbors.body_pairs is NO_BODY_PAIRS
    assert not fluid.arrays.neighbors.touching.size and not fluid.arrays.pairs.contacts.particle.size
