"""The fluid in pybullet worlds that know nothing of it: shapes read right, impulses exact, settings untouched."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pybullet
import pybullet_data
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from coupling.bullet import plugin
from coupling.bullet.plugin import FluidWorld, attach_fluid
from coupling.bullet.shapes import link_mesh
from coupling.solids.surface_sampling import SurfaceSampling, sample_surface
from oilsim import Fluid, FluidConfig, Phase, block
from tests.coupling.pools import pool

GRAVITY = 9.81


def held_sides(client: int, half: float, thick: float, high: float) -> list[int]:
    """Four boxes that stand around a square of half an edge `half` on the ground."""
    bodies = []
    for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        size = [0.5 * thick if x else half + thick, 0.5 * thick if y else half + thick, 0.5 * high]
        shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=size, physicsClientId=client)
        place = [x * (half + 0.5 * thick), y * (half + 0.5 * thick), 0.5 * high]
        bodies.append(pybullet.createMultiBody(0.0, shape, basePosition=place, physicsClientId=client))
    return bodies


def links(body: int, client: int) -> range:
    return range(-1, pybullet.getNumJoints(body, physicsClientId=client))


@pytest.mark.parametrize(
    "urdf", ["cube_small.urdf", "sphere2.urdf", "duck_vhacd.urdf", "teddy_vhacd.urdf", "r2d2.urdf", "block.urdf"]
)
def test_solids_of_urdf_links_fill_their_bounding_boxes(pybullet_client: int, urdf: str) -> None:
    # an axis-aligned box that pybullet reports about each link, plus its collision margins
    body = pybullet.loadURDF(urdf, physicsClientId=pybullet_client)
    found = 0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        meshes = {link: link_mesh(pybullet_client, body, link) for link in links(body, pybullet_client)}
    for link, mesh in meshes.items():
        if mesh is None:
            continue
        found += 1
        if link < 0:
            position, orientation = pybullet.getBasePositionAndOrientation(body, physicsClientId=pybullet_client)
        else:
            position, orientation = pybullet.getLinkState(body, link, physicsClientId=pybullet_client)[:2]
        vertices = Rotation.from_quat(orientation).apply(mesh.vertices) + position
        low, high = pybullet.getAABB(body, link, physicsClientId=pybullet_client)
        size = float(np.max(mesh.extents))
        # pybullet's box is loose for turned compounds: ours lies within, and touches it where the link is not turned
        slack = 0.02 * size + 0.005
        assert (vertices.min(axis=0) > np.array(low) - slack).all() and (
            vertices.max(axis=0) < np.array(high) + slack
        ).all()
        if np.allclose(np.abs(orientation), (0, 0, 0, 1), atol=1e-6):
            tight = 0.12 * size + 0.005
            np.testing.assert_allclose(vertices.min(axis=0), low, atol=tight)
            np.testing.assert_allclose(vertices.max(axis=0), high, atol=tight)
    assert found >= (10 if urdf == "r2d2.urdf" else 1)


def test_primitives_keep_size_and_place_about_the_centre_of_mass(pybullet_client: int) -> None:
    shapes = {
        "cylinder": (
            pybullet.createCollisionShape(
                pybullet.GEOM_CYLINDER, radius=0.2, height=0.6, physicsClientId=pybullet_client
            ),
            math.pi * 0.04 * 0.6,
        ),
        "capsule": (
            pybullet.createCollisionShape(
                pybullet.GEOM_CAPSULE, radius=0.2, height=0.6, physicsClientId=pybullet_client
            ),
            math.pi * 0.04 * (0.6 + 0.8 / 3.0),
        ),
        "box": (
            pybullet.createCollisionShape(
                pybullet.GEOM_BOX, halfExtents=[0.1, 0.2, 0.3], physicsClientId=pybullet_client
            ),
            0.048,
        ),
        "hull": (
            pybullet.createCollisionShape(
                pybullet.GEOM_MESH,
                vertices=[[x, y, z] for x in (-0.1, 0.1) for y in (-0.2, 0.2) for z in (-0.3, 0.3)],
                physicsClientId=pybullet_client,
            ),
            0.048,
        ),
    }
    for name, (shape, volume) in shapes.items():
        body = pybullet.createMultiBody(
            1.0, shape, baseInertialFramePosition=[0.05, 0.0, -0.1], physicsClientId=pybullet_client
        )
        mesh = link_mesh(pybullet_client, body, -1)
        assert mesh is not None
        assert float(mesh.volume) == pytest.approx(volume, rel=1e-3), name
        np.testing.assert_allclose(mesh.center_mass, (-0.05, 0.0, 0.1), atol=2e-3, err_msg=name)


def test_mesh_file_is_scaled(pybullet_client: int) -> None:
    whole = link_mesh(pybullet_client, pybullet.loadURDF("duck_vhacd.urdf", physicsClientId=pybullet_client), -1)
    twice = link_mesh(
        pybullet_client, pybullet.loadURDF("duck_vhacd.urdf", globalScaling=2.0, physicsClientId=pybullet_client), -1
    )
    assert whole is not None and twice is not None
    np.testing.assert_allclose(twice.extents, 2.0 * np.asarray(whole.extents), rtol=1e-6)


def floating_cube(client: int, fluid: Fluid, height: float) -> tuple[FluidWorld, int]:
    body = pybullet.loadURDF("cube_small.urdf", [0.0, 0.0, height], physicsClientId=client)
    pybullet.changeDynamics(body, -1, linearDamping=0.0, angularDamping=0.0, physicsClientId=client)
    return attach_fluid(client, fluid, [body]), body


@pytest.mark.parametrize("sub_steps", [0, 4])
def test_impulse_of_the_fluid_reaches_the_body_whole(pybullet_client: int, sub_steps: int) -> None:
    # m (v_1 - v_0) = (F + m g) H for every step, however many sub-steps pybullet takes
    pybullet.setPhysicsEngineParameter(numSubSteps=sub_steps, physicsClientId=pybullet_client)
    world, body = floating_cube(pybullet_client, pool(0.0125, 0.15, 0.075), 0.102)
    mass = pybullet.getDynamicsInfo(body, -1, physicsClientId=pybullet_client)[0]
    lifted = False
    for _ in range(20):
        before = np.array(pybullet.getBaseVelocity(body, physicsClientId=pybullet_client)[0])
        world.step()
        after = np.array(pybullet.getBaseVelocity(body, physicsClientId=pybullet_client)[0])
        force = world.wrench(body)[:3]
        expected = (force + np.array((0.0, 0.0, -mass * GRAVITY))) / 240.0
        np.testing.assert_allclose(mass * (after - before), expected, atol=1e-9)
        lifted |= force[2] > 0.2 * mass * GRAVITY
    assert lifted
    assert world.fluid.time == pytest.approx(20.0 / 240.0)


def test_settings_of_the_client_stay_as_they_are(pybullet_client: int) -> None:
    world, body = floating_cube(pybullet_client, pool(0.0125, 0.15, 0.05), 0.2)
    pybullet.setTimeStep(1.0 / 120.0, physicsClientId=pybullet_client)
    before = pybullet.getPhysicsEngineParameters(physicsClientId=pybullet_client)
    dynamics = pybullet.getDynamicsInfo(body, -1, physicsClientId=pybullet_client)
    world.step()
    assert pybullet.getPhysicsEngineParameters(physicsClientId=pybullet_client) == before
    assert pybullet.getDynamicsInfo(body, -1, physicsClientId=pybullet_client) == dynamics
    assert world.fluid.time == pytest.approx(1.0 / 120.0)


def test_dry_bodies_move_as_without_a_fluid_in_two_clients_at_once(pybullet_client: int) -> None:
    other = pybullet.connect(pybullet.DIRECT)
    pybullet.setAdditionalSearchPath(pybullet_data.getDataPath(), physicsClientId=other)
    try:
        worlds = [floating_cube(each, pool(0.0125, 0.1, 0.025), 1.0) for each in (pybullet_client, other)]
        for _ in range(12):
            worlds[0][0].step()
        fallen, still = (
            pybullet.getBasePositionAndOrientation(body, physicsClientId=each)[0][2]
            for each, (_, body) in zip((pybullet_client, other), worlds, strict=True)
        )
        assert fallen == pytest.approx(1.0 - GRAVITY / 240.0**2 * 78.0)
        assert still == 1.0
    finally:
        pybullet.disconnect(other)


def test_default_damping_is_told_once_with_its_mending(pybullet_client: int) -> None:
    body = pybullet.loadURDF("cube_small.urdf", [0.0, 0.0, 3.0], physicsClientId=pybullet_client)
    world = attach_fluid(pybullet_client, pool(0.0125, 0.1, 0.025), [body])
    with pytest.warns(UserWarning, match=r"default damping .* changeDynamics\(0, link, linearDamping=0") as told:
        for _ in range(10):
            world.step()
    assert len(told) == 1


def test_inertia_of_a_bounding_box_is_told(pybullet_client: int) -> None:
    points = np.random.default_rng(0).normal(size=(60, 3))
    points *= 0.1 / np.linalg.norm(points, axis=1, keepdims=True)
    shape = pybullet.createCollisionShape(pybullet.GEOM_MESH, vertices=points.tolist(), physicsClientId=pybullet_client)
    body = pybullet.createMultiBody(2.0, shape, physicsClientId=pybullet_client)
    with pytest.warns(UserWarning, match="inertia of its bounding box"):
        attach_fluid(pybullet_client, pool(0.04, 0.2, 0.08), [body])


@pytest.mark.filterwarnings("ignore:body")
def test_many_links_and_bodies_that_come_and_go(pybullet_client: int) -> None:
    fluid = pool(0.05, 0.4, 0.1)
    robot = pybullet.loadURDF("r2d2.urdf", [0.0, 0.0, 2.0], useFixedBase=True, physicsClientId=pybullet_client)
    world = attach_fluid(pybullet_client, fluid, [])
    before = fluid.boundary_count
    with pytest.warns(UserWarning, match="link 9 does not meet the fluid: .* too small for particles"):
        world.add_body(robot)
    assert fluid.boundary_count > before + 200
    world.step()
    assert not world.wrench(robot).any()
    world.remove_body(robot)
    pybullet.removeBody(robot, physicsClientId=pybullet_client)
    assert fluid.boundary_count == before
    world.step()


def test_a_concave_mesh_in_memory_is_asked_for_and_taken(pybullet_client: int) -> None:
    profile = np.array([[0, 0], [0.2, 0], [0.2, 0.2], [0.12, 0.2], [0.12, 0.08], [0, 0.08]])
    bowl = trimesh.creation.revolve(profile, sections=24)
    shape = pybullet.createCollisionShape(
        pybullet.GEOM_MESH,
        vertices=bowl.vertices.tolist(),
        indices=bowl.faces.ravel().tolist(),
        physicsClientId=pybullet_client,
    )
    body = pybullet.createMultiBody(0.0, shape, physicsClientId=pybullet_client)
    fluid = pool(0.04, 0.2, 0.08)
    world = attach_fluid(pybullet_client, fluid, [])
    with pytest.raises(ValueError, match=rf"body {body} .* does not report, allowed: add_body with meshes="):
        world.add_body(body)
    before = fluid.boundary_count
    world.add_body(body, meshes={-1: bowl})
    assert fluid.boundary_count > before
    with pytest.raises(ValueError, match=f"body {body} meets the fluid already"):
        world.add_body(body, meshes={-1: bowl})


def float_chain(client: int, height: float, density: float) -> int:
    """Three boxes of edge 0.1 m in a row, hinged across, without damping and motors; they bump into each other as they fold."""
    collide = pybullet.URDF_USE_SELF_COLLISION | pybullet.URDF_USE_SELF_COLLISION_INCLUDE_PARENT
    edge, mass = 0.1, density * 1e-3
    shape, hung = (
        pybullet.createCollisionShape(
            pybullet.GEOM_BOX, halfExtents=[0.5 * edge] * 3, collisionFramePosition=(x, 0, 0), physicsClientId=client
        )
        for x in (0.0, 0.6 * edge)
    )
    body = pybullet.createMultiBody(
        mass, shape, basePosition=(-1.2 * edge, 0, height), linkMasses=[mass] * 2, linkCollisionShapeIndices=[hung] * 2,
        linkVisualShapeIndices=[-1] * 2, linkPositions=[(0.6 * edge, 0, 0), (1.2 * edge, 0, 0)],
        linkOrientations=[(0, 0, 0, 1)] * 2, linkInertialFramePositions=[(0.6 * edge, 0, 0)] * 2,
        linkInertialFrameOrientations=[(0, 0, 0, 1)] * 2, linkParentIndices=[0, 1],
        linkJointTypes=[pybullet.JOINT_REVOLUTE] * 2, linkJointAxis=[(0, 1, 0)] * 2, flags=collide, physicsClientId=client,
    )  # fmt: skip
    for link in links(body, client):
        pybullet.changeDynamics(
            body, link, linearDamping=0, angularDamping=0, jointDamping=0, physicsClientId=client,
            localInertiaDiagonal=[mass * edge**2 / 6] * 3,
        )  # fmt: skip
        if link >= 0:
            pybullet.setJointMotorControl2(body, link, pybullet.VELOCITY_CONTROL, force=0, physicsClientId=client)
    return body


@pytest.mark.slow
def test_hinged_floats_far_lighter_than_water_rise_and_lie_still(pybullet_client: int) -> None:
    # a fortieth of the water's density: forces a step late, or free bodies' masses with joint forces a step late, blow up
    density = 25.0
    pybullet.setTimeStep(0.01, physicsClientId=pybullet_client)
    body = float_chain(pybullet_client, 0.14, density)
    held_sides(
        pybullet_client, 0.25, 0.1, 1.0
    )  # of the pool, for pybullet: nothing else keeps a float that wanders from passing them
    world = attach_fluid(pybullet_client, pool(0.025, 0.5, 0.2, pybullet_client, (body,)), [body])
    lifts, speeds, momenta = [], [], []
    for _ in range(150):
        world.step()
        lifts.append(sum(world.wrench(body, link)[2] for link in links(body, pybullet_client)))
        speeds.append(np.linalg.norm(pybullet.getBaseVelocity(body, physicsClientId=pybullet_client)[0]))
        moving = [pybullet.getBaseVelocity(body, physicsClientId=pybullet_client)[0]]
        moving += [state[6] for state in pybullet.getLinkStates(body, [0, 1], 1, 1, physicsClientId=pybullet_client)]
        momenta.append(density * 1e-3 * sum(velocity[2] for velocity in moving))
    assert max(speeds) < 2.0
    assert max(speeds[100:]) < 0.3 * max(speeds)
    # what the water gave, less the weight, is the momentum of all links; pybullet turns them with the step, first order in it
    weight = 3e-3 * density * GRAVITY
    given = 0.01 * (np.sum(lifts[50:]) - 100 * weight)
    assert given == pytest.approx(momenta[-1] - momenta[49], abs=1e-2 * weight)
    hinges = pybullet.getLinkStates(body, [0, 1], physicsClientId=pybullet_client)
    # afloat at 0.23 m; a chain that came up folded leans on the pool's sides and bobs, its ends above and below
    heights = [
        pybullet.getBasePositionAndOrientation(body, physicsClientId=pybullet_client)[0][2],
        *(state[0][2] for state in hinges),
    ]
    assert 0.2 < np.mean(heights) < 0.3 and min(heights) > 0.15 and max(heights) < 0.4, heights


def held_chain(client: int, lifted: bool) -> int:
    """Four light boxes, three quarters as wide as they are apart, on ball joints that pybullet's own motors hold, tilted."""
    edge, mass = 0.06, 0.004
    shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.5 * edge] * 3, physicsClientId=client)
    tilt = Rotation.from_euler("y", 0.4).as_quat().tolist()
    body = pybullet.createMultiBody(
        mass, shape, basePosition=(-0.1, 0.0, 0.14), baseOrientation=tilt, linkMasses=[mass] * 3,
        linkCollisionShapeIndices=[shape] * 3, linkVisualShapeIndices=[-1] * 3,
        linkPositions=[(0.67 * edge, 0, 0)] + [(1.33 * edge, 0, 0)] * 2, linkOrientations=[(0, 0, 0, 1)] * 3,
        linkInertialFramePositions=[(0.67 * edge, 0, 0)] * 3, linkInertialFrameOrientations=[(0, 0, 0, 1)] * 3,
        linkParentIndices=[0, 1, 2], linkJointTypes=[pybullet.JOINT_SPHERICAL] * 3, linkJointAxis=[(0, 1, 0)] * 3,
        physicsClientId=client,
    )  # fmt: skip
    if lifted:
        pybullet.changeDynamics(body, -1, maxJointVelocity=1e9, physicsClientId=client)
    return body


@pytest.mark.parametrize("lifted", [False, True])
def test_joints_clipped_before_their_motors_hold_them_are_told(pybullet_client: int, lifted: bool) -> None:
    pybullet.setTimeStep(0.01, physicsClientId=pybullet_client)
    body = held_chain(pybullet_client, lifted)
    world = attach_fluid(pybullet_client, pool(0.03, 0.54, 0.24, pybullet_client, (body,)), [body])
    speeds = []
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        for _ in range(60):
            world.step()
            speeds.append(np.linalg.norm(pybullet.getBaseVelocity(body, physicsClientId=pybullet_client)[0]))
            if not lifted and len(speeds) > 20:
                break
    clipped = [str(warning.message) for warning in told if "maxJointVelocity=1e9)" in str(warning.message)]
    assert len(clipped) == (0 if lifted else 1)
    assert max(speeds) < 2.0 or not lifted


def test_a_link_that_turns_far_in_a_step_is_told(pybullet_client: int) -> None:
    pybullet.setTimeStep(0.01, physicsClientId=pybullet_client)
    shape = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=0.05, physicsClientId=pybullet_client)
    body = pybullet.createMultiBody(1.0, shape, basePosition=(0, 0, 0.1), physicsClientId=pybullet_client)
    world = attach_fluid(pybullet_client, pool(0.025, 0.3, 0.2, pybullet_client, (body,)), [body])
    pybullet.resetBaseVelocity(body, (0, 0, 0), (80.0, 0, 0), physicsClientId=pybullet_client)
    with pytest.warns(
        UserWarning, match=rf"body {body}, link -1 turns by 0\.7\d* rad in a step.* setTimeStep\(0\.003\)"
    ):
        world.step()


def sea_on_the_ground(
    client: int, spacing: float, half: float, depth: float, room: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> tuple[Fluid, list[int]]:
    """Water on plane.urdf between four boxes, without `room` [m] about the origin, and the ids of ground and boxes."""
    # plane.urdf collides as a box of 200 m, its upper side at 0; the water on it has no other floor
    ground = pybullet.loadURDF("plane.urdf", physicsClientId=client)
    config = FluidConfig(
        particle_spacing=spacing,
        phases=(Phase(name="water", rest_density=1000.0),),
        lower=(-2 * half, -2 * half, -0.2),
        upper=(2 * half, 2 * half, 1.0),
    )
    fluid = Fluid(config, threads=1)
    places = block((-half, -half, 0.0), (half, half, depth), spacing)
    fluid.add_particles(places[(np.abs(places) >= room).any(axis=1)], phase="water")
    return fluid, [ground, *held_sides(client, half, 3 * spacing, 0.4)]


@pytest.mark.slow
def test_a_crate_that_lies_on_the_ground_under_water_rises(pybullet_client: int) -> None:
    fluid, held = sea_on_the_ground(pybullet_client, 0.05, 0.3, 0.45, (0.15, 0.15, 0.225))
    shape = pybullet.createCollisionShape(
        pybullet.GEOM_BOX, halfExtents=(0.125, 0.125, 0.1), physicsClientId=pybullet_client
    )
    crate = pybullet.createMultiBody(6.25, shape, basePosition=(0.0, 0.0, 0.1005), physicsClientId=pybullet_client)
    world = attach_fluid(pybullet_client, fluid, [*held, crate])
    for _ in range(240):
        world.step()
    height = pybullet.getBasePositionAndOrientation(crate, physicsClientId=pybullet_client)[0][2]
    assert height > 0.3  # half of its height out of the water, and swinging; without a film it stays where it is


def test_ground_far_larger_than_the_sea_is_sampled_where_the_fluid_can_reach_it(pybullet_client: int) -> None:
    half, depth = 0.2, 0.15
    fluid, held = sea_on_the_ground(pybullet_client, 0.05, half, depth)
    world = attach_fluid(pybullet_client, fluid, held)
    assert fluid.boundary_count < 20_000
    loads = []
    for _ in range(120):
        world.step()
        loads.append([-world.wrench(body)[2] for body in held])
    weight = 1000.0 * GRAVITY * depth * (2 * half) ** 2
    shares = np.mean(loads[60:], axis=0) / weight
    assert shares.sum() == pytest.approx(1.0, rel=1e-3)
    assert shares[0] == pytest.approx(1.0, rel=0.01)
    ground = held[0]
    pybullet.resetBasePositionAndOrientation(ground, (0, 0, -0.1), (0, 0, 0, 1), physicsClientId=pybullet_client)
    with pytest.raises(
        ValueError, match=rf"body {ground} is larger than the fluid's domain .* remove_body\({ground}\)"
    ):
        world.step()


def test_ground_larger_than_a_sea_that_repeats_is_refused(pybullet_client: int) -> None:
    ground = pybullet.loadURDF("plane.urdf", physicsClientId=pybullet_client)
    config = FluidConfig(
        particle_spacing=0.05,
        phases=(Phase(name="water", rest_density=1000.0),),
        lower=(-0.5, -0.5, -0.2),
        upper=(0.5, 0.5, 1.0),
        periodic=(True, False, False),
    )
    with pytest.raises(ValueError, match=rf"body {ground} is larger than the fluid's domain, which repeats, allowed: "):
        attach_fluid(pybullet_client, Fluid(config, threads=1), [ground])


def test_bodies_of_one_shape_are_sampled_once(pybullet_client: int, monkeypatch: pytest.MonkeyPatch) -> None:
    sampled = []

    def counting(mesh: trimesh.Trimesh, *arguments: object, **options: object) -> SurfaceSampling:
        sampled.append(mesh)
        return sample_surface(mesh, *arguments, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(plugin, "sample_surface", counting)
    shapes = [
        pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, physicsClientId=pybullet_client)
        for half in ([0.1, 0.1, 0.1], [0.1, 0.1, 0.1], [0.1, 0.1, 0.15])
    ]
    bodies = [pybullet.createMultiBody(1.0, shape, physicsClientId=pybullet_client) for shape in shapes]
    world = attach_fluid(pybullet_client, pool(0.05, 0.2, 0.1), bodies)
    assert len(sampled) == 2
    assert world.fluid.boundary_count > 0


def test_millimetres_taken_for_metres_are_told(pybullet_client: int) -> None:
    shape = pybullet.createCollisionShape(
        pybullet.GEOM_BOX, halfExtents=[100, 100, 50], physicsClientId=pybullet_client
    )
    crate = pybullet.createMultiBody(5.0, shape, physicsClientId=pybullet_client)
    with pytest.raises(
        ValueError, match=rf"body {crate}, link -1 cannot be sampled: .*200.* m takes .* allowed: 1e\+06; scale it down"
    ):
        attach_fluid(pybullet_client, pool(0.05, 0.2, 0.05), [crate])


def test_bodies_without_a_solid_are_refused(pybullet_client: int) -> None:
    nothing = pybullet.createMultiBody(1.0, physicsClientId=pybullet_client)
    world = attach_fluid(pybullet_client, pool(0.05, 0.2, 0.05), [])
    with pytest.raises(ValueError, match=f"body {nothing} has no collision shape"):
        world.add_body(nothing)
    ground = pybullet.createMultiBody(
        0.0,
        pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=pybullet_client),
        physicsClientId=pybullet_client,
    )
    with pytest.raises(ValueError, match=rf"body {ground} .* of kind {pybullet.GEOM_PLANE}, allowed: box, sphere"):
        world.add_body(ground)
