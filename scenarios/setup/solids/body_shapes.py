"""The solid of each kind of body, in its design frame [m]."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from coupling.solids import bodies
from coupling.solids.solid_mesh import SolidMesh
from scenarios.schema.bodies import (
    Body,
    BoxBody,
    CapsuleBody,
    CylinderBody,
    MeshBody,
    PolygonBody,
    RockBody,
    SphereBody,
    WigleyBody,
)
from vessels.hull import wigley_hull

ROCK_BUMPS = 24


def body_solid(body: Body) -> SolidMesh:
    """Return the solid of a body about the origin of its shape; errors name the file where there is one."""
    if isinstance(body, MeshBody):
        return bodies.load_solid(body.file, body.scale)
    mesh = _MESHES[type(body)](body)
    return SolidMesh(mesh=mesh, outer=mesh)


def rock(size: tuple[float, float, float], roughness: float, seed: int) -> trimesh.Trimesh:
    """Build a boulder: a sphere whose radius varies by random plane waves, stretched to the extents `size` [m].

    radius(e) = 1 + roughness s(e) / max |s| with s(e) = sum_k a_k cos(w_k . e + p_k) for directions e. Wave vectors have lengths of 2 to 6
    and a_k = 1 / |w_k|: long bumps are high, short ones low.
    """
    random = np.random.default_rng(seed)
    mesh = trimesh.creation.icosphere(subdivisions=4)
    direction = np.asarray(mesh.vertices, np.float64)
    wave = random.normal(size=(ROCK_BUMPS, 3))
    wave *= random.uniform(2.0, 6.0, size=(ROCK_BUMPS, 1)) / np.linalg.norm(wave, axis=1, keepdims=True)
    phase = random.uniform(0.0, 2.0 * np.pi, size=ROCK_BUMPS)
    bumps = np.cos(direction @ wave.T + phase) @ (1.0 / np.linalg.norm(wave, axis=1))
    vertices = direction * (1.0 + roughness * bumps / np.abs(bumps).max())[:, None]
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    mesh.vertices = (vertices - 0.5 * (low + high)) / (high - low) * np.array(size)
    return mesh


def prism(outline: Sequence[tuple[float, float]], width: float) -> trimesh.Trimesh:
    """Build a closed prism of `width` [m] along y, about y = 0, over a simple polygon with corners (x, z) [m], in either sense."""
    corners = np.array(outline)
    x, z = corners.T
    if float(np.sum(np.roll(x, 1) * z - x * np.roll(z, 1))) < 0.0:
        corners = corners[::-1]  # now counter-clockwise, seen from -y
    cap, count = _triangles(corners), len(corners)
    near, far = (np.insert(corners, 1, side * 0.5 * width, axis=1) for side in (-1.0, 1.0))
    sides = [
        [[k, (k + 1) % count, k + count], [(k + 1) % count, (k + 1) % count + count, k + count]] for k in range(count)
    ]
    faces = np.concatenate([cap, cap[:, ::-1] + count, np.array(sides)[:, :, ::-1].reshape(-1, 3)])
    mesh = trimesh.Trimesh(np.concatenate([near, far]), faces, process=False)
    if mesh.volume < 0.0:
        mesh.invert()
    return mesh


def _triangles(corners: NDArray[np.float64]) -> NDArray[np.int64]:
    """Cut a simple counter-clockwise polygon (K, 2) [m] into triangles (K - 2, 3) by its ears; it has two at least (Meisters 1975)."""
    left, found = list(range(len(corners))), []
    while len(left) > 3:
        ear = next(k for k in range(len(left)) if _is_ear(corners, left, k))
        found.append([left[ear - 1], left[ear], left[(ear + 1) % len(left)]])
        left.pop(ear)
    return np.array([*found, left])


def _is_ear(corners: NDArray[np.float64], left: list[int], k: int) -> bool:
    """Tell whether the corner `k` of those left is convex, with none of the others in its triangle."""
    a, b, c = (corners[left[at % len(left)]] for at in (k - 1, k, k + 1))

    def turn(p: NDArray[np.float64], q: NDArray[np.float64], r: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray((q[0] - p[0]) * (r[..., 1] - p[1]) - (q[1] - p[1]) * (r[..., 0] - p[0]))

    others = corners[[at for at in left if at not in (left[k - 1], left[k], left[(k + 1) % len(left)])]]
    inside = (turn(a, b, others) >= 0.0) & (turn(b, c, others) >= 0.0) & (turn(c, a, others) >= 0.0)
    return bool(turn(a, b, c) > 0.0 and not inside.any())


_MESHES: dict[type, Callable[[Any], trimesh.Trimesh]] = {
    BoxBody: lambda body: bodies.box(body.size),
    PolygonBody: lambda body: prism(body.outline, body.width),
    CylinderBody: lambda body: bodies.cylinder(body.radius, body.height),
    SphereBody: lambda body: bodies.sphere(body.radius),
    CapsuleBody: lambda body: bodies.capsule(body.radius, body.height),
    WigleyBody: lambda body: wigley_hull(body.length, body.beam, body.draft, body.depth),
    RockBody: lambda body: rock(body.size, body.roughness, body.seed),
}
