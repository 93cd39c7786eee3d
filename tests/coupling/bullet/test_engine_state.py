"""A saved state of the engine restores bit for bit, and a damaged one is refused in words: none reaches pybullet's own reader."""

from __future__ import annotations

import random

import numpy as np
import pytest
import trimesh

from coupling.bullet.engine_state import kinds_of_shapes, rebuilt
from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.solids.bodies import MassProperties


def properties(mass: float) -> MassProperties:
    return MassProperties(mass=mass, center_of_mass=np.zeros(3), inertia=np.eye(3) * mass / 6.0)


def pile() -> RigidBodyWorld:
    """Three boxes on a floor, one on another, beside two that a joint holds together in the air."""
    world = RigidBodyWorld()
    cube = trimesh.creation.box((1.0, 1.0, 1.0))
    world.add_body("floor", trimesh.creation.box((10, 10, 1)), properties(1e5), (0, 0, -0.5), motion="fixed")
    for place in range(3):
        world.add_body(f"box-{place}", cube, properties(500.0), (0.1 * place, 0.0, 0.5 + 1.001 * place))
    world.add_body("left", cube, properties(500.0), (5.0, 0.0, 5.0))
    world.add_body("right", cube, properties(500.0), (6.2, 0.0, 5.0))
    world.add_joint("hinge", "left", "right", (5.6, 0.0, 5.0))
    return world


def advanced(world: RigidBodyWorld, steps: int) -> list[bytes]:
    """Advance the bodies by some steps and return their motion, to the last bit."""
    found = []
    for _ in range(steps):
        world.advance(0.02)
        found += [world.pose(name).tobytes() + world.twist(name).tobytes() for name in world.body_names]
    return found


def test_state_goes_on_bit_for_bit_in_a_world_that_has_touched_nothing_yet() -> None:
    world = pile()
    advanced(world, 20)
    saved = world.save_state()
    expected = advanced(world, 20)
    other = pile()
    other.restore_state(saved)
    assert other.save_state()["bullet"] == saved["bullet"]
    assert advanced(other, 20) == expected
    assert other.save_state()["bullet"] == world.save_state()["bullet"]
    other.restore_state(saved)  # and once more, over contacts of its own
    assert advanced(other, 20) == expected


def test_contacts_are_what_makes_it_so() -> None:
    """Without its contacts a state goes on otherwise: the test above would notice that they are lost."""
    world = pile()
    advanced(world, 20)
    saved = world.save_state()
    expected = advanced(world, 20)
    other = pile()
    other.restore_state(saved | {"bullet": saved["bullet"].replace(b"CONT", b"LOST")})
    assert advanced(other, 20) != expected


def test_no_damaged_state_ends_the_process() -> None:
    """Bytes changed at random, in pointers, counts, lengths and numbers: each is refused in words or restores to finite motion."""
    world = pile()
    advanced(world, 10)
    saved = world.save_state()
    content, chance, refused = saved["bullet"], random.Random(1), 0
    for _ in range(400):
        damaged = bytearray(content)
        for _ in range(chance.choice((1, 1, 4, 64))):
            damaged[chance.randrange(len(damaged))] = chance.randrange(256)
        cut = bytes(damaged[: chance.choice((len(damaged), len(damaged), chance.randrange(len(damaged))))])
        try:
            world.restore_state(saved | {"bullet": cut})
        except ValueError as error:
            assert "engine's state" in str(error)
            refused += 1
    assert refused > 100
    world.restore_state(saved)
    assert all(np.isfinite(world.pose(name)).all() for name in world.body_names)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda state: state | {"tensions": {}}, "has joints \\[\\], allowed: \\['hinge'\\]"),
        (
            lambda state: state | {"arrays": state["arrays"] | {"pose": np.zeros((1, 7))}},
            "'pose' has shape \\(1, 7\\)",
        ),
        (
            lambda state: state | {"arrays": state["arrays"] | {"twist": np.full((6, 6), np.nan)}},
            "'twist' is not finite",
        ),
    ],
)
def test_numbers_of_other_bodies_are_refused(change, told: str) -> None:  # type: ignore[no-untyped-def]
    world = pile()
    with pytest.raises(ValueError, match=told):
        world.restore_state(change(world.save_state()))


def test_state_of_other_bodies_is_refused() -> None:
    world, fewer = pile(), RigidBodyWorld()
    fewer.add_body("box", trimesh.creation.box((1, 1, 1)), properties(500.0))
    with pytest.raises(ValueError, match="has 6 bodies, allowed: 1"):
        rebuilt(world.save_state()["bullet"], fewer.save_state()["bullet"])


def test_kinds_of_shapes_are_told() -> None:
    assert "btConvexHullShapeData" in kinds_of_shapes(pile()._client._file())
