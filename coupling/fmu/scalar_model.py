"""A model of a few numbers as a participant: its variables are declared as attributes, its step is one method.

    class Tank(ScalarModel):
        inflow = taken("m3/s")                    # input
        area = parameter("m2", 2.0)               # set before the run
        level = given("m")                        # output

        def advance(self, time: float, step_size: float) -> None:
            self.level += step_size * self.inflow / self.area

Attributes are read and written like numbers. Everything the model remembers lies in declared variables and in other attributes of
its own, so that its state can be saved: numbers, texts, None, arrays of numbers, and lists, tuples and dicts of them, none of which
lies in two places. A model with more than that, a generator of random numbers say, has a `save_state` and `restore_state` of its own;
what never changes may lie in the class.

As a participant every variable has the shape (1,).
"""

from __future__ import annotations

import importlib.util
import itertools
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from coupling.participant import Causality, Status, StepResult, Variable, checked_value, variable_table

Array = npt.NDArray[np.float64]

MODEL_FILE = "model.py"
OWN = ("_name", "_variables", "memory")  # attributes of every model
NUMERIC = "biufc"  # kinds of numbers in arrays
PLAIN = (float, int, bool, str, type(None))
REMEMBERED = "numbers, texts, None, arrays of numbers, and lists, tuples and dicts of them, each in one place"
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

    _name: str
    _variables: Mapping[str, Variable]
    memory: dict[str, float]

    def __init_subclass__(cls) -> None:
        """ValueError for a variable that would hide what every model has."""
        super().__init_subclass__()
        every = {*dir(ScalarModel), *OWN}
        for name, member in vars(cls).items():
            if isinstance(member, Quantity) and name in every:
                others = ", ".join(sorted(one for one in every if not one.startswith("_")))
                raise ValueError(f"variable {name!r} hides what every model has, allowed: a name other than {others}")

    def __new__(cls, *_: object, **__: object) -> Self:
        """Variables are there before `__init__`, which a model may have of its own."""
        model = super().__new__(cls)
        declared = {
            name: member
            for base in reversed(cls.__mro__)
            for name, member in vars(base).items()
            if isinstance(member, Quantity)
        }
        model._name = cls.__name__
        model._variables = variable_table(Variable(name, q.unit, (1,), q.causality) for name, q in declared.items())
        model.memory = {name: q.start for name, q in declared.items()}
        return model

    def __init__(self, name: str = "") -> None:
        self._name = name or self._name

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
        """All that the model remembers, by name; NotImplementedError for an attribute that cannot be saved, see the module."""
        seen: set[int] = set()
        others = {name: value for name, value in vars(self).items() if name not in OWN}
        numbers = {name: _copied(f"{self._name!r}: attribute {name!r}", value, seen) for name, value in others.items()}
        return {"variables": dict(self.memory), "numbers": numbers}

    def restore_state(self, state: object) -> None:
        """Back to what `save_state` returned; what came into being since then is gone."""
        if not isinstance(state, dict):
            raise TypeError(f"{self._name!r}: restore_state wants what save_state returned, not {type(state).__name__}")
        self.memory = dict(state["variables"])
        for name in vars(self).keys() - {*OWN}:
            del vars(self)[name]
        vars(self).update({name: _copied(name, value, set()) for name, value in state["numbers"].items()})

    def terminate(self) -> None:
        """Nothing is held."""


def _copied(what: str, value: Any, seen: set[int]) -> Any:
    """A copy that shares nothing; NotImplementedError for what is no value, or is met again: it would become two."""
    kind = type(value)
    if kind in PLAIN or (isinstance(value, np.generic) and value.dtype.kind in NUMERIC):
        return value
    is_array = kind is np.ndarray and value.dtype.kind in NUMERIC
    keys_fit = kind is not dict or all(type(key) is str for key in value)
    if not (is_array or (kind in (list, tuple, dict) and keys_fit)):
        raise NotImplementedError(f"{what} is or holds a {kind.__name__}, allowed: {REMEMBERED}")
    owner = id(value.base if is_array and value.base is not None else value)
    if owner in seen and kind is not tuple:
        raise NotImplementedError(
            f"{what} is or holds a {kind.__name__} that lies elsewhere too, allowed: {REMEMBERED}"
        )
    seen.add(owner)
    if is_array:
        return value.copy(order="K")
    if kind is dict:
        return {key: _copied(what, item, seen) for key, item in value.items()}
    return kind(_copied(what, item, seen) for item in value)


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
        raise ValueError(f"{path.name} defines {names}, allowed: one subclass of coupling.fmu.scalar_model.ScalarModel")
    kind: type[ScalarModel] = classes[0]
    if kind.advance is ScalarModel.advance and kind.do_step is ScalarModel.do_step:
        raise ValueError(f"{path.name}: {kind.__name__} has no step, allowed: a method `advance`, or `do_step`")
    try:
        return kind()
    except Exception as cause:
        raise ValueError(f"{path.name}: {kind.__name__}() fails: {type(cause).__name__}: {cause}") from cause


def model_in_folder(folder: Path) -> ScalarModel:
    """The model of the file `model.py` in an FMU's folder."""
    return model_in(folder / MODEL_FILE)
