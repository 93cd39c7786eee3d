"""The description of a run that observers get before it begins: fluids, bodies, booms, camera, and its place on Earth."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from booms.containment import PRACTICE_SPEED
from booms.deployment import BoomLayout
from booms.scores import HeldSpeed, skirt_drag_coefficient, tow_force
from coupling.multibody.lines import ElasticLine
from coupling.multibody.mooring_leg import MooringLeg
from oilsim.oil.fates import FATES
from recordings.model.exercise import BoomDescription, Equipment, ExerciseDescription, WindowDescription
from recordings.model.frame import CameraView, MeshDescription, PhaseDescription, RunDescription
from scenarios.schema.parsing.structuring import as_data
from scenarios.schema.run_settings import PressureProbe, WaveGauge
from scenarios.setup.afloat.boom_losses import has_closures
from scenarios.setup.afloat.boom_remarks import blockage
from scenarios.setup.afloat.moorings import tie_name
from scenarios.setup.simulators import Simulators
from scenarios.setup.solids.placed_solids import Solid, vector
from scenarios.spec.resolve import RunSpec
from scenarios.text.versions import versions

_QUANTITIES = {PressureProbe: "pressure [Pa]", WaveGauge: "height of the surface [m]"}  # what one number may be


def describe_run(simulators: Simulators, *, text: str, overrides: Sequence[str]) -> RunDescription:
    """Return everything about the run that does not change."""
    scenario = simulators.scenario
    properties: dict[str, str | float] = {f"version_{name}": version for name, version in versions().items()}
    properties |= {
        "title": scenario.title,
        "seed": float(scenario.run.seed),
        "boxes": "tank" if scenario.tanks else "windows" if scenario.window is not None else "none",
        "overrides": " ".join(overrides),
    }
    camera, exercise = scenario.camera, _describe_exercise(simulators)
    return RunDescription(
        name=scenario.name,
        text=text,
        particle_spacing=scenario.fluid.particle_spacing,
        dimension=scenario.fluid.dimension,
        properties=properties,
        phases=_describe_phases(scenario),
        meshes=_describe_meshes(simulators.solids),
        boundaries={} if simulators.tank is None else {"tank": simulators.fluid.boundary_positions(simulators.tank)},
        camera=None if camera is None else CameraView(eye=camera.eye, target=camera.target),
        exercise=exercise,
        site=None if scenario.site is None else replace(scenario.site.recorded, chart=simulators.chart),
        windows=describe_windows(simulators),
        fates=FATES,
        plots=_describe_plots(scenario),
    )


def describe_windows(simulators: Simulators) -> tuple[WindowDescription, ...]:
    """Describe the window of a run, then its outer one; empty without one."""
    table, windows = simulators.scenario.window, simulators.windows
    if table is None:
        return ()
    names = ("window",) if len(windows) == 1 else ("inner", "outer")
    return tuple(
        WindowDescription(
            name=name,
            target=_target_in_words(table.target, simulators.scenario),
            size=window.settings.whole_size,
            depth=window.depth,
            spacing=window.settings.spacing,
        )
        for name, window in zip(names, windows, strict=True)
    )


def _target_in_words(target: str | tuple[float, float], scenario: RunSpec) -> str:
    """Say what the middle of a window follows."""
    if not isinstance(target, str):
        return f"the place {target[0]:g}, {target[1]:g} m"
    kind = "the middle of boom" if target in scenario.booms else "vessel" if target in scenario.vessels else "body"
    return f"{kind} {target}"


def _describe_meshes(solids: Sequence[Solid]) -> dict[str, MeshDescription]:
    """Describe the mesh of every body; bodies that share mesh and colour share the description."""
    shapes: dict[tuple[int, object], MeshDescription] = {}
    described = {}
    for solid in solids:
        mesh, key = solid.placed.mesh, (id(solid.placed.mesh), solid.color)
        if key not in shapes:
            shapes[key] = MeshDescription(vertices=mesh.vertices, faces=mesh.faces, color=solid.color)
        described[solid.name] = shapes[key] if solid.drawn is None else solid.drawn
    return described


def _describe_phases(scenario: RunSpec) -> tuple[PhaseDescription, ...]:
    return tuple(
        PhaseDescription(
            name=name,
            rest_density=phase.rest_density,
            dynamic_viscosity=phase.viscosity,
            is_oil=phase.is_oil,
            color=phase.color,
        )
        for name, phase in scenario.phases.items()
    )


def _describe_plots(scenario: RunSpec) -> dict[str, tuple[str, ...]]:
    """Return the series of each plot of a probe that reads one number, by the plot's title."""
    return {
        f"Probe {name}: {_QUANTITIES[type(probe)]}": (f"probes/{name}",)
        for name, probe in scenario.probes.items()
        if type(probe) in _QUANTITIES
    }


def _describe_exercise(simulators: Simulators) -> ExerciseDescription | None:
    """Return the facts on the booms that a debrief needs; None without any."""
    scenario, fleet, water_level = simulators.scenario, simulators.fleet, simulators.level
    if not fleet.booms:
        return None
    current, wind = _current_and_wind(simulators)
    return ExerciseDescription(
        booms=tuple(_describe_boom(name, layout, scenario, water_level) for name, layout in fleet.booms.items()),
        current=current,
        water_level=water_level,
        period=scenario.period,
        wind=wind,
        criteria=as_data(scenario.criteria),
        areas={name: tuple(outlines) for name, outlines in simulators.areas.items()},
        prices=as_data(scenario.prices) if scenario.prices else {},
        equipment=tuple(_describe_equipment(simulators)),
    )


def _describe_equipment(simulators: Simulators) -> Iterator[Equipment]:
    """Yield skimmers, mooring legs and ties, as they were laid."""
    world, fleet = simulators.world, simulators.fleet
    for one in simulators.skimmers:
        mouth = ((one.body or "", vector(one.offset)),)
        width = one.skimmer.design.swath
        yield Equipment(name=one.short_name, kind="skimmer", ends=mouth, places=one.place_series, width=width)
    if world is None:
        return
    for leg in fleet.legs:
        line = world.lines[leg.name]
        assert isinstance(line, MooringLeg)
        ends = ((leg.body, vector(line.point)), ("", vector(line.place)))
        places = f"{leg.name}/anchor/x", f"{leg.name}/anchor/y"
        yield Equipment(name=_short(leg.name), kind="mooring", ends=ends, places=places, series=f"{leg.name}/tension")
    for tie in (line for line in fleet.lines if line.name.startswith(tie_name(""))):
        line = world.lines[tie.name]
        assert isinstance(line, ElasticLine)
        first, second = (vector(point) for point in line.points)
        ends = ((tie.body_a, first), (tie.body_b or "", second))
        yield Equipment(name=_short(tie.name), kind="tie", ends=ends, series=f"{tie.name}/tension")


def _short(name: str) -> str:
    """Return the name of a line in its scenario."""
    return name.partition("/")[2]


def _current_and_wind(simulators: Simulators) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the current at the surface and the wind without gusts (x, y) [m/s] at the start."""
    sea = simulators.sea.now
    return _plane(sea.current([simulators.level], 0.0)[0]), _plane(sea.mean_wind(0.0))


def _plane(vector: Sequence[float] | NDArray[np.float64]) -> tuple[float, float]:
    """Return the first two components of a vector."""
    return float(vector[0]), float(vector[1])


def _describe_boom(name: str, layout: BoomLayout, scenario: RunSpec, level: float) -> BoomDescription:
    settings = scenario.booms[name]
    first, second = (tuple(float(part) for part in point) for point in layout.segment.joint_points)
    labels = settings.end_labels
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
        deployment=settings.kind,
        blockage=blockage(settings, scenario, level),
        fed_by=settings.fed_by,
        skimmers=scenario.skimmers_at(name),
        waiting_ties=tuple(tie for tie, one in scenario.ties.items() if one.waits and name in one.booms),
        flow_shares=() if layout.boom.pocket is None else tuple(layout.boom.flow_shares.tolist()),
        hold_time=HeldSpeed.at(PRACTICE_SPEED, settings.skirt_depth, scenario.sea.height_and_period[1]).window,
        has_closures=has_closures(settings, scenario.phases),
    )


def _fixed_boom_tension(layout: BoomLayout) -> float:
    """Return the tension [N] of the boom as laid, if water met it at 0.7 knots."""
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
