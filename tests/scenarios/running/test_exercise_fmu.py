"""A whole exercise as an FMU, for real: the same numbers as under our own master, in FMPy and in an independent one, rolled back."""

from __future__ import annotations

import gc
import importlib.util
import json
import math
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Literal

import fmpy
import numpy as np
import pybullet
import pytest
from fmpy import simulate_fmu
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu

from coupling.fmu.fmu_participant import FmuParticipant
from coupling.master.participant import Causality, Status
from recordings.files.checkpoint import state_hash
from scenarios.cli import main
from scenarios.running.assembly import build
from scenarios.running.exercise_fmu import ExerciseParticipant
from scenarios.spec.load import load_scenario

EXAMPLE = Path(__file__).parents[3] / "docs" / "fmus" / "winch-tow.toml"
STEP, STEPS, ORDERED = 0.02, 12, 4  # s, number, step from which the orders below are given
ORDERS = {"vessels.tug.legs.0.speed": 0.5, "sea.wind.speed": 9.0, "sea.current.direction": 0.4}
EXTRA = """
[phases.oil]
oil = "alaska-north-slope"

[fill.slick]
shape = "block"
phase = "oil"
lower = [1.0, 0.6, 0.32]
upper = [1.8, 1.2, 0.48]

[sea.wind]
speed = 4.0
gust_intensity = 0.3

[sea.current]
speed = 0.1
"""

VERSIONS = (pytest.param(2, marks=pytest.mark.slow), 3)
Build = Callable[[int], Path]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small exercise with oil, wind and current, and a winch of its own, which is an FMU."""
    place = tmp_path_factory.mktemp("exercise")
    text = EXAMPLE.read_text().replace("particle_spacing = 0.12", "particle_spacing = 0.16")
    (place / "tow.toml").write_text(text.replace("[run]", "[run]\nthreads = 1") + EXTRA)
    assert main(["build-fmu", "docs/fmus/tow_winch.py", "-o", str(place / "tow-winch.fmu")]) == 0
    return place


@pytest.fixture(scope="module")
def exported(folder: Path) -> Build:
    """The exercise as an FMU of a version, exported by the command when it is first asked for."""

    @cache
    def made(version: int) -> Path:
        target = folder / f"tow-{version}.fmu"
        assert main(["export-fmu", str(folder / "tow.toml"), "--fmi", str(version), "-o", str(target)]) == 0
        return target

    return made


@pytest.fixture(scope="module")
def own_run(folder: Path) -> dict[str, float]:
    """Every output after the same orders under our own master."""
    exercise = ExerciseParticipant("tow", load_scenario(folder / "tow.toml").scenario)
    outputs = [name for name, variable in exercise.variables.items() if variable.causality is Causality.OUTPUT]
    assembly = build(load_scenario(folder / "tow.toml").scenario)
    run = assembly.co_simulation()
    run.initialize()
    for k in range(STEPS):
        if k == ORDERED:
            assembly.controls.drive(ORDERS)
        run.step()
    result = {name: exercise._signals[name].read(assembly.parts) for name in outputs}
    run.terminate()
    return result


def test_a_step_that_is_taken_back_leaves_no_oil_in_the_ledger(folder: Path) -> None:
    """After three steps and back, and the same three again, all rows of the oil ledger are those of the first time."""
    exercise = ExerciseParticipant("tow", load_scenario(folder / "tow.toml").scenario)
    exercise.enter_initialization_mode(0.0)
    exercise.exit_initialization_mode()
    rows = [name for name in exercise.variables if name.startswith(("oil.", "booms.")) and ".oil_" in f".{name}"]
    assert "oil.spilled" in exercise.variables and len(rows) >= 20
    exercise.do_step(0.0, STEP)
    saved, found = exercise.save_state(), []
    for _ in range(2):
        before = {name: float(exercise.get(name)[0]) for name in exercise.variables if name.startswith("oil.")}
        for k in range(1, 4):
            assert exercise.do_step(k * STEP, STEP).status is Status.OK
        found.append((before, {name: float(exercise.get(name)[0]) for name in [*rows, "oil.spilled", "oil.contained"]}))
        exercise.restore_state(saved)
    exercise.terminate()
    assert found[0] == found[1]
    assert found[0][1]["oil.spilled"] > 0.0


def drive(fmu: FmuParticipant, begin: int = 0, end: int = STEPS) -> None:
    for k in range(begin, end):
        if k == ORDERED:
            for name, value in ORDERS.items():
                fmu.set(name, np.array([value]))
        result = fmu.do_step(k * STEP, STEP)
        assert result.status is Status.OK, result.message


def begun(path: Path) -> FmuParticipant:
    fmu = FmuParticipant("exercise", path)
    fmu.enter_initialization_mode(0.0)
    fmu.exit_initialization_mode()
    return fmu


@pytest.mark.parametrize("version", VERSIONS)
def test_it_agrees_with_our_own_master(exported: Build, own_run: dict[str, float], version: Literal[2, 3]) -> None:
    """All outputs, poses, tensions, oil and scores: closer than 1e-9; in fact equal, bit for bit."""
    before = os.getcwd(), dict(os.environ)
    fmu = begun(exported(version))
    drive(fmu)
    assert len(own_run) == 82
    for name, value in own_run.items():
        assert float(fmu.get(name)[0]) == value, name
    assert own_run["vessels.tug.thrust"] != 0.0
    assert own_run["booms.main.oil_inside"] + own_run["booms.main.oil_outside"] > 0.0
    assert (os.getcwd(), dict(os.environ)) == before
    fmu.terminate()


@pytest.mark.parametrize("version", VERSIONS)
def test_its_state_goes_back_and_into_another_instance(
    exported: Build, own_run: dict[str, float], version: Literal[2, 3]
) -> None:
    fmu, other = begun(exported(version)), begun(exported(version))
    drive(fmu, 0, 6)
    state = fmu.save_state()
    assert isinstance(state, bytes)
    drive(fmu, 6)
    fmu.restore_state(state)
    other.restore_state(state)
    for one in (fmu, other):
        drive(one, 6)
        for name, value in own_run.items():
            assert float(one.get(name)[0]) == value, name
        one.terminate()


def test_its_state_goes_back_to_a_boom_that_was_whole_and_on_to_one_that_has_parted() -> None:
    """A state from before goes back into the run whose boom broke; one from after goes into another instance."""
    changes = [
        "fidelity='none'",
        "run.communication_step=0.02",
        "sea.current.speed=1.0",
        "booms.main.strength=20.0",
    ]
    scenario = load_scenario("u-sweep", overrides=changes).scenario
    exercise, other = ExerciseParticipant("tow", scenario), ExerciseParticipant("tow", scenario)
    exercise.enter_initialization_mode(0.0)
    exercise.exit_initialization_mode()
    states, ends = [exercise.save_state()], []
    for step in range(6):
        assert exercise.do_step(0.02 * step, 0.02).status is Status.OK
        states.append(exercise.save_state())
    joints = [len(state["strength"]["parted"]["main"]) for state in states if isinstance(state, dict)]
    assert joints == sorted(joints) and joints[0] == 0 < joints[4]
    for one, begin in ((exercise, 0), (other, 4)):
        one.restore_state(states[begin])
        for step in range(begin, 6):
            assert one.do_step(0.02 * step, 0.02).status is Status.OK
        ends.append(state_hash(one.save_state()))
        one.terminate()
    assert ends == [state_hash(states[6])] * 2


def test_a_current_set_after_a_state_was_saved_goes_with_it(folder: Path) -> None:
    """Also out of the scores, which reckon with speeds through the water."""
    exercise = ExerciseParticipant("tow", load_scenario(folder / "tow.toml").scenario)
    exercise.enter_initialization_mode(0.0)
    exercise.exit_initialization_mode()
    state = exercise.save_state()
    speeds = []
    for ordered in (False, True, False):
        exercise.restore_state(state)
        if ordered:
            exercise.set("sea.current.speed", np.array([0.5]))
            exercise.set("sea.current.direction", np.array([2.0]))
        assert exercise.do_step(0.0, STEP).status is Status.OK
        speeds.append(float(exercise.get("booms.main.normal_speed")[0]))
    assert speeds[0] == speeds[2] != speeds[1]
    exercise.terminate()


@pytest.mark.parametrize("version", VERSIONS)
def test_it_is_sound_and_fmpy_runs_it(exported: Build, own_run: dict[str, float], version: Literal[2, 3]) -> None:
    path = exported(version)
    assert validate_fmu(str(path)) == []
    description = fmpy.read_model_description(str(path))
    assert description.defaultExperiment.stepSize == str(STEP) or float(description.defaultExperiment.stepSize) == STEP
    units = {variable.name: variable.unit for variable in description.modelVariables}
    assert units["booms.main.tug.tension"] == "N"
    assert units["booms.main.oil_lost.drainage"] == "m3"
    starts = {variable.name: variable.start for variable in description.modelVariables if variable.causality == "input"}
    assert float(starts["sea.wind.speed"]) == 4.0
    assert "vessels.tug.hauled" not in starts  # the winch inside drives it
    # FMPy sets inputs before every step, ours once: the same orders from the same step on
    given = np.zeros(4, dtype=[("time", float), *((name, float) for name in ORDERS)])
    given["time"] = STEP * np.array([0.0, ORDERED - 0.5, ORDERED - 0.5, STEPS])
    for name, value in ORDERS.items():
        given[name] = (float(starts[name]), float(starts[name]), value, value)
    result = simulate_fmu(str(path), stop_time=STEPS * STEP, output_interval=STEP, input=given, debug_logging=True)
    assert result["time"][-1] == pytest.approx(STEPS * STEP)
    for name, value in own_run.items():
        assert result[name][-1] == value, name


def slave(path: Path, folder: Path) -> FMU2Slave | FMU3Slave:
    """An instance of the exercise in the hands of FMPy, so that a test may call what our master does not."""
    description = fmpy.read_model_description(str(path))
    kind = FMU2Slave if description.fmiVersion.startswith("2") else FMU3Slave
    fmu = kind(
        guid=description.guid,
        unzipDirectory=fmpy.extract(str(path), str(folder)),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="exercise",
    )
    fmu.instantiate()
    return fmu


def initialize(fmu: FMU2Slave | FMU3Slave) -> None:
    if isinstance(fmu, FMU2Slave):
        fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()


@pytest.mark.slow
@pytest.mark.parametrize("version", VERSIONS)
def test_its_state_can_be_saved_before_the_run_begins(exported: Build, tmp_path: Path, version: int) -> None:
    """What was given in time counts, what was given after it was saved does not."""
    path = exported(version)
    references = {v.name: v.valueReference for v in fmpy.read_model_description(str(path)).modelVariables}
    ends = []
    for k, saved_in in enumerate(("no mode", "instantiated", "initialization mode", "step mode")):
        fmu = slave(path, tmp_path / str(k))
        read, write = (fmu.getReal, fmu.setReal) if version == 2 else (fmu.getFloat64, fmu.setFloat64)
        order, wind = references["vessels.tug.legs.0.speed"], references["sea.wind.speed"]
        write([order], [0.5])
        state = None if saved_in == "no mode" else fmu.getFMUState()
        if saved_in in ("instantiated", "step mode"):
            write([wind], [20.0])
        if saved_in == "step mode":
            initialize(fmu)
            fmu.doStep(0.0, STEP)
        if saved_in in ("instantiated", "step mode"):
            fmu.setFMUState(fmu.deserializeFMUState(fmu.serializeFMUState(state)))
        if version == 2:
            fmu.setupExperiment(startTime=0.0)
        fmu.enterInitializationMode()
        if saved_in == "initialization mode":
            state = fmu.getFMUState()
            write([wind], [20.0])
            fmu.setFMUState(state)
        fmu.exitInitializationMode()
        assert read([order, wind]) == [0.5, 4.0]
        for step in range(4):
            fmu.doStep(step * STEP, STEP)
        ends.append(read([references["vessels.tug.x"], references["booms.main.tug.tension"]]))
        fmu.terminate()
        fmu.freeInstance()
    assert ends == ends[:1] * 4


@pytest.mark.slow
def test_a_state_goes_into_an_instance_that_has_not_begun(folder: Path) -> None:
    scenario = load_scenario(folder / "tow.toml").scenario
    first, second = ExerciseParticipant("tow", scenario), ExerciseParticipant("tow", scenario)
    first.set("vessels.tug.legs.0.speed", np.array([0.5]))
    first.enter_initialization_mode(0.0)
    first.exit_initialization_mode()
    first.do_step(0.0, 3 * STEP)
    second.restore_state(first.save_state())
    for one in (first, second):
        assert one.do_step(3 * STEP, 3 * STEP).status is Status.OK
    assert first.get("vessels.tug.x") == second.get("vessels.tug.x")
    first.terminate()
    second.terminate()


def clients() -> int:
    """How many pybullet clients this process has."""
    gc.collect()
    return sum(pybullet.isConnected(client) for client in range(100))


@pytest.mark.slow
@pytest.mark.parametrize("version", VERSIONS)
def test_an_instance_that_is_reset_or_freed_leaves_nothing(exported: Build, tmp_path: Path, version: int) -> None:
    before = clients()
    fmu = slave(exported(version), tmp_path)
    for _ in range(3):
        initialize(fmu)
        fmu.doStep(0.0, STEP)
        assert clients() == before + 1
        fmu.reset()
    initialize(fmu)
    fmu.freeInstance()
    assert clients() == before


ECOS = """
import ctypes, json, sys
from pathlib import Path
ctypes.CDLL(str(Path(sys.prefix) / "lib" / "libtbb.so.12"), mode=ctypes.RTLD_GLOBAL)
from ecospy import EcosSimulation, EcosSimulationStructure
path, result, steps, ordered, orders, outputs = json.loads(sys.argv[1])
structure = EcosSimulationStructure()
structure.add_model("exercise", path)
simulation = EcosSimulation(structure=structure, step_size=0.02)
assert simulation.init()
for k in range(steps):
    if k == ordered:
        for name, value in orders.items():
            simulation.set_real("exercise::" + name, value)
    simulation.step()
Path(result).write_text(json.dumps({name: simulation.get_real("exercise::" + name) for name in outputs}))
simulation.terminate()
simulation.free()
"""


@pytest.mark.slow
@pytest.mark.skipif(
    importlib.util.find_spec("ecospy") is None, reason="the independent master comes with the extra dev"
)
@pytest.mark.parametrize("version", VERSIONS)
def test_an_independent_master_gets_the_same(
    exported: Build, own_run: dict[str, float], version: Literal[2, 3], tmp_path: Path
) -> None:
    """Ecos, a master written in C++ that prints when it likes, in a process of its own, with its result in a file."""
    result = tmp_path / "result.json"
    arguments = json.dumps([str(exported(version)), str(result), STEPS, ORDERED, ORDERS, list(own_run)])
    command = [sys.executable, "-c", ECOS, arguments]
    root = Path(__file__).parents[3]
    paths = os.pathsep.join(filter(None, (str(root), os.environ.get("PYTHONPATH"))))
    done = subprocess.run(
        command,
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"PYTHONPATH": paths},
        cwd=exported(version).parent,
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(result.read_text()) == own_run


def test_steps_and_starts_of_its_master(exported: Build) -> None:
    """It begins when its master begins, takes several communication steps at once, and refuses parts of one."""
    fmu = FmuParticipant("exercise", exported(3))
    fmu.enter_initialization_mode(100.0)
    fmu.exit_initialization_mode()
    assert fmu.do_step(100.0, 5 * STEP).status is Status.OK
    same = begun(exported(3))
    drive(same, 0, ORDERED)
    same.do_step(ORDERED * STEP, STEP)
    np.testing.assert_array_equal(fmu.get("vessels.tug.x"), same.get("vessels.tug.x"))
    result = fmu.do_step(100.0 + 5 * STEP, 0.013)
    assert result.status is Status.ERROR
    assert "allowed: from 100.1 s, whole multiples of communication_step = 0.02 s" in result.message
    for one in (fmu, same):
        one.terminate()


def test_a_master_may_add_up_its_time(folder: Path) -> None:
    """From a Unix time, whose last digit is a hundred thousandth of a step."""
    exercise = ExerciseParticipant("tow", load_scenario(folder / "tow.toml").scenario)
    exercise.enter_initialization_mode(0.0)
    exercise.exit_initialization_mode()
    time = 1.7e9
    for _ in range(STEPS):
        assert exercise.do_step(time, STEP).status is Status.OK
        time += STEP
    assert exercise.do_step(time + 1e-3, STEP).status is Status.ERROR
    exercise.terminate()


@pytest.mark.parametrize(
    ("time", "step_size"),
    [
        (0.0, math.nan),
        *(pytest.param(*one, marks=pytest.mark.slow) for one in ((math.nan, STEP), (0.0, math.inf), (0.0, 0.0))),
    ],
)
def test_a_first_step_from_nowhere_is_refused(folder: Path, time: float, step_size: float) -> None:
    exercise = ExerciseParticipant("tow", load_scenario(folder / "tow.toml").scenario)
    exercise.enter_initialization_mode(0.0)
    exercise.exit_initialization_mode()
    result = exercise.do_step(time, step_size)
    assert result.status is Status.ERROR
    assert "allowed: from 0 s, whole multiples of communication_step" in result.message
    exercise.terminate()


@pytest.mark.parametrize(
    "name",
    ["3d-tow", *(pytest.param(name, marks=pytest.mark.slow) for name in ("true", "default-experiment", "exercise"))],
)
def test_every_scenario_name_makes_an_fmu(folder: Path, tmp_path: Path, name: str) -> None:
    target = tmp_path / "named.fmu"
    assert main(["export-fmu", str(folder / "tow.toml"), "--set", f'name="{name}"', "-o", str(target)]) == 0
    assert validate_fmu(str(target)) == []


def test_it_needs_no_file_of_the_scenario(exported: Build, tmp_path: Path) -> None:
    """Meshes and FMUs travel inside."""
    path = shutil.copy(exported(3), tmp_path)
    with_files = fmpy.extract(str(path), str(tmp_path / "unpacked"))
    assert (Path(with_files) / "resources" / "fmus-winch.fmu").is_file()
    packed = json.loads((Path(with_files) / "resources" / "scenario.json").read_text())
    assert packed["fmus"]["winch"]["file"] == "fmus-winch.fmu"


@pytest.mark.parametrize("version", VERSIONS)
def test_a_shipped_exercise_is_exported(
    tmp_path: Path, version: Literal[2, 3], capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "sweep.fmu"
    assert main(["export-fmu", "u-sweep", "--demo", "--fmi", str(version), "-o", str(target)]) == 0
    assert "inputs: tow.speed, tow.heading, sea.current.speed, sea.current.direction" in capsys.readouterr().out
    assert validate_fmu(str(target)) == []


def test_bad_input_ends_with_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main(["export-fmu", "u-sweep", "-o", str(tmp_path / "no" / "x.fmu")]) == 2
    assert "allowed: a file in an existing folder" in capsys.readouterr().err
    assert main(["build-fmu", "tow-wich"]) == 2
    assert "model 'tow-wich' is no Python file, allowed: a .py file" in capsys.readouterr().err
    monkeypatch.setattr("coupling.fmu.export.PACKAGES", {2: "no_such_package", 3: "no_such_package"})
    assert main(["export-fmu", "u-sweep", "-o", str(tmp_path / "x.fmu")]) == 2
    assert "no_such_package is not installed, needed for FMI 3: pip install 'oilsim[fmu]'" in capsys.readouterr().err
