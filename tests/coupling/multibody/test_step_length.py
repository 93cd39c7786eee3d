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


def sub_steps(monkeypatch, world, duration):
    """Advance a world; return how many sub-steps it took."""
    count, once = [0], RigidBodyWorld._advance_once

    def counted(self, end, sub_step):
        count[0] += 1
        return once(self, end, sub_step)

    monkeypatch.setattr(RigidBodyWorld, "_advance_once", counted)
    world.advance(duration)
    monkeypatch.undo()
    return count[0]


def test_what_held_a_parted_joint_is_not_taken_to_last(monkeypatch):
    """Two light plates in tow, and a third one ahead; without a joint the pull on the second is gone, and nothing flies off."""
    world = RigidBodyWorld(gravity=(0.0, 0.0, 0.0), sub_step=0.02)
    plate = box((0.5, 0.01, 0.5))
    for n in range(3):
        world.add_body(f"plate-{n}", plate, mass_properties(plate, mass=2.0), (0.6 * n, 0.0, 0.0))
    world.add_joint("joint", "plate-0", "plate-1", (0.3, 0.0, 0.0))
    world.add_joint("post", "plate-0", None, (-0.3, 0.0, 0.0))
    world.set_applied_wrench("plate-1", np.array([5e4, 0.0, 0.0, 0.0, 0.0, 0.0]))
    for _ in range(2):
        world.advance(0.04)
    world.set_applied_wrench("plate-1", np.zeros(6))
    world.part_joint("joint")
    assert sub_steps(monkeypatch, world, 0.04) < 10
    world.close()
