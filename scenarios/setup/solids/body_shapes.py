"""The solid of each kind of body, in its design frame [m]."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import trimesh

from coupling.solids import bodies
from coupling.solids.solid_mesh import SolidMesh
from scenarios.schema.bodies import (
    Body,
    BoxBody,
    CylinderBody,
    MeshBody,
    RockBody,
    SphereBody,
)

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


_MESHES: dict[type, Callable[[Any], trimesh.Trimesh]] = {
    BoxBody: lambda body: bodies.box(body.size),
    CylinderBody: lambda body: bodies.cylinder(body.radius, body.height),
    SphereBody: lambda body: bodies.sphere(body.radius),
    RockBody: lambda body: rock(body.size, body.roughness, body.seed),
}
