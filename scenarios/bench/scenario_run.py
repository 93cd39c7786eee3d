"""A scenario under test: it is run step by step, with faults if wanted, and checks read it like any other run.

Bodies in a sea of formulas, without particles: waves and current load them by Morison's equation and Froude-Krylov pressure.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from booms.deployment import PlacedBody
from coupling.bullet.rigid_body_participant import RigidBodyParticipant
from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.master.co_simulation import CoSimulation
from coupling.master.observer_dispatch import CommunicationPoint, Watching
from coupling.multibody.prescribed_motion import UPRIGHT, Quaternion, Vector
from coupling.solids.bodies import mass_properties
from coupling.testkit.faults import FaultPlan
from coupling.testkit.readings import basin_of
from coupling.testkit.run import TestRun, body_frame, turnover
from oilsim.loads.morison import FloatingBodies
from oilsim.sea import Sea, SeaDescription
from recordings.model.frame import Frame, MeshDescription, RunDescription
from scenarios.running.assembly import Assembly, build
from scenarios.running.checkpoints import Restart, run_state
from scenarios.running.plan import Plan
from scenarios.running.run_loop import RunLoop
from scenarios.running.run_requests import RunRequests
from scenarios.setup.at_sea.sea_loads import loads_of_body
from scenarios.spec.load import load_scenario
from scenarios.spec.scenario import Scenario


class ScenarioRun(TestRun):
    """A run of a shipped scenario, a scenario file or a `Scenario`, on one thread unless `threads` says otherwise.

        with ScenarioRun("floating-box", "fluid.particle_spacing=0.1") as run:
            run.run(1.0)
            assert_draft(run, "box", 0.1, within=0.05)

    Settings are those of `oilsim run --set`. faults: what is to fail, beside what the scenario says; state it before the first step.
    Orders and warnings work as in `oilsim run`. Raises ScenarioError for a scenario that cannot be built, and ValueError for settings of
    a `Scenario`.
    """

    def __init__(self, scenario: str | Path | Scenario, *settings: str, demo: bool = False, threads: int = 1) -> None:
        loaded = (
            scenario
            if isinstance(scenario, Scenario)
            else load_scenario(scenario, overrides=settings, demo=demo).scenario
        )
        if isinstance(scenario, Scenario) and (settings or demo):
            raise ValueError(f"scenario run: settings {settings} change a Scenario, allowed: a name or a file")
        self.scenario = replace(loaded, run=replace(loaded.run, threads=threads))
        super().__init__(f"scenario {self.scenario.name}")
        self.faults = FaultPlan()
        self._plan = Plan(scenario=self.scenario)
        self._loop: RunLoop | None = None
        self._assembly: Assembly | None = None

    @property
    def assembly(self) -> Assembly:
        """The parts of the run: fluid, world, fleet, accounts; built at the first access."""
        if self._assembly is None:
            self._assembly = build(self.scenario, faults=self.faults)
        return self._assembly

    def step(self) -> None:
        """Make one communication step, with the orders that are due."""
        self._begin()
        assert self._loop is not None  # begun
        self._loop.step()

    def run(self, duration: float | None = None) -> None:
        """Run for `duration` [s], in whole communication steps, or to the scenario's end; ValueError for a duration not above 0."""
        simulation = self.simulation
        now = simulation.communication_point
        left = self.scenario.run.duration - now.time if duration is None else duration
        if not left > 0.0:
            raise ValueError(f"scenario run: duration is {left} s, allowed: above 0")
        for _ in range(max(1, round(left / now.step_size))):
            if simulation.is_running:
                self.step()

    def save_state(self) -> dict[str, Any]:
        """Return all that the next step depends on, and the run's accounts, as plain data; the run begins if it has not."""
        return copy.deepcopy(run_state(self.simulation, self.assembly))

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Begin at a state that `save_state` of a run of the same scenario returned.

        Raises ValueError once the run has begun, and for scenarios with injects, which `oilsim run --resume` continues, and
        CheckpointError for a state that does not fit.
        """
        if self._loop is not None or self.scenario.injects:
            raise ValueError(
                "scenario run: a state is restored after the run has begun, or with injects, allowed: before, without"
            )
        self._simulation = self._begun_simulation(
            Restart(plan=self._plan, index=0, state=saved, source=Path("saved state"))
        )

    def _terms(self) -> dict[str, Any]:
        world, fluid = self.assembly.world, self.assembly.fluid
        basin = basin_of(self.assembly.description)
        if world is None:
            none = {"momentum": lambda: np.zeros(6), "energy": lambda: 0.0, "turnover": lambda: (0.0, 0.0, 0.0)}
            return self._fluid_terms(fluid, basin, **none)
        turned = partial(turnover, world, {solid.name: solid.placed.mesh for solid in self.assembly.solids})
        return self._fluid_terms(fluid, basin, momentum=world.momentum, energy=world.energy, turnover=turned)

    def _last_frame(self) -> Frame:
        return self.assembly.frame_source(self.simulation.communication_point)

    def _release(self) -> None:
        if self._loop is None and self._assembly is not None:
            for participant in self._assembly.participants:
                participant.terminate()
            self._assembly.fluid.close()

    def _begun_simulation(self, restart: Restart | None = None) -> CoSimulation:
        simulation = self.assembly.co_simulation([self.history, *self._observers])
        self._loop = RunLoop(
            self._plan, self.assembly, simulation, requests=RunRequests(), keepers={}, checkpoints=None
        )
        self._loop.begin(restart)
        return simulation


STEP = 0.02  # [s]
UNRESOLVED = 1.0  # [m], stands for the spacing of a run without particles


def sea_scene(description: SeaDescription, *, communication_step: float = STEP) -> SeaScene:
    """Create a scene in the sea that is described, without bodies; communication_step [s]."""
    return SeaScene(Sea(description), communication_step)


class SeaScene(TestRun):
    """Bodies that a sea loads: add them, then run.

    sea, world: the sea and the rigid bodies. The series `probes/NAME` of the history is the sea's height [m] at a body.
    """

    def __init__(self, sea: Sea, communication_step: float) -> None:
        super().__init__("analytic sea")
        self.sea = sea
        self.world = RigidBodyWorld(sub_step=communication_step, communication_step=communication_step)
        self._step = communication_step
        self._meshes: dict[str, trimesh.Trimesh] = {}
        self._models: dict[str, object] = {}

    def add_body(
        self, name: str, mesh: trimesh.Trimesh, *, density: float, position: Vector, orientation: Quaternion = UPRIGHT
    ) -> None:
        """Add a floating body of even `density` [kg/m3]; `mesh` [m] is about its centre of mass, `position` [m] is where that lies.

        Added mass, wave damping and drag follow from its shape as it is placed (modelled, `vessels.bluff_body`).
        Raises ValueError for a body that sinks, and once the run has begun.
        """
        self._require_not_begun(f"body {name!r}")
        properties = mass_properties(mesh, density=density)
        placed = PlacedBody(
            name=name,
            mesh=mesh,
            mass_properties=properties,
            position=np.array(position),
            orientation=np.array(orientation),
        )
        self._models[name] = loads_of_body(placed, self.sea.description.density)
        self.world.add_body(name, mesh, properties, position, orientation)
        self._meshes[name] = mesh

    def _begun_simulation(self) -> CoSimulation:
        if self._models:
            self.world.set_environment(FloatingBodies(list(self._models.values()), self.sea), list(self._models))  # type: ignore[arg-type]
        description = RunDescription(
            name="analytic sea",
            particle_spacing=UNRESOLVED,
            meshes={
                one: MeshDescription(vertices=mesh.vertices, faces=mesh.faces) for one, mesh in self._meshes.items()
            },
            properties={"boxes": "none"},
        )
        simulation = CoSimulation(
            [RigidBodyParticipant("bodies", self.world, gives_mobility=False)], [], self._step,
            watching=Watching([self.history, *self._observers], self._frame, description),
        )  # fmt: skip
        simulation.initialize()
        return simulation

    def _terms(self) -> dict[str, Any]:
        return {"particles": lambda phase: np.empty((0, 3)), "gravity": self.sea.description.gravity}

    def _last_frame(self) -> Frame:
        return self._frame(self.simulation.communication_point)

    def _release(self) -> None:
        self.world.close()

    def _frame(self, point: CommunicationPoint) -> Frame:
        world = self.world
        bodies = {name: body_frame(world, name, world.sea_wrench(name)) for name in world.body_names}
        places = {name: body.position[:2] for name, body in bodies.items()}
        heights = {f"probes/{name}": float(self.sea.elevation(xy, point.time)) for name, xy in places.items()}
        return Frame(index=point.index, time=point.time, bodies=bodies, scalars=heights)
