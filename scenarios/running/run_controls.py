"""The controls of a run: one setter for each thing that may be changed, for orders and for signals.

Orders change the scenario. Signals change it over the orders, and rule from then on. The setters of what has changed bring the parts of
the run to what the scenario says then: helmsmen, engines, winches, booms, moorings, skimmers, pipes and the sea.

A sea goes gradually from what it is to what is ordered: wind, current, waves and visibility, within `sea.within` seconds.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np

from coupling.multibody.lines import ElasticLine
from coupling.multibody.mooring_leg import MooringLeg
from oilsim import PipeEmitter
from scenarios.controls.table import CONTROLS, SETTERS, with_entry
from scenarios.schema.exercise import BoomSettings, TowSettings, VesselSettings, body_of
from scenarios.schema.moorings import MooringSettings, TieSettings
from scenarios.schema.parsing.relations import entries_at
from scenarios.schema.recovery import SkimmerSettings
from scenarios.schema.sea import SeaSettings
from scenarios.setup.afloat.boom_lines import laid_out, reel_name
from scenarios.setup.afloat.fleet import course_of, gains_of
from scenarios.setup.afloat.moorings import leg_name, tie_name
from scenarios.setup.at_sea.build_sea import build_sea
from scenarios.setup.fluid import pipe_of, pipe_problems
from scenarios.setup.simulators import Simulators
from scenarios.spec.resolve import RunSpec, resolve
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import Problem, ScenarioError
from scenarios.watch.boom_scoring import BoomStrength, Scoring
from vessels.control import MACHINERY_ORDERS, ManualControl, VesselControl

if TYPE_CHECKING:
    from trimesh import Trimesh

    from oilsim.sea import Sea
    from oilsim.slick.spill_source import SpillSource


class RunControls:
    """Brings the parts of a run to what orders and signals ask for; `advance` belongs to each communication point, for winches.

    helms: by the names of their vessels. A line that nobody has ordered is left to others. Lengths are kept with the state of the world,
    and orders with the plan.
    """

    def __init__(
        self,
        scenario: RunSpec,
        simulators: Simulators,
        helms: Mapping[str, VesselControl | ManualControl],
        strength: BoomStrength,
        scoring: Scoring,
    ) -> None:
        """Hold all lines as they were laid; what is hauled in or paid out at the start is ordered so."""
        self._simulators, self._helms, self._strength, self._scoring = simulators, helms, strength, scoring
        self._ordered = self._present = scenario
        self._signaled: dict[str, float] = {}
        self._change: SeaChange | None = None
        self._numbers: dict[str, float] = {}  # of the sea, while it changes
        self._laid = {name: boom.tow_line for name, boom in scenario.booms.items()}
        self._waiting = {tie_name(name) for name, tie in scenario.ties.items() if tie.waits}
        self._lengths: dict[str, tuple[float, float]] = {}  # that are ordered [m], and speeds of winches [m/s], by line
        self._setters: dict[str, Callable[[RunSpec], None]] = {
            "steer": lambda spec: self._steer(spec.vessels, spec.tow),
            "push": lambda spec: self._push(spec.vessels),
            "run_engines": lambda spec: self._run_engines(spec.vessels),
            "part": lambda spec: self._part(spec.booms),
            "make_fast": self._make_fast,
            "moor": lambda spec: self._moor(spec.moorings, spec.ties),
            "skim": lambda spec: self._skim(spec.skimmers),
            "haul": self._haul,
        }
        self._push(scenario.vessels)
        self._haul(scenario)

    def order(self, scenario: Scenario | RunSpec, *, within_reach: bool = True) -> None:
        """Bring every part to what a scenario with all orders so far says, signals aside.

        Raises ScenarioError, and changes nothing, if a part cannot be made or, where `within_reach` is asked for, the ends of a tie that is
        made fast are apart.
        """
        spec = resolve(scenario)
        if within_reach:
            self._require_reach(spec.ties)
        change, numbers, time = self._change, self._numbers, self._simulators.sea.time
        if dict(sea_numbers(spec)) != dict(sea_numbers(self._ordered)):
            change = sea_change(self._present, spec, time)
            numbers = {} if change is None else change.at(time)
        self._obey(spec, self._signaled, numbers)
        self._change = change

    def drive(self, values: Mapping[str, float | None]) -> None:
        """Let signals set entries by their paths, in the unit of each; None gives one back to the orders. ScenarioError as of `order`."""
        signaled = {path: value for path, value in (self._signaled | dict(values)).items() if value is not None}
        if signaled != self._signaled:
            self._obey(self._ordered, signaled, self._numbers)

    @property
    def sea(self) -> SeaSettings:
        """The sea as it is now, on its way to what is ordered."""
        return self._present.sea

    def save_state(self) -> dict[str, Any]:
        """Return what signals have set, and a sea on its way, as plain data; nothing where there is none."""
        signaled = {"signaled": dict(self._signaled)} if self._signaled else {}
        if self._change is None:
            return signaled
        return {**signaled, "sea_change": asdict(self._change), "sea_numbers": self._numbers}

    def restore_state(self, state: Mapping[str, Any]) -> None:
        """Go back to the signals and the sea of a state with what `save_state` returned, before the parts are restored."""
        saved = state.get("sea_change")
        self._obey(self._ordered, dict(state.get("signaled", {})), dict(state.get("sea_numbers", {})))
        self._change = None if saved is None else SeaChange(**saved)

    def present_meshes(self) -> dict[str, Trimesh]:
        """Return the meshes [m] of all bodies that the liquid meets, by name, where they are now."""
        world = self._simulators.world
        return {
            solid.name: solid.world_mesh(pose=None if world is None else world.pose(solid.name))
            for solid in self._simulators.solids
            if solid.wetted
        }

    def advance(self) -> None:
        """Order the length of each line at the end of the next communication step, at the speed of its winch; let the sea change."""
        if self._change is not None:
            self._obey(self._ordered, self._signaled, self._change.at(self._simulators.sea.time))
            if self._simulators.sea.time >= self._change.end:
                self._change, self._numbers = None, {}
        world = self._simulators.world
        for name, (wanted, speed) in self._lengths.items():
            assert world is not None, "lines need a world"
            most, present = speed * self._present.run.communication_step, world.lines.length(name)
            world.lines.order_length(name, present + min(max(wanted - present, -most), most))

    def _obey(self, ordered: RunSpec, signaled: dict[str, float], numbers: dict[str, float]) -> None:
        """Bring every part to what is ordered, with the `numbers` of a sea on its way there, and what is signaled over both."""
        scenario = with_numbers(ordered, numbers)
        for path, value in signaled.items():
            table, *keys = path.split(".")
            is_source = table == "emitters" and keys[0] in scenario.sources
            scenario = with_entry(scenario, ["sources" if is_source else table, *keys], value)
        due = {
            control.setter
            for control in CONTROLS
            if _values(control.key, scenario) != _values(control.key, self._present)
        }
        due |= {"pour"} if scenario.sources != self._present.sources else set()
        sea = self._new_sea(scenario) if "change_sea" in due else None  # it may be refused, as pipes may
        pipes, sources = (self._new_pipes(scenario), self._new_sources(scenario)) if "pour" in due else ((), ())
        self._ordered, self._present, self._signaled, self._numbers = ordered, scenario, signaled, numbers
        for setter in SETTERS:
            if setter in due and setter in self._setters:
                self._setters[setter](scenario)
        if "pour" in due:
            self._pour(scenario, pipes, sources)
        if sea is not None:
            self._retune(scenario.vessels, scenario.orbital_speed)
            self._simulators.sea.become(sea)

    def _steer(self, vessels: Mapping[str, VesselSettings], tow: TowSettings | None) -> None:
        """Give the helmsmen their courses.

        The tow's line goes through a vessel's place at the start. Where the tow turns it, or takes the vessel over, that line may be far
        off by now: then it is laid through the vessel's present place. A course of the vessel's own has lines of its own.
        """
        world = self._simulators.world
        for name, helm in self._helms.items():
            present, course = helm.vessel.course, course_of(vessels[name], tow)
            if not isinstance(helm, VesselControl) or course is None or present is None or course == present:
                continue
            last, before = course.legs[-1], present.legs[-1]
            if not vessels[name].follows_tow:
                helm.lay_line(None)
            elif world is not None and (last.heading, last.through) != (before.heading, before.through):
                x, y = world.pose(body_of(name))[:2].tolist()
                helm.lay_line((x, y))
            helm.change_course(course)
        self._scoring.take_orders([helm.vessel for helm in self._helms.values() if isinstance(helm, VesselControl)])

    def _retune(self, vessels: Mapping[str, VesselSettings], speed: float) -> None:
        """Give the helmsmen the gains for the present waves, whose water swings at a speed [m/s]."""
        for name, helm in self._helms.items():
            gains = gains_of(vessels[name], helm.vessel.hull.mass_properties.mass, speed)
            if isinstance(helm, VesselControl) and gains != helm.vessel.gains:
                helm.retune(gains)

    def _push(self, vessels: Mapping[str, VesselSettings]) -> None:
        """Give thrust and steering of vessels without a helmsman."""
        for name, helm in self._helms.items():
            for order in MACHINERY_ORDERS if isinstance(helm, ManualControl) else ():
                helm.set(f"{name}.{order}", np.array(getattr(vessels[name], order)))

    def _run_engines(self, vessels: Mapping[str, VesselSettings]) -> None:
        for name, helm in self._helms.items():
            screws = vessels[name].screws
            helm.vessel = replace(helm.vessel, engine_runs=any(screws), screws=screws)

    def _part(self, booms: Mapping[str, BoomSettings]) -> None:
        """Let the joints of booms part that have parted by order and still hold."""
        for boom, settings in booms.items():
            for number in settings.parted:
                self._strength.part(boom, number)

    def _require_reach(self, ties: Mapping[str, TieSettings]) -> None:
        """Raise ScenarioError for every tie that is made fast now, but whose ends are not within reach."""
        problems = []
        for name in self._fresh_ties(ties):
            assert self._simulators.world is not None  # that has the tie
            distance, tie = self._simulators.world.line_distance(tie_name(name)), ties[name]
            if tie.reach is not None and distance > tie.reach:
                text = f"cannot be true yet: its ends are {distance:.1f} m apart, allowed: within its reach of {tie.reach:g} m"
                problems.append(Problem(f"--set ties.{name}.made_fast", text))
        if problems:
            raise ScenarioError(problems, "oilsim")

    def _fresh_ties(self, ties: Mapping[str, TieSettings]) -> Iterator[str]:
        """Yield the ties that are made fast by order, and are loose in the world."""
        world = self._simulators.world
        for name, tie in ties.items():
            line = None if world is None else world.lines[tie_name(name)]
            if tie.made_fast and isinstance(line, ElasticLine) and not line.made_fast:
                yield name

    def _make_fast(self, scenario: RunSpec) -> None:
        """Make ties fast, and let their winches haul them in."""
        for name in list(self._fresh_ties(scenario.ties)):
            assert self._simulators.world is not None  # that has the tie
            self._simulators.world.make_line_fast(tie_name(name))
        self._haul(scenario)

    def _moor(self, moorings: Mapping[str, MooringSettings], ties: Mapping[str, TieSettings]) -> None:
        """Let mooring legs and ties part, and anchors hold, as ordered."""
        world = self._simulators.world
        if world is None:
            return
        for name, tie in ties.items():
            if tie.parted:
                world.part_line(tie_name(name))
        for name, leg in moorings.items():
            if leg.parted:
                world.part_line(leg_name(name))
            elif leg.holding is not None:
                line = world.lines[leg_name(name)]
                assert isinstance(line, MooringLeg)
                line.anchor = replace(line.anchor, holding=leg.holding)

    def _haul(self, scenario: RunSpec) -> None:
        """Take the lengths to which winches bring tow lines, mooring legs, ties and booms on reels."""
        world, fleet = self._simulators.world, self._simulators.fleet
        if world is None:
            return
        changes = {leg_name(name): (-leg.hauled, leg.winch_speed) for name, leg in scenario.moorings.items()}
        changes |= {tie_name(name): (-tie.hauled, tie.winch_speed) for name, tie in scenario.ties.items()}
        for boom, settings in scenario.booms.items():
            reel, mouth = settings.reel, settings.ends[0]
            if reel is not None and reel.paid_out is not None and not isinstance(mouth, str):
                changes[reel_name(boom)] = reel.paid_out - laid_out(fleet.booms[boom], mouth), reel.winch_speed
            grown = settings.tow_line - self._laid[boom]
            for end, line in fleet.tensions_of(boom).items():
                hauled = scenario.vessels[end].hauled if end in settings.ends else 0.0
                changes.setdefault(line, (grown - hauled, settings.winch_speed))
        fast = {tie_name(name) for name, tie in scenario.ties.items() if tie.made_fast}
        for name, (change, speed) in changes.items():
            is_loose = name in self._waiting and name not in fast
            if name in world.lines.names and not is_loose and (change != 0.0 or name in self._lengths or name in fast):
                self._lengths[name] = world.lines.laid_length(name) + change, speed
        self.advance()

    def _skim(self, settings_of: Mapping[str, SkimmerSettings]) -> None:
        """Let skimmers run or stop, move, pump and store."""
        for one in self._simulators.skimmers:
            ordered = settings_of[one.short_name]
            one.skimmer.is_running = ordered.running
            one.target = np.array([*ordered.place, 0.0])
            one.skimmer.design = ordered.design(one.skimmer.design.water_density)

    def _new_sea(self, scenario: RunSpec) -> Sea:
        """Return the sea as it goes on from the present one; ScenarioError for one that cannot be built."""
        present = self._simulators.sea
        return present.ordered(build_sea(scenario.sea_at(present.now.level), scenario))

    def _new_pipes(self, liquid: RunSpec) -> Sequence[PipeEmitter]:
        """Create the pipes that the fluid does not have yet; ScenarioError for those that reach into a body or out of the tank."""
        fresh = dict(islice(liquid.emitters.items(), len(self._simulators.fluid.emitters), None))
        if fresh:
            problems = list(pipe_problems(replace(liquid, emitters=fresh), self.present_meshes()))
            if problems:
                raise ScenarioError(problems, "oilsim")
        return [pipe_of(settings, liquid.spacing) for settings in fresh.values()]

    def _new_sources(self, liquid: RunSpec) -> Sequence[SpillSource]:
        """Create the sources of oil that the slick does not have yet; none in a run without parcels."""
        for slick in self._simulators.slicks:
            from scenarios.setup.at_sea.parcels import new_sources  # only a run with parcels pays for its kernels

            return new_sources(slick, liquid)
        return []

    def _pour(self, liquid: RunSpec, pipes: Sequence[PipeEmitter], sources: Sequence[SpillSource]) -> None:
        """Add pipes and sources, and let all of them pour as ordered."""
        fluid = self._simulators.fluid
        for pipe in pipes:
            fluid.add_emitter(pipe)
        for emitter, settings in zip(fluid.emitters, liquid.emitters.values(), strict=True):
            emitter.speed = settings.speed
        for slick in self._simulators.slicks:
            from scenarios.setup.at_sea.parcels import rate_of

            slick.sources += sources
            for source in slick.sources:
                source.rate = rate_of(liquid.sources[source.name])


def _values(key: str, scenario: RunSpec) -> list[tuple[str, Any]]:
    return [(path, value) for path, _, value in entries_at(key, scenario)]


NUMBERS = (
    "sea.wind.speed", "sea.wind.direction", "sea.wind.gust_intensity", "sea.current.speed", "sea.current.direction",
    "sea.waves.height", "sea.waves.significant_height", "sea.waves.period", "sea.waves.peak_period", "sea.visibility",
)  # fmt: skip
_FROM_NOTHING = (
    "speed",
    "height",
    "significant_height",
    "gust_intensity",
)  # of wind, current or waves that were not there


@dataclass(frozen=True)
class SeaChange:
    """Numbers of the sea on their way, by their paths: from `before` at `begin` [s] to `after` at `end` [s], linearly in time.

    Directions turn the short way round.
    """

    begin: float
    end: float
    before: Mapping[str, float]
    after: Mapping[str, float]

    def at(self, time: float) -> dict[str, float]:
        """Return the numbers at `time` [s]."""
        share = 1.0 if time >= self.end else max(0.0, (time - self.begin) / (self.end - self.begin))
        return {path: before + share * self._way(path) for path, before in self.before.items()}

    def _way(self, path: str) -> float:
        way = self.after[path] - self.before[path]
        return math.remainder(way, 2.0 * math.pi) if path.endswith(".direction") else way


def sea_change(present: RunSpec, ordered: RunSpec, time: float) -> SeaChange | None:
    """Return the change, from `time` [s] on, of the `present` sea to that of new orders; None if they act at once."""
    within, wanted, now = ordered.sea.within, dict(sea_numbers(ordered)), dict(sea_numbers(present))
    if within == 0.0:
        return None
    begin = {path: now[path] for path in wanted if path in now}
    begin |= {path: 0.0 for path in wanted if path not in now and path.rpartition(".")[2] in _FROM_NOTHING}
    moving = {path: value for path, value in begin.items() if value != wanted[path]}
    return SeaChange(time, time + within, moving, {path: wanted[path] for path in moving}) if moving else None


def with_numbers(scenario: RunSpec, numbers: Mapping[str, float]) -> RunSpec:
    """Return a scenario whose sea has these numbers, by their paths."""
    for path, value in numbers.items():
        scenario = with_entry(scenario, path.split("."), value)
    return scenario


def sea_numbers(scenario: RunSpec) -> Iterator[tuple[str, float]]:
    """Yield the numbers of a scenario's sea that may change gradually, by their paths."""
    for key in NUMBERS:
        for path, _, value in entries_at(key, scenario):
            if isinstance(value, float | int):
                yield path, float(value)
