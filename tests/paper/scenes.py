"""The runs behind the figures: the shipped scenes of the paper, each in its own setting, followed through time."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field

import numpy as np
import trimesh
from numpy.typing import NDArray

from scenarios.running.assembly import Assembly, build
from scenarios.spec.load import load_scenario
from tests.paper.shapes import Coating, Footprint, coating, footprint

VISCOSITIES = (2.6e-3, 9.0e-3, 1.0e-1)  # [Pa s] the paper's three oils
SAMPLE = 0.05  # [s] between measurements
ROCK_POINTS = 20_000  # on the rock's surface
ABOVE_POOL = 0.1  # [m] height on the rock from which oil counts as hanging on it; the pool of all oil is 5 cm deep


@dataclass(frozen=True, kw_only=True)
class Setting:
    """A way to compute: its name in pictures and tables, and entries of the scenario."""

    name: str
    entries: tuple[str, ...]


PAPER = Setting(
    name="paper's scheme and constants",
    entries=("fluid.scheme=paper", "fluid.viscosity_correction=1e4", "fluid.maximum_time_step=0.01"),
)
OURS = Setting(name="split scheme, SI", entries=("fluid.scheme=split", "fluid.viscosity_correction=1"))


@dataclass(frozen=True, kw_only=True)
class Scene:
    """One run: scenario, setting, the oil's viscosity [Pa s], length [s], the moments [s] to draw, and other entries."""

    scenario: str
    setting: Setting
    viscosity: float
    duration: float
    moments: tuple[float, ...]
    entries: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        """The run in words."""
        return f"{self.scenario}, {self.setting.name}, {self.viscosity:g} Pa s"

    def build(self, threads: int) -> Assembly:
        """Build the run on so many threads."""
        changes = (f"phases.oil.dynamic_viscosity={self.viscosity}", f"run.threads={threads}")
        return build(load_scenario(self.scenario, overrides=[*self.setting.entries, *changes, *self.entries]).scenario)


@dataclass
class Track:
    """A run that was followed.

    times [s] (T,) of the measurements; footprints, coatings (of a rock only), and the way [m] left to the nearest side of the tank at
    these times; pictures: positions (N, 3) [m]
    by phase at the drawn moments; rock: vertices and faces of the rock's mesh; lost: particles that left the tank; wall: [s] it took.
    """

    scene: Scene
    spacing: float = 0.0
    times: list[float] = field(default_factory=list)
    footprints: list[Footprint | None] = field(default_factory=list)
    coatings: list[Coating] = field(default_factory=list)
    room: list[float] = field(default_factory=list)
    oil: list[int] = field(default_factory=list)
    pictures: dict[float, dict[str, NDArray[np.float32]]] = field(default_factory=dict)
    rock: tuple[NDArray[np.float64], NDArray[np.int64]] | None = None
    particles: int = 0
    lost: int = 0
    wall: float = 0.0

    def series(self, name: str) -> NDArray[np.float64]:
        """Return a measure of the footprints (T,) by name; NaN before there is oil."""
        return np.array([np.nan if one is None else getattr(one, name) for one in self.footprints])

    def drift(self) -> NDArray[np.float64]:
        """Return how far (T,) [m] the oil's centre has gone along -x, where the wind blows."""
        at = np.array([np.nan if one is None else one.center[0] for one in self.footprints])
        return np.asarray(at[0] - at)

    def at(self, moment: float) -> int:
        """Return the number of the measurement nearest to a moment [s]."""
        return int(np.argmin(np.abs(np.array(self.times) - moment)))

    def pouring_end(self) -> float:
        """Return the moment [s] at which the last oil particle has left the pipe."""
        return self.times[int(np.argmax(self.oil))]

    def before_walls(self) -> int:
        """Return the number of the last measurement before the oil comes within two spacings of a side; the last of all if none does."""
        near = np.flatnonzero(np.array(self.room) < 2.0 * self.spacing)
        return int(near[0]) - 1 if len(near) else len(self.times) - 1


def follow(scene: Scene) -> Track:
    """Run a scene on one thread, and measure its oil every `SAMPLE` [s]."""
    assembly = scene.build(threads=1)
    fluid = assembly.fluid
    track = Track(scene, spacing=fluid.config.particle_spacing)
    mesh = assembly.controls.present_meshes().get("rock")
    surface = None
    if mesh is not None:
        track.rock = np.array(mesh.vertices), np.array(mesh.faces)
        surface = trimesh.sample.sample_surface_even(mesh, ROCK_POINTS, seed=0)[0]
    begin = time.perf_counter()
    for step in range(round(scene.duration / SAMPLE) + 1):
        if step > 0:
            report = fluid.advance(SAMPLE)
            track.lost += int(sum(report.removed.values()))
        _measure(track, assembly, step * SAMPLE, surface)
    track.wall = time.perf_counter() - begin
    track.particles = fluid.particle_count
    fluid.close()
    return track


def _measure(track: Track, assembly: Assembly, now: float, surface: NDArray[np.float64] | None) -> None:
    """Take down the oil of the present moment."""
    fluid = assembly.fluid
    oil = fluid.phase_positions("oil")
    track.times.append(now)
    track.oil.append(len(oil))
    track.room.append(_room(oil, fluid.config.lower, fluid.config.upper))
    track.footprints.append(footprint(oil[:, :2], 2.0 * track.spacing) if len(oil) else None)
    if surface is not None:
        track.coatings.append(coating(oil, surface, track.spacing, ABOVE_POOL))
    if any(abs(now - moment) < 0.5 * SAMPLE for moment in track.scene.moments):
        track.pictures[now] = {name: fluid.phase_positions(name).copy() for name in assembly.scenario.phases}


def _room(oil: NDArray[np.float64], lower: tuple[float, ...], upper: tuple[float, ...]) -> float:
    """Return the way [m] from the oil (N, 3) [m] to the nearest side of the tank; infinite without oil."""
    if not len(oil):
        return math.inf
    return float(min((oil[:, :2] - lower[:2]).min(), (np.array(upper[:2]) - oil[:, :2]).min()))
