"""The scores of all booms of a run, its oil ledger, in which each litre counts once, and its orders, which are announced.

Notices tell once a run of each pair of a vessel and what it runs into, and of each sensitive area that oil has come to.

Booms part where the tension passes what they or their connectors bear.
"""

from __future__ import annotations

import math
from collections import ChainMap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from booms.containment import fates_of, particle_rows
from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.participants.slick import SlickParticipant
from oilsim.backend.arrays import Array, Index
from oilsim.core.physical_constants import KNOT
from oilsim.oil.ledger import OilLedger, OilRows
from recordings.model.entity_paths import BOOM, VESSELS
from recordings.model.exercise import is_ground
from recordings.model.words import course_in_words, levers_in_words, volume_in_words
from scenarios.schema.exercise import BoomSettings, joint_name
from scenarios.schema.recovery import SkimmerSettings
from scenarios.setup.afloat.boom_losses import assumed_tensions, closure_losses
from scenarios.setup.afloat.fleet import Fleet
from scenarios.setup.at_sea.land import Corners
from scenarios.setup.simulators import Simulators
from scenarios.spec.resolve import RunSpec
from scenarios.watch.boom_score import BoomScore, Notice, Oil
from scenarios.watch.slick_oil import volume_within
from vessels.vessel import Vessel


class Scoring:
    """Keeps the oil ledger of a run and the scores of its booms, and what happened that is worth a line in the log.

    Only `advance` changes them; the rest reads them.
    """

    def __init__(self, scenario: RunSpec, simulators: Simulators) -> None:
        """Prepare ledger and scores."""
        self._slicks, self._skimmers = simulators.slicks, simulators.skimmers
        named = {skimmer.short_name: skimmer for skimmer in simulators.skimmers}
        self._at_boom = {boom: [named[n] for n in scenario.skimmers_at(boom) if n in named] for boom in scenario.booms}
        world, fleet, level = simulators.world, simulators.fleet, simulators.level
        self._fluid, self._passage = simulators.fluid, simulators.bodies.fluid
        self._world = world
        self._level, self._sea = level, simulators.sea
        self._oils = [name for name, phase in scenario.phases.items() if phase.is_oil]
        self._particle_oils = [] if self._slicks else self._oils
        self._bearing = scenario.bearing  # of the x axis, from north
        self._orders = tuple(_orders(fleet.vessels, self._bearing))
        self._announced_until = -math.inf  # [s]
        self._notices: list[Notice] = []
        self._wind: dict[str, float] = {}  # [m/s] without gusts
        self._collisions = Collisions()
        self._areas = SensitiveAreas(simulators.areas)
        self.ledger = OilLedger()
        self.booms = tuple(
            BoomScore(
                name,
                scenario.booms[name],
                layout,
                fleet.tensions_of(name),
                scenario,
                scenario.sea,
                closure_losses(scenario.booms[name], layout, scenario),
                self.ledger,
            )
            for name, layout in fleet.booms.items()
        )
        assumed = [
            *assumed_tensions(scenario),
            *(_assumed_skimmers(scenario.skimmers) if self._skimmers else ()),
        ]
        self._notices += [Notice(text, level="info", source="oilsim") for text in assumed]

    def advance(self, time: float) -> None:
        """Take the state at `time` [s] into the ledger and all scores."""
        if self._sea.now.description.wind is not None:
            x, y = self._sea.now.mean_wind(time)
            self._wind = {"wind/x": float(x), "wind/y": float(y)}
        self._announce_orders(time)
        if self._world is not None:
            self._notices += self._collisions.notices(self._world.met)
        if self.booms and self._world is not None:
            self._advance_booms(time, self._world)
        self.ledger.close(self._rows())
        self._notices += self._areas.advance(self._slicks)

    @property
    def oil_in_areas(self) -> Mapping[str, float]:
        """The oil [m3] in each sensitive area at the last communication point."""
        return self._areas.oil

    def _advance_booms(self, time: float, world: RigidBodyWorld) -> None:
        sea = self._sea.now
        level = self._level + sea.rise(time)
        for boom in self.booms:
            boom.lose(time, self._fluid, world, level)
        oil = Oil(self._positions(), self._ids(), slicks=self._slicks)
        for boom in self.booms:
            middle = world.poses(boom.segments)[:, :2].mean(axis=0) if sea.description.stream else None
            current = np.array([*sea.current([level], time, middle)[0], 0.0])
            recovered = sum(float(one.get("oil")) for one in self._at_boom[boom.name])
            boom.advance(time, world, oil._replace(recovered=recovered), level, current)

    def _rows(self) -> OilRows:
        """Return all oil by its fate, as its carrier tells it."""
        for one in self._slicks:
            return one.slick.oil
        ids, volume, passage = self._ids(), self._fluid.config.rest_volume, self._passage
        entered, left = (sum(count[name] for name in self._oils) for count in (passage.entered, passage.left))
        spilled = self.ledger.begin_with((len(ids) + left - entered) * volume) + entered * volume
        return particle_rows([boom.containment for boom in self.booms], ids, volume, spilled=spilled, left=left)

    def fates(self, phase: str) -> NDArray[np.uint8] | None:
        """Return the fates (N,) of a phase's particles, codes of `FATES`, in the order of their ids; None of one that is no oil."""
        if phase not in self._oils:
            return None
        return fates_of([boom.containment for boom in self.booms], self._fluid.phase_ids(phase)).fate.astype(np.uint8)

    def series(self) -> dict[str, float]:
        """Return ledger, wind, scores and skimmers at the last communication point; a series of one of several booms carries its name."""
        several = len(self.booms) > 1
        scores = {
            _of_boom(key, boom.name) if several else key: value
            for boom in self.booms
            for key, value in boom.series().items()
        }
        ledger = (self.ledger.rows.series() if self._oils else {}) | self._areas.series() | self._wind
        of_skimmers = (one.series() for one in self._skimmers)
        return scores | {f"metrics/{name}": value for name, value in ledger.items()} | dict(ChainMap(*of_skimmers))

    def held_speeds(self) -> dict[str, float]:
        """Return the speed [m/s] of the water that is held against each segment of a boom, by the names of their bodies."""
        return {
            name: speed for boom in self.booms for name, speed in zip(boom.segments, boom.held.tolist(), strict=True)
        }

    def take_notices(self) -> Sequence[Notice]:
        """Return and forget the notices since the last call."""
        notices, self._notices = self._notices, []
        of_skimmers = [
            Notice(text, level="info", source=f"skimmer {one.short_name}")
            for one in self._skimmers
            for text in one.take_notices()
        ]
        return [*notices, *(found for boom in self.booms for found in boom.take_notices()), *of_skimmers]

    def _announce_orders(self, time: float) -> None:
        """Announce the orders that hold from now on."""
        for start, text in self._orders:
            if self._announced_until < start <= time:
                self._notices.append(Notice(text, level="info", source="orders"))
        self._announced_until = time

    def save_state(self) -> dict[str, Any]:
        """Return ledger and scores as they stand, as plain data."""
        booms = {boom.name: boom.save_state() for boom in self.booms}
        return {
            "booms": booms,
            "ledger": self.ledger.save_state(),
            "announced_until": self._announced_until,
        } | ({"collisions": sorted(self._collisions.told)} if self._collisions.told else {})

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Go back to what `save_state` returned."""
        for boom in self.booms:
            boom.restore_state(saved["booms"][boom.name])
        self.ledger.restore_state(saved["ledger"])
        self._announced_until, self._notices = saved["announced_until"], []
        self._collisions.told = {(one, words) for one, words in saved.get("collisions", [])}

    def take_parting(self, boom: str, number: int, why: str = "") -> None:
        """Announce that a joint of a boom, counted from 1 at its first end, has parted, and why."""
        next(score for score in self.booms if score.name == boom).take_parting(number, why)

    def take_share(self, boom: str, share: float) -> None:
        """Note the largest share [-] of its strength that a boom bears now."""
        next(score for score in self.booms if score.name == boom).strength_share = share

    def take_orders(self, vessels: Iterable[Vessel]) -> None:
        """Announce the orders of these vessels' courses from now on."""
        self._orders = tuple(_orders(vessels, self._bearing))

    def summary(self) -> dict[str, Any]:
        """Return the scores of the run so far, by boom."""
        return {boom.name: boom.summary() for boom in self.booms}

    def _positions(self) -> Array:
        """Return the positions (N, 3) [m] of the oil that is particles."""
        of_oils = [self._fluid.phase_positions(name) for name in self._particle_oils]
        return np.concatenate([np.zeros((0, 3)), *of_oils])

    def _ids(self) -> Index:
        """Return the ids (N,) of the oil that is particles, in the order of its positions."""
        of_oils = [self._fluid.phase_ids(name) for name in self._particle_oils]
        return np.concatenate([np.zeros(0, np.uint32), *of_oils])


def _orders(vessels: Iterable[Vessel], bearing: float) -> Iterator[tuple[float, str]]:
    """Yield the times [s] and texts of orders to vessels on a course; vessels with the same orders at the same time share a line.

    bearing [rad] of the x axis, clockwise from north.
    """
    together: dict[tuple[float, float, float, tuple[float, float] | None], list[str]] = {}
    for vessel in vessels:
        legs = vessel.course.legs if vessel.course else ()
        timed = [
            leg for leg, before in zip(legs, (None, *legs), strict=False) if before is None or before.until is None
        ]
        for leg in timed:
            together.setdefault((leg.start_time, leg.speed, leg.heading, leg.by_hand), []).append(vessel.name)
    for (start, speed, heading, by_hand), names in together.items():
        if by_hand is not None:
            yield start, f"{' and '.join(names)}: {levers_in_words(*by_hand)}, by hand"
        elif speed == 0.0:
            yield start, f"{' and '.join(names)}: hold your places"
        else:
            course = course_in_words(heading, bearing)
            yield start, f"{' and '.join(names)}: make {speed / KNOT:.2f} kn over the ground, heading {course}"


def _assumed_skimmers(skimmers: Mapping[str, SkimmerSettings]) -> Iterator[str]:
    """Yield what is assumed of skimmers, in words."""
    for name, skimmer in skimmers.items():
        if skimmer.assumed:
            listed = (f"{key.replace('_', ' ')} of {value:g}" for key, value in skimmer.assumed.items())
            yield f"skimmer {name!r}: a {' and a '.join(listed)} is assumed for a {skimmer.kind}"


def _of_boom(key: str, boom: str) -> str:
    """Name a series of one of several booms: ``metrics/oil_inside`` becomes ``metrics/main/oil_inside``."""
    return key.replace("metrics/", f"metrics/{boom}/", 1)


class Collisions:
    """The account of what vessels have run into so far, as pairs of a name and words: `told`."""

    def __init__(self) -> None:
        self.told: set[tuple[str, str]] = set()

    def notices(self, met: Iterable[tuple[str, str]]) -> Iterator[Notice]:
        """Yield what is new among pairs of bodies that touch now; "" is a half-space, which is the ground."""
        for pair in sorted(met):
            for one, other in (pair, pair[::-1]):
                if not one.startswith(f"{VESSELS}/") or (other.startswith(f"{VESSELS}/") and other < one):
                    continue
                vessel, words = one.partition("/")[2], _met(other)
                if (vessel, words) not in self.told:
                    self.told.add((vessel, words))
                    yield Notice(f"{vessel} {words}", level="warning", source="vessels")


def _met(body: str) -> str:
    """Write what a vessel does that meets a body."""
    group, _, rest = body.partition("/")
    if not body or is_ground(body):
        return f"runs aground on {rest}" if rest else "runs aground"
    if group == VESSELS:
        return f"and {rest} collide"
    return f"runs into boom {rest.partition('/')[0]}" if group == BOOM else f"runs into {body}"


REACHED = 1e-3  # [m3] in an area from which on its oil is told of; chosen; a litre is seen


class SensitiveAreas:
    """The oil [m3] in each area at the last communication point, afloat and ashore; `advance` changes it."""

    def __init__(self, outlines: Mapping[str, Sequence[Corners]]) -> None:
        """Watch areas by name, each of one outline (K, 2) [m] or more."""
        self.oil = dict.fromkeys(outlines, 0.0)
        self._outlines = {name: [np.array(one) for one in own] for name, own in outlines.items()}
        self._reached = set[str]()

    def advance(self, slicks: Sequence[SlickParticipant]) -> Iterator[Notice]:
        """Take the present oil into account; yield what is told the first time that it is in an area."""
        for name, outlines in self._outlines.items():
            self.oil[name] = sum(volume_within(slick, one) for slick in slicks for one in outlines)
            if self.oil[name] >= REACHED and name not in self._reached:
                self._reached.add(name)
                yield Notice(
                    f"oil has come in: {volume_in_words(self.oil[name])}", level="warning", source=f"area {name}"
                )

    def series(self) -> dict[str, float]:
        """Return the oil [m3] in each area by the names of its series."""
        return {f"areas/{name}/oil": volume for name, volume in self.oil.items()}


class BoomStrength:
    """Compares the tension in each joint of each boom that has a strength, and lets joints part that bear more.

    The tension is the mean over the last communication step. One joint of a boom parts in a step, that which bears most of its strength:
    it relieves the others.
    """

    def __init__(
        self,
        booms: Mapping[str, BoomSettings],
        world: RigidBodyWorld | None,
        fleet: Fleet,
        scoring: Scoring,
        slicks: Sequence[SlickParticipant] = (),
    ) -> None:
        """Watch the joints between the segments of these booms; oil of the `slicks` passes where one parts."""
        self._world, self._scoring, self._slicks = world, scoring, slicks
        self._strengths: dict[str, dict[int, float]] = {}
        for name, settings in booms.items():
            strengths = {number: settings.strength_of(number) for number in range(1, settings.segments)}
            known = {number: strength for number, strength in strengths.items() if strength is not None}
            if known and name in fleet.booms:
                self._strengths[name] = known
        self._connectors = {name: frozenset(booms[name].connectors) for name in self._strengths}
        self._parted: dict[str, list[int]] = {name: [] for name in self._strengths}
        self.peak_share = dict.fromkeys(self._strengths, 0.0)  # [-] largest tension so far, of the strength there

    def advance(self) -> None:
        """Let the joint of each boom part that bears most of its strength, if that is more than all of it."""
        if self._world is None:
            return
        for name, strengths in self._strengths.items():
            shares = self._shares(name, strengths)
            if not shares:
                continue
            number = max(shares, key=lambda joint: shares[joint])
            self.peak_share[name] = max(self.peak_share[name], shares[number])
            self._scoring.take_share(name, shares[number])
            if shares[number] > 1.0:
                self._overload(name, number, shares[number] * strengths[number])

    def part(self, boom: str, number: int, why: str = "") -> None:
        """Let a joint of a boom part that still holds, counted from 1 at the first end, for bodies, oil and accounts."""
        joint = joint_name(boom, number)
        if self._world is None or joint not in self._world.joint_names:
            return
        self._world.part_joint(joint)
        for slick in self._slicks:
            slick.slick.part(boom, number)
        self._scoring.take_parting(boom, number, why)

    def save_state(self) -> dict[str, Any]:
        """Return which joints have parted by their load, and the peaks, as plain data."""
        return {"parted": {name: list(found) for name, found in self._parted.items()}, "peak": dict(self.peak_share)}

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Go back to what `save_state` returned; joints that had parted then part, before the states of world and slick are restored."""
        self.peak_share = dict(saved["peak"])
        for name, numbers in saved["parted"].items():
            self._parted[name] = list(numbers)
            for number in numbers:
                joint = joint_name(name, number)
                if self._world is not None and joint in self._world.joint_names:
                    self._world.part_joint(joint)

    def _shares(self, name: str, strengths: Mapping[int, float]) -> dict[int, float]:
        """Return the share of its strength that each joint bears that still holds."""
        assert self._world is not None, "booms need a world"
        holding = set(self._world.joint_names)
        return {
            number: self._world.tension(joint_name(name, number)) / strength
            for number, strength in strengths.items()
            if joint_name(name, number) in holding
        }

    def _overload(self, name: str, number: int, tension: float) -> None:
        self._parted[name].append(number)
        what = "its connector has failed" if number in self._connectors[name] else "it has broken"
        strength = self._strengths[name][number]
        self.part(name, number, f"{what}: {_kilonewtons(tension)} are more than {_kilonewtons(strength)}")


def _kilonewtons(force: float) -> str:
    """Write a force [N] in kN, with three figures."""
    return f"{np.format_float_positional(force / 1e3, precision=3, fractional=False, trim='-')} kN"
