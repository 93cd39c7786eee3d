"""Models of a few numbers: what they remember, and what is no model."""

from __future__ import annotations

from collections import deque
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from coupling.fmu.fmu_participant import FmuParticipant
from coupling.fmu.scalar_model import ScalarModel, given, model_in, parameter, taken
from coupling.master.co_simulation import CoSimulation
from recordings.files.checkpoint import state_from_bytes, state_to_bytes
from scenarios.cli import main


def test_files_may_define_dataclasses_and_models_of_one_name(tmp_path: Path) -> None:
    """A dataclass looks its annotations up in the module that it was defined in."""
    text = """from __future__ import annotations
from dataclasses import dataclass
from typing import ClassVar
from coupling.fmu.scalar_model import ScalarModel, given

@dataclass
class Pipe:
    kind: ClassVar[str] = "steel"
    length: float = {length}

class Model(ScalarModel):
    length = given("m", Pipe().length)

    def advance(self, time, step_size):
        pass
"""
    models = []
    for name, length in (("short", 2.0), ("long", 30.0)):
        (tmp_path / f"{name}.py").write_text(text.format(length=length))
        models.append(model_in(tmp_path / f"{name}.py"))
    assert [float(model.get("length")[0]) for model in models] == [2.0, 30.0]
    assert type(models[0]) is not type(models[1])


def test_models_may_inherit_their_variables() -> None:
    class Base(ScalarModel):
        first = taken("m")
        second = parameter("m", 1.0)

    class Derived(Base):
        third = given("m")

    assert list(Derived().variables) == ["first", "second", "third"]


def test_plain_numbers_of_a_model_are_part_of_its_state() -> None:
    class Counter(ScalarModel):
        sum = given("m")

        def __init__(self) -> None:
            super().__init__()
            self.last, self._count, self.is_odd = 1.0, 0, False

        def advance(self, time: float, step_size: float) -> None:
            self.last, self._count, self.is_odd = 2.0 * self.last, self._count + 1, not self.is_odd
            self.sum += self.last + self._count

    run = CoSimulation([counter := Counter()], [], 0.1, rolls_back=True)
    run.initialize()
    assert run.rollback_faults == {}
    run.run(0.3)
    saved = run.save_state()
    run.run(0.5)
    after = (counter.sum, counter.last, counter._count, counter.is_odd)
    run.restore_state(saved)
    assert (counter.last, counter._count, counter.is_odd) == (8.0, 3, True)
    run.run(0.5)
    assert (counter.sum, counter.last, counter._count, counter.is_odd) == after


# gives its clock five steps late
DELAY = """
import numpy as np
from coupling.fmu.scalar_model import ScalarModel, given

class Delay(ScalarModel):
    late = given("s")
    mean = given("s")

    def __init__(self):
        super().__init__()
        self.queue, self.window, self.last, self.count = [0.0] * 5, np.zeros((2, 3)), None, np.int64(0)
        self.seen = {"mode": ("first", [1])}

    def advance(self, time, step_size):
        self.queue.append(time + step_size)
        self.late = self.queue.pop(0)
        self.window[self.count % 2, self.count % 3] = self.late
        self.mean = self.window.mean() + (self.last or 0.0) + len(self.seen["mode"][1])
        self.count += 1
        self.last = self.late
        self.seen["mode"][1].append(1)
"""


def outputs_of_steps(participant: Any, begin: int, end: int) -> list[tuple[float, float]]:
    values = []
    for k in range(begin, end):
        participant.do_step(0.1 * k, 0.1)
        values.append((float(participant.get("late")[0]), float(participant.get("mean")[0])))
    return values


def test_a_model_remembers_lists_arrays_and_texts(tmp_path: Path) -> None:
    """Taken back, through a checkpoint, and into another model."""
    (tmp_path / "delay.py").write_text(DELAY)
    model, other = model_in(tmp_path / "delay.py"), model_in(tmp_path / "delay.py")
    outputs_of_steps(model, 0, 8)
    state = model.save_state()
    stored = state_from_bytes(state_to_bytes({"model": state}))["model"]
    after = outputs_of_steps(model, 8, 20)
    for one, saved in ((model, state), (model, state), (other, stored)):
        one.restore_state(saved)
        assert outputs_of_steps(one, 8, 20) == after


def test_a_rollback_is_exact_whatever_a_model_remembers(tmp_path: Path) -> None:
    (tmp_path / "delay.py").write_text(DELAY)
    given_late = []
    for rolls_back in (False, True):
        run = CoSimulation([model_in(tmp_path / "delay.py")], [], 0.1, rolls_back=rolls_back)
        run.initialize()
        assert run.rollback_faults == {}
        run.run(1.0)
        given_late.append(float(run.outputs("Delay")["late"][0]))
    assert given_late[0] == given_late[1] == pytest.approx(0.5)


@pytest.mark.parametrize("version", [2, 3])
def test_the_fmu_of_a_model_with_a_list_can_be_rolled_back(tmp_path: Path, version: int) -> None:
    (tmp_path / "delay.py").write_text(DELAY)
    path = tmp_path / "delay.fmu"
    assert main(["build-fmu", str(tmp_path / "delay.py"), "--fmi", str(version), "-o", str(path)]) == 0
    fmu = FmuParticipant("delay", path)
    fmu.enter_initialization_mode(0.0)
    fmu.exit_initialization_mode()
    outputs_of_steps(fmu, 0, 8)
    state = fmu.save_state()
    assert isinstance(state, bytes)
    after = outputs_of_steps(fmu, 8, 14)
    fmu.restore_state(state)
    assert outputs_of_steps(fmu, 8, 14) == after
    fmu.terminate()


class Shared(ScalarModel):
    """Two lists that are one, which a restored model would not know."""

    level = given("m")

    def __init__(self) -> None:
        super().__init__()
        self.first = [0.0]
        self.second = {"list": self.first}


@pytest.mark.parametrize(
    ("value", "told"),
    [
        (deque([0.0]), "'memo' is or holds a deque, allowed: numbers, texts, None, arrays of numbers, and lists"),
        ([1.0, {2.0}], "'memo' is or holds a set"),
        ({3: 1.0}, "'memo' is or holds a dict"),
        (np.array([None]), "'memo' is or holds a ndarray"),
        (np.random.default_rng(1), "'memo' is or holds a Generator"),
    ],
)
def test_what_cannot_be_saved_is_refused_by_name(value: object, told: str) -> None:
    model = Shared()
    del model.second
    model.memo = value  # type: ignore[attr-defined]
    with pytest.raises(NotImplementedError, match=f"'Shared': attribute {told}"):
        model.save_state()


def test_what_lies_in_two_places_is_refused() -> None:
    model = Shared()
    with pytest.raises(
        NotImplementedError, match="'Shared': attribute 'second' is or holds a list that lies elsewhere"
    ):
        model.save_state()
    array = np.zeros(6)
    model.first, model.second = array[:3], array[3:]  # type: ignore[assignment]
    with pytest.raises(NotImplementedError, match="'second' is or holds a ndarray that lies elsewhere too"):
        model.save_state()


def test_what_came_after_a_saved_state_goes_with_it() -> None:
    model = Shared()
    del model.second
    state = model.save_state()
    model.late = 1.0  # type: ignore[attr-defined]
    model.restore_state(state)
    assert not hasattr(model, "late")


MODEL = """
from collections import deque
from coupling.fmu.scalar_model import ScalarModel, given

class Model(ScalarModel):
    {text}
    level = given("m")
"""
ADVANCE = """
    def advance(self, time, step_size):
        self.level += step_size
"""


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "Model has no step, allowed: a method `advance`, or `do_step`"),
        ("def __init__(self, mass): pass" + ADVANCE, r"Model() fails: TypeError: Model.__init__() missing 1 required"),
        ("def __init__(self): self.k = 1 / 0" + ADVANCE, "Model() fails: ZeroDivisionError: division by zero"),
        ("def __init__(self): self.queue = deque()" + ADVANCE, "'Model': attribute 'queue' is or holds a deque, allowed"),
        *(
            (f'{name} = given("m")' + ("" if name == "advance" else ADVANCE), f"variable {name!r} hides what every model has")
            for name in ("memory", "name", "variables", "get", "set", "do_step", "check", "save_state", "terminate", "advance")
        ),
    ],
)  # fmt: skip
def test_what_is_no_model_is_one_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, told: str
) -> None:
    (tmp_path / "model.py").write_text(MODEL.format(text=text))
    assert main(["build-fmu", str(tmp_path / "model.py"), "-o", str(tmp_path / "model.fmu")]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert error.startswith("oilsim: 1 problem\n")
    assert not (tmp_path / "model.fmu").exists()


@pytest.mark.parametrize(
    "text", ['"""   """', "def __init__(self): self.level = 2.0"], ids=["blank docstring", "no super().__init__()"]
)
def test_a_model_needs_no_docstring_and_no_call_of_its_base(tmp_path: Path, text: str) -> None:
    (tmp_path / "model.py").write_text(MODEL.format(text=text) + ADVANCE)
    assert main(["build-fmu", str(tmp_path / "model.py"), "-o", str(tmp_path / "model.fmu")]) == 0
    fmu = FmuParticipant("model", tmp_path / "model.fmu")
    fmu.enter_initialization_mode(0.0)
    fmu.exit_initialization_mode()
    before = fmu.get("level")[0]
    fmu.do_step(0.0, 0.5)
    assert fmu.get("level")[0] == before + 0.5
    fmu.terminate()
