"""Mistakes in a world of somebody else are refused by name, or reported once if they can be mended."""

from __future__ import annotations

import itertools
import warnings
from pathlib import Path

import numpy as np
import pybullet
import pytest
import trimesh

from coupling.bullet.plugin import FluidWorld, attach_fluid
from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.solids.bodies import box, mass_properties
from coupling.solids.surface_sampling import sample_surface
from oilsim import Fluid, FluidConfig, Phase
from tests.coupling.pools import pool

GRAVITY = 9.81


def cube(client: int, *, half: float = 0.15, mass: float = 1.0, height: float = 0.5, maximal: bool = False) -> int:
    shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[half] * 3, physicsClientId=client)
    body: int = pybullet.createMultiBody(
        mass, shape, basePosition=(0, 0, height), useMaximalCoordinates=maximal, physicsClientId=client
    )
    return body


def puddle() -> Fluid:
    return pool(0.1, 1.0, 0.1)


@pytest.mark.parametrize("same_shape", [False, True])
def test_another_body_of_the_same_unique_id_is_refused(pybullet_client: int, same_shape: bool) -> None:
    body = cube(pybullet_client)
    world = attach_fluid(pybullet_client, puddle(), [body])
    world.step()
    pybullet.removeBody(body, physicsClientId=pybullet_client)
    assert cube(pybullet_client, half=0.15 if same_shape else 0.2) == body
    if same_shape:  # nothing that the fluid knows of it has changed
        world.step()
        return
    with pytest.raises(
        ValueError, match=rf"body {body} is not the one that was added .* remove_body\({body}\), then add_body"
    ):
        world.step()
    world.remove_body(body)
    world.add_body(body)
    world.step()


def test_a_body_of_several_shapes_is_known_again(pybullet_client: int, monkeypatch: pytest.MonkeyPatch) -> None:
    # pybullet leaves the first two numbers of all but the first shape as it finds them in memory
    tell, found = pybullet.getCollisionShapeData, itertools.count(1000)

    def told(*arguments: int, **terms: int) -> tuple[tuple[object, ...], ...]:
        first, *others = tell(*arguments, **terms)
        return first, *((next(found), next(found), *shape[2:]) for shape in others)

    monkeypatch.setattr(pybullet, "getCollisionShapeData", told)
    shape = pybullet.createCollisionShapeArray(
        shapeTypes=[pybullet.GEOM_BOX] * 2, halfExtents=[[0.15] * 3] * 2, collisionFramePositions=[[0, 0, 0], [0.2, 0, 0]],
        physicsClientId=pybullet_client,
    )  # fmt: skip
    body = pybullet.createMultiBody(1.0, shape, basePosition=(0, 0, 0.5), physicsClientId=pybullet_client)
    assert len(told(body, -1, physicsClientId=pybullet_client)) == 2
    attach_fluid(pybullet_client, puddle(), [body]).step()


def test_a_failed_attachment_leaves_the_fluid_as_it_was(pybullet_client: int) -> None:
    fluid, good = puddle(), cube(pybullet_client)
    bad = pybullet.createMultiBody(1.0, physicsClientId=pybullet_client)
    before = fluid.boundary_count
    with pytest.raises(ValueError, match=f"body {bad} has no collision shape"):
        attach_fluid(pybullet_client, fluid, [good, bad])
    assert fluid.boundary_count == before


def test_a_warning_taken_for_an_error_leaves_no_part_of_a_body(pybullet_client: int) -> None:
    fluid = pool(0.04, 0.2, 0.08)
    before = fluid.boundary_count
    points = np.random.default_rng(0).normal(size=(60, 3))
    points *= 0.1 / np.linalg.norm(points, axis=1, keepdims=True)
    shape = pybullet.createCollisionShape(pybullet.GEOM_MESH, vertices=points.tolist(), physicsClientId=pybullet_client)
    body = pybullet.createMultiBody(2.0, shape, physicsClientId=pybullet_client)
    with warnings.catch_warnings(), pytest.raises(UserWarning, match="inertia of its bounding box"):
        warnings.filterwarnings("error", message=".*bounding box")
        attach_fluid(pybullet_client, fluid, [body])
    assert fluid.boundary_count == before


# meshes that are no solids


def opened() -> trimesh.Trimesh:
    mesh = box((0.4, 0.4, 0.4))
    return trimesh.Trimesh(mesh.vertices, mesh.faces[2:], process=False)


def reversed_box() -> trimesh.Trimesh:
    mesh = box((0.4, 0.4, 0.4))
    return trimesh.Trimesh(mesh.vertices, mesh.faces[:, ::-1], process=False)


def mixed() -> trimesh.Trimesh:
    mesh = box((0.4, 0.4, 0.4))
    faces = mesh.faces.copy()
    faces[:3] = faces[:3, ::-1]
    return trimesh.Trimesh(mesh.vertices, faces, process=False)


NO_SOLIDS = [
    (opened(), "is not watertight"),
    (reversed_box(), r"encloses -0\.064 m3, allowed: above 0"),
    (mixed(), "has triangles of both windings"),
]
MENDED = [
    (reversed_box(), "1 part wound inwards turned outwards"),
    (mixed(), "3 triangles wound against the neighbours"),
]


@pytest.mark.parametrize(("mesh", "message"), NO_SOLIDS)
def test_rigid_bodies_want_solids(mesh: trimesh.Trimesh, message: str) -> None:
    with pytest.raises(ValueError, match=f"rigid bodies: mesh of 'raft' {message}"):
        RigidBodyWorld().add_body("raft", mesh, mass_properties(box((0.4, 0.4, 0.4)), mass=1.0))


def test_meshes_that_are_no_solids_are_refused(pybullet_client: int) -> None:
    body = cube(pybullet_client)
    world = attach_fluid(pybullet_client, puddle(), [])
    with pytest.raises(ValueError, match=r"^mesh is not watertight"):
        sample_surface(opened(), 0.1)
    with pytest.raises(ValueError, match=rf"meshes\[-1\] of body {body} is not watertight"):
        world.add_body(body, meshes={-1: opened()})


@pytest.mark.parametrize(("mesh", "message"), MENDED)
def test_meshes_of_another_winding_are_mended_and_that_is_told(
    pybullet_client: int, mesh: trimesh.Trimesh, message: str
) -> None:
    body = cube(pybullet_client)
    world = attach_fluid(pybullet_client, puddle(), [])
    with pytest.warns(UserWarning, match=f"^mesh: {message}"):
        sampling = sample_surface(mesh, 0.1)
    np.testing.assert_array_equal(sampling.volume, sample_surface(box((0.4, 0.4, 0.4)), 0.1).volume)
    with pytest.warns(UserWarning, match=rf"meshes\[-1\] of body {body}: {message}"):
        world.add_body(body, meshes={-1: mesh})


def test_meshes_of_links_that_are_not_there_are_refused(pybullet_client: int) -> None:
    body = cube(pybullet_client)
    world = attach_fluid(pybullet_client, puddle(), [])
    with pytest.raises(ValueError, match=f"meshes of body {body} has the link 3, allowed: -1 to -1"):
        world.add_body(body, meshes={3: box((0.4, 0.4, 0.4))})
    with pytest.raises(
        TypeError, match=rf"meshes\[-1\] of body {body} is of the type ndarray, allowed: trimesh\.Trimesh"
    ):
        world.add_body(body, meshes={-1: np.zeros((4, 3))})


def test_what_is_no_body_of_links_is_named(pybullet_client: int) -> None:
    world = attach_fluid(pybullet_client, puddle(), [])
    with pytest.raises(ValueError, match="body 5 is not in the client, allowed: none, because the client is empty"):
        world.add_body(5)
    body = cube(pybullet_client, maximal=True)
    with pytest.raises(
        ValueError, match=f"body {body} is soft or has maximal coordinates, allowed: .*useMaximalCoordinates"
    ):
        world.add_body(body)
    with pytest.raises(TypeError, match=r"body is '0', allowed: the unique id"):
        world.add_body("0")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"bodies is 0, allowed: several unique ids, \[0\] for one body"):
        attach_fluid(pybullet_client, puddle(), 0)  # type: ignore[arg-type]


def test_a_link_that_does_not_meet_the_fluid_has_no_wrench(pybullet_client: int) -> None:
    body = cube(pybullet_client)
    world = attach_fluid(pybullet_client, puddle(), [body])
    with pytest.raises(
        ValueError, match=rf"link -1 of body 9 does not meet the fluid, allowed \(body/link\): {body}/-1"
    ):
        world.wrench(9)


def test_a_client_that_is_not_connected_is_named() -> None:
    with pytest.raises(ValueError, match="client 77 is not connected, allowed: "):
        attach_fluid(77, puddle(), [])
    client = pybullet.connect(pybullet.DIRECT)
    world = attach_fluid(client, puddle(), [])
    pybullet.disconnect(client)
    with pytest.raises(ValueError, match=f"client {client} is not connected"):
        world.step()


def test_a_fluid_of_two_dimensions_is_refused(pybullet_client: int) -> None:
    config = FluidConfig(
        particle_spacing=0.1, phases=(Phase(name="water", rest_density=1000.0),), lower=(-1, -0.5, -1), upper=(1, 0.5, 2),
        dimension=2,
    )  # fmt: skip
    with pytest.raises(ValueError, match="fluid has 2 dimensions, allowed: 3"):
        attach_fluid(pybullet_client, Fluid(config, threads=1), [])


def told_in(world: FluidWorld, steps: int, carried: int | None = None, velocity: float = 0.0) -> list[str]:
    """Collect the warnings of some steps, in each of which a held body is set further by 0.5 m/s times the step."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        for step in range(steps):
            if carried is not None:
                client = world.client
                place = (-0.6 + 0.5 / 240.0 * step, 0, 0.5)
                pybullet.resetBasePositionAndOrientation(carried, place, (0, 0, 0, 1), physicsClientId=client)
                pybullet.resetBaseVelocity(carried, (velocity, 0, 0), physicsClientId=client)
            world.step()
    return [str(warning.message) for warning in told]


def test_two_gravities_are_told_once(pybullet_client: int) -> None:
    pybullet.setGravity(0.0, 0.0, 0.0, physicsClientId=pybullet_client)
    world = attach_fluid(pybullet_client, puddle(), [cube(pybullet_client)])
    told = told_in(world, 3)
    assert len(told) == 1
    assert (
        "gravity is [0.0, 0.0, 0.0] m/s2 in the client and [0.0, 0.0, -9.81] m/s2 in the fluid; make them equal with setGravity("
        in told[0]
    )
    pybullet.setGravity(0.0, 0.0, -GRAVITY, physicsClientId=pybullet_client)
    assert not told_in(attach_fluid(pybullet_client, puddle(), []), 2)


@pytest.mark.parametrize("velocity", [0.0, 0.5])
def test_a_held_body_that_is_carried_without_a_velocity_is_told_once(pybullet_client: int, velocity: float) -> None:
    body = cube(pybullet_client, mass=0.0)
    world = attach_fluid(pybullet_client, puddle(), [body])
    told = told_in(world, 6, carried=body, velocity=velocity)
    if velocity > 0.0:
        assert not told
        return
    assert len(told) == 1
    assert f"resetBaseVelocity({body}, [0.5, 0.0, 0.0], [0.0, 0.0, 0.0]) after" in told[0]


def test_a_held_body_that_is_moved_once_is_not_told_of(pybullet_client: int) -> None:
    body = cube(pybullet_client, mass=0.0)
    world = attach_fluid(pybullet_client, puddle(), [body])
    assert not told_in(world, 2)
    pybullet.resetBasePositionAndOrientation(body, (0.1, 0, 0.5), (0, 0, 0, 1), physicsClientId=pybullet_client)
    assert not told_in(world, 2)


def test_a_piston_that_turns_round_at_its_velocity_is_not_told_of(pybullet_client: int) -> None:
    body = cube(pybullet_client, mass=0.0)
    world = attach_fluid(pybullet_client, puddle(), [body])
    for step in range(-8, 9):
        place, velocity = (0.01 * (step / 8) ** 2, 0, 0.5), (0.02 * step / 64 * 240, 0, 0)
        pybullet.resetBasePositionAndOrientation(body, place, (0, 0, 0, 1), physicsClientId=pybullet_client)
        pybullet.resetBaseVelocity(body, velocity, physicsClientId=pybullet_client)
        assert not told_in(world, 1)


def test_a_planar_joint_is_refused_for_its_axis_is_not_told(pybullet_client: int, tmp_path: Path) -> None:
    inertial = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    solid = '<collision><geometry><box size="0.3 0.3 0.3"/></geometry></collision>'
    (tmp_path / "raft.urdf").write_text(
        f'<robot name="raft"><link name="ground">{inertial}</link><link name="float">{inertial}{solid}</link>'
        '<joint name="plane" type="planar"><parent link="ground"/><child link="float"/><axis xyz="0 0 1"/></joint></robot>'
    )
    body = pybullet.loadURDF(str(tmp_path / "raft.urdf"), useFixedBase=True, physicsClientId=pybullet_client)
    message = rf"joint 0 \(plane\) of body {body} is planar, .* allowed: two prismatic joints and a revolute one"
    with pytest.raises(ValueError, match=message):
        attach_fluid(pybullet_client, puddle(), [body])
