"""This solver on a scene. A new knob is one more `Family`: its settings are fields of `FluidConfig` (and `threads`)."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from coupling.solids.bodies import box
from coupling.solids.surface_sampling import boundary_particles
from oilsim import Fluid, FluidConfig, FluidError, Phase, tank_walls
from tests.benchmarks.pareto.measures import Sample
from tests.benchmarks.pareto.results import Family, Row, Variant, failure, outcome
from tests.benchmarks.pareto.scenes import DENSITY, Body, Scene

NAME = "oilsim"
FAMILIES = (
    Family(name="spacing", settings=({},), spacings="every"),
    Family(
        name="time step", settings=tuple({"maximum_time_step": dt} for dt in (0.005, 0.0025, 0.02)), spacings="every"
    ),
    Family(
        name="tolerance",
        settings=tuple({"density_tolerance": share, "divergence_tolerance": share} for share in (1e-2, 1e-4, 1e-5)),
    ),
    Family(name="paper scheme", settings=({"scheme": "paper"},), spacings="every"),
    Family(name="one thread", settings=({"threads": 1},), spacings="finest", scenes=("dam", "box")),
)
_compiled: set[Any] = set()


def configuration(scene: Scene, spacing: float, options: Mapping[str, Any]) -> FluidConfig:
    """The scene's constant data; `options` are fields of `FluidConfig` in place of its defaults."""
    viscosity = DENSITY * scene.kinematic_viscosity
    margin = np.zeros(3) if scene.periodic else np.full(3, 4.0 * spacing)
    if scene.dimension == 2:
        margin[1] = 1.0
    return FluidConfig(
        particle_spacing=spacing,
        phases=(Phase(name="water", rest_density=DENSITY, dynamic_viscosity=viscosity),),
        lower=tuple(np.array(scene.lower) - margin),
        upper=tuple(np.array(scene.upper) + margin),
        periodic=(scene.periodic, False, scene.periodic),
        gravity=(0.0, 0.0, -scene.gravity),
        dimension=scene.dimension,
        **options,
    )


class Run:
    """A scene's fluid and its body, advanced one communication step after the other."""

    def __init__(self, scene: Scene, variant: Variant) -> None:
        settings = dict(variant.options)
        threads = settings.pop("threads", None)
        self.scene = scene
        self.fluid = Fluid(configuration(scene, variant.spacing, settings), threads=threads)
        if not scene.periodic:
            sides = ["-x", "+x", "-z"] + ["-y", "+y"] * (scene.dimension == 3) + ["+z"] * (not scene.open_top)
            walls = tank_walls(scene.lower, scene.upper, variant.spacing, sides=tuple(sides), dimension=scene.dimension)
            self.fluid.add_boundary(walls)
        points = scene.particles(variant.spacing)
        self.fluid.add_particles(points, phase="water", velocity=scene.velocity(points))
        self.body_height = math.nan
        if scene.body is not None:
            self._float(scene.body, variant.spacing)

    def _float(self, body: Body, spacing: float) -> None:
        self._handle = self.fluid.add_boundary(boundary_particles("box", box(body.size), spacing))
        squared = np.array(body.size) ** 2
        inertia = body.mass / 12.0 * (squared.sum() - squared)
        self._inverse_mass = np.diag(np.concatenate([np.full(3, 1.0 / body.mass), 1.0 / inertia]))
        self._motion = (np.array(body.center), np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(3), np.zeros(3))
        self.body_height = body.center[2]

    def step(self) -> float:
        """Advance by the scene's interval; the wall time it took [s]."""
        begin = time.perf_counter()
        if self.scene.body is not None:
            fall = (0.0, 0.0, -self.scene.gravity, 0.0, 0.0, 0.0)
            self.fluid.set_boundary_motion(self._handle, *self._motion, self._inverse_mass, fall)
        self.fluid.advance(self.scene.interval)
        seconds = time.perf_counter() - begin
        if self.scene.body is not None:
            moved = self.fluid.boundary_motion(self._handle)
            self._motion = (moved.position, moved.orientation, moved.twist[:3], moved.twist[3:])
            self.body_height = float(moved.position[2])
        return seconds

    def sample(self) -> Sample:
        """What the solver-independent measures see."""
        return Sample(
            time=self.fluid.time,
            position=self.fluid.phase_positions("water").astype(np.float64),
            velocity=self.fluid.phase_velocities("water").astype(np.float64),
            pressure=self.fluid.pressure_at(self.scene.probes) if self.scene.probes else np.zeros(0),
            body_height=self.body_height,
        )


def run(scene: Scene, variant: Variant) -> Row:
    """Run a variant with everything compiled before the first timed step."""
    try:
        words = (scene.name, *(value for value in variant.options.values() if isinstance(value, str)))
        if words not in _compiled:
            warm = Run(scene, variant)
            warm.step()
            warm.sample()
            warm.fluid.close()
            _compiled.add(words)
        simulation = Run(scene, variant)
        seconds, samples = [], []
        for _ in range(round(scene.duration / scene.interval)):
            seconds.append(simulation.step())
            samples.append(simulation.sample())
        simulation.fluid.close()
        result = outcome(scene, variant, samples, seconds)
    except (FluidError, ValueError, TypeError) as error:
        return failure(scene, variant, str(error))
    return Row(scene=scene.name, solver=variant.solver, family=variant.family, label=variant.label, **result)
