"""Particles within the support are each other's neighbours, with the weights of their liquids."""

from __future__ import annotations

import numpy as np

from oilsim import BoundaryParticles
from oilsim.boundaries.walls import MovingBody
from oilsim.stages.pairs import search_neighbors
from tests.oilsim.stages.conftest import state_of


def listed(pairs, i):
    return sorted(pairs.neighbor[pairs.start[i] : pairs.start[i] + pairs.number[i]].tolist())


def test_neighbours_lie_within_the_support(make_context):
    context, state = make_context(), state_of([[0, 0, 0], [0.27, 0, 0], [0.28, 0.28, 0]], phases=(0, 1, 0))  # 2.75 d
    neighbors = search_neighbors(context, state)
    place = {round(float(x), 2): i for i, x in enumerate(state.position[0])}
    assert listed(neighbors.neighborhood.fluid, place[0.0]) == [place[0.27]]
    assert listed(neighbors.neighborhood.fluid, place[0.28]) == []
    np.testing.assert_array_equal(neighbors.rest_density, np.where(state.phase == 1, 800.0, 1000.0))
    np.testing.assert_array_equal(neighbors.weight, np.where(state.phase == 1, np.float32(1.25), 1.0))
    np.testing.assert_array_equal(neighbors.points[:, :3], state.position.T)


def test_particles_beside_a_body_are_marked(make_context):
    context = make_context()
    point = BoundaryParticles(name="point", position=np.zeros((1, 3)), volume=np.array([1e-3]), area=np.array([1e-2]))
    motion = MovingBody(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(6), np.eye(6), np.zeros(6))
    context.walls.set_motion(context.walls.add(point), motion)
    neighbors = search_neighbors(context, state_of([[0.1, 0, 0], [0.9, 0, 0]]))
    assert neighbors.by_body.sum() == neighbors.touching.size == 1
    assert neighbors.points[neighbors.touching[0], 0] == np.float32(0.1)
