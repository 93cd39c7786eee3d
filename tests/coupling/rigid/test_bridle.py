"""Bridles: statics against formulas, virtual work and moments, damping, breaking, winching, restart, and what is refused."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from coupling.bodies import box, mass_properties
from coupling.rigid.bridle import Bridle, meeting_point
from coupling.rigid.rigid_body_world import RigidBodyWorld

EA, LENGTH, LEG, SPREAD = 1e4, 3.0, 1.3, 1.0
AT_REST = np.array([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]])


def bridle(far: tuple[float, float, float], legs: tuple[float, float] = (LEG, LEG), tau: float = 0.0) -> Bridle:
    """A line from a fixed point to a body whose legs are fast at half a spread above and below its centre."""
    points = np.array([far, (0.0, 0.0, 0.5 * SPREAD), (0.0, 0.0, -0.5 * SPREAD)])
    return Bridle(-1, 0, points, legs, EA, tau, LENGTH)


def turned(angle: tuple[float, float, float], place: tuple[float, float, float]) -> np.ndarray:
    """Return a pose (1, 7), turned by a small rotation vector [rad] as far as second order goes."""
    half = 0.5 * np.array(angle)
    quaternion = np.array([*half, 1.0])
    return np.array([[*place, *(quaternion / np.linalg.norm(quaternion))]])


def energy(line: Bridle, pose: np.ndarray) -> float:
    """Return the elastic energy [N m]: sum of T^2 l / (2 EA)."""
    return float((line.pulls(pose) ** 2 * [line.length, *line.leg_lengths]).sum() / (2.0 * EA))


def test_legs_of_a_symmetric_bridle_share_the_pull_by_their_angle() -> None:
    for stretched in (1e-4, 0.01, 0.1):
        line = bridle((LENGTH + math.sqrt(LEG**2 - 0.25 * SPREAD**2) + stretched, 0.0, 0.0))
        pull, *legs = line.pulls(AT_REST)
        leg = LEG * (1.0 + legs[0] / EA)  # as stretched
        cosine = math.sqrt(leg**2 - 0.25 * SPREAD**2) / leg
        assert pull > 0.0
        assert legs == pytest.approx([pull / (2.0 * cosine)] * 2, rel=1e-7)


def test_the_leg_of_the_nearer_point_is_slack_and_the_other_one_pulls_alone() -> None:
    far = np.array([1.0, 0.0, 4.0])  # almost above the body
    line = bridle(tuple(far))
    span = float(np.linalg.norm(far - [0.0, 0.0, -0.5 * SPREAD]))
    expected = EA * (span / (LENGTH + LEG) - 1.0)
    np.testing.assert_allclose(line.pulls(AT_REST), [expected, 0.0, expected], rtol=1e-9)
    np.testing.assert_array_equal(bridle((4.0, 0.0, 0.0)).pulls(AT_REST), 0.0)  # nothing is taut


@pytest.mark.parametrize("far", [(4.3, 0.2, 0.1), (4.0, 1.6, 0.9), (2.0, -3.0, 3.0), (0.0, 0.0, 5.0)])
def test_virtual_work_and_moments_balance(far: tuple[float, float, float]) -> None:
    line, pose = bridle(far, (1.2, 1.4)), turned((0.1, -0.05, 0.2), (0.02, -0.03, 0.01))
    tension, wrenches = line.pull(pose, np.zeros((1, 6)), 0.0)
    assert tension > 0.0
    at_body, at_far = wrenches[1] + wrenches[2], wrenches[0]
    np.testing.assert_allclose(at_body[:3], -at_far[:3], atol=1e-7)
    moment = at_body[3:] + np.cross(pose[0, :3], at_body[:3]) + np.cross(np.array(far), at_far[:3])
    np.testing.assert_allclose(moment, 0.0, atol=1e-6)
    for axis in range(3):
        step = 1e-6 * np.eye(7)[axis]
        slope = (energy(line, pose + step) - energy(line, pose - step)) / 2e-6
        assert -slope == pytest.approx(at_body[axis], abs=1e-3 * tension)


def test_damping_takes_energy_and_keeps_the_junction_in_balance() -> None:
    twist = np.array([[0.3, -0.2, 0.1, 0.4, 0.5, -0.3]])
    for way in (1.0, -1.0):
        loose, stiff = (bridle((4.6, 0.3, 0.2), tau=tau).pull(AT_REST, way * twist, 0.0) for tau in (0.0, 0.05))
        powers = [float(((found[1][1] + found[1][2]) * way * twist[0]).sum()) for found in (loose, stiff)]
        assert powers[1] < powers[0]
        np.testing.assert_allclose(stiff[1].sum(axis=0)[:3], 0.0, atol=1e-6)


def test_a_broken_leg_leaves_the_load_to_the_other() -> None:
    line = bridle((4.6, 0.0, 0.0))
    line.breaking_load = 0.9 * line.pulls(AT_REST)[1]
    line.legs_parted = [True, False]
    pull, upper, lower = line.pulls(AT_REST)
    assert upper == 0.0
    assert pull == pytest.approx(lower, rel=1e-9)
    line.pull(AT_REST, np.zeros((1, 6)), 0.0)
    line.settle()
    assert line.parted == (pull > line.breaking_load)


@pytest.fixture
def world() -> Iterator[RigidBodyWorld]:
    world = RigidBodyWorld(gravity=(0.0, 0.0, -9.81))
    yield world
    world.close()


def hang(world: RigidBodyWorld) -> None:
    """A beam of 4 kg on a bridle under the origin."""
    beam = box((1.0, 0.1, 0.1))
    world.add_body("beam", beam, mass_properties(beam, mass=4.0), (0.0, 0.0, -4.2))
    ends = np.array([(0.0, 0.0, 0.0), (-0.5, 0.0, -4.2), (0.5, 0.0, -4.2)])
    junction = meeting_point(ends, (LEG, LEG))
    assert np.linalg.norm(junction - ends[1:], axis=1) == pytest.approx([LEG, LEG])
    points = tuple(tuple(float(x) for x in end) for end in ends)
    world.add_bridle(
        "bridle", None, "beam", points, lengths=(LENGTH, LEG, LEG), stiffness=EA, relaxation_time=0.05
    )  # fmt: skip


def test_a_beam_comes_to_rest_under_its_bridle_and_repeats_after_a_restore(world: RigidBodyWorld) -> None:
    hang(world)
    for _ in range(100):
        world.advance(0.02)
    assert world.tension("bridle") == pytest.approx(4.0 * 9.81, rel=1e-3)
    assert world.pose("beam")[2] == pytest.approx(-LENGTH - math.sqrt(LEG**2 - 0.25), abs=0.03)
    world.lines.order_length("bridle", 2.98)
    saved = world.save_state()
    world.advance(0.05)
    after, tension = world.pose("beam"), world.tension("bridle")
    world.advance(0.05)
    world.restore_state(saved)
    world.advance(0.05)
    np.testing.assert_array_equal(world.pose("beam"), after)
    assert world.tension("bridle") == tension
    assert world.lines.length("bridle") == pytest.approx(2.98)


def test_impossible_bridles_are_refused() -> None:
    with pytest.raises(ValueError, match=r"legs of 0\.4 and 0\.5 m from points 1 m apart cannot be taut together"):
        bridle((4.0, 0.0, 0.0), (0.4, 0.5))
    with pytest.raises(ValueError, match=r"leg is 0\.0, allowed: above 0"):
        bridle((4.0, 0.0, 0.0), (0.0, 1.0))
