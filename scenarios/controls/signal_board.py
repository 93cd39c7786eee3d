"""Signals as a participant, to which a scenario's FMUs are connected."""

from __future__ import annotations

from collections.abc import Mapping
from typing import cast

import numpy as np
from numpy.typing import NDArray

from coupling.master.participant import (
    Causality,
    Participant,
    Status,
    StepResult,
    Variable,
    checked_value,
    variable_table,
)
from scenarios.controls.signals import RunParts, Signal

Array = NDArray[np.float64]


def signal_variables(signals: Mapping[str, Signal]) -> dict[str, Variable]:
    """Turn signals into variables of shape (1,)."""
    return variable_table(
        Variable(
            signal.name,
            signal.unit,
            (1,),
            Causality.INPUT if signal.is_input else Causality.OUTPUT,
            limits=signal.limits,
        )
        for signal in signals.values()
    )


class SignalBoard(Participant):
    """Reads outputs from the parts of a run as they are and puts inputs into effect at once; keeps the contract of a participant.

    A run has two: `ORDER_BOARD` takes what FMUs drive, before the parts step; `READING_BOARD` gives what feeds them, after.

    An input that is never set leaves the run to the scenario and its orders; one that has been set rules from then on.
    """

    STATE = ()

    def __init__(self, name: str, signals: Mapping[str, Signal], parts: RunParts) -> None:
        super().__init__(name, signal_variables(signals).values())
        self._signals = dict(signals)
        self._parts = parts
        self._given: dict[str, float] = {}

    def get(self, name: str) -> Array:
        """Return a signal (1,) in its unit, for an input the value last set; ValueError for an output that is not known."""
        signal = self._signals.get(name)
        if signal is None:
            raise ValueError(f"the run has no signal {name!r}, allowed: {', '.join(self._signals)}")
        return np.array([self._given.get(name, signal.start) if signal.read is None else signal.read(self._parts)])

    def set(self, name: str, value: Array) -> None:
        """Set an input (1,) in its unit; ValueError for a number beyond the limits of its key in a scenario file."""
        number = float(checked_value(self.name, self.variables, name, value)[0])
        self._parts.drive({name: number})
        self._given[name] = number

    def do_step(self, time: float, step_size: float) -> StepResult:
        """Do nothing: inputs are in effect already."""
        return StepResult(Status.OK, time + step_size)

    def save_state(self) -> object:
        """Return the values of the inputs that have been set."""
        return dict(self._given)

    def restore_state(self, state: object) -> None:
        """Go back to a state that `save_state` returned; ValueError for a number beyond its limits."""
        given = {
            name: float(checked_value(self.name, self.variables, name, [value])[0])
            for name, value in cast(dict[str, float], state).items()
        }
        self._parts.drive(dict.fromkeys(self._given) | given)
        self._given = given
