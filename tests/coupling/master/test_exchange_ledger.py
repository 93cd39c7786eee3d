"""The ledger of what passes between fluid and bodies finds what is lost on the way, in every component."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, cast

import pytest

from coupling.master.algorithms import Steppers
from coupling.master.errors import CoSimulationError
from coupling.master.exchange_ledger import BodyBond, ExchangeLedger

STILL = (0.0,) * 6
LENGTH, STEP = 0.1, 0.01


def closed(given: tuple[float, ...], taken: tuple[float, ...], predicted: tuple[float, ...] = STILL) -> ExchangeLedger:
    """A ledger after one step, in which a body at rest was given one wrench and took another."""
    ledger = ExchangeLedger([BodyBond("raft", "fluid", "bodies")], LENGTH)
    fluid: Any = SimpleNamespace(outputs={"raft.wrench": given, "raft.predicted_twist": predicted}, inputs={})
    bodies: Any = SimpleNamespace(outputs={"raft.twist": STILL}, inputs={"raft.wrench": taken})
    steppers = cast(Steppers, {"fluid": fluid, "bodies": bodies})
    ledger.open(steppers)
    ledger.close(steppers, 0.0, STEP)
    return ledger


def test_what_arrives_whole_passes() -> None:
    wrench = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    assert closed(wrench, wrench).momentum_residual == 0.0
    closed(wrench, tuple(value * (1.0 + 1e-9) for value in wrench))
    # a torque of 0 but for what rounding makes of a force
    closed((1.0, 0.0, 0.0, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0, 0.5e-6 * LENGTH, 0.0))


@pytest.mark.parametrize("component", range(6))
def test_what_is_lost_is_found_in_every_component(component: int) -> None:
    given = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    taken = given.copy()
    taken[component] += 1e-5
    with pytest.raises(
        CoSimulationError,
        match=r"'raft' took an impulse of .* N m s, but the fluid gave .* allowed: a relative difference of 1e-06",
    ):
        closed(tuple(given), tuple(taken))


def test_no_number_is_no_balance() -> None:
    wrench = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for given, taken in (((math.nan,) * 6, (math.nan,) * 6), (wrench, (math.nan,) * 6)):
        with pytest.raises(CoSimulationError, match="'raft' took an impulse of"):
            closed(given, taken)
    with pytest.raises(CoSimulationError, match="'raft': the exchange has created nan J"):
        closed(wrench, wrench, predicted=(math.nan,) * 6)
