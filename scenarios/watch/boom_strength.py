"""Booms part where the tension passes what they or their connectors bear."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from coupling.bullet.rigid_body_world import RigidBodyWorld
from scenarios.schema.exercise import BoomSettings, joint_name
from scenarios.setup.afloat.fleet import Fleet
from scenarios.watch.boom_scoring import Scoring

if TYPE_CHECKING:
    from coupling.participants.slick import SlickParticipant


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
