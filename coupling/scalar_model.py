"""A model of a few numbers as a participant: its variables are declared as attributes, its step is one method.

    class Tank(ScalarModel):
        inflow = taken("m3/s")                    # input
        area = parameter("m2", 2.0)               # set before the run
        level = given("m")                        # output

        def advance(self, time: float, step_size: float) -> None:
            self.level += step_size * self.inflow / self.area

Attributes are read and written like numbers. Everything the model remembers lies in declared variables and in other attributes
that are plain numbers (float, int, bool), set in `__init__`, so that its state can be saved.

As a participant every variable has the shape (1,).
"""

from __future__ import annotations

import importlib.util
import itertools
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt

from coupling.participant import Causality, Status, StepResult, Variable, checked_value, variable_table

Array = npt.NDArray[np.float64]

MODEL_FILE = "model.py"
_loads = itertools.count(1)  # files loaded so far: two may define models of one name


class Quantity:
    """One declared variable; see `taken`, `given`, `parameter`."""

    def __init__(self, causality: Causality, unit: str, start: float) -> None:
        self.causality, self.unit, self.start = causality, unit, start
        self.name = ""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __get__(self, model: ScalarModel, owner: type) -> float:
        return model.memory[self.name]

    def __set__(self, model: ScalarModel, value: float) -> None:
        model.memory[self.name] = float(value)


def taken(unit: str, start: float = 0.0) -> Quantity:
    """An input; `start` holds until it is set."""
    return Quantity(Causality.INPUT, unit, start)


def given(unit: str, start: float = 0.0) -> Quantity:
    """An output."""
    return Quantity(Causality.OUTPUT, unit, start)


def parameter(unit: str, start: float) -> Quantity:
    """A parameter, set before the run."""
    return Quantity(Causality.PARAMETER, unit, start)


class ScalarModel:
    """Base of a model; keeps the contract of `coupling.participant.Participant`."""

    def __init__(self, name: str = "") -> None:
        self._name = name or type(self).__name__
        declared = {
            name: member
            for base in reversed(type(self).__mro__)
            for name, member in vars(base).items()
            if isinstance(member, Quantity)
        }
        self._variables = variable_table(Variable(name, q.unit, (1,), q.causality) for name, q in declared.items())
        self.memory: dict[str, float] = {name: q.start for name, q in declared.items()}

    @property
    def name(self) -> str:
        """See `Participant`."""
        return self._name

    @property
    def variables(self) -> Mapping[str, Variable]:
        """In the order they are declared."""
        return self._variables

    def check(self) -> None:
        """Refuse impossible parameters by ValueError; called once when the run begins."""

    def advance(self, time: float, step_size: float) -> None:
        """From `time` to `time + step_size` [s]: change outputs and memory by the inputs as they are."""
        raise NotImplementedError

    def enter_initialization_mode(self, start_time: float) -> None:
        """Parameters are set by now."""
        self.check()

    def exit_initialization_mode(self) -> None:
        """Nothing is left to do."""

    def get(self, name: str) -> Array:
        """A fresh copy of a variable (1,)."""
        if name not in self._variables:
            raise ValueError(f"{self._name!r} has no variable {name!r}, allowed: {', '.join(self._variables)}")
        return np.array([self.memory[name]])

    def set(self, name: str, value: Array) -> None:
        """Set an input or a parameter."""
        self.memory[name] = float(checked_value(self._name, self._variables, name, value)[0])

    def do_step(self, time: float, step_size: float) -> StepResult:
        """See `advance`."""
        self.advance(time, step_size)
        return StepResult(Status.OK, time + step_size)

    def save_state(self) -> object:
        """All that the model remembers, by name: its variables, and other attributes that are plain numbers."""
        numbers = {name: value for name, value in vars(self).items() if isinstance(value, float | int)}
        return {"variables": dict(self.memory), "numbers": numbers}

    def restore_state(self, state: object) -> None:
        """Back to what `save_state` returned."""
        if not isinstance(state, dict):
            raise TypeError(f"{self._name!r}: restore_state wants what save_state returned, not {type(state).__name__}")
        self.memory = dict(state["variables"])
        vars(self).update(state["numbers"])

    def terminate(self) -> None:
        """Nothing is held."""


def model_in(path: Path) -> ScalarModel:
    """A model of the one class that a Python file defines; ValueError if it defines none or several."""
    spec = importlib.util.spec_from_file_location(f"oilsim_model_{next(_loads)}", path)
    if spec is None or spec.loader is None:
        raise ValueError(f"{path} cannot be read, allowed: a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # where dataclasses look their annotations up
    try:
        spec.loader.exec_module(module)
    except Exception as cause:
        del sys.modules[spec.name]
        raise ValueError(f"{path.name} cannot be run: {type(cause).__name__}: {cause}") from cause
    classes = [
        member
        for member in vars(module).values()
        if isinstance(member, type) and issubclass(member, ScalarModel) and member.__module__ == spec.name
    ]
    if len(classes) != 1:
        names = ", ".join(found.__name__ for found in classes) or "none"
        raise ValueError(f"{path.name} defines {names}, allowed: one subclass of coupling.scalar_model.ScalarModel")
    model: ScalarModel = classes[0]()
    return model


def model_in_folder(folder: Path) -> ScalarModel:
    """The model of the file `model.py` in an FMU's folder."""
    return model_in(folder / MODEL_FILE)
