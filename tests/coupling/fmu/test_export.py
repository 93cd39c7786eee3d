"""FMUs made of participants, for real: the same numbers as the participant itself, rolled back, in one process with others."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Literal

import fmpy
import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu

from coupling.fmu.export import FmuContent, FmuExportError, export_fmu
from coupling.fmu.fmu_participant import FmuParticipant
from coupling.fmu.scalar_model import MODEL_FILE, model_in
from coupling.master.co_simulation import CoSimulation
from coupling.master.errors import CoSimulationError
from coupling.master.participant import Status

Version = Literal[2, 3]

# fails when it is asked for its output in a run, not when it is built
TAUT = """
from coupling.fmu.scalar_model import ScalarModel, given

class Tank(ScalarModel):
    pull = given("N")
    is_running = False

    def enter_initialization_mode(self, start_time):
        self.is_running = True

    def get(self, name):
        if self.is_running:
            raise ValueError("rope is taut")
        return super().get(name)

    def advance(self, time, step_size):
        pass
"""

# half of each step at first, with an event there; the end after 0.1 s
HALTING = """
from coupling.master.participant import Status, StepResult
from coupling.fmu.scalar_model import ScalarModel, given

class Halting(ScalarModel):
    place = given("m")
    rounds = given("1")

    def do_step(self, time, step_size):
        if step_size > 0.03:
            self.place += 0.5 * step_size
            return StepResult(Status.EARLY_RETURN, time + 0.5 * step_size, "half", event_handling_needed=True)
        self.place += step_size
        end = time + step_size
        return StepResult(Status.OK, end, "winch is empty", terminate_simulation=end > 0.09)

    def update_discrete_states(self):
        self.rounds += 1
        return self.rounds % 2 == 1
"""

TANK = '''
from coupling.master.participant import Status, StepResult
from coupling.fmu.scalar_model import ScalarModel, given, parameter, taken

class {name}(ScalarModel):
    """A tank that is filled."""

    inflow = taken("m3/s", 0.5)
    area = parameter("m2", 2.0)
    level = given("m")

    def check(self):
        if not self.area > 0.0:
            raise ValueError("area is %g m2, allowed: above 0" % self.area)

    def advance(self, time, step_size):
        self.level += {sign} step_size * self.inflow / self.area
        if self.level > 10.0:
            raise RuntimeError("tank overflows")

    def do_step(self, time, step_size):
        if self.inflow < 0.0:
            return StepResult(Status.DISCARD, time, "no outflow")
        return super().do_step(time, step_size)
'''


# a step that is too long is found out on the way: FMI 2 leaves it to the master to take it back
STIFF = """
from coupling.master.participant import Status, StepResult
from coupling.fmu.scalar_model import ScalarModel, given, taken

class Stiff(ScalarModel):
    speed = taken("m/s", 1.0)
    place = given("m")

    def do_step(self, time, step_size):
        self.place += step_size * self.speed
        if step_size > 0.03:
            return StepResult(Status.DISCARD, time, "too long")
        return StepResult(Status.OK, time + step_size)
"""


def build(
    folder: Path, version: Version, name: str = "Tank", sign: str = "", text: str = TANK, saves_state: bool = True
) -> Path:
    """The FMU of a tank, which empties if sign is -, or of another model."""
    source = folder / f"{name}.py"
    source.write_text(text.format(name=name, sign=sign))
    path = folder / f"{name}-{version}.fmu"
    content = FmuContent(
        identifier=name,
        factory="coupling.fmu.scalar_model:model_in_folder",
        description="a tank",
        step_size=0.1,
        stop_time=2.0,
        any_step=True,
        saves_state=saves_state,
        files={MODEL_FILE: source},
    )
    export_fmu(content, path, version)
    return path


@pytest.mark.parametrize("version", [2, 3])
def test_fmu_gives_what_its_model_gives_bit_for_bit(tmp_path: Path, version: Version) -> None:
    path = build(tmp_path, version)
    assert validate_fmu(str(path)) == []
    model = model_in(tmp_path / "Tank.py")
    fmu = FmuParticipant("tank", path, {"area": 3.0})
    assert {name: variable.unit for name, variable in fmu.variables.items()} == {
        "inflow": "m3/s",
        "area": "m2",
        "level": "m",
    }
    model.set("area", np.array([3.0]))
    rng = np.random.default_rng(7)
    fmu.enter_initialization_mode(0.0)
    fmu.exit_initialization_mode()
    saved: tuple[object, object] | None = None
    for k, inflow in enumerate(rng.random(20)):
        for one in (fmu, model):
            one.set("inflow", np.array([inflow]))
            assert one.do_step(0.1 * k, 0.1).status is Status.OK
        np.testing.assert_array_equal(fmu.get("level"), model.get("level"))
        if k == 9:
            saved = fmu.save_state(), model.save_state()
    assert saved is not None
    assert isinstance(saved[0], bytes)
    for one, state in ((fmu, saved[0]), (model, saved[1])):
        one.restore_state(state)
        one.do_step(1.0, 0.1)
    np.testing.assert_array_equal(fmu.get("level"), model.get("level"))
    fmu.terminate()


@pytest.mark.parametrize("version", [2, 3])
def test_fmpy_runs_it_by_itself(tmp_path: Path, version: Version) -> None:
    path = build(tmp_path, version)
    result = simulate_fmu(str(path), stop_time=1.0, output_interval=0.1, start_values={"inflow": 0.4})
    assert result["level"][-1] == pytest.approx(1.0 * 0.4 / 2.0)
    description = fmpy.read_model_description(str(path))
    assert (description.modelName, description.description) == ("Tank", "a tank")
    assert description.coSimulation.canGetAndSetFMUstate
    assert description.coSimulation.canHandleVariableCommunicationStepSize
    level = next(variable for variable in description.modelVariables if variable.name == "level")
    assert level.unit == "m"
    assert {unit.name: unit.baseUnit.m for unit in description.unitDefinitions}["m3/s"] == 3


@pytest.mark.parametrize("version", [2, 3])
def test_state_is_promised_only_where_it_can_be_saved(tmp_path: Path, version: Version) -> None:
    fmu = FmuParticipant("tank", build(tmp_path, version, saves_state=False))
    assert fmu.why_not_kept == "it lacks canSerializeFMUState"
    with pytest.raises(NotImplementedError, match=r"'tank': Tank-.\.fmu cannot save its state"):
        fmu.save_state()
    assert FmuParticipant("tank", build(tmp_path, version)).why_not_kept == ""


@pytest.mark.parametrize("version", [2, 3])
def test_an_fmu_that_cannot_save_its_state_though_it_says_so_runs_without(
    tmp_path: Path, version: Version, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Found out once it is initialized; a master that would take it back is told, and goes on."""

    def fail(*_: object) -> None:
        raise FMICallException("GetFMUState", 3)

    fmu = FmuParticipant("tank", build(tmp_path, version))
    monkeypatch.setattr(FMU2Slave if version == 2 else FMU3Slave, "getFMUState", fail)
    run = CoSimulation([fmu], [], 0.1, rolls_back=True)
    assert fmu.why_not_kept == ""
    run.initialize()
    assert fmu.why_not_kept == "GetFMUState failed with status 3 (error)"
    assert "cannot save its state (GetFMUState failed with status 3" in run.rollback_faults["tank"]
    run.run(0.3)
    assert float(fmu.get("level")[0]) == pytest.approx(0.3 * 0.5 / 2.0)
    run.terminate()


FORGETFUL = """
    def save_state(self):
        raise NotImplementedError("there is too much of it")
"""


@pytest.mark.parametrize("version", [2, 3])
def test_an_fmu_that_fails_fatally_at_its_state_is_named(tmp_path: Path, version: Version) -> None:
    run = CoSimulation([FmuParticipant("tank", build(tmp_path, version, text=TANK + FORGETFUL))], [], 0.1)
    with pytest.raises(CoSimulationError, match=r"'tank' failed at 0 s: .*there is too much of it"):
        run.initialize()


@pytest.mark.parametrize("version", [2, 3])
def test_after_a_fatal_error_an_fmu_is_not_called_again(
    tmp_path: Path, version: Version, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not even to end it, which a master does with whoever failed; what it said is told."""
    called: list[str] = []
    run = CoSimulation([FmuParticipant("tank", build(tmp_path, version, text=TAUT))], [], 0.1)
    for call in ("terminate", "freeInstance"):
        for kind in (FMU2Slave, FMU3Slave):
            monkeypatch.setattr(kind, call, lambda fmu, call=call: called.append(call))
    with pytest.raises(
        CoSimulationError, match=r"'tank' failed at 0 s: the output 'pull' cannot be read: .*rope is taut"
    ):
        run.initialize()
    assert called == []


def test_two_fmus_of_one_process_keep_apart(tmp_path: Path) -> None:
    fmus = []
    for version in (3, 2):
        for name, sign in (("Filling", ""), ("Emptying", "-")):
            fmus.append(FmuParticipant(name, build(tmp_path, version, name, sign)))
    for fmu in fmus:
        fmu.enter_initialization_mode(0.0)
        fmu.exit_initialization_mode()
    for fmu in fmus:
        fmu.do_step(0.0, 2.0)
    assert [float(fmu.get("level")[0]) for fmu in fmus] == [0.5, -0.5, 0.5, -0.5]
    for fmu in fmus:
        fmu.terminate()


@pytest.mark.parametrize("version", [2, 3])
def test_failures_are_told_in_the_models_words(tmp_path: Path, version: Version) -> None:
    path = build(tmp_path, version)
    with pytest.raises(RuntimeError, match="area is -1 m2, allowed: above 0"):
        FmuParticipant("tank", path, {"area": -1.0}).enter_initialization_mode(0.0)
    fmu = FmuParticipant("tank", path, {"inflow": 100.0})
    fmu.enter_initialization_mode(0.0)
    fmu.exit_initialization_mode()
    result = fmu.do_step(0.0, 1.0)
    assert result.status is Status.ERROR
    assert "tank overflows" in result.message
    fmu.terminate()


@pytest.mark.parametrize("version", [2, 3])
def test_a_discarded_step_is_a_discarded_step(tmp_path: Path, version: Version) -> None:
    fmu = FmuParticipant("tank", build(tmp_path, version), {"inflow": -1.0})
    fmu.enter_initialization_mode(0.0)
    fmu.exit_initialization_mode()
    result = fmu.do_step(0.0, 0.1)
    assert (result.status, result.last_successful_time) == (Status.DISCARD, 0.0)
    assert "no outflow" in result.message
    fmu.set("inflow", np.array([1.0]))
    assert fmu.do_step(0.0, 0.1).status is Status.OK
    fmu.terminate()


@pytest.mark.parametrize("version", [2, 3])
def test_an_early_return_is_gone_on_from_and_the_end_is_told(tmp_path: Path, version: Version) -> None:
    fmu = FmuParticipant("halting", build(tmp_path, version, "Halting", text=HALTING))
    run = CoSimulation([fmu], [], 0.05)
    run.initialize()
    run.step()
    assert (fmu.get("place")[0], fmu.get("rounds")[0]) == (0.05, 2.0)
    assert run.is_running
    run.run(1.0)
    assert not run.is_running
    assert run.communication_point.index == 2
    assert float(run.outputs("halting")["place"][0]) == pytest.approx(0.1)


def stiff_run(path: Path, rolls_back: bool = False) -> tuple[FmuParticipant, CoSimulation]:
    """A run of an FMU that discards steps; its own time of a step is 0.1 s."""
    fmu = FmuParticipant("stiff", path)
    run = CoSimulation([fmu], [], 0.1, rolls_back=rolls_back)
    run.initialize()
    return fmu, run


@pytest.mark.parametrize("rolls_back", [False, True])
def test_after_a_discard_fmi_2_is_taken_back_for_shorter_steps(tmp_path: Path, rolls_back: bool) -> None:
    fmu, run = stiff_run(build(tmp_path, 2, "Stiff", text=STIFF), rolls_back)
    assert run.rollback_faults == {}
    run.run(0.4)
    assert fmu.get("place") == pytest.approx(0.4, rel=1e-12)
    run.terminate()


def test_fmi_2_goes_as_far_as_it_says_it_can(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fmu, run = stiff_run(build(tmp_path, 2, "Stiff", text=STIFF))
    monkeypatch.setattr(FMU2Slave, "getRealStatus", lambda *_: 0.02)  # PythonFMU can only say that it has not moved
    result = fmu.do_step(0.0, 0.1)
    assert (result.status, result.last_successful_time) == (Status.EARLY_RETURN, 0.02)
    assert fmu.get("place") == pytest.approx(0.02, rel=1e-12)
    run.terminate()


def test_fmi_2_that_says_nothing_of_a_discarded_step_is_rolled_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unknown(*_: object) -> float:
        raise FMICallException("fmi2GetStatus", 2)

    fmu, run = stiff_run(build(tmp_path, 2, "Stiff", text=STIFF))
    for kind in ("getRealStatus", "getBooleanStatus"):
        monkeypatch.setattr(FMU2Slave, kind, unknown)
    run.run(0.4)
    assert fmu.get("place") == pytest.approx(0.4, rel=1e-12)
    run.terminate()


def test_fmi_2_that_discards_and_cannot_be_taken_back_is_named(tmp_path: Path) -> None:
    _, run = stiff_run(without("canGetAndSetFMUstate", build(tmp_path, 2, "Stiff", text=STIFF)))
    message = r"'stiff' failed at 0 s: error: .*discard.*; bare\.fmu cannot be rolled back for a shorter step"
    with pytest.raises(CoSimulationError, match=message):
        run.step()


def test_fmi_2_that_discards_for_it_has_ended_ends_the_run(tmp_path: Path) -> None:
    _, run = stiff_run(without("PythonFMU", build(tmp_path, 2, "Stiff", text=STIFF)))
    run.step()
    assert not run.is_running


def without(word: str, path: Path) -> Path:
    """A copy of an FMU whose description has a word less."""
    bare = path.with_name("bare.fmu")
    with zipfile.ZipFile(path) as whole, zipfile.ZipFile(bare, "w") as copy:
        for item in whole.namelist():
            content = whole.read(item)
            if item == "modelDescription.xml":
                content = content.replace(f'{word}="true"'.encode(), b"").replace(f'"{word} '.encode(), b'"other ')
            copy.writestr(item, content)
    return bare


def test_missing_extra_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("coupling.fmu.export.PACKAGES", {3: "no_such_package"})
    with pytest.raises(
        FmuExportError, match=r"no_such_package is not installed, needed for FMI 3: pip install 'oilsim\[fmu\]'"
    ):
        build(tmp_path, 3)
    assert not list(tmp_path.glob("*.fmu"))


def test_host_without_oilsim_is_told_what_to_install(tmp_path: Path) -> None:
    """The FMU's script in a Python that finds none of our packages."""
    path = build(tmp_path, 3)
    folder = fmpy.extract(str(path), str(tmp_path / "unpacked"))
    script = next((Path(folder) / "resources").glob("oilsim_fmu_*.py"))
    code = f"""
import sys, importlib.abc
class Nothing(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.split('.')[0] == 'coupling':
            raise ModuleNotFoundError(f"No module named {{name!r}}")
sys.meta_path.insert(0, Nothing())
sys.path.insert(0, {str(script.parent)!r})
import {script.stem}
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "this FMU needs oilsim in the Python of its host: pip install oilsim" in done.stderr


@pytest.mark.parametrize("version", [2, 3])
def test_variables_may_have_any_name(tmp_path: Path, version: Version) -> None:
    """Also that of the independent variable of FMI 3, and letters that C does not know."""
    text = """from coupling.fmu.scalar_model import ScalarModel, given, taken

class {name}(ScalarModel):
    größe = taken("m/s", 1.0)
    time = given("s")

    def advance(self, time, step_size):
        self.time = self.größe * (time + step_size)
"""
    fmu = FmuParticipant("odd", build(tmp_path, version, "Odd", text=text))
    assert list(fmu.variables) == ["größe", "time"]
    fmu.enter_initialization_mode(0.0)
    fmu.set("größe", np.array([3.0]))
    fmu.exit_initialization_mode()
    fmu.do_step(0.0, 0.5)
    assert float(fmu.get("time")[0]) == 1.5
    fmu.terminate()


def test_what_cannot_be_an_fmu_is_refused(tmp_path: Path) -> None:
    for name in ("my tank", "True", "Böe"):
        with pytest.raises(ValueError, match=f"identifier of an FMU is '{name}'"):
            FmuContent(identifier=name, factory="", description="", step_size=0.1, stop_time=1.0)
    (tmp_path / "none.py").write_text("x = 1\n")
    with pytest.raises(ValueError, match=r"none\.py defines none, allowed: one subclass"):
        model_in(tmp_path / "none.py")
    (tmp_path / "wrong.py").write_text("x = y\n")
    with pytest.raises(ValueError, match=r"wrong\.py cannot be run: NameError: name 'y' is not defined"):
        model_in(tmp_path / "wrong.py")
    (tmp_path / "odd.py").write_text(TANK.format(name="Odd", sign="").replace("m3/s", "stone"))
    content = FmuContent(
        identifier="Odd",
        factory="coupling.fmu.scalar_model:model_in_folder",
        description="",
        step_size=0.1,
        stop_time=1.0,
        files={MODEL_FILE: tmp_path / "odd.py"},
    )
    with pytest.raises(
        FmuExportError,
        match="cannot build the FMU of Odd: ValueError: unit 'stone' is not known, allowed",
    ):
        export_fmu(content, tmp_path / "odd.fmu", 3)
