"""A jointed boom in a steady stream takes the shape and the tension of the exact catenary.

Drag is prescribed, normal to each segment: F = 0.5 rho Cd d l (V sin theta)^2, theta the angle between segment and
stream; the reference is `data/boom_catenary.csv`. The chain starts as a V of two straight arms and is damped to rest.
"""

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import trimesh

from booms.deployment import catenary_chain
from booms.scores import tow_force
from coupling.bullet.rigid_body_participant import RigidBodyWorld
from coupling.solids.bodies import mass_properties

LENGTH, PRESSURE = 10.0, 12.0  # boom [m]; q d, drag of a length square to the stream [N/m]
TABLE = np.loadtxt(Path(__file__).parent / "data" / "boom_catenary.csv", delimiter=",")


def vee(segment_count, gap):
    """Joints (n + 1, 2) of a chain of two straight arms between (-+ gap / 2, 0), its point at y < 0."""
    arm = np.array([0.5 * gap, -math.sqrt(0.25 * (LENGTH**2 - gap**2))]) / (segment_count // 2)
    down = np.array([-0.5 * gap, 0.0]) + np.arange(segment_count // 2 + 1)[:, None] * arm
    return np.concatenate([down, down[-2::-1] * (-1.0, 1.0)])


def moored_chain(line):
    """World with a segment on every link of the line, joined, its ends held to the world."""
    world = RigidBodyWorld(gravity=(0.0, 0.0, 0.0), sub_step=1.0 / 120.0, solver_iterations=100)
    length = LENGTH / (len(line) - 1)
    mesh = trimesh.creation.box((length, 0.05, 0.3))
    for k, (start, end) in enumerate(pairwise(line)):
        half = 0.5 * math.atan2(*(end - start)[::-1])
        center = (*(0.5 * (start + end)), 0.0)
        orientation = (0.0, 0.0, math.sin(half), math.cos(half))
        world.add_body(f"s{k}", mesh, mass_properties(mesh, mass=length), center, orientation, friction=None)
    for k, point in enumerate(line):
        before, after = f"s{max(k - 1, 0)}", None if k in (0, len(line) - 1) else f"s{k}"
        world.add_joint(f"j{k}", before, after, (*point, 0.0))
    return world


def settle(world, count, duration=14.0, step=1.0 / 60.0):
    """Prescribed normal drag of a stream along -y, and a linear damping that vanishes at rest."""
    link = LENGTH / count
    for _ in range(round(duration / step)):
        for k in range(count):
            pose, twist = world.pose(f"s{k}"), world.twist(f"s{k}")
            yaw = 2.0 * math.atan2(pose[5], pose[6])
            normal = np.array([math.sin(yaw), -math.cos(yaw), 0.0])  # out of the U at the apex
            force = PRESSURE * link * abs(normal[1]) * -normal[1] * normal - 2.0 * link * twist[:3]
            world.set_applied_wrench(f"s{k}", np.concatenate([force, -0.05 * link**3 * twist[3:]]))
        world.advance(step)


def joints(world, count):
    """Joints (count + 1, 2) of the chain in plan."""
    points = []
    for k in range(count):
        pose = world.pose(f"s{k}")
        yaw = 2.0 * math.atan2(pose[5], pose[6])
        arm = 0.5 * LENGTH / count * np.array([math.cos(yaw), math.sin(yaw)])
        points.append((pose[:2] - arm, pose[:2] + arm))
    starts, ends = np.moveaxis(np.array(points), 1, 0)
    assert np.abs(ends[:-1] - starts[1:]).max() < 0.005 * LENGTH / count  # joints stay closed
    return np.concatenate([starts, ends[-1:]])


@pytest.mark.parametrize(
    ("count", "gap_ratio"),
    [pytest.param(20, 0.5, marks=pytest.mark.slow), (40, 0.333), pytest.param(60, 0.3, marks=pytest.mark.slow)],
)
def test_sag_and_tension_of_a_chain_in_a_stream(count, gap_ratio):
    tension, sag = TABLE[np.isclose(TABLE[:, 0], gap_ratio)][0, 1:3]
    world = moored_chain(vee(count, gap_ratio * LENGTH))
    settle(world, count)
    line = joints(world, count)
    assert -line[:, 1].min() / LENGTH == pytest.approx(sag, rel=0.003)
    tensions = [world.tension(f"j{k}") / (PRESSURE * LENGTH) for k in range(count + 1)]
    assert np.mean(tensions) == pytest.approx(tension, rel=0.01)
    assert np.ptp(tensions) < 0.001 * tension  # constant along the boom
    world.close()


@pytest.mark.parametrize(("gap_ratio", "tension", "sag", "drag"), TABLE)
def test_formulas_and_layout_reproduce_the_table(gap_ratio, tension, sag, drag):
    # depth 1, q = 1: rho Cd V^2 = 2
    computed = tow_force(1.0, gap_ratio, 1.0, 1.0, drag_coefficient=2.0, density=1.0)
    assert computed == pytest.approx((tension, drag), abs=6e-4)
    for count, tolerance in ((20, 0.01), (60, 0.003)):
        assert -catenary_chain(count, gap_ratio)[:, 1].min() == pytest.approx(sag, rel=tolerance)
