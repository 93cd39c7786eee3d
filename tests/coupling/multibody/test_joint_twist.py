"""Joints that resist a twist, against formulas: a torsion pendulum, its decay, and a chain's stiffest mode at the longest step."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh

from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.multibody.joint_constraints import PointJoint
from coupling.multibody.joint_twist import longest_twist_step, twist_torques, twists_of
from coupling.solids.bodies import mass_properties

STIFFNESS = 30.0  # [N m/rad]


def rolled(angle: float) -> tuple[float, float, float, float]:
    return math.sin(0.5 * angle), 0.0, 0.0, math.cos(0.5 * angle)


def chain(rolls: list[float], relaxation_time: float = 0.0) -> tuple[RigidBodyWorld, float]:
    """Bars of 1 m along x without weight, jointed end to end and rolled about x; return the world and a bar's inertia about x [kg m2]."""
    world = RigidBodyWorld(gravity=(0.0, 0.0, 0.0), sub_step=0.01)
    mesh = trimesh.creation.box((1.0, 0.2, 0.6))
    properties = mass_properties(mesh, mass=20.0)
    for n, roll in enumerate(rolls):
        world.add_body(f"bar-{n}", mesh, properties, (float(n), 0.0, 0.0), rolled(roll), friction=None)
    for n in range(1, len(rolls)):
        world.add_joint(
            f"joint-{n}", f"bar-{n - 1}", f"bar-{n}", (n - 0.5, 0.0, 0.0),
            twisting_stiffness=STIFFNESS, relaxation_time=relaxation_time,
        )  # fmt: skip
    return world, float(properties.inertia[0, 0])


def roll_of(world: RigidBodyWorld, name: str) -> float:
    x, _, _, w = world.pose(name)[3:]
    return 2.0 * math.atan2(x, w)


def test_two_bars_swing_against_each_other_as_a_torsion_pendulum() -> None:
    """theta'' = -2 K theta / I: after a period both are where they began, after half of it on the other side; their sum never turns."""
    world, inertia = chain([0.1, -0.1])
    period = 2.0 * math.pi / math.sqrt(2.0 * STIFFNESS / inertia)
    world.advance(0.5 * period)
    assert roll_of(world, "bar-0") == pytest.approx(-0.1, rel=0.02)
    world.advance(0.5 * period)
    assert roll_of(world, "bar-0") == pytest.approx(0.1, rel=0.02)
    assert world.momentum()[3] == pytest.approx(0.0, abs=1e-9)
    world.close()


def test_relaxation_takes_the_swing_as_kelvin_voigt_does() -> None:
    """The damping ratio is tau omega / 2: after a period the swing is exp(-pi tau omega) of what it was, for light damping."""
    omega = math.sqrt(2.0 * STIFFNESS / chain([0.0])[1])
    world, _ = chain([0.1, -0.1], relaxation_time=0.1 / omega)
    world.advance(2.0 * math.pi / (omega * math.sqrt(1.0 - 0.05**2)))
    assert roll_of(world, "bar-0") == pytest.approx(0.1 * math.exp(-0.1 * math.pi), rel=0.05)
    world.close()


def test_bars_bend_freely_and_a_parted_joint_resists_nothing() -> None:
    pose = np.array([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.0, 0.0, math.sin(0.3), math.cos(0.3)]])
    joints = [PointJoint(0, 1, np.zeros(3), np.zeros(3), twisting_stiffness=STIFFNESS)]
    np.testing.assert_allclose(twist_torques(twists_of(joints), pose, np.zeros((2, 6))), 0.0, atol=1e-12)
    world, _ = chain([0.1, -0.1])
    world.part_joint("joint-1")
    world.advance(1.0)
    assert roll_of(world, "bar-0") == pytest.approx(0.1, abs=1e-9)
    world.close()


def test_the_longest_step_keeps_the_stiffest_mode_of_a_chain() -> None:
    """A long chain's neighbours turn against each other with omega^2 = 4 K / I; symplectic Euler bears omega h < 2, and the limit is 4."""
    world, inertia = chain([0.0] * 6)
    twists = twists_of([PointJoint(n, n + 1, np.zeros(3), np.zeros(3), twisting_stiffness=STIFFNESS) for n in range(5)])
    inverse = np.zeros((6, 6, 6))
    inverse[:, 3:, 3:] = np.eye(3) / inertia
    pose = np.array([world.pose(f"bar-{n}") for n in range(6)])
    assert longest_twist_step(twists, pose, inverse, 4.0) == pytest.approx(2.0 / math.sqrt(4.0 * STIFFNESS / inertia))
    assert longest_twist_step(twists_of([]), pose, inverse, 4.0) == math.inf
    world.close()
