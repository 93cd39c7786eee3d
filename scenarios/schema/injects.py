"""Injects: orders that a scenario gives itself, at a time, on a condition, or when the instructor says so."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar
from zlib import crc32

import numpy as np

from oilsim.core.quantity import quantity
from scenarios.schema.parsing.quantity_fields import Section
from scenarios.schema.parsing.relations import Relation, at_most_one, exactly_one, only_with, reference
from scenarios.text.problems import Problem


@dataclass(frozen=True, kw_only=True)
class ConditionSettings(Section):
    """A condition on a signal of the run.

    signal        name as of `oilsim signals`, such as ``booms.main.normal_speed_held``
    above, below  number in the signal's unit that it must pass; one of the two
    after         [s] the signal is not looked at before this time
    """

    RELATIONS: ClassVar[tuple[Relation, ...]] = (exactly_one("above", "below"),)
    signal: str
    above: float | None = quantity("", default=None)
    below: float | None = quantity("", default=None)
    after: float = quantity("s", default=0.0, at_least=0.0)

    def is_met_by(self, value: float) -> bool:
        """Return whether a value of the signal has passed the number."""
        return value > self.above if self.above is not None else value < (self.below or 0.0)


@dataclass(frozen=True, kw_only=True)
class InjectSettings(Section):
    """Orders that the scenario gives itself once; without `at` and `when`, they wait for the instructor's order injects.NAME.given=true.

    at      [s] time; or
    when    a condition on a signal; the inject comes when it is met first
    delay   [s] after the condition is met
    spread  [s] the time is earlier or later by up to this, drawn from run.seed
    chance  [1] that the inject comes at all, drawn from run.seed
    orders  texts KEY=VALUE, as for `oilsim order`; they act together
    text    what crews are told, in words of what they notice; without it, they are told nothing
    to      the vessels whose crews are told; by default all
    given   whether it has been given; an order sets it
    """

    RELATIONS: ClassVar[tuple[Relation, ...]] = (
        at_most_one("at", "when"),
        only_with("delay", "when"),
        only_with("spread", "at or when"),
        only_with("to", "text"),
    )
    at: float | None = quantity("s", default=None, at_least=0.0)
    when: ConditionSettings | None = None
    delay: float = quantity("s", default=0.0, at_least=0.0)
    spread: float = quantity("s", default=0.0, at_least=0.0)
    chance: float = quantity("", default=1.0, at_least=0.0, at_most=1.0)
    orders: tuple[str, ...]
    text: str = ""
    to: tuple[str, ...] = reference("vessels", default=())
    given: bool = False

    def problems(self) -> Iterator[Problem]:
        """Check that there are orders."""
        if not self.orders:
            yield Problem("orders", "is empty, allowed: one text KEY=VALUE or more")

    def drawn(self, name: str, seed: int) -> tuple[bool, float]:
        """Return whether the inject of that name comes, and by how much [s] it is early or late, with a run's seed."""
        draws = np.random.default_rng([seed, crc32(name.encode())]).random(2)
        return bool(draws[0] < self.chance), self.spread * (2.0 * float(draws[1]) - 1.0)

    def time_at(self, name: str, seed: int) -> float:
        """Return the time [s] at which the inject comes; infinite if it has none, or does not come."""
        comes, shift = self.drawn(name, seed)
        return max(0.0, self.at + shift) if comes and self.at is not None else math.inf
