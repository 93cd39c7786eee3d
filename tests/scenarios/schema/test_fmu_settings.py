"""FMUs in a scenario, for real: a winch on a tow line, an autopilot on a tug; what is wrong with them is told before the run."""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Slave

from coupling.fmu import isolated_fmu
from coupling.fmu.isolated_fmu import IsolatedFmu
from coupling.master.errors import CoSimulationError
from coupling.master.participant import Status
from recordings.files.checkpoint import state_from_bytes, state_hash, state_to_bytes
from scenarios.bench.scenario_run import ScenarioRun
from scenarios.cli import main
from scenarios.controls.fmu_checks import fmu_problems
from scenarios.controls.signals import signals_of
from scenarios.running.assembly import Assembly, build
from scenarios.running.exercise_fmu import ExerciseParticipant, exercise_content
from scenarios.schema.fmu_settings import FmuSettings
from scenarios.spec.load import load_scenario
from scenarios.text.problems import Problem, ScenarioError
from tests.coupling.fmu.test_variables import described, inputs, outputs

EXAMPLES = Path(__file__).parents[3] / "docs" / "fmus"
QUICK = ("fluid.particle_spacing=0.16", "run.threads=1", "run.duration=0.4")
LINE = "boom/main/tow-tug"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The example scenarios with the FMUs they ask for, built by the command: the winch for FMI 3, the autopilot for FMI 2."""
    place = tmp_path_factory.mktemp("fmus")
    for file in EXAMPLES.glob("*.toml"):
        shutil.copy(file, place)
    assert main(["build-fmu", "docs/fmus/tow_winch.py", "-o", str(place / "tow-winch.fmu")]) == 0
    assert main(["build-fmu", "docs/fmus/autopilot.py", "--fmi", "2", "-o", str(place / "autopilot.fmu")]) == 0
    return place


def assembled(file: Path, *overrides: str) -> Assembly:
    return build(load_scenario(file, overrides=[*QUICK, *overrides]).scenario)


def participant(assembly: Assembly, name: str) -> IsolatedFmu:
    found = next(one for one in assembly.participants if one.name == name)
    assert isinstance(found, IsolatedFmu)
    return found


@pytest.mark.slow
def test_winch_renders_until_the_line_pulls_as_ordered(folder: Path, scenario_run: type[ScenarioRun]) -> None:
    """On the winch the tug pays out line under load; with the brake set the line keeps its length and pulls harder."""
    lengths, tensions = {}, {}
    for brake in (0, 1):
        winch = {"brake": brake, "brake_holding": 500, "tension_order": 5}
        settings = [f"fmus.winch.start.{name}={value}" for name, value in winch.items()]
        hurry = ("run.duration=2.0", "vessels.tug.acceleration=1.0", "vessels.tug.legs.0.speed=0.5")
        run = scenario_run(folder / "winch-tow.toml", *QUICK, *hurry, *settings)
        assembly, peak = run.assembly, []
        for _ in range(50):
            run.step()
            peak.append(assembly.world.tension(LINE))
        # what the drum has paid out is what the line has grown by, in the same communication step
        grown = assembly.world.lines.length(LINE) - assembly.world.lines.laid_length(LINE)
        assert grown == pytest.approx(float(participant(assembly, "fmus.winch").get("paid_out")[0]), abs=1e-12)
        lengths[brake], tensions[brake] = grown, max(peak)
    assert lengths[1] == 0.0
    assert lengths[0] > 0.02
    assert tensions[0] < tensions[1]


def test_autopilot_turns_a_tug_without_a_helmsman(folder: Path, scenario_run: type[ScenarioRun]) -> None:
    engaged = ("run.duration=3.0", "fmus.autopilot.start.engaged=true")
    run = scenario_run(folder / "autopilot-turn.toml", *QUICK, *engaged)
    run.run()
    control = run.assembly.parts.helms["tug"]
    assert float(control.get("tug.heading")) > math.radians(15.0)
    assert float(control.get("tug.speed")) > 0.05
    pilot = participant(run.assembly, "fmus.autopilot")
    # the tug pushes as the autopilot says, in the same step
    assert float(control.get("tug.thrust")) == float(pilot.get("thrust")[0])
    assert float(control.get("tug.yaw_moment")) == float(pilot.get("yaw_moment")[0])
    # and the recording is shown it
    assert run.readings().one_series("fmus/autopilot/thrust").value[-1] == float(pilot.get("thrust")[0])


@pytest.mark.parametrize("version", [pytest.param(2, marks=pytest.mark.slow), 3])
def test_a_model_of_ones_own_drives_the_wind_in_knots(
    folder: Path, version: int, scenario_run: type[ScenarioRun]
) -> None:
    """The squall of the documentation: 20 kn at its peak, which is what the liquid and the tug feel in m/s."""
    target = folder / f"squall-{version}.fmu"
    assert main(["build-fmu", str(EXAMPLES / "squall.py"), "--fmi", str(version), "-o", str(target)]) == 0
    squall = [f'fmus.squall.file="{target.name}"', "fmus.squall.start.start=0.0", "fmus.squall.start.duration=0.2"]
    wind = ["sea.wind.speed=2.0", 'fmus.squall.outputs.speed="sea.wind.speed"']
    run = scenario_run(folder / "winch-tow.toml", *QUICK, *squall, *wind)
    run.run(0.1)
    assembly = run.assembly
    peak = pytest.approx([20.0 * 1852.0 / 3600.0, 0.0], rel=1e-12)
    assert assembly.parts.helms["tug"].wind(np.zeros(2), 0.1)[:2] == peak
    assert assembly.fluid.forcings[0].sea.mean_wind(0.1) == peak
    run.run(0.2)
    assert assembly.fluid.forcings[0].sea.mean_wind(0.3)[0] == pytest.approx(4.0 * 1852.0 / 3600.0, rel=1e-12)


WINDS = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real

class Winds(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        for k in (1, 2):
            self.register_variable(Real(f"w[{k}]", causality=Fmi2Causality.output, getter=lambda k=k: 3.0 * k), nested=False)

    def do_step(self, current_time, step_size):
        return True
"""


def test_an_element_of_an_array_drives_a_signal_and_is_recorded_once(
    folder: Path, scenario_run: type[ScenarioRun]
) -> None:
    (folder / "winds_2.py").write_text(WINDS)
    command = [sys.executable, "-m", "pythonfmu", "build", "-f", "winds_2.py"]
    subprocess.run(command, check=True, capture_output=True, cwd=folder)
    winds = ['fmus.winds.file="Winds.fmu"', 'fmus.winds.units.w[2]="kn"']
    wind = ["sea.wind.speed=2.0", 'fmus.winds.outputs.w[2]="sea.wind.speed"']
    run = scenario_run(folder / "winch-tow.toml", *QUICK, *winds, *wind)
    run.step()
    assert run.assembly.fluid.forcings[0].sea.mean_wind(0.0)[0] == pytest.approx(6.0 * 1852.0 / 3600.0, rel=1e-12)
    series = run.readings().series
    shown = {name: track.value[-1] for name, track in series.items() if name.startswith("fmus/winds")}
    assert shown == {"fmus/winds/w/0": 3.0, "fmus/winds/w/1": 6.0}


def test_a_run_with_an_fmu_repeats_from_its_saved_state(folder: Path, scenario_run: type[ScenarioRun]) -> None:
    run = scenario_run(folder / "winch-tow.toml", *QUICK).simulation
    run.run(0.2)
    saved = run.save_state()
    run.run(0.3)
    after = state_hash(run.save_state())
    run.restore_state(state_from_bytes(state_to_bytes(saved)))
    assert run.communication_point.index == 10
    run.run(0.3)
    assert state_hash(run.save_state()) == after


@pytest.mark.slow
def test_a_run_with_an_fmu_goes_on_from_a_checkpoint_in_another_program(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The scenario is named as in its own folder; the second program is started elsewhere."""
    settings = [part for setting in (*QUICK, "recording.checkpoint_interval=0.2") for part in ("--set", setting)]
    record, whole, second = (str(tmp_path / name) for name in ("whole.rrd", "whole.json", "second.json"))
    monkeypatch.chdir(folder)
    assert main(["run", "winch-tow.toml", *settings, "--record", record, "--summary", whole]) == 0
    checkpoint = tmp_path / "whole.checkpoints" / "step-000000010.npz"
    command = ["run", "--resume", str(checkpoint), "--no-record", "--summary", second]
    subprocess.run(
        [sys.executable, "-m", "scenarios.cli", *command],
        check=True,
        stderr=subprocess.DEVNULL,
        cwd=tmp_path,
        env=_here(),
    )
    hashes = [json.loads(Path(file).read_text())["state_hash"] for file in (whole, second)]
    assert hashes[0] == hashes[1]


@pytest.mark.parametrize("lacking", ["canGetAndSetFMUState", "canSerializeFMUState"])
def test_a_run_with_an_fmu_that_cannot_be_kept_writes_no_checkpoints_and_says_so(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], lacking: str
) -> None:
    scenario = with_bare_winch(folder, tmp_path, lacking)
    settings = [part for setting in (*QUICK, "run.duration=0.06") for part in ("--set", setting)]
    files = ["--record", str(tmp_path / "tow.rrd"), "--summary", str(tmp_path / "tow.json")]
    assert main(["run", str(scenario), *settings, *files]) == 0
    told = f"no checkpoints: the state of fmus.winch (it lacks {lacking}) cannot be saved as bytes"
    assert capsys.readouterr().err.count(told) == 1
    summary = json.loads((tmp_path / "tow.json").read_text())
    assert summary["state_hash"] is None
    assert summary["ended"] == "completed"
    assert not (tmp_path / "tow.checkpoints").exists()


def test_an_exercise_with_an_fmu_that_cannot_be_kept_does_not_promise_its_state(folder: Path, tmp_path: Path) -> None:
    """Whoever asks for it all the same is refused, and the exercise goes on."""
    scenario = load_scenario(with_bare_winch(folder, tmp_path, "canGetAndSetFMUState"), overrides=QUICK).scenario
    assert not exercise_content(scenario).saves_state
    exercise = ExerciseParticipant("tow", scenario)
    exercise.enter_initialization_mode(0.0)
    exercise.exit_initialization_mode()
    with pytest.raises(
        NotImplementedError, match=r"'tow': the state of fmus\.winch \(it lacks canGetAndSetFMUState\) cannot be saved"
    ):
        exercise.save_state()
    assert exercise.do_step(0.0, scenario.run.communication_step).status is Status.OK
    exercise.terminate()


@pytest.mark.parametrize("failing", ["getFMUState", "serializeFMUState"])
def test_what_an_fmu_says_it_can_and_cannot_is_found_out_and_the_run_goes_on(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, failing: str
) -> None:
    monkeypatch.setattr(isolated_fmu, "is_own_process", lambda: False)  # what is patched here is not in another process
    monkeypatch.setattr(FMU3Slave, failing, failure("fmi3" + failing, 3))
    settings = [part for setting in (*QUICK, "run.duration=0.06") for part in ("--set", setting)]
    files = ["--record", str(tmp_path / "tow.rrd"), "--summary", str(tmp_path / "tow.json")]
    assert main(["run", str(folder / "winch-tow.toml"), *settings, *files]) == 0
    told = f"the state of fmus.winch (fmi3{failing} failed with status 3 (error)) cannot be saved as bytes"
    assert capsys.readouterr().err.count(f"no checkpoints: {told}") == 1
    assert json.loads((tmp_path / "tow.json").read_text())["state_hash"] is None
    assert not (tmp_path / "tow.checkpoints").exists()
    assert not exercise_content(load_scenario(folder / "winch-tow.toml").scenario).saves_state


def failure(function: str, status: int) -> Callable[..., None]:
    """A call to an FMU that fails."""

    def fail(*_: object) -> None:
        raise FMICallException(function, status)

    return fail


def with_bare_winch(folder: Path, place: Path, lacking: str) -> Path:
    """The scenario of the winch in another place, with an FMU that lacks a capability."""
    with zipfile.ZipFile(folder / "tow-winch.fmu") as whole, zipfile.ZipFile(place / "tow-winch.fmu", "w") as bare:
        for item in whole.namelist():
            content = whole.read(item)
            assert item != "modelDescription.xml" or f'{lacking}="true"'.encode() in content
            bare.writestr(item, content.replace(f'{lacking}="true"'.encode(), b""))
    return Path(shutil.copy(folder / "winch-tow.toml", place))


def _here() -> dict[str, str]:
    """The environment of a program that is started elsewhere and finds these packages."""
    return os.environ | {"PYTHONPATH": str(EXAMPLES.parents[1])}


def test_units_are_compared_and_ends_checked(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Each fault is one line with its place; the exit code is 2 and nothing was built."""
    faults = {
        'fmus.winch.inputs.tension="booms.main.tug.tensoin"': "is 'booms.main.tug.tensoin', which is no"
        " output of the run, did you mean 'booms.main.tug.tension'? allowed: booms.main.tug.tension",
        'fmus.winch.inputs.tesnion="booms.main.tug.tension"': "target variable 'tesnion' does not exist, allowed: tension",
        'fmus.winch.inputs.tension="vessels.tug.x"': "unit 'm' feeds unit 'N'",
        'fmus.winch.inputs.paid_out="vessels.tug.x"': "target is an output, allowed: input",
        'fmus.winch.outputs.paid_out="vessels.tug.x"': "target is an output, allowed: input",
        'fmus.winch.outputs.paid_out="vessels.tug.hualed"': "which is no input of the run, did you mean 'vessels.tug.hauled'?",
        'fmus.winch.inputs.tension="fmus.wind.speed"': "is from 'fmus.wind', which does not exist, allowed: fmus.winch, a signal",
        'fmus.winch.outputs.paid_out="vessels.tug.hauled"': "which fmus.winch.outputs.hauled already drives",
        'fmus.winch.units.tension="kN"': "unit of 'tension' is given as 'kN', but the FMU itself says 'N'",
        "fmus.winch.start.capacity=3": "has no parameter or input 'capacity', allowed: tension, speed_order",
        'fmus.winch.start.brake="on"': "fmus.winch.start.brake is 'on', allowed: a number or true or false",
        "fmus.winch.start.brake=nan": "fmus.winch.start.brake is nan, allowed: a finite number",
        "fmus.winch.start.tension=inf": "fmus.winch.start.tension is inf, allowed: a finite number",
        'fmus.winch.file="nowhere.fmu"': "nowhere.fmu does not exist",
        'fmus.winch.file="winch-tow.toml"': "winch-tow.toml is no FMU",
        'vessels.tug.control="manual"': 'vessels.tug.legs is given, allowed: only with control = "helmsman"',
        "booms.main.tow_line=0.0": "allowed: only with tow_line",
    }
    for setting, told in faults.items():
        assert main(["check", str(folder / "winch-tow.toml"), "--set", setting]) == 2, setting
        assert told in capsys.readouterr().err, setting


def test_an_array_of_an_fmu_and_its_element_are_not_fed_both(tmp_path: Path) -> None:
    fmus = {}
    for name, variables in {"a": outputs("w[1]", "w[2]"), "b": inputs("w[1]", "w[2]")}.items():
        (tmp_path / name).mkdir()
        fmus[name] = FmuSettings(file=str(described(tmp_path / name, 2, variables)))
    fmus["b"] = replace(fmus["b"], inputs={"w[2]": "fmus.a.w[1]", "w": "fmus.a.w"})
    told = "feeds an element of what fmus.b.inputs.w feeds, allowed: one of them"
    assert list(fmu_problems(fmus, {})) == [Problem("fmus.b.inputs.w[2]", told)]
    fmus["b"] = replace(fmus["b"], inputs={"w[2]": "fmus.a.w[1]", "w[1]": "fmus.a.w[2]"})
    assert not list(fmu_problems(fmus, {}))


def test_an_fmu_that_runs_once_in_a_process_is_not_run_twice(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    name = "canBeInstantiatedOnlyOncePerProcess"
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    with zipfile.ZipFile(folder / "tow-winch.fmu") as whole, zipfile.ZipFile(tmp_path / "once.fmu", "w") as once:
        for item in whole.namelist():
            once.writestr(item, whole.read(item).replace(f'{name}="false"'.encode(), f'{name}="true"'.encode()))
    codes = []
    for file in ("tow-winch.fmu", "once.fmu"):
        settings = [f'fmus.{fmu}.file="{file}"' for fmu in ("winch", "second")]
        codes.append(main(["check", str(tmp_path / "winch-tow.toml"), *("--set", settings[0], "--set", settings[1])]))
    assert codes == [0, 2]
    told = (
        f"fmus.second is the same FMU as fmus.winch, which runs only once in a process ({name}), allowed: one of them"
    )
    assert told in capsys.readouterr().err


def test_broken_fmu_is_refused_before_anything_is_computed(folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    with zipfile.ZipFile(folder / "tow-winch.fmu") as whole, zipfile.ZipFile(tmp_path / "tow-winch.fmu", "w") as broken:
        for item in whole.namelist():
            broken.writestr(item, b"no program" if item.startswith("binaries") else whole.read(item))
    with pytest.raises(ScenarioError, match=r"fmus\.winch cannot be used: FMU .*tow-winch\.fmu cannot be loaded"):
        assembled(tmp_path / "winch-tow.toml")
    with zipfile.ZipFile(folder / "tow-winch.fmu") as whole, zipfile.ZipFile(tmp_path / "tow-winch.fmu", "w") as bare:
        for item in whole.namelist():
            if not item.startswith("binaries"):
                bare.writestr(item, whole.read(item))
    with pytest.raises(ScenarioError, match=r"has binaries for no platform, needed: "):
        load_scenario(tmp_path / "winch-tow.toml")


def test_failing_fmu_ends_the_run_under_its_name(folder: Path) -> None:
    assembly = assembled(folder / "winch-tow.toml", "fmus.winch.start.brake_slip=-3.0")
    with pytest.raises(
        CoSimulationError, match=r"'fmus\.winch' failed at 0 s: .*brake_slip is -3 N s/m, allowed: above 0"
    ):
        assembly.co_simulation().initialize()


def test_line_too_stiff_for_its_bodies_is_refused(folder: Path) -> None:
    with pytest.raises(
        ScenarioError, match=r"booms\.main\.line_stiffness cannot be used: .*stiffness is 1e\+07 N, allowed: up to"
    ):
        assembled(folder / "winch-tow.toml", "booms.main.line_stiffness=1e7")


def test_orders_of_the_tow_do_not_reach_vessels_with_a_route_of_their_own() -> None:
    routes = [
        f"vessels.{name}.{entry}"
        for name in ("port", "starboard")
        for entry in ("waypoints=[[50.0,0.0]]", "transit=0.3")
    ]
    followed, alone = (load_scenario("sweep-200m", overrides=changes).scenario for changes in ([], routes))
    assert "tow.speed" in signals_of(followed.parts) and "tow.speed" not in signals_of(alone.parts)


def test_signals_reach_what_they_are_called_after(folder: Path) -> None:
    """Wind, current and tow orders, each put into effect where it is felt."""
    extra = (
        "sea.wind.speed=3.0",
        "sea.current.speed=0.1",
        "sea.waves.height=0.02",
        "sea.waves.period=1.0",
    )
    assembly = assembled(folder / "winch-tow.toml", *extra, "tow.speed=0.1", "tow.heading=0.0", "vessels.tug.legs=[]")
    board = next(one for one in assembly.participants if one.name == "orders")
    control, fluid = assembly.parts.helms["tug"], assembly.fluid
    for name, value in (
        ("sea.wind.speed", 5.0),
        ("sea.wind.direction", math.pi / 2),
        ("sea.current.speed", 0.3),
        ("sea.current.direction", math.pi),
        ("tow.speed", 0.25),
    ):
        board.set(name, np.array([value]))
        assert board.get(name)[0] == value
    (driving,) = fluid.forcings
    assert driving.sea is assembly.sea.now
    assert driving.sea.mean_wind(0.0) == pytest.approx([0.0, 5.0], abs=1e-12)
    assert control.wind(np.zeros(2), 0.0) == pytest.approx([0.0, 5.0, 0.0], abs=1e-12)
    assert driving.sea.current(0.0, 0.0) == pytest.approx((-0.3, 0.0), abs=1e-12)
    assert control.vessel.course.legs[-1].speed == 0.25
    with pytest.raises(ValueError, match=r"'tow\.speed' is nan, allowed: 0 or more and at most 20 m/s"):
        board.set("tow.speed", np.array([math.nan]))
    for one in assembly.participants:
        one.terminate()
