"""Quantities: what their limits accept, and how a refusal reads."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest

from oilsim.core.quantity import LARGEST, Quantity, quantities, quantity, quantity_of, require


@dataclass(frozen=True, kw_only=True)
class Pump:
    """A class that declares three quantities."""

    rate: float = quantity("m3/s", default=0.1, at_least=0.0, below=2.0)
    stages: int = quantity("", above=0, at_most=9, whole=True)
    limit: float | None = quantity("Pa", default=None, above=0.0)

    def __post_init__(self) -> None:
        require("pump", Pump, vars(self))


@dataclass(frozen=True, kw_only=True)
class PumpSettings:
    """The same pump, as somebody else lets it be described."""

    flow: float = quantity_of(Pump, "rate")
    stages: int = quantity_of(Pump, "stages", default=3)


@pytest.mark.parametrize(
    ("declared", "words"),
    [
        (Quantity(unit="m"), "finite, in m"),
        (Quantity(), "finite"),
        (Quantity(unit="m", above=0.0), "above 0 m"),
        (Quantity(at_least=1.0), "1 or more"),
        (Quantity(unit="s", above=0.0, below=0.1), "above 0 and below 0.1 s"),
        (Quantity(unit="N", at_least=-2.0, at_most=2.0), "-2 or more and at most 2 N"),
    ],
)
def test_limits_are_told_in_words(declared: Quantity, words: str) -> None:
    assert declared.allowed == words


def test_limits_hold_at_their_ends() -> None:
    open_, closed = Quantity(above=0.0, below=1.0), Quantity(at_least=0.0, at_most=1.0)
    inside, ends = (math.ulp(0.0), 0.5, 1.0 - 2.0**-53), (0.0, 1.0)
    assert all(open_.accepts(number) and closed.accepts(number) for number in inside)
    assert not any(open_.accepts(number) for number in ends)
    assert all(closed.accepts(number) for number in ends)
    assert not any(closed.accepts(number) for number in (-1e-300, 1.0 + 2.0**-52, math.nan, math.inf, -math.inf))


def test_every_fault_is_told_at_once_with_value_limits_and_unit() -> None:
    with pytest.raises(ValueError) as caught:
        Pump(rate=2.0, stages=0)
    assert str(caught.value) == (
        "pump: rate is 2.0, allowed: 0 or more and below 2 m3/s; stages is 0, allowed: above 0 and at most 9"
    )
    for stages in (2.5, "3", True, None):
        with pytest.raises(ValueError, match=r"pump: stages is .*, allowed: a whole number, above 0 and at most 9$"):
            Pump(stages=stages)  # type: ignore[arg-type]
    with pytest.raises(
        ValueError, match=rf"limit is 1e\+13, allowed: magnitudes up to {LARGEST:g}".replace("1e+12", r"1e\+12")
    ):
        Pump(stages=1, limit=1e13)
    assert Pump(stages=np.int64(2), rate=np.float32(0.5)).limit is None  # type: ignore[arg-type]


def test_settings_of_a_quantity_are_those_of_its_owner() -> None:
    assert quantities(PumpSettings) == {"flow": quantities(Pump)["rate"], "stages": quantities(Pump)["stages"]}
    assert PumpSettings() == PumpSettings(flow=0.1, stages=3)
