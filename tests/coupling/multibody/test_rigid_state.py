"""Masses of bodies that a sea loads."""

import numpy as np
import pytest

from coupling.multibody.prescribed_motion import Motion
from coupling.multibody.rigid_state import RigidBodyState
from coupling.solids.bodies import MassProperties


def two_bodies() -> RigidBodyState:
    """One free body that is turned, and a fixed one."""
    state, inertia = RigidBodyState(), np.diag((1.0, 2.0, 2.5))
    properties = MassProperties(mass=3.0, center_of_mass=np.zeros(3), inertia=inertia)
    turned = Motion(np.zeros(3), np.array((0.0, 0.6, 0.0, 0.8)))
    state.append(properties, turned, is_free=True)
    state.append(properties, turned, is_free=False)
    return state


def test_inverse_mass_is_that_of_body_and_water():
    state, rng = two_bodies(), np.random.default_rng(1)
    root = rng.standard_normal((6, 6))
    state.resist([0], (root @ root.T)[None])
    expected = np.linalg.inv(state.mass_matrix(0) + root @ root.T)
    assert state.inverse_mass(0) == pytest.approx(expected, rel=1e-10)
    assert not state.inverse_mass(1).any()


def test_mass_that_is_not_positive_is_refused():
    with pytest.raises(FloatingPointError, match="not positive definite"):
        two_bodies().resist([0], -10.0 * np.eye(6)[None])


def test_reaction_is_the_change_of_momentum_that_known_forces_leave():
    """A body of 3 kg goes from (2, 0, 0) to (3, 0, 1) m/s in 0.5 s under its weight and 10 N along x; a fixed one reacts with nothing."""
    state = two_bodies()
    state.twist[0, :3] = (2.0, 0.0, 0.0)
    before = state.momenta().copy()
    state.twist[0, :3] = (3.0, 0.0, 1.0)
    state.applied_wrench[0, 0] = 10.0
    state.settle_reaction(before, 0.5, np.array((0.0, 0.0, -9.81)))
    assert state.reaction[0] == pytest.approx((6.0 - 10.0, 0.0, 6.0 + 3.0 * 9.81, 0.0, 0.0, 0.0))
    assert not state.reaction[1].any()
