"""Bodies take shorter steps of the engine where they could leap into another one, and only there."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.multibody.broad_phase import FURTHEST
from coupling.multibody.prescribed_motion import Vector
from coupling.solids.bodies import box, mass_properties
from tests.coupling.motions import UniformMotion

SIDE, SPEED, STEP = 0.2, 2.0, 0.01


@pytest.fixture
def space() -> Iterator[RigidBodyWorld]:
    """No gravity, and a cube on its way along x."""
    world = RigidBodyWorld(gravity=(0.0, 0.0, 0.0))
    cube = box((SIDE, SIDE, SIDE))
    properties = mass_properties(cube, density=500.0)
    world.add_body("cube", cube, properties, (0.0, 0.0, 0.0), twist=(SPEED, 0.0, 0.0, 0.0, 0.0, 0.0))
    yield world
    world.close()


def steps(world: RigidBodyWorld, monkeypatch: pytest.MonkeyPatch, duration: float = STEP) -> int:
    """Of the engine, in an advance of `duration` [s]."""
    made: list[float] = []
    client = type(world._client)
    step = client.step
    monkeypatch.setattr(client, "step", lambda self, duration: (made.append(duration), step(self, duration)))
    world.advance(duration)
    monkeypatch.undo()
    assert sum(made) == pytest.approx(duration)
    return len(made)


def add_wall(world: RigidBodyWorld, position: Vector, *, contact: bool = True, turned: bool = False) -> None:
    """A held slab of 20 x 2 x 2 m, along x, or along y if turned."""
    slab = box((20.0, 2.0, 2.0))
    around = (0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)) if turned else (0.0, 0.0, 0.0, 1.0)
    world.add_body(
        "wall",
        slab,
        mass_properties(slab, density=1.0),
        position,
        around,
        motion="fixed",
        friction=0.5 if contact else None,
    )


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
    space.add_body("other", cube, properties, (0.25, 0.0, 0.0))
    assert steps(space, monkeypatch) == 4
    space.add_joint("joint", "cube", "other", (0.15, 0.0, 0.0))
    assert steps(space, monkeypatch) == 1


@pytest.mark.parametrize(("velocity", "expected"), [(0.0, 4), (0.5 * SPEED, 2), (SPEED, 1), (-SPEED, 7)])
def test_bodies_count_as_fast_as_they_pass_each_other(
    space: RigidBodyWorld, monkeypatch: pytest.MonkeyPatch, velocity: float, expected: int
) -> None:
    cube = box((SIDE, SIDE, SIDE))
    properties = mass_properties(cube, density=500.0)
    space.add_body("other", cube, properties, (0.25, 0.0, 0.0), twist=(velocity, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert steps(space, monkeypatch) == expected


@pytest.mark.parametrize(
    ("length", "velocity", "rate"), [(SIDE, (0.0, SPEED, 0.0), 0.0), (4.0, (0.0, 0.0, 0.0), SPEED / 1.8)]
)
def test_bodies_at_rest_count_where_led_ones_come(
    monkeypatch: pytest.MonkeyPatch, length: float, velocity: Vector, rate: float
) -> None:
    world = RigidBodyWorld(gravity=(0.0, 0.0, 0.0))
    cube, bar = box((SIDE, SIDE, SIDE)), box((length, SIDE, SIDE))
    world.add_body("cube", cube, mass_properties(cube, density=500.0), (0.45 * length, 0.28, 0.0))
    motion = UniformMotion(position=(0.0, 0.0, 0.0), linear_velocity=velocity, angular_velocity=(0.0, 0.0, rate))
    world.add_body("bar", bar, mass_properties(bar, density=500.0), motion=motion)
    assert steps(world, monkeypatch) == 4
    world.close()


def test_tips_of_a_turning_body_count_and_turns_about_its_length_hardly(monkeypatch: pytest.MonkeyPatch) -> None:
    bar = box((4.0, 0.2, 0.2))
    for axis, expected in ((0, 1), (1, 7)):  # 0.2 rad/s about it make 0.03 m/s, across it 0.4 m/s, of 6.25 mm a step
        world = RigidBodyWorld(gravity=(0.0, 0.0, 0.0), sub_step=0.1)
        world.add_half_space((0.0, 0.0, -0.3), (0.0, 0.0, 1.0))
        rate = tuple(0.2 * np.eye(3)[axis])
        world.add_body("bar", bar, mass_properties(bar, density=500.0), twist=(0.0, 0.0, 0.0, *rate))
        assert steps(world, monkeypatch, 0.1) == expected
        world.close()


@pytest.mark.parametrize("speed", [1.0, 3.0])
def test_what_a_piston_pushes_goes_as_fast_as_the_piston(speed: float) -> None:
    # a chip of 2 cm at rest: in steps of 10 ms it was hit at a depth that threw it off at twice the speed, or blew up
    world = RigidBodyWorld(gravity=(0.0, 0.0, 0.0))
    piston, chip = box((0.2, 1.0, 1.0)), box((0.02, 0.02, 0.02))
    motion = UniformMotion(position=(-0.2, 0.0, 0.0), linear_velocity=(speed, 0.0, 0.0))
    world.add_body("piston", piston, mass_properties(piston, mass=1.0), motion=motion)
    world.add_body("chip", chip, mass_properties(chip, density=500.0))
    while world.time < 0.3 / speed:
        world.advance(STEP)
        assert world.pose("chip")[0] > world.pose("piston")[0] + 0.1 + 0.009
    assert world.twist("chip")[0] == pytest.approx(speed, rel=0.05)
    world.close()


@pytest.mark.parametrize("gap", [0.0, 0.008])
def test_a_chip_pressed_on_a_sheet_does_not_go_through(gap: float) -> None:
    # at rest, and pressed by 30 times its weight: a step of 10 ms would bring it 30 mm on its way, of which the sheet is 5 thick
    world = RigidBodyWorld()
    sheet, chip = box((1.0, 1.0, 0.005)), box((0.02, 0.02, 0.02))
    world.add_body("sheet", sheet, mass_properties(sheet, mass=1.0), motion="fixed")
    world.add_body("chip", chip, mass_properties(chip, mass=0.008), (0.0, 0.0, 0.0125 + gap))
    world.set_applied_wrench("chip", np.array([0.0, 0.0, -2.4, 0.0, 0.0, 0.0]))
    for _ in range(20):
        world.advance(STEP)
        assert 0.0115 < world.pose("chip")[2] < 0.0225
    world.close()


def test_what_lies_on_the_ground_is_not_taken_for_falling(monkeypatch: pytest.MonkeyPatch) -> None:
    world = RigidBodyWorld()
    world.add_half_space((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    sheet = box((0.5, 0.5, 0.004))  # falls 1 mm in a step, and may go 0.125
    world.add_body("sheet", sheet, mass_properties(sheet, density=500.0), (0.0, 0.0, 0.003))
    assert steps(world, monkeypatch) > 5
    for _ in range(30):
        world.advance(STEP)
    assert steps(world, monkeypatch) == 1
    world.close()


@pytest.mark.parametrize("speed", [0.6, 1.5, 3.0])
def test_a_cube_sinks_into_the_ground_by_less_than_a_twentieth(speed: float) -> None:
    for part in range(4):  # of a step, that the blow comes later: steps of 5 ms let it sink by 13 mm at 1.5 m/s
        world = RigidBodyWorld()
        world.add_half_space((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
        cube = box((SIDE, SIDE, SIDE))
        height = 0.5 * SIDE + 0.01 + 0.25 * part * speed * STEP
        world.add_body(
            "cube",
            cube,
            mass_properties(cube, density=500.0),
            (0.0, 0.0, height),
            twist=(0.0, 0.0, -speed, 0.0, 0.0, 0.0),
        )
        for _ in range(20):
            world.advance(STEP)
            assert world.pose("cube")[2] > 0.5 * SIDE - 0.025 * SIDE
        world.close()
