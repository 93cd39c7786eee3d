"""Readings of a run, as checks take them: alike for scenes, pybullet worlds, scenario runs and recordings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NoReturn, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt
import trimesh
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from coupling.solids.hydrostatics import hydrostatics
from coupling.testkit.history import BodyTrack, History, Track
from coupling.testkit.verdict import Context
from oilsim import Fluid
from recordings.model.frame import RunDescription

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Basin:
    """An upright tank: area [m2] of its plan, the height [m] of its floor, and the names of bodies that lie outside of it."""

    area: float
    bottom: float
    without: tuple[str, ...] = ()


@runtime_checkable
class Readable(Protocol):
    """Gives readings: a scene, a watched world, a scenario run."""

    def readings(self) -> Readings:
        """Return the readings up to now."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Live:
    """A run that can be asked and stepped.

    step: makes one communication step. momentum (6,) [kg m/s, kg m2/s] about the origin, energy [J]: of free bodies, without the liquid.
    turnover: their sum of m |v| [kg m/s], that of |I omega| [kg m2/s], and the distance [m] of their furthest point from the origin.
    """

    fluid: Fluid
    step: Callable[[], object]
    momentum: Callable[[], Array]
    energy: Callable[[], float]
    turnover: Callable[[], tuple[float, float, float]]


@dataclass(frozen=True, kw_only=True, eq=False)
class Readings:
    """Everything that a check may read of a run.

    run: its description. bodies, series: over time, by name. particles: positions (N, 3) [m] of a phase at the last moment. time [s]: of
    that moment. gravity [m/s2]:
    of free fall. basin: the tank, None if it is unknown. live: None for a recording.
    """

    run: RunDescription
    bodies: Mapping[str, BodyTrack]
    series: Mapping[str, Track]
    particles: Callable[[str], Array]
    time: float = 0.0
    gravity: float = 9.81
    basin: Basin | None = None
    live: Live | None = None
    source: str = "the run"
    _meshes: dict[str, trimesh.Trimesh] = field(default_factory=dict)

    @property
    def spacing(self) -> float:
        """Particle spacing [m]."""
        return self.run.particle_spacing

    def context(self, *bodies: str, order: float = 1.0) -> Context:
        """Return the circumstances of a measurement of these bodies at the last moment."""
        spacing = None if self.run.properties.get("detail") == "none" else self.spacing  # a run without particles
        return Context(bodies=bodies, time=self.time, spacing=spacing, order=order)

    def body(self, name: str) -> BodyTrack:
        """Return a body's motion; ValueError for an unknown name."""
        if name not in self.bodies:
            raise ValueError(f"{self.source} has no body {name!r}, allowed: {', '.join(self.bodies) or 'none'}")
        return self.bodies[name]

    def one_series(self, name: str) -> Track:
        """Return a series; ValueError for an unknown name."""
        if name not in self.series:
            raise ValueError(f"{self.source} has no series {name!r}, allowed: {', '.join(self.series) or 'none'}")
        return self.series[name]

    def alive(self, need: str) -> Live:
        """Return the live run; TypeError if there is none, or no body or fluid, for a check that needs `need`."""
        if self.live is None:
            _refuse(f"{self.source} holds no {need}, allowed: a scene, a watched world or a scenario run")
        return self.live

    def placed(self, name: str) -> trimesh.Trimesh:
        """Return the body's mesh [m] at its last place in the world; ValueError if it has none."""
        return placed(self.mesh(name), self.body(name).pose[-1])

    def mesh(self, name: str) -> trimesh.Trimesh:
        """Return the body's mesh [m] about its centre of mass; ValueError if it has none."""
        if name not in self._meshes:
            if name not in self.run.meshes:
                raise ValueError(
                    f"{self.source} has no mesh of {name!r}, allowed: {', '.join(self.run.meshes) or 'none'}"
                )
            stored = self.run.meshes[name]
            self._meshes[name] = trimesh.Trimesh(stored.vertices.astype(np.float64), stored.faces)
        return self._meshes[name]

    def volume(self, phase: str | None = None) -> float:
        """Return the volume [m3] of a phase, or of all liquid."""
        names = [one.name for one in self.run.phases] if phase is None else [phase]
        return sum(len(self.particles(name)) for name in names) * self.run.particle_volume

    def level(self) -> float:
        """Compute the height [m] of the still water around the bodies as they are; ValueError if the tank is unknown."""
        if self.basin is None:
            raise ValueError(f"{self.source} has no tank, whose level could be told, allowed: to state level=...")
        names = set(self.bodies) & set(self.run.meshes) - set(self.basin.without)
        bodies = [self.placed(name) for name in sorted(names)]
        return still_level(self.basin, self.volume(), bodies)


def placed(mesh: trimesh.Trimesh, pose: Array) -> trimesh.Trimesh:
    """Return the mesh [m] at a pose (7,) [m, 1]."""
    there = mesh.copy()
    turn = np.eye(4)
    turn[:3, :3], turn[:3, 3] = Rotation.from_quat(pose[3:]).as_matrix(), pose[:3]
    there.apply_transform(turn)
    return there


def still_level(basin: Basin, water: float, bodies: list[trimesh.Trimesh]) -> float:
    """Solve A (level - bottom) = V_water + V_displaced(level) for the level [m], between all bodies dry and all submerged.

    water [m3]; bodies: meshes [m] at their places.
    """
    lowest = basin.bottom + water / basin.area
    highest = lowest + sum(float(mesh.volume) for mesh in bodies) / basin.area

    def missing(level: float) -> float:
        return basin.area * (level - basin.bottom) - water - sum(displaced(mesh, level) for mesh in bodies)

    return float(brentq(missing, lowest, highest)) if missing(lowest) < 0.0 else lowest


def displaced(mesh: trimesh.Trimesh, level: float) -> float:
    """Return the volume [m3] of a mesh below a level [m]."""
    return hydrostatics(mesh, level).displaced_volume if level > mesh.bounds[0, 2] else 0.0


def history_readings(history: History, **terms: Any) -> Readings:
    """Return readings of a history; ValueError if its run has not begun."""
    if history.run is None:
        raise ValueError("the run has not begun, allowed: checks after its first step")
    return Readings(run=history.run, time=history.time, bodies=history.bodies(), series=history.series(), **terms)


def _refuse(text: str) -> NoReturn:
    raise TypeError(text)
