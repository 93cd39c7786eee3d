"""Joints of somebody else's world that are set in every step: a link without its velocity does not push the fluid, and that is told."""

from __future__ import annotations

import math
import warnings

import pybullet
import pytest

from coupling.bullet.plugin import FluidWorld, attach_fluid
from tests.coupling.pools import pool

STEP = 1.0 / 240.0


def paddle(client: int, joint: int) -> int:
    """A paddle on a held base above the water, on a joint without a motor."""
    shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=(0.1, 0.2, 0.2), physicsClientId=client)
    body: int = pybullet.createMultiBody(
        0.0, -1, basePosition=(0, 0, 0.6), linkMasses=[2.0], linkCollisionShapeIndices=[shape], linkVisualShapeIndices=[-1],
        linkPositions=[(0, 0, 0)], linkOrientations=[(0, 0, 0, 1)], linkInertialFramePositions=[(0, 0, -0.2)],
        linkInertialFrameOrientations=[(0, 0, 0, 1)], linkParentIndices=[0], linkJointTypes=[joint], linkJointAxis=[(0, 1, 0)],
        physicsClientId=client,
    )  # fmt: skip
    pybullet.setJointMotorControl2(body, 0, pybullet.VELOCITY_CONTROL, force=0, physicsClientId=client)
    return body


def led(world: FluidWorld, body: int, rate: float | None, steps: int) -> list[str]:
    """Return the warnings of some steps; before each the joint moves on by 1 rad/s or m/s, with rate None it is left alone."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        for step in range(steps):
            if rate is not None:
                pybullet.resetJointState(body, 0, step * STEP, targetVelocity=rate, physicsClientId=world.client)
            world.step()
    return [text for text in (str(warning.message) for warning in told) if "resetJointState" in text]


@pytest.mark.parametrize("joint", [pybullet.JOINT_REVOLUTE, pybullet.JOINT_PRISMATIC])
def test_a_joint_led_without_its_velocity_is_told_of_once_with_the_velocity(pybullet_client: int, joint: int) -> None:
    body = paddle(pybullet_client, joint)
    world = attach_fluid(pybullet_client, pool(0.1, 1.0, 0.4), [body])
    (told,) = led(world, body, 0.0, 6)
    assert f"joint 0 of body {body} is set step after step, but without a velocity" in told
    assert f"resetJointState({body}, 0, ..., targetVelocity=1)" in told


@pytest.mark.parametrize("joint", [pybullet.JOINT_REVOLUTE, pybullet.JOINT_PRISMATIC])
def test_a_joint_led_at_its_velocity_placed_once_or_left_alone_is_not_told_of(pybullet_client: int, joint: int) -> None:
    body = paddle(pybullet_client, joint)
    world = attach_fluid(pybullet_client, pool(0.1, 1.0, 0.4), [body])
    assert not led(world, body, 1.0, 4)
    pybullet.resetJointState(body, 0, 0.3, physicsClientId=pybullet_client)
    assert not led(world, body, None, 4)


def test_a_ball_joint_is_told_of_too(pybullet_client: int) -> None:
    body = paddle(pybullet_client, pybullet.JOINT_SPHERICAL)
    world = attach_fluid(pybullet_client, pool(0.1, 1.0, 0.4), [body])
    with pytest.warns(UserWarning, match=r"as in resetJointStateMultiDof\("):
        for step in range(4):
            turn = (0.0, math.sin(0.5 * step * STEP), 0.0, math.cos(0.5 * step * STEP))
            pybullet.resetJointStateMultiDof(body, 0, turn, targetVelocity=(0, 0, 0), physicsClientId=pybullet_client)
            world.step()
