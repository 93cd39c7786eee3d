"""Bodies that swing fast get steps that follow the swing."""

from __future__ import annotations

import numpy as np
import pytest

from coupling.bullet import rigid_body_world
from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.solids.bodies import box, mass_properties


@pytest.mark.parametrize("length", [0.8, 0.2])
def test_a_step_follows_a_swing_by_half_a_radian(monkeypatch, length):
    """A thin rod that hangs from its upper end has omega^2 = 3 g / 2 l twice; their bound is the fourth root of two higher."""
    rates, gravity = [], 9.81
    asked = rigid_body_world.step_rate
    monkeypatch.setattr(rigid_body_world, "step_rate", lambda *terms: rates.append(asked(*terms)) or rates[-1])
    world = RigidBodyWorld(gravity=(0.0, 0.0, -gravity), sub_step=1.0)
    rod = box((1e-4, 1e-4, length))
    world.add_body("rod", rod, mass_properties(rod, mass=2.0), (0.0, 0.0, -0.5 * length), friction=None)
    world.add_joint("pivot", "rod", None, (0.0, 0.0, 0.0))
    world.advance(1.0)
    world.close()
    assert rates[0] == pytest.approx(2.0**0.25 * np.sqrt(1.5 * gravity / length) / 0.5, rel=1e-6)
