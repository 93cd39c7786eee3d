"""A run under test: what scenes, watched pybullet worlds, seas and scenario runs have in common."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Any, Self

import numpy as np
import trimesh

from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.master.co_simulation import CoSimulation
from coupling.master.observer_dispatch import Observer
from coupling.testkit.readings import Basin, History, Live, Readings, history_readings
from oilsim import Fluid
from oilsim.backend.arrays import Array
from recordings.model.frame import BodyFrame, Frame, MeshDescription, PhaseDescription, PhaseFrame, RunDescription


class TestRun:
    """A run that begins at the first step or the first look, keeps its history, and is read by checks.

    history: what happened so far. Use it in a `with` block, which ends the run. A subclass makes the coupled run in `_begun_simulation`,
    and says in `_terms` what checks may read besides the history, and in `_last_frame` how it looks now.
    """

    __test__ = False  # it is no test

    def __init__(self, name: str) -> None:
        """Take the name by which errors call it."""
        self.name, self.history = name, History()
        self._observers: list[Observer] = []
        self._simulation: CoSimulation | None = None
        self._is_closed = False

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def simulation(self) -> CoSimulation:
        """The coupled run, made and begun at the first access; nothing can be added afterwards."""
        if self._simulation is None:
            self._simulation = self._begun_simulation()
        return self._simulation

    def watch(self, observer: Observer) -> None:
        """Show the run to an observer, a `Recorder` for example; ValueError once the run has begun."""
        self._require_not_begun(f"observer {type(observer).__name__}")
        self._observers.append(observer)

    def step(self) -> None:
        """Make one communication step."""
        self.simulation.step()

    def run(self, duration: float) -> None:
        """Run for `duration` [s], in whole communication steps; ValueError for a duration that is not above 0."""
        if not (math.isfinite(duration) and duration > 0.0):
            raise ValueError(f"{self.name}: duration of the run is {duration} s, allowed: above 0")
        self.simulation.run(self.simulation.communication_point.time + duration)

    def save_state(self) -> dict[str, Any]:
        """Return all that the next step depends on, as plain data; the run begins if it has not."""
        return self.simulation.save_state()

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Go on from a state that `save_state` returned, here or in a run made alike; CoSimulationError if it does not fit."""
        self.simulation.restore_state(saved)

    def readings(self) -> Readings:
        """Return the readings of the run up to now; the run begins if it has not."""
        self._begin()
        return history_readings(self.history, source=f"the {self.name}", **self._terms())

    def last_frame(self) -> Frame:
        """Return the frame of the present moment, with its particles."""
        frame = self._last_frame()
        frame.read_particles()
        return frame

    def close(self) -> None:
        """End the run and release what it holds."""
        if not self._is_closed:
            self._is_closed = True
            if self._simulation is not None:
                self._simulation.terminate()
            self._release()

    def _begin(self) -> None:
        _ = self.simulation

    def _begun_simulation(self) -> CoSimulation:
        raise NotImplementedError

    def _terms(self) -> dict[str, Any]:
        raise NotImplementedError

    def _last_frame(self) -> Frame:
        raise NotImplementedError

    def _release(self) -> None:
        """Release what the run holds beside its participants."""

    def _require_not_begun(self, what: str) -> None:
        if self._simulation is not None:
            raise ValueError(f"{self.name}: {what} is added after the run has begun, allowed: before")

    def _fluid_terms(self, fluid: Fluid, basin: Basin | None, **bodies: Callable[[], Any]) -> dict[str, Any]:
        """Return what checks may read of a fluid, and of bodies by their `momentum`, `energy` and `turnover`."""
        return {
            "particles": lambda phase: fluid.phase_positions(phase).astype(np.float64),
            "gravity": abs(fluid.config.gravity[2]),
            "basin": basin,
            "live": Live(fluid=fluid, step=self.step, **bodies),
        }


def describe(name: str, fluid: Fluid, meshes: Mapping[str, trimesh.Trimesh]) -> RunDescription:
    """Describe a run of a fluid and bodies with these meshes [m], about their centres of mass.

    Walls are all boundaries that stand still.
    """
    moving = set(fluid.moving_boundaries)
    walls = [fluid.boundary_positions(handle) for handle in fluid.boundaries if handle not in moving]
    phases = fluid.config.phases
    return RunDescription(
        name=name,
        particle_spacing=fluid.config.particle_spacing,
        dimension=fluid.config.dimension,
        phases=tuple(
            PhaseDescription(
                name=phase.name,
                rest_density=phase.rest_density,
                dynamic_viscosity=phase.dynamic_viscosity,
                is_oil="oil" in phase.name,
            )
            for phase in phases
        ),
        meshes={one: MeshDescription(vertices=mesh.vertices, faces=mesh.faces) for one, mesh in meshes.items()},
        boundaries={"tank": np.concatenate(walls).astype(np.float32)} if walls else {},
    )


def body_frame(world: RigidBodyWorld, name: str, wrench: Array) -> BodyFrame:
    """Return a body's motion now, with the wrench (6,) [N, N m] that the water makes."""
    pose, twist = world.pose(name), world.twist(name)
    return BodyFrame(
        position=pose[:3], orientation=pose[3:], linear_velocity=twist[:3], angular_velocity=twist[3:], wrench=wrench
    )


def phase_frames(fluid: Fluid) -> dict[str, PhaseFrame]:
    """Return a copy of the particles of each phase."""
    return {
        phase.name: PhaseFrame(position=fluid.phase_positions(phase.name), id=fluid.phase_ids(phase.name))
        for phase in fluid.config.phases
    }


def turnover(world: RigidBodyWorld, meshes: Mapping[str, trimesh.Trimesh]) -> tuple[float, float, float]:
    """Return sum m |v| [kg m/s] and sum |I omega| [kg m2/s] of free bodies, and how far [m] the furthest reaches from the origin.

    meshes: by body, about its centre of mass [m].
    """
    moving = spin = far = 0.0
    for body in world.free_body_names:
        momentum = world.mass_matrix(body) @ world.twist(body)
        moving += float(np.linalg.norm(momentum[:3]))
        spin += float(np.linalg.norm(momentum[3:]))
        extent = float(np.linalg.norm(meshes[body].vertices, axis=1).max())
        far = max(far, float(np.linalg.norm(world.pose(body)[:3])) + extent)
    return moving, spin, far
