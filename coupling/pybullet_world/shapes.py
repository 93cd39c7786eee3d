"""The solid of a link of any pybullet body, read from its collision shapes.

The result is one mesh in the link's centre-of-mass frame, from boxes, spheres, cylinders, capsules, mesh files with scale, and hulls that
pybullet keeps as vertices.
"""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from coupling.bodies import box, capsule, cylinder, load_mesh, mesh_parts, sphere
from coupling.pybullet_import import pybullet

KINDS = "box, sphere, cylinder, capsule, mesh"
UNTOLD = "unknown_file"  # pybullet's name of meshes from memory, and of files given to createCollisionShape


def link_mesh(client: int, body: int, link: int) -> trimesh.Trimesh | None:
    """Return the link's solid in its centre-of-mass frame; None if it has no collision shape.

    Raises ValueError, with body and link, for a shape that encloses no volume: a plane, a flat hull, or an open mesh of a held body, with
    which pybullet can collide.
    """
    parts, name = [], _name(client, body, link)
    for index, shape in enumerate(pybullet.getCollisionShapeData(body, link, physicsClientId=client)):
        _, _, kind, dimensions, path, position, orientation = shape
        if kind == pybullet.GEOM_MESH and not _is_file(name, path.decode()):
            parts.append(_hull(client, body, link, index))
            continue
        try:
            part = _primitive(kind, dimensions)
        except ValueError as cause:
            raise ValueError(f"{name}: {cause}") from cause
        if part is None and kind == pybullet.GEOM_MESH:
            is_held = link < 0 and pybullet.getDynamicsInfo(body, link, physicsClientId=client)[0] == 0.0
            part = _file(name, Path(path.decode()), np.array(dimensions), is_held)
        if part is None:
            raise ValueError(f"{name} has a collision shape of kind {kind}, allowed: {KINDS}")
        transform = np.eye(4)
        transform[:3, :3], transform[:3, 3] = Rotation.from_quat(orientation).as_matrix(), position
        part.apply_transform(transform)
        parts.append(part)
    return trimesh.util.concatenate(parts) if parts else None


def link_pose(client: int, body: int, link: int) -> tuple[np.ndarray, np.ndarray]:
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


def _file(name: str, path: Path, scale: np.ndarray, is_held: bool) -> trimesh.Trimesh:
    """Read the mesh of a file if it is closed, else the convex hulls of its parts, with which pybullet collides unless it is held."""
    try:
        mesh = load_mesh(path)
    except ValueError as cause:
        if is_held:
            raise ValueError(f"{name}: {cause}, allowed: a closed mesh, or add_body with meshes=") from cause
        warnings.warn(f"{name}: {cause}; the convex hulls of its parts are used", stacklevel=4)
        mesh = trimesh.util.concatenate([_convex(name, part) for part in mesh_parts(path)])
    mesh.apply_scale(scale)
    return mesh


def _hull(client: int, body: int, link: int, index: int) -> trimesh.Trimesh:
    """Build the convex hull of a shape that pybullet keeps as vertices, which are in the centre-of-mass frame."""
    name = _name(client, body, link)
    count, vertices = pybullet.getMeshData(body, link, collisionShapeIndex=index, physicsClientId=client)
    if count < 4:
        raise ValueError(f"{name} has a mesh that pybullet does not report, allowed: add_body with meshes=")
    warnings.warn(
        f"{name} has a mesh without a file known to pybullet: fluid and pybullet use its convex hull; give the fluid another solid with "
        "add_body and meshes=",
        stacklevel=4,
    )
    return _convex(name, np.array(vertices))


def _convex(name: str, solid: trimesh.Trimesh | np.ndarray) -> trimesh.Trimesh:
    """Build the hull of a mesh or of points (N, 3) [m]; ValueError if it is flat."""
    try:
        return trimesh.convex.convex_hull(solid)
    except Exception as cause:  # an error of qhull, or of trimesh's further attempts
        raise ValueError(
            f"{name} has a mesh that encloses no volume, allowed: a solid, or add_body with meshes="
        ) from cause


def _name(client: int, body: int, link: int) -> str:
    """Write the body's name, its id, and the link's name."""
    base, name = (text.decode() for text in pybullet.getBodyInfo(body, physicsClientId=client))
    part = base if link < 0 else pybullet.getJointInfo(body, link, physicsClientId=client)[12].decode()
    return f"body {body} ({name or 'unnamed'}), link {link} ({part or 'unnamed'})"
