"""The solid that a link of any pybullet body is, read from its collision shapes, as one mesh in the link's centre-of-mass
frame: boxes, spheres, cylinders, capsules, mesh files with scale, and hulls that pybullet keeps as vertices.

Shapes of one link that overlap are one solid (`coupling.solids.solid_mesh`). Sealed hollows are dry unless liquid lies in them.

Before the process is trusted to a call that may end it, it is found out whether pybullet can tell a body's collision shapes.
`getCollisionShapeData` of pybullet 3.2.7 reads memory that is not there for shapes of several spheres, as `loadMJCF` makes them of
capsules with `fromto`. Where the engine runs in this process it is asked in a copy of the process first. A copy may live by
chance, and where the engine runs elsewhere it could not ask. So the engine's own file tells besides whether its world has such
shapes.
"""

from __future__ import annotations

import faulthandler
import os
import resource
import signal
import tempfile
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import trimesh
from scipy.spatial.transform import Rotation

from coupling.bullet.engine_state import kinds_of_shapes
from coupling.bullet.pybullet_import import pybullet
from coupling.solids.bodies import box, capsule, cylinder, load_solid, mesh_parts, sphere
from coupling.solids.signed_distance import SignedDistance
from coupling.solids.solid_mesh import SolidMesh, read_objects, told_solid
from oilsim.backend.arrays import Array

NO_LIQUID = np.zeros((0, 3))
KINDS = "box, sphere, cylinder, capsule, mesh"
UNTOLD_FILE = "has a mesh without a file known to pybullet"
UNTOLD = "unknown_file"  # pybullet's word for meshes from memory, and for files given to createCollisionShape


def link_mesh(
    client: int, body: int, link: int, liquid: npt.NDArray[np.floating] = NO_LIQUID
) -> trimesh.Trimesh | None:
    """Return what liquid meets of a link, in its centre-of-mass frame; None if it has no collision shape.

    liquid: positions (N, 3) [m] of the particles that are there. ValueError, naming body and link, for a shape that encloses no volume: a
    plane, a flat hull, an open mesh that is ground, which pybullet may collide with as it is.
    """
    parts, name = [], _name(client, body, link)
    for index, shape in enumerate(pybullet.getCollisionShapeData(body, link, physicsClientId=client)):
        parts.append(_shape(client, (body, link, index), name, shape))
    if not parts:
        return None
    solid = read_objects(parts, f"{name}, with its collision shapes,")
    return met_by_liquid(solid, link_pose(client, body, link), liquid) if solid.has_hollow else solid.mesh


def given_solid(
    mesh: trimesh.Trimesh, name: str, pose: tuple[Array, Array], liquid: npt.NDArray[np.floating]
) -> trimesh.Trimesh:
    """Return the surface that liquid meets of a solid that the user gives; a warning tells what was mended in its mesh.

    pose: position (3,) [m] and orientation (4,) xyzw of the solid. liquid: positions (N, 3) [m] of the particles. Raises TypeError for
    anything but a mesh and ValueError for a mesh that is no solid; the message begins with `name`.
    """
    solid = told_solid(mesh, name, stacklevel=4)
    return met_by_liquid(solid, pose, liquid) if solid.has_hollow else solid.mesh


def met_by_liquid(solid: SolidMesh, pose: tuple[Array, Array], liquid: npt.NDArray[np.floating]) -> trimesh.Trimesh:
    """Return the outer surface of a solid at a pose, and that of its hollows too if some of the `liquid` (N, 3) [m] lies in them."""
    own = Rotation.from_quat(pose[1]).inv().apply(liquid - pose[0])
    near = own[((own > solid.outer.bounds[0]) & (own < solid.outer.bounds[1])).all(axis=1)]
    is_wet = ((SignedDistance(solid.outer).phi(near) < 0.0) & ~solid.contains(near)).any() if len(near) else False
    return solid.mesh if is_wet else solid.outer


def _shape(client: int, where: tuple[int, int, int], name: str, shape: tuple[Any, ...]) -> trimesh.Trimesh:
    """The solid of one collision shape in the link's centre-of-mass frame; `where`: body, link and index of the shape."""
    _, _, kind, dimensions, path, position, orientation = shape
    if kind == pybullet.GEOM_MESH and not _is_file(name, path.decode()):
        return _hull(client, where, UNTOLD_FILE)
    try:
        part = _primitive(kind, dimensions)
    except ValueError as cause:
        raise ValueError(f"{name}: {cause}") from cause
    if part is None and kind == pybullet.GEOM_MESH:
        part = _file(name, Path(path.decode()), is_ground=_is_ground(client, *where[:2]))
        if part is None:
            return _hull(client, where, f"has a mesh from the file {path.decode()!r}, which cannot be read here")
        part.apply_scale(np.array(dimensions))
    if part is None:
        raise ValueError(f"{name} has a collision shape of kind {kind}, allowed: {KINDS}")
    transform = np.eye(4)
    transform[:3, :3], transform[:3, 3] = Rotation.from_quat(orientation).as_matrix(), position
    part.apply_transform(transform)
    return part


def _is_ground(client: int, body: int, link: int) -> bool:
    """Whether a link is held and a body by itself; the base of a robot arm is held as well, and pybullet collides with its hull."""
    mass = pybullet.getDynamicsInfo(body, link, physicsClientId=client)[0]
    return link < 0 and mass == 0.0 and pybullet.getNumJoints(body, physicsClientId=client) == 0


def link_pose(client: int, body: int, link: int) -> tuple[Array, Array]:
    """Return position (3,) [m] and orientation (4,) xyzw of a link's centre of mass in the world."""
    if link < 0:
        position, orientation = pybullet.getBasePositionAndOrientation(body, physicsClientId=client)
    else:
        position, orientation = pybullet.getLinkState(body, link, 1, 1, physicsClientId=client)[:2]
    return np.array(position), np.array(orientation)


def _is_file(name: str, path: str) -> bool:
    """Tell whether pybullet reports a shape's file; ValueError if the file does not exist as seen from here."""
    if path == UNTOLD:
        return False
    if not Path(path).is_file():
        raise ValueError(
            f"{name} has a mesh from the file {path!r}, which does not exist as seen from {Path.cwd()}, allowed: to attach from the folder "
            "in which the body was loaded, to load it by its whole path, or add_body with meshes="
        )
    return True


def _primitive(kind: int, dimensions: tuple[float, ...]) -> trimesh.Trimesh | None:
    """Build a box (edge lengths), sphere (radius), cylinder or capsule (height, radius) along z; None for other shapes."""
    if kind == pybullet.GEOM_BOX:
        return box((dimensions[0], dimensions[1], dimensions[2]))
    if kind == pybullet.GEOM_SPHERE:
        return sphere(dimensions[0])
    if kind == pybullet.GEOM_CYLINDER:
        return cylinder(dimensions[1], dimensions[0])
    if kind == pybullet.GEOM_CAPSULE:
        return capsule(dimensions[1], dimensions[0])
    return None


def _file(name: str, path: Path, *, is_ground: bool) -> trimesh.Trimesh | None:
    """The mesh of a file if it is a solid, else the convex hulls of its parts, which pybullet collides with unless it is ground; None if
    it cannot be read.
    """
    try:
        solid = load_solid(path)
    except ValueError as cause:
        if is_ground:
            raise ValueError(f"{name}: {cause}, allowed: a closed mesh, or add_body with meshes=") from cause
        parts = _sound_parts(path)
        if parts:
            warnings.warn(f"{name}: {cause}; the convex hulls of its parts are used", stacklevel=5)
        return trimesh.util.concatenate([_convex(name, part) for part in parts]) if parts else None
    if solid.notes:
        warnings.warn(f"{name}: mesh {path}: {'; '.join(solid.notes)}", stacklevel=5)
    return solid.mesh


def _sound_parts(path: Path) -> list[trimesh.Trimesh]:
    """The objects of a file of which hulls can be made; none if it cannot be read."""
    try:
        parts = mesh_parts(path)
    except ValueError:
        return []
    return parts if all(np.isfinite(part.vertices).all() for part in parts) else []


def _hull(client: int, where: tuple[int, int, int], why: str) -> trimesh.Trimesh:
    """Build the convex hull of a shape that pybullet keeps as vertices, which are in the centre-of-mass frame."""
    body, link, index = where
    name = _name(client, body, link)
    count, vertices = pybullet.getMeshData(body, link, collisionShapeIndex=index, physicsClientId=client)
    if count < 4:
        raise ValueError(f"{name} has a mesh that pybullet does not report, allowed: add_body with meshes=")
    warnings.warn(
        f"{name} {why}: fluid and pybullet use its convex hull; give the fluid another solid with add_body and meshes=",
        stacklevel=5,
    )
    return _convex(name, np.array(vertices))


def _convex(name: str, solid: trimesh.Trimesh | np.ndarray) -> trimesh.Trimesh:
    """Build the hull of a mesh or of points (N, 3) [m]; ValueError if it is flat."""
    try:
        return trimesh.convex.convex_hull(solid)
    except Exception as cause:  # qhull's own, or of what trimesh then tries
        raise ValueError(
            f"{name} has a mesh that encloses no volume, allowed: a solid, or add_body with meshes="
        ) from cause


def _name(client: int, body: int, link: int) -> str:
    """Write the body's name, its id, and the link's name."""
    base, name = (text.decode() for text in pybullet.getBodyInfo(body, physicsClientId=client))
    part = base if link < 0 else pybullet.getJointInfo(body, link, physicsClientId=client)[12].decode()
    return f"body {body} ({name or 'unnamed'}), link {link} ({part or 'unnamed'})"


_PATIENCE = 10.0  # s, far above what the longest answer takes
_OWN = {getattr(pybullet, name) for name in ("DIRECT", "SHARED_MEMORY_SERVER") if hasattr(pybullet, name)}
_SPHERES = "btMultiSphereShapeData"
_OTHERWISE = "a URDF file of it, or capsules in its MJCF file by size, pos and quat in place of fromto"


def require_askable(client: int, body: int) -> None:
    """Require that pybullet can tell the collision shapes of a body, given by its unique id, in the world of a client, given by its id.

    Raises ValueError if the question ends the process or is not answered; for an engine in another process, if it may end this one.
    """
    is_own = pybullet.getConnectionInfo(client)["connectionMethod"] in _OWN
    trouble = _trouble_in_copy(client, body) if is_own else ""
    if not trouble and _may_have_spheres(client, body) and _SPHERES in _world_kinds(client):
        trouble = "may end the process"  # a copy that lived read what happened to lie there
    if trouble:
        raise ValueError(
            f"body {body}: pybullet's getCollisionShapeData {trouble} where a shape is made of spheres, as capsules of MJCF files by "
            f"fromto are, allowed: {_OTHERWISE}"
        )


def _trouble_in_copy(client: int, body: int) -> str:
    """How a copy of this process fared that asked for all shapes; empty if well."""
    with warnings.catch_warnings():
        # Python 3.12 warns of copies beside threads; this one asks pybullet only, waits for no thread, and has a limit of time
        warnings.filterwarnings("ignore", message=".*fork", category=DeprecationWarning)
        child = os.fork()
        if child == 0:
            _ask_and_leave(client, body)
    deadline = time.monotonic() + _PATIENCE
    while time.monotonic() < deadline:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return "" if os.WIFEXITED(status) else f"ends the process ({signal.Signals(os.WTERMSIG(status)).name})"
        time.sleep(0.001)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return "does not come back"


def _ask_and_leave(client: int, body: int) -> None:
    """Run by the copy: it says nothing, leaves no core file, and ends without Python's own end."""
    try:
        faulthandler.disable()
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        quiet = os.open(os.devnull, os.O_WRONLY)
        os.dup2(quiet, 1)
        os.dup2(quiet, 2)
        for link in range(-1, pybullet.getNumJoints(body, physicsClientId=client)):
            for index, shape in enumerate(pybullet.getCollisionShapeData(body, link, physicsClientId=client)):
                if shape[2] == pybullet.GEOM_MESH:
                    pybullet.getMeshData(body, link, collisionShapeIndex=index, physicsClientId=client)
    finally:
        os._exit(0)  # what is wrong without ending the process is told when the process itself asks


def _world_kinds(client: int) -> set[str]:
    """The kinds of all collision shapes of the client's world."""
    with tempfile.TemporaryDirectory(prefix="oilsim-") as folder:
        path = Path(folder) / "world.bullet"
        pybullet.saveBullet(str(path), physicsClientId=client)
        return kinds_of_shapes(path.read_bytes()) if path.is_file() else set()


def _may_have_spheres(client: int, body: int) -> bool:
    """Whether the body shows a capsule, or does not show what it is."""
    shown = [shape[2] for shape in pybullet.getVisualShapeData(body, physicsClientId=client)]
    return not shown or pybullet.GEOM_CAPSULE in shown
