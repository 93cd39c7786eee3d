"""Explicit forces against their formulas, particle by particle."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import BoundaryParticles, Phase
from oilsim.boundaries.adhesion import adhesion_scale
from oilsim.boundaries.walls import MovingBody
from oilsim.forcing import ForcingView
from oilsim.stages.explicit import (
    add_gravity,
    advect,
    apply_adhesion,
    apply_forcings,
    apply_tension,
    wrap_periodic,
)
from oilsim.stages.pairs import search_neighbors
from tests.oilsim.stages.conftest import SPACING, state_of

WORK, AREA, DISTANCE, STEP = 0.05, 0.01, 0.12, 0.5
SUPPORT = 2.75 * SPACING


def test_gravity_adds_dt_g():
    velocity = np.ones((3, 2), np.float32)
    add_gravity(velocity, (0.0, 0.5, -8.0), 0.25)
    np.testing.assert_array_equal(velocity, [[1.0, 1.0], [1.125, 1.125], [-1.0, -1.0]])


def test_adhesion_of_one_particle_to_one_point(make_context):
    # a = w a_b A d^-3 |ds/dr| / rho towards the point, s = (1 - q)^2 (1 + 2 q), ds/dr = -6 q (1 - q) / H
    sticky = Phase(name="oil", rest_density=800.0, adhesion=WORK)
    context = make_context(phases=(sticky,))
    point = BoundaryParticles(name="point", position=np.zeros((1, 3)), volume=np.array([1e-3]), area=np.array([AREA]))
    motion = MovingBody(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(6), np.eye(6), np.zeros(6))
    context.walls.set_motion(context.walls.add(point), motion)
    state = state_of([[0, 0, DISTANCE]])
    neighbors = search_neighbors(context, state)
    force = apply_adhesion(context, neighbors, state.position, state.phase, state.velocity, STEP)
    q = DISTANCE / SUPPORT
    expected = WORK * AREA * adhesion_scale(3) / SPACING**3 * 6.0 * q * (1.0 - q) / SUPPORT / 800.0
    np.testing.assert_allclose(state.velocity[:, 0], [0.0, 0.0, -STEP * expected], rtol=1e-5, atol=1e-12)
    np.testing.assert_allclose(force[0, :3], [0.0, 0.0, 800.0 * SPACING**3 * expected], rtol=1e-5, atol=1e-12)


def test_adhesion_without_bodies_returns_no_force(make_context):
    context = make_context(phases=(Phase(name="oil", rest_density=800.0, adhesion=WORK),))
    state = state_of([[0, 0, 0]])
    neighbors = search_neighbors(context, state)
    assert apply_adhesion(context, neighbors, state.position, state.phase, state.velocity, STEP) is None
    assert not state.velocity.any()


def test_tension_keeps_momentum(make_context):
    phases = Phase(name="water", rest_density=1000.0), Phase(name="oil", rest_density=800.0, interfacial_tension=0.03)
    context, random = make_context(phases=phases), np.random.default_rng(0)
    state = state_of(random.uniform(-0.25, 0.25, (60, 3)), phases=tuple(random.integers(0, 2, 60)))
    neighbors = search_neighbors(context, state)
    apply_tension(context, neighbors, state.phase, state.velocity, STEP)
    momenta = neighbors.rest_density * state.velocity.astype(np.float64)
    assert np.abs(momenta).max() > 0.1
    np.testing.assert_allclose(momenta.sum(axis=1), 0.0, atol=1e-5 * np.abs(momenta).sum())


class Push:
    """A forcing that gives every particle the same velocity."""

    def __init__(self, velocity):
        self.velocity = np.array(velocity, np.float32)[:, None]

    def apply(self, view):
        view.velocity[:] += self.velocity


def view_of(velocity):
    none = np.zeros_like(velocity)
    return ForcingView(0.0, STEP, none, velocity, np.zeros(velocity.shape[1], np.uint8), none, np.ones(1), 1e-3)


def test_forcings_act_one_after_the_other():
    velocity = np.zeros((3, 4), np.float32)
    apply_forcings([Push((1, 0, 0)), Push((0.5, 0, -2))], view_of(velocity), plane=True)
    np.testing.assert_array_equal(velocity, np.outer([1.5, 0.0, -2.0], np.ones(4)))


def test_a_forcing_across_the_plane_is_refused():
    with pytest.raises(ValueError, match="Push moves liquid along y, allowed: x and z in two dimensions"):
        apply_forcings([Push((0, 1, 0))], view_of(np.zeros((3, 1), np.float32)), plane=True)


def test_particles_move_by_their_velocities():
    position, velocity = np.array([[1.0], [2.0], [3.0]], np.float32), np.array([[4.0], [-2.0], [0.5]], np.float32)
    advect(position, velocity, 0.25)
    np.testing.assert_array_equal(position, [[2.0], [1.5], [3.125]])


def test_only_periodic_axes_wrap():
    position = np.array([[2.25, -1.5, 0.5]] * 3, np.float32)
    wrap_periodic(position, (-1.0, 0.0, 0.0), (np.float32(2.0), np.float32(0.0), np.float32(1.0)))
    np.testing.assert_array_equal(position, [[0.25, 0.5, 0.5], [2.25, -1.5, 0.5], [0.25, 0.5, 0.5]])
    wrap_periodic(position, (-1.0, 0.0, 0.0), None)
    assert position[1, 0] == 2.25
