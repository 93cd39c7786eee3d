"""What the fluid would meet otherwise than it is, in worlds of somebody else: told as a body is attached, or refused by name."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pybullet
import pytest
import trimesh

from coupling.bullet.plugin import attach_fluid
from coupling.bullet.shapes import link_mesh
from coupling.solids.bodies import box, load_mesh
from oilsim import solid_box
from tests.coupling.pools import pool


def made(client: int, shape: int, mass: float = 1.0, place: tuple[float, float, float] = (0, 0, 0.5)) -> int:
    body: int = pybullet.createMultiBody(mass, shape, basePosition=place, physicsClientId=client)
    return body


def boxed(client: int, half: tuple[float, float, float]) -> int:
    shape: int = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, physicsClientId=client)
    return shape


def told_of(client: int, bodies: list[int], depth: float = 0.2) -> list[str]:
    """What is said while bodies are attached to a pool."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        attach_fluid(client, pool(0.1, 1.0, depth), bodies)
    return [str(warning.message) for warning in told]


@pytest.fixture
def ring(tmp_path: Path) -> Path:
    """A ring of 0.5 m, a tenth of a metre wide; its hull is a cylinder of half as much volume again."""
    trimesh.creation.annulus(0.3, 0.5, 0.5).export(tmp_path / "ring.obj")
    return tmp_path / "ring.obj"


RING, CYLINDER = np.pi * 0.16 * 0.5, np.pi * 0.25 * 0.5  # m3


def loaded(client: int, mesh: Path | str, folder: Path, mass: float = 5.0) -> int:
    inertia = 'ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"'
    text = f"""<robot name="ring"><link name="ring"><inertial><mass value="{mass}"/><inertia {inertia}/></inertial>
    <collision><geometry><mesh filename="{mesh}"/></geometry></collision></link></robot>"""
    (folder / "ring.urdf").write_text(text)
    body: int = pybullet.loadURDF(str(folder / "ring.urdf"), physicsClientId=client)
    return body


def test_parts_thinner_than_a_particle_are_told_with_what_they_are_taken_for(pybullet_client: int) -> None:
    # 0.4 x 0.4 x 0.02 m of 0.1 m: the fluid meets some 0.4 x 0.4 x 0.1
    told, leak = told_of(pybullet_client, [made(pybullet_client, boxed(pybullet_client, (0.2, 0.2, 0.01)))])
    assert leak.startswith(
        "body 0, link -1 has plates 0.02 m thin, 0.2 particle spacings: the fluid keeps its particles"
    )
    assert "body 0, link -1 has parts thinner than a particle: the fluid sees and lifts" in told
    factor = float(told.split("lifts ")[1].split()[0])
    assert 4.0 < factor < 6.0
    assert "times its volume of 0.0032 m3; a particle_spacing below 0.1 m resolves them" in told


@pytest.mark.parametrize(("gap", "expected"), [(0.0, 0), (-0.15, 1)])
def test_bodies_that_lie_in_each_other_are_told_once_and_those_that_touch_are_not(
    pybullet_client: int, gap: float, expected: int
) -> None:
    shape = boxed(pybullet_client, (0.2, 0.2, 0.2))
    bodies = [made(pybullet_client, shape, place=(x, 0, 0.8)) for x in (-0.2 - 0.5 * gap, 0.2 + 0.5 * gap)]
    told = told_of(pybullet_client, bodies)
    assert len(told) == expected
    if told:
        assert "solids overlap: body 1, link -1 in body 0, link -1 with" in told[0]


def test_ground_under_a_tank_with_a_floor_is_told(pybullet_client: int) -> None:
    (told,) = told_of(pybullet_client, [pybullet.loadURDF("plane.urdf", physicsClientId=pybullet_client)])
    assert "body 0, link -1 in boundary 0 (tank) with" in told


def test_a_mesh_file_that_is_not_where_it_was_is_refused_by_its_path(
    pybullet_client: int, ring: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Loaded by a path relative to a folder that is no longer the present one; its hull would be half as large again."""
    monkeypatch.chdir(tmp_path)
    body = loaded(pybullet_client, "ring.obj", Path())
    mesh = link_mesh(pybullet_client, body, -1)
    assert mesh is not None and mesh.volume == pytest.approx(RING, rel=0.02)
    monkeypatch.chdir(tmp_path.parent)
    with pytest.raises(
        ValueError, match=r"body 0 \(ring\), link -1 \(ring\) has a mesh from the file 'ring.obj', which does not exist"
    ):
        link_mesh(pybullet_client, body, -1)


def test_mesh_without_a_file_known_to_pybullet_becomes_its_hull_with_a_warning(
    pybullet_client: int, ring: Path
) -> None:
    shape = pybullet.createCollisionShape(pybullet.GEOM_MESH, fileName=str(ring), physicsClientId=pybullet_client)
    body = made(pybullet_client, shape)
    with pytest.warns(
        UserWarning,
        match="a mesh without a file known to pybullet: fluid and pybullet use its convex hull; .* with add_body and meshes=",
    ):
        mesh = link_mesh(pybullet_client, body, -1)
    assert mesh is not None and mesh.volume == pytest.approx(CYLINDER, rel=0.02)


@pytest.mark.parametrize("mass", [0.0, 5.0])
def test_an_open_mesh_is_refused_if_held_and_else_met_as_the_hull_that_pybullet_collides_with(
    pybullet_client: int, tmp_path: Path, mass: float
) -> None:
    valley = trimesh.Trimesh(*_sheet(), process=False)
    valley.export(tmp_path / "valley.obj")
    body = loaded(pybullet_client, tmp_path / "valley.obj", tmp_path, mass)
    if mass == 0.0:
        with pytest.raises(
            ValueError, match=r"valley.obj is not watertight: .*, allowed: a closed mesh, or add_body with"
        ):
            link_mesh(pybullet_client, body, -1)
    else:
        with pytest.warns(UserWarning, match="the convex hulls of its parts are used"):
            mesh = link_mesh(pybullet_client, body, -1)
        assert mesh is not None and mesh.is_watertight


def test_the_base_of_a_fixed_robot_is_met_as_its_hull_as_a_free_one_is(pybullet_client: int, tmp_path: Path) -> None:
    """Pybullet collides with the hull of both; only ground by itself may be concave."""
    trimesh.Trimesh(*_sheet(), process=False).export(tmp_path / "valley.obj")
    shape = f'<collision><geometry><mesh filename="{tmp_path / "valley.obj"}"/></geometry></collision>'
    inertia = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    joint = (
        '<joint name="j" type="revolute"><parent link="a"/><child link="b"/><limit effort="1" velocity="1"/></joint>'
    )
    links = "".join(f'<link name="{name}">{inertia}{shape}</link>' for name in "ab")
    (tmp_path / "arm.urdf").write_text(f'<robot name="arm">{links}{joint}</robot>')
    for is_fixed in (True, False):
        arm = pybullet.loadURDF(str(tmp_path / "arm.urdf"), useFixedBase=is_fixed, physicsClientId=pybullet_client)
        for link in (-1, 0):
            with pytest.warns(
                UserWarning, match=r"valley\.obj is not watertight: .*; the convex hulls of its parts are used"
            ):
                mesh = link_mesh(pybullet_client, arm, link)
            assert mesh is not None and mesh.volume == pytest.approx(2.0)


def test_shapes_of_a_link_that_overlap_are_one_solid(pybullet_client: int) -> None:
    shape = pybullet.createCollisionShapeArray(
        shapeTypes=[pybullet.GEOM_BOX] * 2, halfExtents=[[0.15] * 3] * 2, collisionFramePositions=[[0, 0, 0], [0.2, 0, 0]],
        physicsClientId=pybullet_client,
    )  # fmt: skip
    mesh = link_mesh(pybullet_client, made(pybullet_client, shape), -1)
    assert mesh is not None and mesh.volume == pytest.approx(0.3 * 0.3 * 0.5)


def test_a_sealed_hollow_is_a_wall_only_if_liquid_lies_in_it(pybullet_client: int, tmp_path: Path) -> None:
    room = box((0.2, 0.2, 0.2))
    hollow = trimesh.Trimesh(room.vertices, room.faces[:, ::-1], process=False)
    trimesh.util.concatenate([box((0.4, 0.4, 0.4)), hollow]).export(tmp_path / "float.stl")
    body = loaded(pybullet_client, tmp_path / "float.stl", tmp_path)
    pybullet.resetBasePositionAndOrientation(body, (0, 0, 1), (0, 0, 0, 1), physicsClientId=pybullet_client)
    beside, within = np.array([[0.3, 0.0, 1.0], [0.0, 0.0, 0.0]]), np.array([[0.05, 0.0, 1.0]])
    volumes = [link_mesh(pybullet_client, body, -1, liquid).volume for liquid in (beside, within)]  # type: ignore[union-attr]
    assert volumes == pytest.approx([0.064, 0.056])


def _sheet() -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of an open valley."""
    points = np.array([(x, y, abs(x)) for x in (-1.0, 0.0, 1.0) for y in (-1.0, 1.0)])
    return points, np.array([(0, 2, 1), (1, 2, 3), (2, 4, 3), (3, 4, 5)])


def test_closed_parts_that_share_corners_are_a_solid(tmp_path: Path) -> None:
    """Joined at their corners, their surfaces would count as one that is not closed; the wall between them is no surface."""
    lines, first = [], 1
    for n, x in enumerate((0.0, 1.0)):
        part = box((1.0, 1.0, 1.0)).apply_translation((x, 0, 0))
        lines += [f"o part{n}", *(f"v {a} {b} {c}" for a, b, c in part.vertices)]
        lines += [f"f {a} {b} {c}" for a, b, c in part.faces + first]
        first += len(part.vertices)
    (tmp_path / "two.obj").write_text("\n".join(lines))
    with pytest.warns(UserWarning, match=r"two\.obj: 2 parts that overlap or touch joined to one solid"):
        mesh = load_mesh(tmp_path / "two.obj")
    assert mesh.is_watertight and mesh.volume == pytest.approx(2.0) and mesh.area == pytest.approx(10.0)


def test_a_flat_hull_is_refused_by_name(pybullet_client: int) -> None:
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)]
    shape = pybullet.createCollisionShape(pybullet.GEOM_MESH, vertices=points, physicsClientId=pybullet_client)
    with (
        warnings.catch_warnings(),
        pytest.raises(
            ValueError, match=r"body 0 \(.*\), link -1 \(.*\) has a mesh that encloses no volume, allowed: a solid"
        ),
    ):
        warnings.simplefilter("ignore")
        link_mesh(pybullet_client, made(pybullet_client, shape), -1)


def test_ground_out_of_the_fluids_reach_is_told_as_that(pybullet_client: int) -> None:
    body = pybullet.loadURDF("plane.urdf", basePosition=(0, 0, -5), physicsClientId=pybullet_client)
    with pytest.raises(
        ValueError, match="body 0, link -1 cannot be sampled: it lies where the fluid does not come, allowed: in reach"
    ):
        attach_fluid(pybullet_client, pool(0.1, 1.0, 0.2), [body])


def test_worlds_of_one_client_that_step_in_turn_are_told_once(pybullet_client: int) -> None:
    shape = boxed(pybullet_client, (0.2, 0.2, 0.2))
    one, other = (
        attach_fluid(pybullet_client, pool(0.1, 1.0, 0.1), [made(pybullet_client, shape, place=(x, 0, 0.8))])
        for x in (-0.3, 0.3)
    )
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        for _ in range(3):
            one.step()
            other.step()
    texts = [str(warning.message) for warning in told]
    assert (
        sum("client 0 is stepped by another fluid's world in turn" in text for text in texts) == 2
    )  # by each world once


def test_a_surface_that_somebody_else_moves_is_refused(pybullet_client: int) -> None:
    """A program that moves a boundary of the fluid itself is told so; `test_plugin_misuse.py` tests two worlds of one fluid."""
    fluid, shape = pool(0.1, 1.0, 0.1), boxed(pybullet_client, (0.2, 0.2, 0.2))
    world = attach_fluid(pybullet_client, fluid, [made(pybullet_client, shape, place=(-0.3, 0, 0.8))])
    world.step()
    plate = fluid.add_boundary(solid_box((0.2, 0.2, 0.2), 0.1))
    fluid.set_boundary_motion(plate, (0.3, 0.0, 0.8), (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.1), (0.0, 0.0, 0.0))
    with pytest.raises(
        ValueError,
        match=rf"boundaries \[{plate}\] of the fluid are moved by somebody else, allowed: bodies of one world",
    ):
        world.step()


def test_arguments_of_other_kinds_are_named(pybullet_client: int) -> None:
    fluid, body = pool(0.1, 1.0, 0.1), made(pybullet_client, boxed(pybullet_client, (0.2, 0.2, 0.2)))
    with pytest.raises(
        TypeError, match=r"client is '0', allowed: what pybullet.connect returned, of a BulletClient its _client"
    ):
        attach_fluid("0", fluid, [])  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"fluid is None, allowed: an oilsim\.Fluid"):
        attach_fluid(pybullet_client, None, [])  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="no_slip is 'yes', allowed: True or False"):
        attach_fluid(pybullet_client, fluid, [body], no_slip="yes")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="meshes is a list, allowed: solids by the index of their link"):
        attach_fluid(pybullet_client, fluid, []).add_body(body, meshes=[box((1, 1, 1))])  # type: ignore[arg-type]


@pytest.mark.parametrize("what", ["time step", "gravity"])
def test_a_client_that_cannot_be_stepped_is_told_by_the_call_that_set_it(pybullet_client: int, what: str) -> None:
    world = attach_fluid(
        pybullet_client, pool(0.1, 1.0, 0.1), [made(pybullet_client, boxed(pybullet_client, (0.2, 0.2, 0.2)))]
    )
    if what == "time step":
        pybullet.setTimeStep(0.0, physicsClientId=pybullet_client)
        message = "the client's time step is 0.0 s, allowed: setTimeStep above 0"
    else:
        pybullet.setGravity(0.0, 0.0, float("nan"), physicsClientId=pybullet_client)
        message = "the client's gravity is .* m/s2, allowed: setGravity of finite numbers"
    with pytest.raises(ValueError, match=message):
        world.step()
