"""Models of a few numbers as participants: attributes declare the variables, and one method makes a step.

    class Tank(ScalarModel):
        inflow = taken("m3/s")                    # input
        area = parameter("m2", 2.0)               # set before the run
        level = given("m")                        # output

        def advance(self, time: float, step_size: float) -> None:
            self.level += step_size * self.inflow / self.area

Attributes are read and written like numbers. A model keeps its whole state in declared variables and other attributes of its own, so that
it can be saved: numbers, texts, None, arrays of numbers, and lists, tuples and dicts of them, none of which is stored in two places. A
model that keeps anything else, such as a random number generator, defines its own `save_state` and `restore_state`. Constants may be
attributes of the class.

As a participant, the model has every variable in the shape (1,) and in its declared unit, as in [m3/s].
"""

from __future__ import annotations

import importlib.util
import itertools
import sys
from pathlib import Path
from typing import Any, Self

import numpy as np

from coupling.master.participant import (
    Causality,
    Participant,
    Status,
    StepResult,
    Variable,
    checked_value,
    variable_table,
)
from oilsim.backend.arrays import Array

MODEL_FILE = "model.py"
OWN = ("name", "variables", "memory")  # attributes of every model
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
    """Declare an input in `unit`; it has the value `start` until it is set."""
    return Quantity(Causality.INPUT, unit, start)


def given(unit: str, start: float = 0.0) -> Quantity:
    """Declare an output in `unit`, with the value `start` at first."""
    return Quantity(Causality.OUTPUT, unit, start)


def parameter(unit: str, start: float) -> Quantity:
    """Declare a parameter in `unit`, with the default value `start`; it is set before the run."""
    return Quantity(Causality.PARAMETER, unit, start)


class ScalarModel(Participant):
    """Base of a model."""

    memory: dict[str, float]

    def __init_subclass__(cls) -> None:
        """Refuse a variable whose name would hide an attribute of every model; ValueError."""
        super().__init_subclass__()
        every = {*dir(ScalarModel), *OWN}
        for name, member in vars(cls).items():
            if isinstance(member, Quantity) and name in every:
                others = ", ".join(sorted(one for one in every if not one.startswith("_")))
                raise ValueError(f"variable {name!r} hides what every model has, allowed: a name other than {others}")

    def __new__(cls, *_: object, **__: object) -> Self:
        """Create the variables before `__init__`, which a model may define itself."""
        model = super().__new__(cls)
        declared = {
            name: member
            for base in reversed(cls.__mro__)
            for name, member in vars(base).items()
            if isinstance(member, Quantity)
        }
        model.name = cls.__name__
        model.variables = variable_table(Variable(name, q.unit, (1,), q.causality) for name, q in declared.items())
        model.memory = {name: q.start for name, q in declared.items()}
        return model

    def __init__(self, name: str = "") -> None:
        self.name = name or self.name

    def check(self) -> None:
        """Refuse impossible parameters by ValueError; called once when the run begins."""

    def advance(self, time: float, step_size: float) -> None:
        """Advance the model from `time` to `time + step_size` [s]: update outputs and memory from the present inputs."""
        raise NotImplementedError

    def enter_initialization_mode(self, start_time: float) -> None:
        """Check the parameters, which are set by now."""
        self.check()

    def get(self, name: str) -> Array:
        """Return a copy of a variable (1,) in its unit; ValueError for a name that is no variable."""
        if name not in self.variables:
            raise ValueError(f"{self.name!r} has no variable {name!r}, allowed: {', '.join(self.variables)}")
        return np.array([self.memory[name]])

    def set(self, name: str, value: Array) -> None:
        """Set an input or a parameter (1,) in its unit; ValueError for an output, an unknown name and another shape."""
        self.memory[name] = float(checked_value(self.name, self.variables, name, value)[0])

    def do_step(self, time: float, step_size: float) -> StepResult:
        """Make a step by `advance`."""
        self.advance(time, step_size)
        return StepResult(Status.OK, time + step_size)

    def save_state(self) -> object:
        """Return the model's whole state by name; NotImplementedError for an attribute that cannot be saved, see the module."""
        seen: set[int] = set()
        others = {name: value for name, value in vars(self).items() if name not in OWN}
        numbers = {name: _copied(f"{self.name!r}: attribute {name!r}", value, seen) for name, value in others.items()}
        return {"variables": dict(self.memory), "numbers": numbers}

    def restore_state(self, state: object) -> None:
        """Go back to a state that `save_state` returned, without attributes added since; TypeError for anything else."""
        if not isinstance(state, dict):
            raise TypeError(f"{self.name!r}: restore_state wants what save_state returned, not {type(state).__name__}")
        self.memory = dict(state["variables"])
        for name in vars(self).keys() - {*OWN}:
            del vars(self)[name]
        vars(self).update({name: _copied(name, value, set()) for name, value in state["numbers"].items()})


def _copied(what: str, value: Any, seen: set[int]) -> Any:
    """Copy a value, deeply; NotImplementedError for other types, and for an object met before, which would become two."""
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
    """Create a model of the one `ScalarModel` that a Python file defines.

    Raises ValueError if the file cannot be run, defines no model or several, or if the model has no step or cannot be created.
    """
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
    """Create the model that the file `model.py` in an FMU's folder defines, as `model_in` does."""
    return model_in(folder / MODEL_FILE)
