"""Elastic lines on bodies without fluid: statics, an oscillation, momentum, winching, and what is refused."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np
import pytest

from coupling.bullet.rigid_body_participant import RigidBodyParticipant
from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.solids.bodies import box, mass_properties

BOX = box((0.2, 0.2, 0.2))
MASS, LENGTH, STIFFNESS = 4.0, 1.0, 2000.0


@pytest.fixture
def world() -> Iterator[RigidBodyWorld]:
    world = RigidBodyWorld(gravity=(0.0, 0.0, -9.81))
    yield world
    world.close()


def hang(world: RigidBodyWorld, *, drop: float = 0.0, relaxation_time: float = 0.0) -> None:
    """A box on a line under the origin, `drop` [m] below where the line becomes taut."""
    depth = LENGTH + drop
    world.add_body("load", BOX, mass_properties(BOX, mass=MASS), (0.0, 0.0, -depth - 0.1))
    world.add_line(
        "line", "load", None, ((0.0, 0.0, -depth), (0.0, 0.0, 0.0)),
        length=LENGTH, stiffness=STIFFNESS, relaxation_time=relaxation_time,
    )  # fmt: skip


def test_load_hangs_where_its_weight_stretches_the_line(world: RigidBodyWorld) -> None:
    stretch = MASS * 9.81 * LENGTH / STIFFNESS
    hang(world, drop=stretch)
    for _ in range(50):
        world.advance(0.02)
    assert world.pose("load")[2] == pytest.approx(-LENGTH - stretch - 0.1, abs=1e-9)
    assert world.tension("line") == pytest.approx(MASS * 9.81, rel=1e-9)
    assert world.free_acceleration("load") == pytest.approx(np.zeros(6), abs=1e-9)


def test_two_lines_from_one_point_are_a_bridle(world: RigidBodyWorld) -> None:
    # each leg bears T / (2 cos a), a from the vertical; where one has parted, the other bears T below its point
    leg, half = 1.3, 0.5
    height = math.sqrt(leg**2 - half**2)
    beam = box((1.0, 0.1, 0.1))
    world.add_body("beam", beam, mass_properties(beam, mass=MASS), (0.0, 0.0, -height))
    for name, side in (("one", -half), ("other", half)):
        ends = ((side, 0.0, -height), (0.0, 0.0, 0.0))
        world.add_line(name, "beam", None, ends, length=leg, stiffness=1e4, relaxation_time=0.05)
    for _ in range(100):
        world.advance(0.02)
    stretched = -float(world.pose("beam")[2])
    expected = MASS * 9.81 / 2.0 * math.hypot(half, stretched) / stretched
    assert [world.tension(name) for name in ("one", "other")] == pytest.approx([expected] * 2, rel=1e-6)
    world.part_line("one")
    pulls = []
    for _ in range(400):
        world.advance(0.02)
        pulls.append(world.tension("other"))
    assert world.tension("one") == 0.0
    assert np.mean(pulls[200:]) == pytest.approx(MASS * 9.81, rel=0.2)  # it swings below the point


def test_load_swings_up_and_down_with_the_period_of_its_spring(world: RigidBodyWorld) -> None:
    # z'' = -(k / m) z about the hanging place while the line stays taut; symplectic Euler's period is short by (w h)^2 / 24
    stretch = MASS * 9.81 * LENGTH / STIFFNESS
    hang(world, drop=1.5 * stretch)
    omega = math.sqrt(STIFFNESS / LENGTH / MASS)
    steps = round(5.0 * 2.0 * math.pi / omega * 240.0)
    heights = []
    for _ in range(steps):
        world.advance(1.0 / 240.0)
        heights.append(world.pose("load")[2] + LENGTH + stretch + 0.1)
    crossings = [k for k in range(1, steps) if heights[k - 1] < 0.0 <= heights[k]]
    measured = (crossings[-1] - crossings[0]) / (len(crossings) - 1) / 240.0
    assert measured == pytest.approx(2.0 * math.pi / omega, rel=0.01)
    assert max(heights) == pytest.approx(0.5 * stretch, rel=0.06)


def test_slack_line_does_not_push(world: RigidBodyWorld) -> None:
    hang(world, drop=-0.3)
    world.advance(0.1)
    assert world.tension("line") == 0.0
    assert world.twist("load")[2] == pytest.approx(-0.981, rel=1e-12)  # free fall


def test_line_between_two_bodies_keeps_momentum() -> None:
    world = RigidBodyWorld(gravity=(0.0, 0.0, 0.0))
    for name, x in (("left", 0.0), ("right", 1.5)):
        world.add_body(
            name, BOX, mass_properties(BOX, mass=MASS), (x, 0.0, 0.0), twist=(0.2 * x, 0.3, 0.0, 0.0, 0.0, 0.0)
        )
    world.add_line("line", "left", "right", ((0.1, 0.1, 0.0), (1.4, -0.1, 0.05)), length=1.29, stiffness=500.0)
    before, tensions = world.momentum(), []
    for _ in range(60):
        world.advance(0.02)
        tensions.append(world.tension("line"))
    assert max(tensions) > 5.0
    assert min(tensions) == 0.0
    # equal and opposite forces along one line leave both momenta as they are; symplectic Euler keeps them to rounding
    assert world.momentum() == pytest.approx(before, abs=1e-9)
    world.close()


def test_winch_hauls_a_load_up(world: RigidBodyWorld) -> None:
    stretch = MASS * 9.81 * LENGTH / STIFFNESS
    hang(world, drop=stretch, relaxation_time=0.02)
    bodies = RigidBodyParticipant("bodies", world)
    assert bodies.variables["line.length"].unit == "m"
    for k in range(1, 101):
        bodies.set("line.length", np.array([LENGTH - 0.004 * k]))
        bodies.do_step(0.02 * (k - 1), 0.02)
    assert world.lines.length("line") == pytest.approx(0.6)
    # the stretch of the shorter line is shorter in proportion
    assert world.pose("load")[2] == pytest.approx(-0.6 * (1.0 + stretch / LENGTH) - 0.1, abs=2e-4)
    assert bodies.get("line.tension")[0] == pytest.approx(MASS * 9.81, rel=0.02)


@pytest.mark.parametrize("relaxation_time", [0.0, 0.01])
def test_many_stiff_lines_on_one_body_are_stable_together(relaxation_time: float) -> None:
    # 8 taut lines of which each alone bears steps of 10 ms, or 4 ms with damping: together they threw the box off at 100 m/s
    world = RigidBodyWorld(gravity=(0.0, 0.0, 0.0))
    world.add_body("box", BOX, mass_properties(BOX, mass=10.0), twist=(0.0, 0.0, 0.1, 0.0, 0.0, 0.0))
    for index, (x, y, side) in enumerate(itertools.product((-0.1, 0.1), (-0.1, 0.1), (-1.0, 1.0))):
        ends = ((x, y, 0.1 * side), (x, y, 1.15 * side))
        world.add_line(f"line-{index}", "box", None, ends, length=1.0, stiffness=1e5, relaxation_time=relaxation_time)
    for _ in range(50):
        world.advance(0.02)
        assert abs(world.twist("box")[2]) < 0.15  # 0.1 / sqrt(1 - (w h / 2)^2), (w h)^2 = 2
    world.close()


@pytest.mark.slow
def test_a_stiff_line_that_a_winch_makes_short_stays_stable(world: RigidBodyWorld) -> None:
    # over a twentieth of its length it is 20 times as stiff a spring and damper, which steps of half a millisecond do not bear
    world.add_body("load", BOX, mass_properties(BOX, mass=MASS), (0.0, 0.0, -2.1))
    ends = ((0.0, 0.0, -2.0), (0.0, 0.0, 0.0))
    world.add_line("line", "load", None, ends, length=2.0, stiffness=2.5e6, relaxation_time=0.005)
    for k in range(1, 191):
        world.lines.order_length("line", 2.0 - 0.01 * k)
        world.advance(0.01)
        assert world.twist("load")[2] == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize(("laid", "made"), [(0.8, 1.0), (1.3, 1.3)])
def test_a_line_made_fast_is_as_long_as_its_ends_are_apart_and_no_shorter_than_laid(
    world: RigidBodyWorld, laid: float, made: float
) -> None:
    """Ends 1 m apart: what is missing is paid out, and a slack line stays slack."""
    hang(world)
    ends = ((0.0, 0.0, -LENGTH), (0.0, 0.0, 0.0))
    world.add_line("tie", "load", None, ends, length=laid, stiffness=STIFFNESS)
    world.lines.loosen("tie")
    world.make_line_fast("tie")
    assert world.line_distance("tie") == pytest.approx(1.0)
    assert world.lines.length("tie") == pytest.approx(made)
    world.advance(0.01)
    assert world.lines.length("tie") == pytest.approx(made), "no winch hauls it in"


def test_line_repeats_after_a_restore(world: RigidBodyWorld) -> None:
    hang(world, drop=0.05)
    world.advance(0.05)
    world.lines.order_length("line", 0.9)
    saved = world.save_state()
    world.advance(0.05)
    after, tension = world.pose("load"), world.tension("line")
    world.advance(0.05)
    world.restore_state(saved)
    world.advance(0.05)
    np.testing.assert_array_equal(world.pose("load"), after)
    assert world.tension("line") == tension
    assert world.lines.length("line") == pytest.approx(0.9)


def test_impossible_lines_are_refused(world: RigidBodyWorld) -> None:
    hang(world)
    ends = ((0.0, 0.0, -1.0), (0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match=r"stiffness is 1e\+09 N, allowed: up to"):
        world.add_line("other", "load", None, ends, length=1.0, stiffness=1e9)
    with pytest.raises(ValueError, match="'line' is added twice"):
        world.add_line("line", "load", None, ends, length=1.0, stiffness=10.0)
    with pytest.raises(ValueError, match=r"length is 0\.0, allowed: above 0"):
        world.add_line("short", "load", None, ends, length=0.0, stiffness=10.0)
    with pytest.raises(ValueError, match=r"the length of line 'line' is -1.0 m"):
        world.lines.order_length("line", -1.0)
