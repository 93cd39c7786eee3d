"""The smallest participant that has a state, for tests of the master."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from coupling.master.participant import Causality, Participant, Status, StepResult, Variable, checked_value
from oilsim.backend.arrays import Array


class Accumulator(Participant):
    """dy/dt = u, exactly, for an input held over the step; writes every call it gets into a shared log.

    Output `mean` is y's mean over the step. `on_step` may answer a step in its place.
    """

    STATE = ("output", "mean")

    def __init__(self, name: str, log: list[tuple[object, ...]], shape: tuple[int, ...] = (), unit: str = "m") -> None:
        super().__init__(
            name,
            [
                Variable("u", unit, shape, Causality.INPUT),
                Variable("y", unit, shape, Causality.OUTPUT),
                Variable("mean", unit, shape, Causality.OUTPUT, is_mean=True),
            ],
        )
        self.log = log
        self.input = np.zeros(shape)
        self.output = np.ones(shape)
        self.mean = np.ones(shape)
        self.on_step: Callable[[float, float], StepResult | None] = lambda time, step_size: None

    def enter_initialization_mode(self, start_time: float) -> None:
        self.log.append((self.name, "enter", start_time))

    def exit_initialization_mode(self) -> None:
        self.log.append((self.name, "exit"))

    def get(self, name: str) -> Array:
        return np.copy(self.output if name == "y" else self.mean)

    def set(self, name: str, value: Array) -> None:
        self.input = checked_value(self.name, self.variables, name, value)

    def do_step(self, time: float, step_size: float) -> StepResult:
        self.log.append((self.name, "step", time, step_size))
        result = self.on_step(time, step_size)
        if result is not None and result.status in (Status.ERROR, Status.DISCARD):
            return result
        done = step_size if result is None else result.last_successful_time - time
        self.mean = self.output + 0.5 * done * self.input
        self.output = self.output + done * self.input
        return result or StepResult(Status.OK, time + step_size)

    def terminate(self) -> None:
        self.log.append((self.name, "terminate"))
