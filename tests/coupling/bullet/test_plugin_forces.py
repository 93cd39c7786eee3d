"""The water's wrenches in worlds of somebody else: they arrive whatever holds the bodies, and wherever these rest."""

from __future__ import annotations

import numpy as np
import pybullet
import pytest

from coupling.bullet.plugin import attach_fluid
from oilsim import Fluid
from tests.coupling.pools import pool

GRAVITY = 9.81


def dammed(depth: float) -> Fluid:
    """Water to the one side, x < -0.1 m, of a tank of 1 m."""
    fluid = pool(0.1, 1.0, depth)
    fluid.remove_particles(fluid.particles.position[0] > -0.1)
    return fluid


def gate(client: int, force: float) -> int:
    """A gate across the tank on a hinge above, whose motor gives `force` [N m] at most to keep it still."""
    top, leaf = (
        pybullet.createCollisionShape(
            pybullet.GEOM_BOX, halfExtents=half, collisionFramePosition=place, physicsClientId=client
        )
        for half, place in (((0.2, 0.2, 0.1), (0, 0, 0)), ((0.1, 0.5, 0.4), (0, 0, -0.5)))
    )
    body = pybullet.createMultiBody(
        0.0, top, basePosition=(0, 0, 1.6), linkMasses=[20.0], linkCollisionShapeIndices=[leaf], linkVisualShapeIndices=[-1],
        linkPositions=[(0, 0, -0.7)], linkOrientations=[(0, 0, 0, 1)], linkInertialFramePositions=[(0, 0, -0.5)],
        linkInertialFrameOrientations=[(0, 0, 0, 1)], linkParentIndices=[0], linkJointTypes=[pybullet.JOINT_REVOLUTE],
        linkJointAxis=[(0, 1, 0)], physicsClientId=client,
    )  # fmt: skip
    unbrake(client, body)
    pybullet.setJointMotorControl2(
        body, 0, pybullet.VELOCITY_CONTROL, targetVelocity=0.0, force=force, physicsClientId=client
    )
    return body


def unbrake(client: int, body: int) -> None:
    for link in range(-1, pybullet.getNumJoints(body, physicsClientId=client)):
        pybullet.changeDynamics(body, link, linearDamping=0, angularDamping=0, jointDamping=0, physicsClientId=client)


def test_a_motor_on_a_fixed_base_bears_the_water_it_holds_back(pybullet_client: int) -> None:
    body = gate(pybullet_client, 5000.0)
    world = attach_fluid(pybullet_client, dammed(0.6), [body])
    water, motor = [], []
    for _ in range(120):
        world.step()
        arm = np.array(pybullet.getLinkState(body, 0, physicsClientId=pybullet_client)[0]) - (0.0, 0.0, 0.9)
        wrench = world.wrench(body, 0)
        water.append((np.cross(arm, wrench[:3]) + wrench[3:])[1])
        motor.append(pybullet.getJointState(body, 0, physicsClientId=pybullet_client)[3])
    assert np.mean(water[60:]) < -500.0
    assert np.mean(motor[60:]) == pytest.approx(-np.mean(water[60:]), rel=1e-3)


def test_a_motor_on_a_fixed_base_gives_way_to_more_water_than_it_can_hold(pybullet_client: int) -> None:
    body = gate(pybullet_client, 200.0)
    world = attach_fluid(pybullet_client, dammed(0.6), [body])
    for _ in range(60):
        world.step()
    assert abs(pybullet.getJointState(body, 0, physicsClientId=pybullet_client)[0]) > 0.1


def submerged_arm(client: int, force: float) -> int:
    """A block a twentieth as dense as water, under it, hinged at its end; its lift is 84 N m, its motor gives `force` [N m]."""
    shape = pybullet.createCollisionShape(
        pybullet.GEOM_BOX, halfExtents=(0.2, 0.15, 0.15), collisionFramePosition=(0.25, 0, 0), physicsClientId=client
    )
    body = pybullet.createMultiBody(
        0.0, -1, basePosition=(-0.25, 0, 0.4), linkMasses=[1.8], linkCollisionShapeIndices=[shape], linkVisualShapeIndices=[-1],
        linkPositions=[(0, 0, 0)], linkOrientations=[(0, 0, 0, 1)], linkInertialFramePositions=[(0.25, 0, 0)],
        linkInertialFrameOrientations=[(0, 0, 0, 1)], linkParentIndices=[0], linkJointTypes=[pybullet.JOINT_REVOLUTE],
        linkJointAxis=[(0, 1, 0)], physicsClientId=client,
    )  # fmt: skip
    unbrake(client, body)
    pybullet.setJointMotorControl2(
        body, 0, pybullet.VELOCITY_CONTROL, targetVelocity=0.0, force=force, physicsClientId=client
    )
    return body


@pytest.mark.parametrize("force", [10.0, 60.0, 100.0, 150.0])
def test_a_motor_that_is_overcome_by_a_light_link_does_not_throw_it(pybullet_client: int, force: float) -> None:
    """Taken for rigid as soon as its torque changes, be it from one limit to the other, it swung between 100 N m and 700 times the lift."""
    body = submerged_arm(pybullet_client, force)
    world = attach_fluid(pybullet_client, pool(0.05, 1.0, 0.7, pybullet_client, (body,)), [body])
    lifts = []
    for _ in range(48):
        world.step()
        lifts.append(world.wrench(body, 0)[2])
    lift = 1000.0 * GRAVITY * 0.4 * 0.3 * 0.3
    assert np.abs(lifts).max() < 2.5 * lift
    angle, rate, _, torque = pybullet.getJointState(body, 0, physicsClientId=pybullet_client)
    assert abs(rate) < 10.0
    if force < 80.0:
        assert angle < -0.1 and torque == pytest.approx(force)  # too weak: it rises
    else:
        assert abs(angle) < 0.1  # strong enough: held, but for the first blow


def drag_of_a_slide(client: int, density: float, gain: float = 1.0) -> np.ndarray:
    """(190,) [N] of the water on a submerged cube that a strong motor takes along for 0.8 s, faster and then slower, from step 10 on."""
    shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.2] * 3, physicsClientId=client)
    body = pybullet.createMultiBody(
        0.0, -1, basePosition=(0, 0, 0.4), linkMasses=[0.064 * density], linkCollisionShapeIndices=[shape], linkVisualShapeIndices=[-1],
        linkPositions=[(0, 0, 0)], linkOrientations=[(0, 0, 0, 1)], linkInertialFramePositions=[(0, 0, 0)],
        linkInertialFrameOrientations=[(0, 0, 0, 1)], linkParentIndices=[0], linkJointTypes=[pybullet.JOINT_PRISMATIC],
        linkJointAxis=[(1, 0, 0)], physicsClientId=client,
    )  # fmt: skip
    unbrake(client, body)
    world, drag = attach_fluid(client, pool(0.1, 1.2, 0.8, client, (body,)), [body]), []
    for step in range(200):
        rate = 0.4 * np.sin(2.0 * np.pi * step / 480)
        pybullet.setJointMotorControl2(
            body, 0, pybullet.VELOCITY_CONTROL, targetVelocity=rate, velocityGain=gain, force=1e5, physicsClientId=client
        )  # fmt: skip
        world.step()
        drag.append(world.wrench(body, 0)[0])
    return np.array(drag[10:])


@pytest.mark.slow
def test_what_a_strong_motor_moves_feels_the_same_water_whatever_it_weighs(pybullet_client: int) -> None:
    """A motor that slowed its joint down passed for one that is overcome: drag of the light fell to nothing, and came back as a blow."""
    heavy = drag_of_a_slide(pybullet_client, 1000.0)
    pybullet.resetSimulation(physicsClientId=pybullet_client)
    light = drag_of_a_slide(pybullet_client, 50.0)
    assert np.abs(light - heavy).max() < 0.05 * np.abs(heavy).max()


def test_a_motor_that_yields_to_loads_is_not_taken_for_one_that_holds(pybullet_client: int) -> None:
    """Held by it, then thrown by what the water had laid on it as on something held, a light cube felt 349 N, half its lift."""
    assert np.abs(drag_of_a_slide(pybullet_client, 50.0, gain=0.1)).max() < 50.0


@pytest.mark.parametrize("limit", [1.0, 10.0, 100.0, 1e4])
def test_a_weak_constraint_neither_holds_a_float_nor_throws_it(pybullet_client: int, limit: float) -> None:
    # 27 kg of water displaced by 1.6 kg: 265 N of buoyancy. Held as if for good, it would be thrown off at hundreds of m/s2
    shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.15] * 3, physicsClientId=pybullet_client)
    body = pybullet.createMultiBody(1.6, shape, basePosition=(0, 0, 0.3), physicsClientId=pybullet_client)
    unbrake(pybullet_client, body)
    tie = pybullet.createConstraint(
        body, -1, -1, -1, pybullet.JOINT_POINT2POINT, (0, 0, 0), (0, 0, 0), (0, 0, 0.3), physicsClientId=pybullet_client
    )
    pybullet.changeConstraint(tie, maxForce=limit, physicsClientId=pybullet_client)
    world = attach_fluid(pybullet_client, pool(0.1, 1.0, 0.6, pybullet_client, (body,)), [body])
    speeds = []
    for _ in range(120):
        world.step()
        speeds.append(pybullet.getBaseVelocity(body, physicsClientId=pybullet_client)[0])
    changes = np.linalg.norm(np.diff(speeds, axis=0), axis=1) * 240.0
    height = pybullet.getBasePositionAndOrientation(body, physicsClientId=pybullet_client)[0][2]
    assert (
        changes.max() < 265.0 / 1.6 - GRAVITY
    )  # what buoyancy gives its own mass; water that it takes along makes it less
    assert (height > 0.5) == (limit < 265.0)


def test_water_wakes_a_body_that_pybullet_put_to_sleep(pybullet_client: int) -> None:
    floor, shape = (
        pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, physicsClientId=pybullet_client)
        for half in ((2.0, 2.0, 0.1), (0.1, 0.1, 0.1))
    )
    pybullet.createMultiBody(0.0, floor, basePosition=(0, 0, -0.1), physicsClientId=pybullet_client)
    body = pybullet.createMultiBody(
        4.0, shape, basePosition=(0.2, 0, 0.1), flags=pybullet.URDF_ENABLE_SLEEPING, physicsClientId=pybullet_client
    )
    pybullet.changeDynamics(
        body,
        -1,
        activationState=pybullet.ACTIVATION_STATE_ENABLE_SLEEPING,
        lateralFriction=0.1,
        physicsClientId=pybullet_client,
    )
    for _ in range(900):
        pybullet.stepSimulation(physicsClientId=pybullet_client)
    assert not np.any(pybullet.getBaseVelocity(body, physicsClientId=pybullet_client))
    world = attach_fluid(pybullet_client, dammed(0.6), [body])
    for _ in range(80):
        world.step()
    assert pybullet.getBasePositionAndOrientation(body, physicsClientId=pybullet_client)[0][0] > 0.25
