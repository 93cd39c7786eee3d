"""What observers are shown of a run at each communication point: a frame."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from coupling.co_simulation import CommunicationPoint
from coupling.rigid_body_world import RigidBodyWorld
from oilsim.solver import AdvanceReport, Fluid
from recordings.entity_paths import BOOM
from recordings.frame import (
    BodyFrame,
    Frame,
    PhaseFrame,
)
from scenarios.coupling_figures import CouplingFigures
from scenarios.fleet import Fleet
from scenarios.instruments import RunFigures, probe_readings
from scenarios.scenario import Scenario
from scenarios.scoring import Scoring
from scenarios.solids import Solid

Array = NDArray[np.float64]
Wrench = Callable[[str], Array]


def _pulls(fleet: Fleet) -> dict[str, tuple[str, ...]]:
    """By boom segment and tow line, the joints at its ends."""
    found: dict[str, tuple[str, ...]] = {}
    for joint in fleet.joints:
        for body in (joint.body_a, joint.body_b):
            if body is not None and body.startswith(f"{BOOM}/"):
                found[body] = (*found.get(body, ()), joint.name)
    return found


class FramePainter:
    """Makes the frame of a communication point: figures and poses at once, particles only for whoever asks."""

    def __init__(
        self,
        scenario: Scenario,
        fluid: Fluid,
        world: RigidBodyWorld | None,
        solids: Sequence[Solid],
        fleet: Fleet,
        wrench: Wrench,
        scoring: Scoring,
        coupling_figures: CouplingFigures,
        report: Callable[[], AdvanceReport | None],
    ) -> None:
        """`wrench` gives the fluid's wrench (6,) on a body, `report` the fluid's report on its last step."""
        self._scenario = scenario
        self._fluid = fluid
        self._world = world
        self._solids = solids
        self._pulls = _pulls(fleet)
        self._wrench = wrench
        self._scoring = scoring
        self._coupling_figures = coupling_figures
        self._figures = RunFigures(fluid, report)
        self._probes = probe_readings(scenario.probes, fluid, self._pose_and_wrench)

    def __call__(self, point: CommunicationPoint) -> Frame:
        """The frame at a communication point; its particles must be asked for before the run goes on."""
        scalars = self._figures(point.time) | dict(self._probes()) | self._scoring(point.time)
        scalars |= self._coupling_figures(point.time)
        return Frame(
            index=point.index,
            time=point.time,
            bodies={solid.name: self._body(solid) for solid in self._solids},
            scalars=scalars,
            read_phases=self._phases,
            read_lost=self._scoring.lost_ids,
        )

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
            tension=max((self._world.tension(joint) for joint in self._pulls.get(solid.name, ())), default=math.nan),
        )

    def _pose_and_wrench(self, name: str) -> tuple[Array, Array]:
        assert self._world is not None  # a probed body is coupled
        return self._world.pose(name), self._wrench(name)
