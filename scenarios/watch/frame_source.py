"""Frames: what observers see of a run at each communication point."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from coupling.master.co_simulation import CommunicationPoint
from coupling.participant import Causality, Participant
from recordings.entity_paths import BOOM
from recordings.frame import (
    BodyFrame,
    Frame,
    PhaseFrame,
)
from scenarios.setup.fleet import Fleet
from scenarios.setup.placed_solids import Solid
from scenarios.setup.simulators import Scene
from scenarios.watch.boom_scoring import Scoring
from scenarios.watch.coupling_series import CouplingFigures
from scenarios.watch.probe_readings import RunFigures, probe_readings

Array = NDArray[np.float64]


def _pulls(fleet: Fleet) -> dict[str, tuple[str, ...]]:
    """Return, for each boom segment and tow line, the joints at its ends."""
    found: dict[str, tuple[str, ...]] = {}
    for joint in fleet.joints:
        for body in (joint.body_a, joint.body_b):
            if body is not None and body.startswith(f"{BOOM}/"):
                found[body] = (*found.get(body, ()), joint.name)
    return found


class FramePainter:
    """A source of frames: numbers and poses at once, particles only on request."""

    def __init__(
        self, scene: Scene, scoring: Scoring, coupling_figures: CouplingFigures, fmus: Sequence[Participant] = ()
    ) -> None:
        """Prepare the frames; the outputs of `fmus` are shown, too."""
        self._scene = scene
        self._pulls = _pulls(scene.fleet)
        self._scoring = scoring
        self._coupling_figures = coupling_figures
        self._fmus = fmus
        self._figures = RunFigures(scene.fluid, lambda: scene.fluid_participant.report)
        self._probes = probe_readings(scene.scenario.probes, scene.fluid, self._pose_and_wrench)

    def __call__(self, point: CommunicationPoint) -> Frame:
        """Make the frame of a communication point; its particles must be requested before the run continues."""
        scalars = self._figures(point.time) | dict(self._probes()) | self._scoring(point.time)
        scalars |= self._coupling_figures(point.time)
        scalars |= self._fmu_outputs()
        return Frame(
            index=point.index,
            time=point.time,
            bodies={solid.name: self._body(solid) for solid in self._scene.solids},
            scalars=scalars,
            read_phases=self._phases,
            read_lost=self._scoring.lost_ids,
        )

    def _fmu_outputs(self) -> dict[str, float]:
        """Return the outputs of each FMU, as ``fmus/winch/paid_out``; of an array, each element."""
        outputs: dict[str, float] = {}
        for fmu in self._fmus:
            arrays = {name for name, variable in fmu.variables.items() if math.prod(variable.shape) > 1}
            for name, variable in fmu.variables.items():
                if variable.causality is Causality.OUTPUT and name.rpartition("[")[0] not in arrays:
                    values = fmu.get(name).ravel()
                    place = f"{fmu.name.replace('.', '/', 1)}/{name}"
                    outputs |= {f"{place}/{i}" if len(values) > 1 else place: float(v) for i, v in enumerate(values)}
        return outputs

    def _phases(self) -> Mapping[str, PhaseFrame]:
        fluid = self._scene.fluid
        return {
            name: PhaseFrame(position=fluid.phase_positions(name), id=fluid.phase_ids(name))
            for name in self._scene.scenario.phases
        }

    def _body(self, solid: Solid) -> BodyFrame:
        world = self._scene.world
        if world is None:
            return BodyFrame(position=solid.placed.position, orientation=solid.placed.orientation)
        pose, twist = world.pose(solid.name), world.twist(solid.name)
        return BodyFrame(
            position=pose[:3],
            orientation=pose[3:],
            linear_velocity=twist[:3],
            angular_velocity=twist[3:],
            wrench=self._scene.wrench(solid.name),
            tension=max((world.tension(joint) for joint in self._pulls.get(solid.name, ())), default=math.nan),
        )

    def _pose_and_wrench(self, name: str) -> tuple[Array, Array]:
        world = self._scene.world
        assert world is not None  # a probed body is coupled
        return world.pose(name), self._scene.wrench(name)
