"""What observers are shown of a run: once its description, then a frame at each communication point."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from coupling.co_simulation import CommunicationPoint
from coupling.participant import Causality, Participant
from coupling.rigid_body_world import RigidBodyWorld
from oilsim.solver import AdvanceReport, Fluid
from recordings.frame import (
    BodyFrame,
    CameraView,
    Frame,
    MeshDescription,
    PhaseDescription,
    PhaseFrame,
    RunDescription,
)
from scenarios.coupling_figures import CouplingFigures
from scenarios.instruments import RunFigures, probe_readings
from scenarios.scenario import Scenario
from scenarios.scoring import Scoring
from scenarios.solids import Solid
from scenarios.versions import versions

Array = NDArray[np.float64]
Wrench = Callable[[str], Array]


def describe_run(
    scenario: Scenario, fluid: Fluid, tank: int | None, solids: Sequence[Solid], *, text: str, overrides: Sequence[str]
) -> RunDescription:
    """Everything about the run that does not change."""
    properties: dict[str, str | float] = {f"version_{name}": version for name, version in versions().items()}
    properties |= {"title": scenario.title, "seed": float(scenario.run.seed), "overrides": " ".join(overrides)}
    camera = scenario.camera
    return RunDescription(
        name=scenario.name,
        text=text,
        particle_spacing=scenario.fluid.particle_spacing,
        properties=properties,
        phases=tuple(
            PhaseDescription(
                name=name, rest_density=phase.rest_density, dynamic_viscosity=phase.viscosity, color=phase.color
            )
            for name, phase in scenario.phases.items()
        ),
        meshes={
            solid.name: MeshDescription(
                vertices=solid.placed.mesh.vertices, faces=solid.placed.mesh.faces, color=solid.color
            )
            for solid in solids
        },
        boundaries={} if tank is None else {"tank": fluid.boundary_positions(tank)},
        camera=None if camera is None else CameraView(eye=camera.eye, target=camera.target),
    )


class FramePainter:
    """Makes the frame of a communication point: figures and poses at once, particles only for whoever asks."""

    def __init__(
        self,
        scenario: Scenario,
        fluid: Fluid,
        world: RigidBodyWorld | None,
        solids: Sequence[Solid],
        wrench: Wrench,
        scoring: Scoring,
        coupling_figures: CouplingFigures,
        report: Callable[[], AdvanceReport | None],
        fmus: Sequence[Participant] = (),
    ) -> None:
        """`wrench` gives the fluid's wrench (6,) on a body, `report` the fluid's report on its last step; the outputs of `fmus` are
        shown too.
        """
        self._fmus = fmus
        self._scenario = scenario
        self._fluid = fluid
        self._world = world
        self._solids = solids
        self._wrench = wrench
        self._scoring = scoring
        self._coupling_figures = coupling_figures
        self._figures = RunFigures(fluid, report)
        self._probes = probe_readings(scenario.probes, fluid, self._pose_and_wrench)

    def __call__(self, point: CommunicationPoint) -> Frame:
        """The frame at a communication point; its particles must be asked for before the run goes on."""
        scalars = self._figures(point.time) | dict(self._probes()) | self._scoring(point.time)
        scalars |= self._coupling_figures(point.time)
        scalars |= self._fmu_outputs()
        return Frame(
            index=point.index,
            time=point.time,
            bodies={solid.name: self._body(solid) for solid in self._solids},
            scalars=scalars,
            read_phases=self._phases,
        )

    def _fmu_outputs(self) -> dict[str, float]:
        """What each FMU gives, as ``fmus/winch/paid_out``; of an array, each element."""
        outputs: dict[str, float] = {}
        for fmu in self._fmus:
            for name, variable in fmu.variables.items():
                if variable.causality is Causality.OUTPUT:
                    values = fmu.get(name).ravel()
                    place = f"{fmu.name.replace('.', '/', 1)}/{name}"
                    outputs |= {f"{place}/{i}" if len(values) > 1 else place: float(v) for i, v in enumerate(values)}
        return outputs

    def _phases(self) -> Mapping[str, PhaseFrame]:
        fluid = self._fluid
        return {
            name: PhaseFrame(position=fluid.phase_positions(name), id=fluid.phase_ids(name))
            for name in self._scenario.phases
        }

    def _body(self, solid: Solid) -> BodyFrame:
        if self._world is None:
            return BodyFrame(position=solid.placed.position, orientation=solid.placed.orientation)
        pose, twist = self._world.pose(solid.name), self._world.twist(solid.name)
        return BodyFrame(
            position=pose[:3],
            orientation=pose[3:],
            linear_velocity=twist[:3],
            angular_velocity=twist[3:],
            wrench=self._wrench(solid.name),
        )

    def _pose_and_wrench(self, name: str) -> tuple[Array, Array]:
        assert self._world is not None  # a probed body is coupled
        return self._world.pose(name), self._wrench(name)
