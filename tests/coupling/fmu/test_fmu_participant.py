"""Real FMUs, built here from Python sources, as participants: FMI 2 and FMI 3."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fmpy.fmi3 import FMU3Slave

from coupling.fmu import trial_process
from coupling.fmu.fmu_participant import FmuParticipant
from coupling.master.co_simulation import CoSimulation
from coupling.master.connection import Connection
from coupling.master.errors import CoSimulationError, CouplingSetupError
from coupling.master.participant import Causality

# A tow winch: it reels in at a commanded speed, and its brake slips in proportion to the pull beyond what it holds.
# length' = -speed + max(tension - holding, 0) / slip
WINCH_2 = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real, Boolean

class Winch(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.tension, self.speed, self.holding, self.slip, self.length, self.locked = 0.0, 0.0, 1000.0, 500.0, 50.0, False
        self.force = [0.0, 0.0, 0.0]
        for name in ("tension", "speed"):
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        self.register_variable(Boolean("locked", causality=Fmi2Causality.input))
        for name in ("holding", "slip"):
            self.register_variable(Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable))
        self.register_variable(Real("length", causality=Fmi2Causality.output))
        for k in range(3):
            self.register_variable(Real(f"force[{k + 1}]", causality=Fmi2Causality.output,
                                        getter=lambda k=k: self.force[k], setter=lambda v, k=k: None))

    def do_step(self, current_time, step_size):
        if self.tension > 1e6:
            raise RuntimeError("rope parted")
        if not self.locked:
            self.length += step_size * (-self.speed + max(self.tension - self.holding, 0.0) / self.slip)
        self.force = [self.tension, 2.0 * self.tension, -self.tension]
        return True
"""

WINCH_3 = """
from pythonfmu3 import Fmi3Slave, Fmi3Causality, Fmi3Variability, Float64, Fmi3StepResult, Fmi3Status

class WinchThree(Fmi3Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.time, self.tension, self.speed, self.holding, self.slip, self.length = 0.0, 0.0, 0.0, 1000.0, 500.0, 50.0
        self.register_variable(Float64("time", causality=Fmi3Causality.independent, variability=Fmi3Variability.continuous))
        for name in ("tension", "speed"):
            self.register_variable(Float64(name, causality=Fmi3Causality.input))
        for name in ("holding", "slip"):
            self.register_variable(Float64(name, causality=Fmi3Causality.parameter, variability=Fmi3Variability.tunable))
        self.register_variable(Float64("length", causality=Fmi3Causality.output))

    def do_step(self, current_time, step_size):
        self.length += step_size * (-self.speed + max(self.tension - self.holding, 0.0) / self.slip)
        return Fmi3StepResult(status=Fmi3Status.ok)
"""

Build = Callable[[int], Path]


@pytest.fixture(scope="module")
def build(tmp_path_factory: pytest.TempPathFactory) -> Build:
    """Builds the winch for FMI 2 or 3, once each."""
    folder = tmp_path_factory.mktemp("fmus")

    def make(version: int) -> Path:
        package, source = ("pythonfmu", WINCH_2) if version == 2 else ("pythonfmu3", WINCH_3)
        target = folder / str(version)
        if not target.is_dir():
            target.mkdir()
            script = target / f"winch_{version}.py"  # Python keeps one module of a name in a process
            script.write_text(source)
            handling = ["--handle-state", "--serialize-state"] if version == 2 else ["--handle-state"]
            command = [sys.executable, "-m", package, "build", "-f", str(script), "-d", str(target), *handling]
            subprocess.run(command, check=True, capture_output=True)
        return next(target.glob("*.fmu"))

    return make


@pytest.mark.parametrize("version", [2, 3])
def test_winch_pays_out_and_reels_in(build: Build, version: int) -> None:
    # length = 50 - 0.5 t + (1800 - 1000) / 400 t
    winch = FmuParticipant("winch", build(version), {"slip": 400.0})
    run = CoSimulation([winch], [], 0.1)
    run.initialize()
    assert winch.get("length") == pytest.approx(50.0)
    winch.set("speed", np.array([0.5]))
    winch.set("tension", np.array([1800.0]))
    run.run(2.0)
    assert winch.get("length") == pytest.approx(50.0 - 1.0 + 4.0, abs=1e-9)
    run.terminate()
    with pytest.raises(RuntimeError, match="'winch' is not running"):
        winch.get("length")


@pytest.mark.parametrize("version", [2, 3])
def test_state_of_an_fmu_repeats(build: Build, version: int) -> None:
    winch = FmuParticipant("winch", build(version))
    winch.enter_initialization_mode(0.0)
    winch.exit_initialization_mode()
    winch.set("speed", np.array([0.37]))
    winch.do_step(0.0, 0.1)
    state = winch.save_state()
    winch.do_step(0.1, 0.1)
    after = winch.get("length")
    winch.restore_state(state)
    assert winch.get("length") == pytest.approx(50.0 - 0.037)
    winch.do_step(0.1, 0.1)
    np.testing.assert_array_equal(winch.get("length"), after)
    with pytest.raises(TypeError, match="wants what save_state returned"):
        winch.restore_state("yesterday")
    winch.terminate()


def test_variables_are_those_of_the_model(build: Build) -> None:
    variables = FmuParticipant("winch", build(2)).variables
    assert {name: (v.shape, v.causality) for name, v in variables.items()} == {
        "tension": ((1,), Causality.INPUT),
        "speed": ((1,), Causality.INPUT),
        "locked": ((1,), Causality.INPUT),
        "holding": ((1,), Causality.PARAMETER),
        "slip": ((1,), Causality.PARAMETER),
        "length": ((1,), Causality.OUTPUT),
        **{f"force[{k}]": ((1,), Causality.OUTPUT) for k in (1, 2, 3)},
        "force": ((3,), Causality.OUTPUT),
    }


@pytest.mark.parametrize("version", [2, 3])
def test_units_that_an_fmu_leaves_open_can_be_said(build: Build, version: int) -> None:
    path = build(version)
    assert FmuParticipant("winch", path).variables["tension"].unit == "1"
    winch = FmuParticipant("winch", path, units={"tension": "kN", "speed": "kn"})
    known = winch.variables["tension"].known_unit
    assert known is not None
    assert known.factor == 1000.0
    with pytest.raises(ValueError, match="unit of 'pull' is given, which is no variable, allowed: tension, speed"):
        FmuParticipant("winch", path, units={"pull": "N"})
    with pytest.raises(ValueError, match="unit of 'tension' is 'stone', which is not known"):
        FmuParticipant("winch", path, units={"tension": "stone"})


def test_two_fmus_and_a_boolean_in_one_run(build: Build) -> None:
    first, second = FmuParticipant("first", build(2)), FmuParticipant("second", build(3))
    connections = [Connection("first", "length", "second", "tension"), Connection("second", "length", "first", "speed")]
    run = CoSimulation([first, second], connections, 0.5)
    run.initialize()
    run.step()
    # first reels in at 50 m/s for half a second, second sees a pull of 25 N and stays
    assert first.get("length") == pytest.approx(25.0)
    assert second.get("length") == pytest.approx(50.0)
    np.testing.assert_array_equal(first.get("force"), np.zeros(3))
    first.set("tension", np.array([3.0]))
    first.set("locked", np.array([1.0]))
    run.step()
    assert first.get("length") == pytest.approx(25.0)
    np.testing.assert_allclose(first.get("force"), (3.0, 6.0, -3.0))
    run.terminate()
    with pytest.raises(CouplingSetupError, match=r"shape \(3,\) feeds shape \(1,\)"):
        CoSimulation([first, second], [Connection("first", "force", "second", "tension")], 0.5)


def test_failing_fmu_is_named(build: Build) -> None:
    winch = FmuParticipant("winch", build(2))
    run = CoSimulation([winch], [], 0.1)
    run.initialize()
    winch.set("tension", np.array([2e6]))
    with pytest.raises(CoSimulationError, match=r"'winch' failed at 0 s: error: .*DoStep failed.*rope parted"):
        run.step()
    winch.terminate()


def test_bad_fmus_are_refused(build: Build, tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"FMU .*nowhere\.fmu does not exist"):
        FmuParticipant("winch", tmp_path / "nowhere.fmu")
    with pytest.raises(ValueError, match=r"FMU .* is a folder, allowed: a file"):
        FmuParticipant("winch", tmp_path)
    (tmp_path / "noise.fmu").write_text("no archive")
    with pytest.raises(ValueError, match=r"noise\.fmu is no FMU"):
        FmuParticipant("winch", tmp_path / "noise.fmu")
    with pytest.raises(
        ValueError, match="no parameter or input 'sleep', allowed: tension, speed, locked, holding, slip"
    ):
        FmuParticipant("winch", build(2), {"sleep": 1.0})
    with zipfile.ZipFile(build(2)) as whole, zipfile.ZipFile(tmp_path / "bare.fmu", "w") as bare:
        for item in whole.namelist():
            if not item.startswith("binaries"):
                bare.writestr(item, whole.read(item))
    with pytest.raises(ValueError, match=r"bare\.fmu has binaries for no platform, needed: "):
        FmuParticipant("winch", tmp_path / "bare.fmu")
    with zipfile.ZipFile(build(3)) as whole, zipfile.ZipFile(tmp_path / "broken.fmu", "w") as broken:
        for item in whole.namelist():
            broken.writestr(item, b"no program" if item.startswith("binaries") else whole.read(item))
    broken_fmu = FmuParticipant("winch", tmp_path / "broken.fmu")
    with pytest.raises(ValueError, match=r"broken\.fmu cannot be loaded: .*(file too short|invalid ELF header)"):
        broken_fmu.rehearse()
    broken_fmu.load_and_free()
    assert Path.cwd().is_dir()  # not the folder that was unpacked and thrown away


@pytest.mark.parametrize(
    ("source", "told"),
    [
        ("import os; os.abort()", r"it crashes \(SIGABRT\)"),
        ("import time; time.sleep(1e6)", "it does not come back within 4 s"),
        (f"{WINCH_3}\nraise ImportError('no module named rope')", "it crashes .*: ImportError: no module named rope"),
    ],
    ids=["crash", "hang", "missing module"],
)
def test_fmus_that_crash_or_hang_do_no_harm(
    build: Build, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, source: str, told: str
) -> None:
    with zipfile.ZipFile(build(3)) as whole, zipfile.ZipFile(tmp_path / "bad.fmu", "w") as bad:
        for item in whole.namelist():
            bad.writestr(item, source if item == "resources/winch_3.py" else whole.read(item))
    if "sleep" in source:
        monkeypatch.setattr(trial_process, "PATIENCE", 4.0)
    with pytest.raises(ValueError, match=rf"FMU .*bad\.fmu cannot be loaded: {told}"):
        FmuParticipant("winch", tmp_path / "bad.fmu").rehearse()


def test_a_crash_for_the_path_of_temporary_files_is_suspected(
    build: Build, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """PythonFMU's binary (0.7) takes the path for an address of the web, and does not decode it."""
    folder = tmp_path / "tü%mp"
    folder.mkdir()
    monkeypatch.setenv("TMPDIR", str(folder))
    monkeypatch.setattr("tempfile.tempdir", None)
    with pytest.raises(ValueError, match=r"cannot be loaded: .*; perhaps for the '%ü' in the path of temporary files"):
        FmuParticipant("winch", build(2)).rehearse()


GEAR = """
from enum import Enum
from pythonfmu3 import *
from pythonfmu3.variable_types import EnumerationType

class Mode(Enum):
    off = 0
    on = 1

class Gear(Fmi3Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.time, self.speed, self.teeth, self.engaged, self.mode = 0.0, 0.0, 0, False, 1
        self.type_definitions["Mode"] = EnumerationType("Mode", Mode)
        discrete = Fmi3Variability.discrete
        self.register_variable(Float64("time", causality=Fmi3Causality.independent, variability=Fmi3Variability.continuous))
        self.register_variable(Int32("teeth", causality=Fmi3Causality.input, variability=discrete))
        self.register_variable(Boolean("engaged", causality=Fmi3Causality.input, variability=discrete))
        self.register_variable(Float64("speed", causality=Fmi3Causality.output))
        mode = Enumeration("mode", declared_type="Mode", causality=Fmi3Causality.output, variability=discrete)
        mode.dimensions = []  # which pythonfmu3 (0.3) forgets, and asks for
        self.register_variable(mode)

    def do_step(self, current_time, step_size):
        self.speed = float(self.teeth * self.engaged)
        return Fmi3StepResult(status=Fmi3Status.ok)
"""


@pytest.fixture(scope="module")
def gear(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An FMU of FMI 3 with an integer, a boolean and an enumeration, whose state it holds itself."""
    folder = tmp_path_factory.mktemp("gear")
    script = folder / "gear_3.py"
    script.write_text(GEAR)
    command = [sys.executable, "-m", "pythonfmu3", "build", "-f", str(script), "-d", str(folder), "--handle-state"]
    subprocess.run(command, check=True, capture_output=True)
    return next(folder.glob("*.fmu"))


def test_integers_booleans_and_enumerations_are_numbers(gear: Path) -> None:
    fmu = FmuParticipant("gear", gear, {"teeth": 7, "engaged": True})
    run = CoSimulation([fmu], [], 0.1)
    run.initialize()
    run.step()
    assert {name: float(value[0]) for name, value in run.outputs("gear").items()} == {"speed": 7.0, "mode": 1.0}
    fmu.set("teeth", np.array([-(2.0**31)]))
    run.terminate()


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("teeth", 2.7, "whole numbers from -2147483648 to 2147483647"),
        ("teeth", 1e12, "whole numbers from -2147483648 to 2147483647"),
        ("teeth", np.nan, "whole numbers"),
        ("engaged", 0.2, "0 or 1"),
        ("engaged", -1.0, "0 or 1"),
    ],
)
def test_what_is_no_integer_or_boolean_is_not_made_one(gear: Path, name: str, value: float, allowed: str) -> None:
    with pytest.raises(ValueError, match=f"'gear': '{name}' is .*, allowed: {allowed}"):
        FmuParticipant("gear", gear, {name: value})
    fmu = FmuParticipant("gear", gear)
    fmu.enter_initialization_mode(0.0)
    with pytest.raises(ValueError, match=f"'gear': '{name}' is .*, allowed: {allowed}"):
        fmu.set(name, np.array([value]))
    fmu.terminate()


def test_states_that_an_fmu_holds_are_let_go_with_the_last_who_may_want_them(
    build: Build, monkeypatch: pytest.MonkeyPatch
) -> None:
    freed: list[object] = []
    free = FMU3Slave.freeFMUState
    monkeypatch.setattr(FMU3Slave, "freeFMUState", lambda fmu, state: (freed.append(state), free(fmu, state)))
    run = CoSimulation([FmuParticipant("winch", build(3))], [], 0.1, rolls_back=True)
    run.initialize()
    assert run.rollback_faults == {}
    freed.clear()
    for _ in range(20):
        run.step()
    assert len(freed) >= 19
    run.terminate()
