"""Links of pybullet bodies: what they are said to do under gravity and wrenches is what pybullet does with them, joint by joint."""

from __future__ import annotations

import numpy as np
import pybullet
import pytest

from coupling.bullet.links import LinkedBody, LinkSystem, read_links, read_loads

GRAVITY = np.array((0.3, -0.5, -9.81))
STEP = 1e-4


@pytest.fixture(autouse=True)
def _slanting_gravity_and_short_steps(pybullet_client: int) -> None:
    pybullet.setGravity(*GRAVITY, physicsClientId=pybullet_client)
    pybullet.setTimeStep(STEP, physicsClientId=pybullet_client)


def unbrake(client: int, body: int) -> None:
    """No damping and no motors: what pybullet adds by default and nobody can ask for."""
    for link in range(-1, pybullet.getNumJoints(body, physicsClientId=client)):
        pybullet.changeDynamics(
            body, link, linearDamping=0, angularDamping=0, jointDamping=0, maxJointVelocity=1e3, physicsClientId=client
        )
        if link < 0:
            continue
        kind = pybullet.getJointInfo(body, link, physicsClientId=client)[2]
        if kind == pybullet.JOINT_SPHERICAL:
            pybullet.setJointMotorControlMultiDof(
                body, link, pybullet.POSITION_CONTROL, [0, 0, 0, 1], positionGain=0, velocityGain=0, force=[0, 0, 0],
                physicsClientId=client,
            )  # fmt: skip
        elif kind in (pybullet.JOINT_REVOLUTE, pybullet.JOINT_PRISMATIC):
            pybullet.setJointMotorControl2(body, link, pybullet.VELOCITY_CONTROL, force=0, physicsClientId=client)


def chain(client: int, kind: int, *, base_mass: float = 1.5) -> int:
    """A bent chain of four boxes, joined by joints of one kind, with crooked axes."""
    shapes = [
        pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=size, physicsClientId=client)
        for size in ((0.1, 0.2, 0.05), (0.2, 0.05, 0.1), (0.05, 0.1, 0.1), (0.1, 0.1, 0.2))
    ]
    body = pybullet.createMultiBody(
        base_mass, shapes[0], basePosition=(0, 0, 2), baseOrientation=(0.1, 0.2, 0.3, 0.9273618495),
        linkMasses=[0.8, 0.3, 2.0], linkCollisionShapeIndices=shapes[1:], linkVisualShapeIndices=[-1] * 3,
        linkPositions=[(0.3, 0.1, 0.0), (0.2, 0.0, 0.3), (0.0, 0.4, 0.1)],
        linkOrientations=[(0, 0, 0, 1), (0.2, 0, 0, 0.9797958971), (0, 0, 0, 1)],
        linkInertialFramePositions=[(0.1, 0.05, 0.0), (0.0, 0.1, 0.1), (0.02, 0.0, 0.1)],
        linkInertialFrameOrientations=[(0, 0, 0, 1), (0, 0.3, 0, 0.9539392014), (0, 0, 0, 1)],
        linkParentIndices=[0, 1, 1], linkJointTypes=[kind] * 3, linkJointAxis=[(0, 1, 0), (0.6, 0, 0.8), (0, 0, 1)],
        physicsClientId=client,
    )  # fmt: skip
    unbrake(client, body)
    return body


def set_going(client: int, body: int, kind: int) -> None:
    pybullet.resetBaseVelocity(body, (0.4, -0.2, 0.1), (1.0, 2.0, -1.5), physicsClientId=client)
    for link, rate in enumerate((2.0, -1.0, 1.5)):
        if kind == pybullet.JOINT_SPHERICAL:
            pybullet.resetJointStateMultiDof(
                body, link, (0, 0, 0.19866933, 0.98006658), (rate, 0.5, -0.7), physicsClientId=client
            )
        elif kind != pybullet.JOINT_FIXED:
            pybullet.resetJointState(body, link, 0.2 * rate, rate, physicsClientId=client)


def push(client: int, system: LinkSystem, wrenches: np.ndarray) -> None:
    for (body, link), pose, wrench in zip(system.keys, system.pose, wrenches, strict=True):
        world = pybullet.WORLD_FRAME
        pybullet.applyExternalForce(body, link, wrench[:3].tolist(), pose[:3].tolist(), world, physicsClientId=client)
        pybullet.applyExternalTorque(body, link, wrench[3:].tolist(), world, physicsClientId=client)


def step_with(client: int, *linked: LinkedBody) -> None:
    """Make a step of the client, after which bodies read what their motors and constraints gave in it."""
    pybullet.stepSimulation(physicsClientId=client)
    read_loads(client, linked)


def measured_and_expected(client: int, linked: list[LinkedBody], step: float = STEP) -> tuple[np.ndarray, np.ndarray]:
    """Accelerations (L, 6) of one step under random wrenches, and what the links' inverse mass makes of them."""
    system = read_links(client, linked, GRAVITY, step)
    wrenches = np.random.default_rng(1).normal(scale=5.0, size=(len(system.keys), 6))
    expected = system.acceleration + (system.inverse_mass @ wrenches.ravel()).reshape(-1, 6)
    push(client, system, wrenches)
    step_with(client, *linked)
    after = np.concatenate([body.motion()[1] for body in linked])
    return (after - system.twist) / step, expected


@pytest.mark.parametrize("base_mass", [1.5, 0.0])
@pytest.mark.parametrize("kind", ["REVOLUTE", "PRISMATIC", "SPHERICAL", "FIXED"])
def test_links_accelerate_as_they_are_said_to(pybullet_client: int, kind: str, base_mass: float) -> None:
    joint = getattr(pybullet, f"JOINT_{kind}")
    body = chain(pybullet_client, joint, base_mass=base_mass)
    if base_mass > 0.0:
        set_going(pybullet_client, body, joint)
    measured, expected = measured_and_expected(pybullet_client, [LinkedBody(pybullet_client, body)])
    # pybullet turns with the step, so that its link velocities differ in first order of it
    np.testing.assert_allclose(measured, expected, atol=1e-2 * np.abs(expected).max())


def test_inverse_mass_is_symmetric_and_moves_no_fixed_base(pybullet_client: int) -> None:
    body = LinkedBody(pybullet_client, chain(pybullet_client, pybullet.JOINT_REVOLUTE, base_mass=0.0))
    system = read_links(pybullet_client, [body], GRAVITY, STEP)
    np.testing.assert_allclose(system.inverse_mass, system.inverse_mass.T, atol=1e-12)
    assert np.linalg.eigvalsh(system.inverse_mass).min() > -1e-12
    assert np.linalg.matrix_rank(system.inverse_mass) == 3  # three hinges and nothing else
    assert not system.inverse_mass[:6].any()
    assert list(system.is_free) == [False, True, True, True]


def test_bodies_that_nothing_ties_answer_each_for_itself(pybullet_client: int) -> None:
    bodies = [
        LinkedBody(pybullet_client, chain(pybullet_client, pybullet.JOINT_REVOLUTE, base_mass=mass))
        for mass in (1.5, 0.0, 0.7)
    ]
    together = read_links(pybullet_client, bodies, np.array(GRAVITY), STEP)
    expected = np.zeros_like(together.inverse_mass)
    for n, body in enumerate(bodies):
        alone, rows = read_links(pybullet_client, [body], np.array(GRAVITY), STEP), slice(24 * n, 24 * n + 24)
        expected[rows, rows] = alone.inverse_mass
        np.testing.assert_array_equal(together.acceleration[4 * n : 4 * n + 4], alone.acceleration)
    np.testing.assert_array_equal(together.inverse_mass, expected)


def test_forces_reach_links_of_a_fixed_base_that_motors_hold(pybullet_client: int) -> None:
    body = chain(pybullet_client, pybullet.JOINT_REVOLUTE, base_mass=0.0)
    for link in range(3):
        pybullet.setJointMotorControl2(
            body, link, pybullet.VELOCITY_CONTROL, targetVelocity=0.0, force=1e6, physicsClientId=pybullet_client
        )
    linked = LinkedBody(pybullet_client, body)
    for _ in range(3):
        system = read_links(pybullet_client, [linked], GRAVITY, STEP)
        step_with(pybullet_client, linked)
    assert not system.inverse_mass.any()
    assert list(system.is_free) == [False, True, True, True]


def test_a_constraint_on_what_motors_hold_changes_nothing(pybullet_client: int) -> None:
    """There is nothing left that it could hold."""
    body = chain(pybullet_client, pybullet.JOINT_REVOLUTE, base_mass=0.0)
    for link in range(3):
        pybullet.setJointMotorControl2(
            body, link, pybullet.POSITION_CONTROL, targetPosition=0.0, force=1e6, physicsClientId=pybullet_client
        )
    place = pybullet.getLinkState(body, 2, physicsClientId=pybullet_client)[0]
    away = (place[0], place[1], place[2] + 1e-3)
    pybullet.createConstraint(
        body, 2, -1, -1, pybullet.JOINT_POINT2POINT, (0, 0, 0), (0, 0, 0), away, physicsClientId=pybullet_client
    )
    linked = LinkedBody(pybullet_client, body)
    for _ in range(5):
        system = read_links(pybullet_client, [linked], GRAVITY, STEP)
        step_with(pybullet_client, linked)
    np.testing.assert_allclose(system.inverse_mass, 0.0, atol=1e-12)


@pytest.mark.parametrize("without", ["mass", "inertia"])
def test_what_has_no_inertia_is_not_moved_by_forces(pybullet_client: int, without: str) -> None:
    """A leaf without mass on a hinge, and a body that may not turn: pybullet moves them so."""
    shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.15] * 3, physicsClientId=pybullet_client)
    if without == "mass":
        body = pybullet.createMultiBody(
            5.0, shape, linkMasses=[0.0], linkCollisionShapeIndices=[-1], linkVisualShapeIndices=[-1], linkPositions=[(0, 0, 0.2)],
            linkOrientations=[(0, 0, 0, 1)], linkInertialFramePositions=[(0, 0, 0)], linkInertialFrameOrientations=[(0, 0, 0, 1)],
            linkParentIndices=[0], linkJointTypes=[pybullet.JOINT_REVOLUTE], linkJointAxis=[(0, 0, 1)], physicsClientId=pybullet_client,
        )  # fmt: skip
    else:
        body = pybullet.createMultiBody(5.0, shape, physicsClientId=pybullet_client)
        pybullet.changeDynamics(body, -1, localInertiaDiagonal=(0, 0, 0), physicsClientId=pybullet_client)
    system = read_links(pybullet_client, [LinkedBody(pybullet_client, body)], GRAVITY, STEP)
    np.testing.assert_allclose(system.inverse_mass[:3, :3], np.eye(3) / 5.0, atol=1e-12)
    np.testing.assert_allclose(system.acceleration[0], [*GRAVITY, 0, 0, 0], atol=1e-12)
    if without == "inertia":
        assert not system.inverse_mass[3:6].any()


@pytest.mark.parametrize("kind", ["POINT2POINT", "FIXED"])
def test_constraints_tie_bodies_to_each_other_and_to_the_world(pybullet_client: int, kind: str) -> None:
    pybullet.setPhysicsEngineParameter(numSolverIterations=500, physicsClientId=pybullet_client)
    shape = pybullet.createCollisionShape(
        pybullet.GEOM_BOX, halfExtents=(0.1, 0.1, 0.1), physicsClientId=pybullet_client
    )
    bodies = [
        pybullet.createMultiBody(1.0 + n, shape, basePosition=(0.5 * n, 0, 1), physicsClientId=pybullet_client)
        for n in range(2)
    ]
    joint = getattr(pybullet, f"JOINT_{kind}")
    ties = [((bodies[0], bodies[1]), (0.25, 0, 0), (-0.25, 0, 0)), ((bodies[0], -1), (-0.25, 0, 0), (-0.25, 0, 1))]
    for (first, second), pivot, other in ties[: 2 if kind == "POINT2POINT" else 1]:
        tie = pybullet.createConstraint(
            first, -1, second, -1, joint, (0, 0, 0), pivot, other, physicsClientId=pybullet_client
        )
        pybullet.changeConstraint(tie, maxForce=1e9, physicsClientId=pybullet_client)
    for body in bodies:
        unbrake(pybullet_client, body)
    linked = [LinkedBody(pybullet_client, body) for body in bodies]
    measured_and_expected(pybullet_client, linked)  # that they hold shows when they have carried something
    measured, expected = measured_and_expected(pybullet_client, linked)
    np.testing.assert_allclose(measured, expected, atol=2e-2 * np.abs(expected).max())


@pytest.mark.parametrize("kind", ["POINT2POINT", "FIXED"])
@pytest.mark.parametrize(("limit", "freedoms"), [(5.0, 6), (1e3, 0)])
def test_a_constraint_that_gives_all_it_may_is_a_force(
    pybullet_client: int, kind: str, limit: float, freedoms: int
) -> None:
    shape = pybullet.createCollisionShape(
        pybullet.GEOM_BOX, halfExtents=(0.1, 0.1, 0.1), physicsClientId=pybullet_client
    )
    body = pybullet.createMultiBody(
        1.0, shape, physicsClientId=pybullet_client
    )  # of 9.81 N, about twice the smaller limit
    joint = getattr(pybullet, f"JOINT_{kind}")
    tie = pybullet.createConstraint(
        body, -1, -1, -1, joint, (0, 0, 0), (0, 0, 0), (0, 0, 0), physicsClientId=pybullet_client
    )
    pybullet.changeConstraint(tie, maxForce=limit, physicsClientId=pybullet_client)
    if kind == "POINT2POINT":
        freedoms = max(freedoms, 3)
    linked = LinkedBody(pybullet_client, body)
    for expected in (6, freedoms, freedoms):
        system = read_links(pybullet_client, [linked], GRAVITY, STEP)
        assert np.linalg.matrix_rank(system.inverse_mass, tol=1e-6) == expected
        step_with(pybullet_client, linked)


def test_a_motor_that_keeps_its_rate_makes_a_joint_rigid(pybullet_client: int) -> None:
    step = 1.0 / 240.0
    pybullet.setTimeStep(step, physicsClientId=pybullet_client)
    body = chain(pybullet_client, pybullet.JOINT_REVOLUTE)
    for link in range(3):
        pybullet.setJointMotorControl2(
            body, link, pybullet.VELOCITY_CONTROL, targetVelocity=0.0, force=1e4, physicsClientId=pybullet_client
        )
    linked = LinkedBody(pybullet_client, body)
    ranks = []
    for _ in range(3):
        system = read_links(pybullet_client, [linked], GRAVITY, step)
        ranks.append(np.linalg.matrix_rank(system.inverse_mass))
        push(pybullet_client, system, np.full((4, 6), 3.0))
        step_with(pybullet_client, linked)
    assert ranks == [9, 6, 6]
    measured, expected = measured_and_expected(pybullet_client, [linked], step)
    np.testing.assert_allclose(measured, expected, atol=2e-2 * np.abs(expected).max())


def ranks_of(client: int, body: int, steps: int) -> list[int]:
    """Freedoms of a pushed chain step by step."""
    step = 1.0 / 240.0
    pybullet.setTimeStep(step, physicsClientId=client)
    linked, ranks = LinkedBody(client, body), []
    for _ in range(steps):
        system = read_links(client, [linked], GRAVITY, step)
        ranks.append(int(np.linalg.matrix_rank(system.inverse_mass)))
        push(client, system, np.full((4, 6), 3.0))
        step_with(client, linked)
    return ranks


def test_default_motors_of_ball_joints_make_them_rigid(pybullet_client: int) -> None:
    body = chain(pybullet_client, pybullet.JOINT_SPHERICAL)
    for link in range(3):
        pybullet.setJointMotorControlMultiDof(
            body, link, pybullet.POSITION_CONTROL, [0, 0, 0, 1], positionGain=0, velocityGain=1, force=[1e4] * 3,
            physicsClientId=pybullet_client,
        )  # fmt: skip
    assert ranks_of(pybullet_client, body, 4) == [15, 6, 6, 6]


def test_a_servo_is_rigid_while_it_moves_and_gives_way_once_its_force_is_spent(pybullet_client: int) -> None:
    for force, expected in ((1e6, 6), (1e-2, 9)):
        body = chain(pybullet_client, pybullet.JOINT_REVOLUTE)
        for link in range(3):
            pybullet.setJointMotorControl2(
                body, link, pybullet.POSITION_CONTROL, targetPosition=1.0, force=force, physicsClientId=pybullet_client
            )
        ranks = ranks_of(pybullet_client, body, 6)
        assert ranks[0] == 9
        assert ranks[2:] == [expected] * 4, force


def test_a_body_that_has_left_all_bounds_is_named(pybullet_client: int) -> None:
    body = chain(pybullet_client, pybullet.JOINT_REVOLUTE)
    linked = LinkedBody(pybullet_client, body)
    pybullet.resetBaseVelocity(body, (1e8, 0.0, 0.0), (0.0, 0.0, 0.0), physicsClientId=pybullet_client)
    with pytest.raises(ValueError, match=rf"body {body} is at .* allowed: below 1e\+06; .* setTimeStep"):
        read_links(pybullet_client, [linked], GRAVITY, STEP)


def test_a_body_removed_behind_the_fluids_back_is_named(pybullet_client: int) -> None:
    body = chain(pybullet_client, pybullet.JOINT_REVOLUTE)
    linked = LinkedBody(pybullet_client, body)
    pybullet.removeBody(body, physicsClientId=pybullet_client)
    with pytest.raises(ValueError, match=rf"body {body} is no longer in the client, allowed: remove_body"):
        read_links(pybullet_client, [linked], GRAVITY, STEP)
