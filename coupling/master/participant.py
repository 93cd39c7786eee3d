"""The interface of every participant of a coupled run: that of FMI 3 co-simulation, in snake case.

Conventions, for every participant: SI units; world frame with z up; quaternions xyzw; a pose is [x y z qx qy qz qw] of
the centre of mass and the body's axes; a twist is [vx vy vz wx wy wz] and a wrench [fx fy fz tx ty tz], both in the
world frame and about the centre of mass; a wrench is the mean over a communication step (impulse / step size).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any, ClassVar, Literal

import numpy as np

from coupling.master.saved_fields import SavedFields
from coupling.master.units import Unit, read_unit
from oilsim.backend.arrays import Array
from oilsim.core.quantity import Quantity

# name of an array's element that is a variable of its own as well
ELEMENT = re.compile(r"^(?P<name>.+)\[(?P<index>\d+)\]$")


class Causality(Enum):
    """The one who sets a variable: the master (input), the participant in its steps (output) or the user before the run (parameter)."""

    INPUT = "input"
    OUTPUT = "output"
    PARAMETER = "parameter"


class Numbers(Enum):
    """The kind of numbers that a variable holds, from the most to the fewest: each kind can be given where an earlier one is taken."""

    REAL = "real"
    WHOLE = "whole"
    BOOLEAN = "boolean"

    def fits(self, taken: Numbers) -> bool:
        """Tell whether all numbers of this kind are also of the kind `taken`."""
        kinds = list(Numbers)
        return kinds.index(self) >= kinds.index(taken)


@dataclass(frozen=True)
class Variable:
    """One quantity that a participant takes or gives.

    Attributes:
        name: unique in its participant, as in "hull.pose".
        unit: unit as text, as in "N m"; quantities of mixed units name each group ("N, N m"); "1" stands for no unit.
        shape: shape of the array; () for a number, which is passed as a 0-dimensional array.
        causality: see `Causality`.
        is_mean: true for an output that is a mean over the last step, such as an impulse over its duration; if a step is made in
            parts, the master passes on the mean over all of them, so that no impulse is lost.
        si: the unit's relation to SI, if the participant knows more of it than the text says.
        numbers: the kind of numbers it holds (real, whole, or truth values); they are passed as floats all the same.
        limits: of each number of an input or parameter; None: it takes any number.
    """

    name: str
    unit: str
    shape: tuple[int, ...]
    causality: Causality
    is_mean: bool = False
    si: Unit | None = None
    numbers: Numbers = Numbers.REAL
    limits: Quantity | None = None

    @property
    def known_unit(self) -> Unit | None:
        """The unit's relation to SI: `si`, else read from the text; None if the text is not known."""
        return self.si if self.si is not None else read_unit(self.unit)


class Status(Enum):
    """The end of a step; `Participant` says what each value means."""

    OK = "ok"
    EARLY_RETURN = "early return"
    DISCARD = "discard"
    ERROR = "error"


@dataclass(frozen=True)
class StepResult:
    """Result of a step: its status, and the time [s] that the participant has reached.

    message: the reason for a status other than OK, or the event.
    event_handling_needed: discrete states change at that time, see `Participant.update_discrete_states`.
    level: of the event in the run's log.
    terminate_simulation: the participant ends the run; this is no failure.
    cause: the exception that caused an error, if there was one.
    """

    status: Status
    last_successful_time: float
    message: str = ""
    event_handling_needed: bool = False
    terminate_simulation: bool = False
    cause: Exception | None = None
    level: Literal["info", "warning"] = "info"


class Participant(SavedFields):
    """One simulator in a coupled run: the base class of all, which holds values and does nothing else.

    Call order, kept by the master:

    1. `variables` may be read at any time and never changes.
    2. `expect_step(step_size)` once, before the run.
    3. `enter_initialization_mode(start_time)` once; from then on `get` returns the initial outputs.
    4. `set` and `get` in any order, to exchange initial values; outputs that depend on inputs at once follow them.
    5. `exit_initialization_mode()` once.
    6. For every communication step: `observe`, then `set` for connected inputs, then `do_step(time, step_size)`, then `get`. A step may
       be asked for in parts; inputs then hold. Times never decrease; `time` is where the last successful step ended. After a step that
       returns `event_handling_needed`, `update_discrete_states` until it returns False.
    7. `save_state` and `restore_state` between steps only. After a restore the next step begins at the saved time, and
       given the same inputs it gives the same outputs bit for bit.
    8. `terminate()` once, last; also after another participant failed.

    Ownership: `get` returns an array that the caller may keep (the participant will not write into it); `set` copies.

    Failure: `do_step` returns OK when it has reached `time + step_size`; EARLY_RETURN when it stopped before, at
    `last_successful_time`, and asks to be called again from there; DISCARD when it could not do the step and its state
    is as before, and it may be asked for a shorter one; ERROR, or an exception, when it cannot go on, after which only
    `terminate` is called.

    A subclass defines `do_step`, and of the others those in which it has something to do. `STATE` names the fields that `save_state` saves;
    `_values` among them holds each variable's value, 0 at first, which `get` and `set` then serve.
    """

    STATE: ClassVar[tuple[str, ...]] = ("_values",)

    def __init__(self, name: str, variables: Iterable[Variable] = ()) -> None:
        """Take a name that is unique in a run, and the variables; ValueError if two of them have the same name."""
        self.name = name
        self.variables: Mapping[str, Variable] = variable_table(variables)
        if "_values" in self.STATE:
            self._values = {key: np.zeros(variable.shape) for key, variable in self.variables.items()}

    def expect_step(self, step_size: float) -> None:
        """Prepare for whole steps of one and the same `step_size` [s], to the last bit, which differences of times are not."""

    def enter_initialization_mode(self, start_time: float) -> None:
        """Prepare for a run that begins at `start_time` [s]."""

    def exit_initialization_mode(self) -> None:
        """Finish the initialization: the initial inputs are set, and steps follow."""

    def observe(self) -> bool:
        """Read a simulator that others may change between steps; return True if outputs are to be read anew."""
        return False

    def get(self, name: str) -> Array:
        """Return a copy of the variable `name`, an array of its shape, as (6,), in its unit, as [N, N m]; ValueError for another name."""
        values: Mapping[str, Array] = getattr(self, "_values", {})
        if name not in values:
            raise ValueError(f"{self.name!r} has no variable {name!r}, allowed: {', '.join(values) or 'none'}")
        return values[name].copy()

    def set(self, name: str, value: Array) -> None:
        """Set the input or parameter `name` to `value`, of its shape, as (6,), in its unit, as [N, N m]; ValueError if it cannot be."""
        self._values[name] = checked_value(self.name, self.variables, name, value)

    def do_step(self, time: float, step_size: float) -> StepResult:
        """Go from `time` to `time + step_size` [s]."""
        raise NotImplementedError

    def update_discrete_states(self) -> bool:
        """Make one round of event iteration at the present time; return True as long as another round is needed."""
        return False

    def restore_state(self, state: Any) -> None:
        """Go back to what `save_state` returned; errors are those of `SavedFields`, and ValueError for values beyond their limits."""
        if "_values" in self.STATE and isinstance(state, Mapping):
            checked_values(self.name, self.variables, state["values"])
        super().restore_state(state)

    def terminate(self) -> None:
        """Release all resources; no call follows."""


def variable_table(variables: Iterable[Variable]) -> dict[str, Variable]:
    """Return the variables by name; ValueError if two have the same name."""
    table: dict[str, Variable] = {}
    for variable in variables:
        if variable.name in table:
            raise ValueError(f"variable {variable.name!r} is declared twice")
        table[variable.name] = variable
    return table


def array_of(name: str, variables: Mapping[str, Variable]) -> str | None:
    """Return the name of the array that a variable is an element of, as "w" of "w[2]"; None for a variable that is no element.

    A variable of one number is no array, whatever its name.
    """
    match = ELEMENT.match(name)
    array = variables.get(match["name"]) if match else None
    return array.name if array is not None and array.shape not in ((), (1,)) else None


def checked_value(participant: str, variables: Mapping[str, Variable], name: str, value: object) -> Array:
    """Return a float64 copy of `value`, checked to have the shape of the variable `name`, as (6,), in its unit, as [N, N m].

    Raises ValueError for a variable that does not exist or is an output, and for a value of another shape or beyond the variable's limits.
    """
    variable = variables.get(name)
    if variable is None:
        raise ValueError(f"{participant!r} has no variable {name!r}, allowed: {', '.join(variables)}")
    if variable.causality is Causality.OUTPUT:
        raise ValueError(f"{participant!r}: variable {name!r} is an output and cannot be set")
    array = np.array(value, dtype=np.float64)
    if array.shape != variable.shape:
        raise ValueError(f"{participant!r}: variable {name!r} has shape {array.shape}, allowed: {variable.shape}")
    fault = None if variable.limits is None else variable.limits.fault(tuple(array.ravel().tolist()))
    if fault:
        raise ValueError(f"{participant!r}: variable {name!r} {fault}")
    return array


def checked_values(
    participant: str, variables: Mapping[str, Variable], values: Mapping[str, object]
) -> dict[str, Array]:
    """Return copies of a saved value for each of `variables`, of its shape, as (6,), in its unit, as [N, N m], outputs included.

    Each is checked as `checked_value` does. Raises KeyError for a value that is missing.
    """
    as_inputs = {name: replace(variable, causality=Causality.INPUT) for name, variable in variables.items()}
    return {name: checked_value(participant, as_inputs, name, values[name]) for name in variables}
