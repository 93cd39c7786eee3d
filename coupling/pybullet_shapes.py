"""The solid that a link of any pybullet body is, read from its collision shapes, as one mesh in the link's centre-of-mass
frame: boxes, spheres, cylinders, capsules, mesh files with scale, and hulls that pybullet keeps as vertices.
"""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from coupling.bodies import box, capsule, cylinder, load_mesh, sphere
from coupling.quiet_pybullet import pybullet

KINDS = "box, sphere, cylinder, capsule, mesh"


def link_mesh(client: int, body: int, link: int) -> trimesh.Trimesh | None:
    """The link's solid in its centre-of-mass frame; None if it has no collision shape.

    ValueError, naming body and link, for a shape that encloses no volume (a plane, a height field).
    """
    parts = []
    for index, shape in enumerate(pybullet.getCollisionShapeData(body, link, physicsClientId=client)):
        _, _, kind, dimensions, path, position, orientation = shape
        part = _primitive(kind, dimensions)
        if part is None and kind == pybullet.GEOM_MESH:
            if not Path(path.decode()).is_file():
                parts.append(_hull(client, body, link, index))
                continue
            part = _file(_name(client, body, link), Path(path.decode()), np.array(dimensions))
        if part is None:
            raise ValueError(f"{_name(client, body, link)} has a collision shape of kind {kind}, allowed: {KINDS}")
        transform = np.eye(4)
        transform[:3, :3], transform[:3, 3] = Rotation.from_quat(orientation).as_matrix(), position
        part.apply_transform(transform)
        parts.append(part)
    return trimesh.util.concatenate(parts) if parts else None


def _primitive(kind: int, dimensions: tuple[float, ...]) -> trimesh.Trimesh | None:
    """A box (edge lengths), sphere (radius), cylinder or capsule (height, radius) along z; None for anything else."""
    if kind == pybullet.GEOM_BOX:
        return box((dimensions[0], dimensions[1], dimensions[2]))
    if kind == pybullet.GEOM_SPHERE:
        return sphere(dimensions[0])
    if kind == pybullet.GEOM_CYLINDER:
        return cylinder(dimensions[1], dimensions[0])
    if kind == pybullet.GEOM_CAPSULE:
        return capsule(dimensions[1], dimensions[0])
    return None


def _file(name: str, path: Path, scale: np.ndarray) -> trimesh.Trimesh:
    """The mesh of a file if it is closed, else the convex hull that pybullet collides with."""
    try:
        mesh = load_mesh(path)
    except ValueError as cause:
        warnings.warn(f"{name}: {cause}; its convex hull is used", stacklevel=4)
        mesh = trimesh.load(path, force="mesh").convex_hull
    mesh.apply_scale(scale)
    return mesh


def _hull(client: int, body: int, link: int, index: int) -> trimesh.Trimesh:
    """The convex hull of a shape that pybullet keeps as vertices, which it gives in the centre-of-mass frame."""
    count, vertices = pybullet.getMeshData(body, link, collisionShapeIndex=index, physicsClientId=client)
    if count < 4:
        raise ValueError(
            f"{_name(client, body, link)} has a mesh that pybullet keeps to itself, allowed: add_body with meshes="
        )
    return trimesh.convex.convex_hull(np.array(vertices))


def _name(client: int, body: int, link: int) -> str:
    """As the user knows it: the body's name, its id, and the link's name."""
    base, name = (text.decode() for text in pybullet.getBodyInfo(body, physicsClientId=client))
    part = base if link < 0 else pybullet.getJointInfo(body, link, physicsClientId=client)[12].decode()
    return f"body {body} ({name or 'unnamed'}), link {link} ({part or 'unnamed'})"
