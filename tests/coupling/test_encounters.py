"""Bodies take shorter steps of the engine where they could leap into another one, and only there."""

from __future__ import annotations

import numpy as np
import pytest

from coupling.bodies import box, mass_properties
from coupling.encounters import FURTHEST
from coupling.motion import Vector
from coupling.rigid_body_world import RigidBodyWorld

SIDE, SPEED, STEP = 0.2, 2.0, 0.01


@pytest.fixture
def space() -> RigidBodyWorld:
    """No gravity, and a cube on its way along x."""
    world = RigidBodyWorld(gravity=(0.0, 0.0, 0.0))
    cube = box((SIDE, SIDE, SIDE))
    properties = mass_properties(cube, density=500.0)
    world.add_body("cube", cube, properties, (0.0, 0.0, 0.0), linear_velocity=(SPEED, 0.0, 0.0))
    return world


def steps(world: RigidBodyWorld, monkeypatch: pytest.MonkeyPatch) -> int:
    """Of the engine, in an advance of STEP."""
    made: list[float] = []
    client = type(world._client)
    step = client.step
    monkeypatch.setattr(client, "step", lambda self, duration: (made.append(duration), step(self, duration)))
    world.advance(STEP)
    monkeypatch.undo()
    assert sum(made) == pytest.approx(STEP)
    return len(made)


def add_wall(world: RigidBodyWorld, position: Vector, *, contact: bool = True, turned: bool = False) -> None:
    """A held slab of 20 x 2 x 2 m, along x, or along y if turned."""
    slab = box((20.0, 2.0, 2.0))
    around = (0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)) if turned else (0.0, 0.0, 0.0, 1.0)
    world.add_body("wall", slab, mass_properties(slab, density=1.0), position, around, motion="fixed", contact=contact)


def test_only_what_could_be_run_into_asks_for_short_steps(
    space: RigidBodyWorld, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert FURTHEST * 0.5 * SIDE * 4 > SPEED * STEP > FURTHEST * 0.5 * SIDE * 3
    assert steps(space, monkeypatch) == 1  # alone
    add_wall(space, (0.3, 0.0, 1.5))  # along the way, 0.4 m from the cube's side, well within the slab's own sphere
    assert steps(space, monkeypatch) == 1


@pytest.mark.parametrize(
    ("contact", "turned", "x", "expected"),
    [(True, True, 1.18, 4), (True, True, 1.2, 1), (False, True, 1.18, 1), (True, False, 1.2, 4)],
)
def test_boxes_about_bodies_count_as_they_lie(
    space: RigidBodyWorld, monkeypatch: pytest.MonkeyPatch, *, contact: bool, turned: bool, x: float, expected: int
) -> None:
    # across the way the slab's near side is 0.18 or 0.2 m away, of which half the cube's diagonal takes 0.173 and a step 0.02; along it
    # the cube lies in the slab
    add_wall(space, (x, 0.0, 0.0), contact=contact, turned=turned)
    assert steps(space, monkeypatch) == expected


def test_half_spaces_and_bodies_that_come_to_meet_count(space: RigidBodyWorld, monkeypatch: pytest.MonkeyPatch) -> None:
    space.add_half_space((-0.3, 0.0, 0.0), (1.0, 0.0, 0.0))
    assert steps(space, monkeypatch) == 1
    space.add_half_space((0.2, 0.0, 0.0), (-1.0, 0.0, 0.0))
    assert steps(space, monkeypatch) == 4


def test_bodies_on_a_joint_do_not_count_for_each_other(space: RigidBodyWorld, monkeypatch: pytest.MonkeyPatch) -> None:
    cube = box((SIDE, SIDE, SIDE))
    properties = mass_properties(cube, density=500.0)
    space.add_body("other", cube, properties, (0.25, 0.0, 0.0), linear_velocity=(SPEED, 0.0, 0.0))
    assert steps(space, monkeypatch) == 4
    space.add_joint("joint", "cube", "other", (0.15, 0.0, 0.0))
    assert steps(space, monkeypatch) == 1


@pytest.mark.parametrize("speed", [0.6, 1.5, 3.0])
def test_a_cube_sinks_into_the_ground_by_less_than_a_twentieth(speed: float) -> None:
    for part in range(4):  # of a step, that the blow comes later: steps of 5 ms let it sink by 13 mm at 1.5 m/s
        world = RigidBodyWorld()
        world.add_half_space((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
        cube = box((SIDE, SIDE, SIDE))
        height = 0.5 * SIDE + 0.01 + 0.25 * part * speed * STEP
        world.add_body(
            "cube", cube, mass_properties(cube, density=500.0), (0.0, 0.0, height), linear_velocity=(0.0, 0.0, -speed)
        )
        for _ in range(20):
            world.advance(STEP)
            assert world.pose("cube")[2] > 0.5 * SIDE - 0.025 * SIDE
        world.close()
