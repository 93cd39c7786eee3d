"""What observers are shown of a run: once its description, then a frame at each communication point."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from booms.containment import PRACTICE_SPEED
from booms.deployment import BoomLayout
from booms.scores import skirt_drag_coefficient, tow_force
from coupling.co_simulation import CommunicationPoint
from coupling.rigid_body_world import RigidBodyWorld
from oilsim.solver import AdvanceReport, Fluid
from recordings.entity_paths import BOOM
from recordings.exercise import BoomDescription, ExerciseDescription, Site
from recordings.frame import (
    BodyFrame,
    CameraView,
    Frame,
    MeshDescription,
    PhaseDescription,
    PhaseFrame,
    RunDescription,
)
from scenarios.build_fluid import horizontal
from scenarios.fleet import Fleet
from scenarios.instruments import RunFigures, probe_readings
from scenarios.scenario import Scenario, SiteSettings
from scenarios.scoring import Scoring
from scenarios.solids import Solid
from scenarios.versions import versions

Array = NDArray[np.float64]
Wrench = Callable[[str], Array]


def describe_run(
    scenario: Scenario,
    fluid: Fluid,
    tank: int | None,
    solids: Sequence[Solid],
    *,
    exercise: ExerciseDescription | None,
    text: str,
    overrides: Sequence[str],
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
        exercise=exercise,
        site=None if scenario.site is None else _site(scenario.site),
    )


def _site(site: SiteSettings) -> Site:
    return Site(latitude=site.latitude, longitude=site.longitude, bearing=math.degrees(site.bearing), start=site.start)


def describe_exercise(scenario: Scenario, fleet: Fleet, water_level: float) -> ExerciseDescription | None:
    """What a debrief must know of the booms; None without any."""
    if not fleet.booms:
        return None
    current = scenario.forcing.current
    flow = (0.0, 0.0, 0.0) if current is None else horizontal(current.speed, current.direction)
    return ExerciseDescription(
        booms=tuple(_describe_boom(name, layout, scenario) for name, layout in fleet.booms.items()),
        current=(flow[0], flow[1]),
        water_level=water_level,
    )


def _describe_boom(name: str, layout: BoomLayout, scenario: Scenario) -> BoomDescription:
    settings = scenario.booms[name]
    first, second = (tuple(float(part) for part in point) for point in layout.segment.joint_points)
    labels = [end if isinstance(end, str) else f"end-{index}" for index, end in enumerate(settings.ends)]
    pulls = [scenario.vessels[end].bollard_pull for end in settings.ends if isinstance(end, str)]
    return BoomDescription(
        name=name,
        segments=tuple(segment.name for segment in layout.segments),
        ends=(labels[0], labels[1]),
        length=settings.length,
        skirt_depth=settings.skirt_depth,
        freeboard=settings.freeboard,
        waterline=float(layout.segment.waterline),
        joint_points=((first[0], first[1], first[2]), (second[0], second[1], second[2])),
        full_tension=max(pulls, default=0.0) or _fixed_boom_tension(layout),
    )


def _fixed_boom_tension(layout: BoomLayout) -> float:
    """Tension [N] of the boom as laid, if water met it at 0.7 knots."""
    boom = layout.boom
    gap = min(layout.gap_ratio, 0.95)  # a straight boom's is unbounded
    tension, _ = tow_force(
        boom.length,
        gap,
        boom.skirt_depth,
        PRACTICE_SPEED,
        drag_coefficient=skirt_drag_coefficient(),
        density=boom.water_density,
    )
    return tension


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
        self._figures = RunFigures(fluid, report)
        self._probes = probe_readings(scenario.probes, fluid, self._pose_and_wrench)

    def __call__(self, point: CommunicationPoint) -> Frame:
        """The frame at a communication point; its particles must be asked for before the run goes on."""
        scalars = self._figures(point.time) | dict(self._probes()) | self._scoring(point.time)
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
