"""Orders during a run: how they reach helmsmen, engines, booms, skimmers, pipes and the sea."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING

from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.multibody.lines import ElasticLine
from coupling.multibody.mooring_leg import MooringLeg
from oilsim import PipeEmitter
from scenarios.problems import Problem, ScenarioError
from scenarios.running.assembly import Assembly
from scenarios.scenario import Scenario
from scenarios.schema.exercise import body_of
from scenarios.setup.fleet import course_of, gains_of
from scenarios.setup.fluid import pipe_of, pipe_problems
from scenarios.setup.moorings import leg_name, tie_name
from scenarios.setup.resolve import RunSpec, resolve

if TYPE_CHECKING:
    from oilsim.slick.spill_source import SpillSource
    from vessels.control import VesselControl


def give_orders(assembly: Assembly, scenario: Scenario) -> None:
    """Bring every part to what `scenario` says of it; it differs from the assembly's own by orders that `plan` allows.

    Raises ScenarioError, and changes nothing, if a new part cannot be made. Whether ties are within reach is for `require_reach`.
    """
    spec = resolve(scenario)
    sea = assembly.sea.ordered(spec)
    pipes = _new_pipes(assembly, spec)
    sources = _new_sources(assembly, spec)
    for control in assembly.controls:
        _steer(assembly, spec, control)
        mass = control.vessel.hull.mass_properties.mass
        gains = gains_of(scenario.vessels[control.vessel.name], mass, spec.orbital_speed)
        if gains != control.vessel.gains:
            control.retune(gains)
    for station in assembly.parts.controls.values():
        ordered = scenario.vessels[station.vessel.name]
        station.vessel = replace(station.vessel, engine_runs=any(ordered.screws), screws=ordered.screws)
    _part(assembly, scenario)
    _change_moorings(assembly, scenario)
    _change_skimmers(assembly, scenario)
    assembly.winches.take_orders(scenario)
    assembly.scoring.take_orders([control.vessel for control in assembly.controls])
    for pipe in pipes:
        assembly.fluid.add_emitter(pipe)
    for emitter, settings in zip(assembly.fluid.emitters, spec.emitters.values(), strict=True):
        emitter.speed = settings.speed
    if assembly.slick is not None:
        from scenarios.setup.at_sea.parcels import rate_of

        assembly.slick.sources += sources
        for source in assembly.slick.sources:
            source.rate = rate_of(spec.sources[source.name])
    assembly.sea.take_orders(spec, sea)


def _steer(assembly: Assembly, scenario: RunSpec, control: VesselControl) -> None:
    """Give a helmsman the course that `scenario` has for its vessel.

    The tow's line goes through the vessel's place at the start. Where the tow turns it, or takes the vessel over, that line may be far
    off by now: then it is laid through the vessel's present place. A course of the vessel's own has lines of its own.
    """
    name = control.vessel.name
    present, course = control.vessel.course, course_of(scenario.vessels[name], scenario)
    if course is None or present is None or course == present:
        return
    last, before = course.legs[-1], present.legs[-1]
    if scenario.vessels[name].legs or scenario.vessels[name].waypoints:
        control.lay_line(None)
    elif assembly.world is not None and (last.heading, last.through) != (before.heading, before.through):
        x, y = assembly.world.pose(body_of(name))[:2].tolist()
        control.lay_line((x, y))
    control.change_course(course)


def require_reach(assembly: Assembly, scenario: Scenario) -> None:
    """Raise ScenarioError for every tie that `scenario` makes fast now, but whose ends are not within reach."""
    if assembly.world is None:
        return
    problems = []
    for name in _fresh_ties(assembly.world, scenario):
        distance, tie = assembly.world.line_distance(tie_name(name)), scenario.ties[name]
        if tie.reach is not None and distance > tie.reach:
            text = (
                f"cannot be true yet: its ends are {distance:.1f} m apart, allowed: within its reach of {tie.reach:g} m"
            )
            problems.append(Problem(f"--set ties.{name}.made_fast", text))
    if problems:
        raise ScenarioError(problems, "oilsim")


def _fresh_ties(world: RigidBodyWorld, scenario: Scenario) -> Iterator[str]:
    """Yield the ties that `scenario` makes fast and that are loose in the world."""
    for name, tie in scenario.ties.items():
        line = world.lines[tie_name(name)]
        if tie.made_fast and isinstance(line, ElasticLine) and not line.made_fast:
            yield name


def _part(assembly: Assembly, scenario: Scenario) -> None:
    """Let the joints of booms part that have parted in `scenario` and still hold."""
    for boom, settings in scenario.booms.items():
        for number in settings.parted:
            assembly.strength.part(boom, number)


def _change_moorings(assembly: Assembly, scenario: Scenario) -> None:
    """Let the ties be fast and the mooring legs and ties part as in `scenario`, and let anchors hold as it says."""
    if assembly.world is None:
        return
    for name in list(_fresh_ties(assembly.world, scenario)):
        assembly.world.make_line_fast(tie_name(name))
    for name, tie in scenario.ties.items():
        if tie.parted:
            assembly.world.part_line(tie_name(name))
    for name, leg in scenario.moorings.items():
        if leg.parted:
            assembly.world.part_line(leg_name(name))
        elif leg.holding is not None:
            line = assembly.world.lines[leg_name(name)]
            assert isinstance(line, MooringLeg)
            line.anchor = replace(line.anchor, holding=leg.holding)


def _change_skimmers(assembly: Assembly, scenario: Scenario) -> None:
    """Let skimmers run or stop, pump and store as in `scenario`."""
    for one in assembly.skimmers:
        ordered = scenario.skimmers[one.short_name]
        one.skimmer.is_running = ordered.running
        one.skimmer.design = ordered.design(one.skimmer.design.water_density)


def _new_pipes(assembly: Assembly, scenario: RunSpec) -> list[PipeEmitter]:
    """Create the pipes that the fluid does not have yet; ScenarioError for those that reach into a body or out of the tank."""
    spacing, known = scenario.fluid.particle_spacing, len(assembly.fluid.emitters)
    fresh = dict(islice(scenario.emitters.items(), known, None))
    if fresh:
        problems = list(pipe_problems(replace(scenario, emitters=fresh), assembly.present_meshes()))
        if problems:
            raise ScenarioError(problems, "oilsim")
    return [pipe_of(settings, spacing) for settings in fresh.values()]


def _new_sources(assembly: Assembly, scenario: RunSpec) -> list[SpillSource]:
    """Create the sources of oil that the slick does not have yet; none in a run without parcels."""
    if assembly.slick is None:
        return []
    from scenarios.setup.at_sea.parcels import new_sources  # only a run with parcels pays for its kernels

    return new_sources(assembly.slick, scenario)
