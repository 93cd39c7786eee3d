"""What somebody else does to a world between the steps of its fluid: told where it spoils physics, else taken as it is."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np
import pybullet
import pytest

from coupling.bullet.plugin import attach_fluid
from tests.coupling.pools import pool

HALF = 0.15  # [m] of the cube's edge


def cube(client: int, height: float, mass: float = 10.0) -> int:
    shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[HALF] * 3, physicsClientId=client)
    body: int = pybullet.createMultiBody(mass, shape, basePosition=(0, 0, height), physicsClientId=client)
    pybullet.changeDynamics(body, -1, linearDamping=0, angularDamping=0, physicsClientId=client)
    return body


def told_in(client: int, body: int, steps: int, between: Callable[[int], None]) -> list[str]:
    """What is said in some steps, with a call of the step's number after each."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        world = attach_fluid(client, pool(0.1, 1.0, 0.3), [body])
        for step in range(steps):
            world.step()
            between(step)
    return [str(warning.message) for warning in told]


@pytest.mark.parametrize("more", [0, 1, 4])
def test_steps_of_the_engine_beside_those_of_the_world_are_told_once(pybullet_client: int, more: int) -> None:
    body = cube(pybullet_client, 0.6)

    def between(_: int) -> None:
        for _ in range(more):
            pybullet.stepSimulation(physicsClientId=pybullet_client)

    told = told_in(pybullet_client, body, 60, between)
    assert len(told) == (more > 0)
    if told:
        assert f"body {body} moves between the steps" in told[0] and "call world.step() instead" in told[0]


def test_water_does_no_work_on_a_loose_body_that_is_set_back_in_every_step(pybullet_client: int) -> None:
    """It was met as if it rose: the water lost 3.9 J in the last 40 steps, to a body that never left its place."""
    body, place = cube(pybullet_client, 0.4, 5.4), (0, 0, 0.4)
    world, work = attach_fluid(pybullet_client, pool(0.1, 1.0, 0.7, pybullet_client, (body,)), [body]), []
    world.fluid.watch()
    for _ in range(60):
        pybullet.resetBasePositionAndOrientation(body, place, (0, 0, 0, 1), physicsClientId=pybullet_client)
        pybullet.resetBaseVelocity(body, (0, 0, 0), (0, 0, 0), physicsClientId=pybullet_client)
        budget = world.step().budget
        assert budget is not None
        work.append(budget.part("pressure").work_on_bodies)
    assert abs(sum(work[20:])) < 0.4


def test_a_loose_body_that_is_set_along_its_way_is_not_told_of(pybullet_client: int) -> None:
    body = cube(pybullet_client, 0.8)

    def between(step: int) -> None:
        place = (-0.2 + 0.5 * step / 240.0, 0.0, 0.8)
        pybullet.resetBasePositionAndOrientation(body, place, (0, 0, 0, 1), physicsClientId=pybullet_client)
        pybullet.resetBaseVelocity(body, (0.5, 0.0, 0.0), (0.0, 0.0, 0.0), physicsClientId=pybullet_client)

    assert not told_in(pybullet_client, body, 30, between)


def test_a_body_that_lies_in_liquid_or_is_set_into_it_is_told_of(pybullet_client: int) -> None:
    body = cube(pybullet_client, 0.8)

    def between(step: int) -> None:
        if step in (3, 6):
            place = (0.0, 0.0, 0.15 if step == 3 else 0.8)
            pybullet.resetBasePositionAndOrientation(body, place, (0, 0, 0, 1), physicsClientId=pybullet_client)
            pybullet.resetBaseVelocity(body, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), physicsClientId=pybullet_client)

    told = told_in(pybullet_client, body, 10, between)
    # 0.3 m of water in layers of 0.1 m: of 3 x 3 x 3 particles or more all but the outermost lie half a spacing deep
    assert len(told) == 1
    assert f"body {body}, link -1 is placed in liquid: " in told[0] and "particles" in told[0]
    sunk = cube(pybullet_client, 0.15)
    assert len(told_in(pybullet_client, sunk, 2, lambda _: None)) == 1


def test_bodies_that_collide_in_water_repeat_bit_for_bit_when_taken_back(pybullet_client: int) -> None:
    bodies = [cube(pybullet_client, 0.45), cube(pybullet_client, 0.77)]
    pybullet.loadURDF("plane.urdf", physicsClientId=pybullet_client)
    world = attach_fluid(pybullet_client, pool(0.1, 1.0, 0.3), bodies)

    def states(steps: int) -> list[object]:
        found: list[object] = []
        for _ in range(steps):
            world.step()
            found.append([pybullet.getBaseVelocity(body, physicsClientId=pybullet_client) for body in bodies])
        return found

    states(40)
    saved, moment = world.save_state(), pybullet.saveState(physicsClientId=pybullet_client)
    first = states(20)
    world.restore_state(saved)
    pybullet.restoreState(moment, physicsClientId=pybullet_client)
    assert states(20) == first
    world.remove_body(bodies[0])
    with pytest.raises(
        ValueError, match=rf"state is of the bodies {bodies[0]}, {bodies[1]}, allowed: {bodies[1]}, which"
    ):
        world.restore_state(saved)


def boxes_on_a_motor(client: int) -> list[int]:
    """Two boxes on one hinge that a motor holds."""
    shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.15] * 3, physicsClientId=client)
    body = pybullet.createMultiBody(
        3.0, shape, basePosition=(-0.2, 0, 0.4), linkMasses=[3.0], linkCollisionShapeIndices=[shape], linkVisualShapeIndices=[-1],
        linkPositions=[(0.4, 0, 0)], linkOrientations=[(0, 0, 0, 1)], linkInertialFramePositions=[(0, 0, 0)],
        linkInertialFrameOrientations=[(0, 0, 0, 1)], linkParentIndices=[0], linkJointTypes=[pybullet.JOINT_REVOLUTE],
        linkJointAxis=[(0, 1, 0)], physicsClientId=client,
    )  # fmt: skip
    pybullet.setJointMotorControl2(
        body, 0, pybullet.VELOCITY_CONTROL, targetVelocity=0.0, force=500.0, physicsClientId=client
    )
    return [body]


def boxes_on_a_constraint(client: int) -> list[int]:
    """Two boxes, one of which is tied to the other at a point between them."""
    shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.15] * 3, physicsClientId=client)
    bodies = [
        pybullet.createMultiBody(3.0, shape, basePosition=(x, 0, 0.4), physicsClientId=client) for x in (-0.2, 0.2)
    ]
    pybullet.createConstraint(
        bodies[0], -1, bodies[1], -1, pybullet.JOINT_POINT2POINT, (0, 0, 0), (0.2, 0, 0), (-0.2, 0, 0), physicsClientId=client
    )  # fmt: skip
    return bodies


@pytest.mark.parametrize("boxes", [boxes_on_a_motor, boxes_on_a_constraint])
@pytest.mark.parametrize("steps_before", [0, 3])
def test_bodies_that_hang_together_repeat_bit_for_bit_from_any_step(
    pybullet_client: int, boxes: Callable[[int], list[int]], steps_before: int
) -> None:
    """A world that goes back to before its first step forgets which bodies hung together in later ones."""
    bodies = boxes(pybullet_client)
    world = attach_fluid(pybullet_client, pool(0.1, 1.0, 0.3), bodies)
    pybullet.resetBaseVelocity(bodies[0], (0, 0, -1), (0, 3, 0), physicsClientId=pybullet_client)

    def wrenches(steps: int) -> np.ndarray:
        found = []
        for _ in range(steps):
            world.step()
            found.append([world.wrench(body) for body in bodies])
        return np.array(found)

    wrenches(steps_before)
    saved, moment = world.save_state(), pybullet.saveState(physicsClientId=pybullet_client)
    first = wrenches(4)
    world.restore_state(saved)
    pybullet.restoreState(moment, physicsClientId=pybullet_client)
    np.testing.assert_array_equal(wrenches(4), first)
    assert first.any()


def test_a_controllers_force_that_goes_through_zero_is_not_taken_for_damping(pybullet_client: int) -> None:
    body = cube(pybullet_client, 0.8)
    pybullet.resetBaseVelocity(body, (0.5, 0.0, 0.0), physicsClientId=pybullet_client)

    def between(step: int) -> None:
        place = pybullet.getBasePositionAndOrientation(body, physicsClientId=pybullet_client)[0]
        velocity = np.array(pybullet.getBaseVelocity(body, physicsClientId=pybullet_client)[0])
        damping = -10.0 * 0.04 * velocity * (1.0 + np.linalg.norm(velocity))  # [N] pybullet's default, of 10 kg
        force = (step // 4 - 1) * damping  # of a controller that is asked every fourth step
        pybullet.applyExternalForce(
            body, -1, force.tolist(), place, pybullet.WORLD_FRAME, physicsClientId=pybullet_client
        )

    assert not told_in(pybullet_client, body, 20, between)
