"""Bodies in a sea of formulas, without particles: waves and current load them by Morison's equation and Froude-Krylov pressure."""

from __future__ import annotations

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
from coupling.testkit.run import TestRun, body_frame
from oilsim.loads.morison import FloatingBodies
from oilsim.sea import Sea, SeaDescription
from recordings.model.frame import Frame, MeshDescription, RunDescription
from scenarios.setup.at_sea.sea_loads import loads_of_body

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
