"""A scene as the files that SPlisHSPlasH reads: JSON scene, particles as text (Maya PDA), a unit cube as mesh."""

from __future__ import annotations

import itertools
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tests.benchmarks.pareto.measures import Double
from tests.benchmarks.pareto.scenes import DENSITY, Body, Scene

WALL_OFFSET = {0: 0.6, 2: 0.5}  # spacings between a surface and its mesh, by boundary method: Akinci 2012, Bender 2019
CLOSED_OFFSET = (
    0.7  # the same where the liquid has no surface to give way to: 0.6 overfills the box, and its motion dies
)
SOLVER_KEYS = ("minIterations", "maxIterations", "maxIterationsV", "maxError", "maxErrorV")
DFSPH, WEILER = 4, 6
QUADS = (
    (0, 1, 3, 2),
    (4, 6, 7, 5),
    (0, 4, 5, 1),
    (2, 3, 7, 6),
    (0, 2, 6, 4),
    (1, 5, 7, 3),
)  # corners, seen from outside


def to_library(vector: Double) -> Double:
    """(x, y, z) with z up to (x, z, -y) with y up."""
    return np.stack([vector[..., 0], vector[..., 2], -vector[..., 1]], axis=-1)


def from_library(vector: Double) -> Double:
    """The inverse of `to_library`."""
    return np.stack([vector[..., 0], -vector[..., 2], vector[..., 1]], axis=-1)


def write(scene: Scene, spacing: float, options: Mapping[str, Any], folder: Path) -> Path:
    """Write the files of a scene; `options` are keys of the library's scene format in place of those chosen here."""
    _write_cube(folder / "cube.obj")
    _write_particles(folder / "particles.pda", to_library(scene.particles(spacing)))
    configuration = _configuration(scene, spacing) | {
        k: v for k, v in options.items() if k not in (*SOLVER_KEYS, "threads")
    }
    configuration["DFSPH"] |= {key: value for key, value in options.items() if key in SOLVER_KEYS}
    configuration["timeStepSize"] = min(configuration["timeStepSize"], configuration["cflMaxTimeStepSize"])
    share = WALL_OFFSET[configuration["boundaryHandlingMethod"]] if scene.open_top else CLOSED_OFFSET
    offset = share * spacing
    bodies = [_tank(scene, offset, folder)]
    if scene.body is not None:
        bodies.append(_body(scene.body, offset, folder))
    content = {
        "Configuration": configuration,
        "Materials": [_material(scene)],
        "RigidBodies": bodies,
        "FluidModels": [{"particleFile": str(folder / "particles.pda")}],
    }
    file = folder / "scene.json"
    file.write_text(json.dumps(content))
    return file


def _configuration(scene: Scene, spacing: float) -> dict[str, Any]:
    return {
        "sim2D": scene.dimension == 2,
        "particleRadius": 0.5 * spacing,
        "gravitation": [0.0, -scene.gravity, 0.0],
        "simulationMethod": DFSPH,
        "boundaryHandlingMethod": 0,
        "timeStepSize": 0.001,
        "cflMethod": 1,
        "cflFactor": 1.0,
        "cflMaxTimeStepSize": 0.005,  # above it the library's scenes explode
        "DFSPH": {
            "minIterations": 2, "maxIterations": 100, "maxIterationsV": 100, "maxError": 0.1, "maxErrorV": 0.1,
            "enableDivergenceSolver": True,
        },
    }  # fmt: skip


def _material(scene: Scene) -> dict[str, Any]:
    material: dict[str, Any] = {"id": "Fluid", "density0": DENSITY, "viscosityMethod": 0}
    if scene.kinematic_viscosity:
        material["viscosityMethod"] = WEILER
        material["Weiler et al. 2018"] = {"viscosity": scene.kinematic_viscosity, "viscosityBoundary": 0.0}
    return material


def _solid(identity: int, center: Double, size: Double, folder: Path) -> dict[str, Any]:
    return {
        "id": identity, "geometryFile": str(folder / "cube.obj"), "translation": center.tolist(), "scale": size.tolist(),
        "rotationAxis": [1, 0, 0], "rotationAngle": 0.0, "samplingMode": 1, "collisionObjectType": 0,
        "velocity": [0, 0, 0], "restitution": 0.0, "friction": 0.0, "color": [0.5, 0.5, 0.5, 1.0],
    }  # fmt: skip


def _tank(scene: Scene, offset: float, folder: Path) -> dict[str, Any]:
    lower, upper = np.array(scene.lower) - offset, np.array(scene.upper) + offset
    if scene.dimension == 2:
        lower[1], upper[1] = -0.5, 0.5
    size = np.abs(to_library(upper - lower))
    tank = _solid(1, to_library(0.5 * (lower + upper)), size, folder)
    cells = np.clip(np.round(size / 0.05), 6, 60).astype(int).tolist()
    return tank | {"isDynamic": False, "isWall": True, "density": DENSITY, "mapInvert": True, "mapResolution": cells}


def _body(body: Body, offset: float, folder: Path) -> dict[str, Any]:
    size = np.array(body.size) - 2.0 * offset
    solid = _solid(2, to_library(np.array(body.center)), np.abs(to_library(size)), folder)
    return solid | {"isDynamic": True, "isWall": False, "density": body.mass / float(np.prod(size))}


def _write_cube(file: Path) -> None:
    """A cube of edge 1 about the origin, two triangles a side."""
    corners = [f"v {x} {y} {z}" for x, y, z in itertools.product((-0.5, 0.5), repeat=3)]
    faces = [f"f {a + 1} {b + 1} {c + 1}" for p, q, r, s in QUADS for a, b, c in ((p, q, r), (p, r, s))]
    file.write_text("\n".join(corners + faces) + "\n")


def _write_particles(file: Path, position: Double) -> None:
    header = f"ATTRIBUTES\n position\nTYPES\n V\nNUMBER_OF_PARTICLES: {len(position)}\nBEGIN DATA\n"
    rows = (" ".join(f"{value:.9g}" for value in row) for row in position)
    file.write_text(header + "\n".join(rows) + "\n")
