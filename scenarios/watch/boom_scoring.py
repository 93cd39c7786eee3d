"""The scores of all booms of a run together: each litre counts once, and orders are announced."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from booms.balance import OilBalance, balance, lost_ids
from coupling.bullet.rigid_body_world import RigidBodyWorld
from oilsim import Fluid
from oilsim.core.physical_constants import KNOT
from recordings.model.words import course_in_words, levers_in_words
from scenarios.scenario import Scenario
from scenarios.setup.boom_losses import assumed_tensions, closure_losses
from scenarios.setup.fleet import Fleet
from scenarios.watch.boom_score import Beside, BoomScore, Notice
from scenarios.watch.slick_account import lost_parcels
from vessels.vessel import Vessel

if TYPE_CHECKING:
    from booms.recovery.skimming import SkimmingParticipant
    from coupling.participants.slick import SlickParticipant
    from scenarios.setup.run_sea import RunSea

Array = NDArray[np.float64]


class Scoring:
    """Keeps the accounts of all booms of a run, and what happened to them that is worth a line in the log.

    Only `advance` changes the accounts; the rest reads them.
    """

    def __init__(
        self,
        scenario: Scenario,
        fluid: Fluid,
        world: RigidBodyWorld | None,
        fleet: Fleet,
        level: float,
        sea: RunSea,
        slick: SlickParticipant | None = None,
        skimmers: Sequence[SkimmingParticipant] = (),
    ) -> None:
        """Prepare the accounts; `level` [m] is that of the still water, which `sea` moves, `slick` the oil of a run without particles."""
        self._slick = slick
        named = {skimmer.name.removeprefix("skimmers/"): skimmer for skimmer in skimmers}
        self._skimmers = {boom: [named[n] for n in scenario.skimmers_at(boom) if n in named] for boom in scenario.booms}
        self._fluid = fluid
        self._world = world
        self._level, self._sea = level, sea
        self._oils = [name for name, phase in scenario.phases.items() if phase.is_oil]
        self._bearing = 0.5 * math.pi if scenario.site is None else scenario.site.bearing  # of the x axis, from north
        self._orders = tuple(_orders(fleet.vessels, self._bearing))
        self._announced_until = -math.inf  # [s]
        self._notices: list[Notice] = []
        self.balance: OilBalance | None = None  # without booms, and before the first communication point
        self.booms = tuple(
            BoomScore(name, scenario, layout, fleet.tensions_of(name), closure_losses(scenario, name, layout))
            for name, layout in fleet.booms.items()
        )
        self._notices += [Notice(text, level="info", source="oilsim") for text in assumed_tensions(scenario)]

    def advance(self, time: float) -> None:
        """Take the state at `time` [s] into all accounts."""
        self._announce_orders(time)
        if not self.booms or self._world is None:
            return
        for boom in self.booms:
            boom.lose(time, self._fluid, self._world, self._level)
        oil, sea = self._oil(), self._sea.now
        level = self._level + sea.rise(time)
        current = np.array([*sea.current([level], time)[0], 0.0])
        for boom in self.booms:
            skimmed = sum(float(one.get("oil")) for one in self._skimmers[boom.name])
            boom.advance(time, self._world, oil, level, current, Beside(self._slick, skimmed))
        self.balance = balance([boom.tracker for boom in self.booms], oil[1])

    def series(self) -> dict[str, float]:
        """Return the scores at the last communication point; with several booms, each series carries its boom's name."""
        several = len(self.booms) > 1
        return {
            _of_boom(key, boom.name) if several else key: value
            for boom in self.booms
            for key, value in boom.series().items()
        }

    def take_notices(self) -> Sequence[Notice]:
        """Return and forget the notices since the last call."""
        notices, self._notices = self._notices, []
        return [*notices, *(found for boom in self.booms for found in boom.take_notices())]

    def lost_ids(self) -> dict[str, NDArray[np.uint32]]:
        """Return the ids (N,), increasing, of oil particles that booms have lost and none holds, by cause; each particle once."""
        if self._slick is not None:
            return lost_parcels(self._slick)
        return lost_ids([boom.tracker for boom in self.booms])

    def _announce_orders(self, time: float) -> None:
        """Announce the orders that hold from now on."""
        for start, text in self._orders:
            if self._announced_until < start <= time:
                self._notices.append(Notice(text, level="info", source="orders"))
        self._announced_until = time

    def save_state(self) -> dict[str, Any]:
        """Return all accounts as they stand, as plain data."""
        booms = {boom.name: boom.save_state() for boom in self.booms}
        return {
            "booms": booms,
            "balance": None if self.balance is None else asdict(self.balance),
            "announced_until": self._announced_until,
        }

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Go back to what `save_state` returned; `series` is empty until the next communication point."""
        for boom in self.booms:
            boom.restore_state(saved["booms"][boom.name])
        self.balance = None if saved["balance"] is None else OilBalance(**saved["balance"])
        self._announced_until, self._notices = saved["announced_until"], []

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

    def _oil(self) -> tuple[Array, NDArray[np.uint32]]:
        if not self._oils:
            return np.zeros((0, 3)), np.zeros(0, np.uint32)
        positions = [self._fluid.phase_positions(name) for name in self._oils]
        ids = [self._fluid.phase_ids(name) for name in self._oils]
        return np.concatenate(positions).astype(np.float64), np.concatenate(ids)


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


def _of_boom(key: str, boom: str) -> str:
    """Name a series of one of several booms: ``metrics/oil_inside`` becomes ``metrics/main/oil_inside``."""
    return key.replace("metrics/", f"metrics/{boom}/", 1)
