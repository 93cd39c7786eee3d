"""The limits of a scenario's keys hold at every entrance: file, --set, order, signal, exported FMU, Python, and saved state."""

from __future__ import annotations

import contextlib
import math
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from recordings import Replay
from scenarios.cli import main
from scenarios.load import scenario_from
from scenarios.problems import ScenarioError
from scenarios.running.assembly import Assembly, build
from scenarios.running.exercise_fmu import ExerciseParticipant
from scenarios.running.plan import Plan
from scenarios.scenario import Scenario
from scenarios.schema.parsing.overrides import with_override
from scenarios.schema.parsing.structuring import as_data
from scenarios.setup.cost import require_memory
from scenarios.setup.resolve import resolve
from scenarios.signals.signal_participant import SignalBoard
from scenarios.signals.signal_table import signals_of
from tests.fuzz.scenario_files import paths_of

TEXT = (Path(__file__).parent / "all_inputs.toml").read_text(encoding="utf-8")


@dataclass(frozen=True)
class Input:
    """One input of a run. key: in the file and in orders; signal: its name as one; assign: sets it on the part behind."""

    allowed: str
    wrong: tuple[float, ...]
    key: str = ""
    signal: str = ""
    assign: Callable[[Assembly, float], None] | None = None


def signaled(kind: str, direction: bool = False) -> Callable[[Assembly, float], None]:
    return lambda assembly, value: assembly.sea.signal(kind, *((1.0, value) if direction else (value, 0.0)))


def ordered(vessel: str, order: str) -> Callable[[Assembly, float], None]:
    return lambda assembly, value: assembly.parts.controls[vessel].set(f"{vessel}.{order}", np.array(value))


def pipe_speed(assembly: Assembly, value: float) -> None:
    assembly.fluid.emitters[0].speed = value


NEVER = (math.nan, math.inf, 2e12)
ANY_PUSH = "allowed: finite, in N"
INPUTS = {
    "wind": Input(
        "allowed: 0 or more and at most 100 m/s", (-1.0, 5e4), "sea.wind.speed", "sea.wind.speed", signaled("wind")
    ),
    "wind direction": Input(
        "allowed: finite, in rad", (), "sea.wind.direction", "sea.wind.direction", signaled("wind", direction=True)
    ),
    "gusts": Input("allowed: 0 or more and at most 0.5", (-0.1, 0.6), "sea.wind.gust_intensity"),
    "waves": Input("allowed: 0 or more m", (-0.1,), "sea.waves.height"),
    "current": Input("allowed: 0 or more and at most 100 m/s", (101.0,), "sea.current.speed", "sea.current.speed", signaled("current")),
    "current direction": Input(
        "allowed: finite, in rad", (), "sea.current.direction", "sea.current.direction", signaled("current", direction=True)
    ),
    "pipe": Input("allowed: 0 or more m/s", (-0.1,), "emitters.pipe.speed", "", pipe_speed),
    "tow": Input("allowed: 0 or more and at most 20 m/s", (-0.5, 21.0), "tow.speed", "tow.speed"),
    "tow heading": Input("allowed: finite, in rad", (), "tow.heading", "tow.heading", ordered("follower", "heading_order")),
    "leg": Input(
        "allowed: -20 or more and at most 20 m/s", (-21.0, 21.0), "vessels.legged.legs.0.speed", "vessels.legged.speed_order",
        ordered("legged", "speed_order"),
    ),
    "leg heading": Input(
        "allowed: finite, in rad", (), "vessels.legged.legs.0.heading", "vessels.legged.heading_order", ordered("legged", "heading_order")
    ),
    "thrust": Input(ANY_PUSH, (), "", "vessels.pushed.thrust_order", ordered("pushed", "thrust_order")),
    "side thrust": Input(ANY_PUSH, (), "", "vessels.pushed.side_thrust_order", ordered("pushed", "side_thrust_order")),
    "moment": Input("allowed: finite, in N m", (), "", "vessels.pushed.yaw_moment_order", ordered("pushed", "yaw_moment_order")),
}  # fmt: skip


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return scenario_from(tomllib.loads(TEXT))


@pytest.fixture(scope="module")
def assembly(scenario: Scenario) -> Assembly:
    return build(scenario)


def refused(call: Callable[[], object], one: Input, value: float) -> None:
    """The call is refused in words that give the value and what is allowed."""
    with pytest.raises(ValueError) as told:  # a ScenarioError is one
        call()
    said = str(told.value)
    assert one.allowed in said or (not abs(value) <= 1e12 and "allowed: " in said), said
    assert f"{value!r}" in said or f"{value:g}" in said, said


CASES = [(name, value) for name, one in INPUTS.items() for value in (*one.wrong, *NEVER)]


@pytest.mark.parametrize(("name", "value"), CASES)
def test_every_entrance_has_the_limits_of_the_file(
    name: str, value: float, scenario: Scenario, assembly: Assembly
) -> None:
    one = INPUTS[name]
    if one.key:
        data = tomllib.loads(TEXT)
        refused(lambda: scenario_from(with_override(data, tuple(one.key.split(".")), value)), one, value)
        setting = f"{one.key}={value!r}"
        if ".legs." not in one.key:  # a leg is ordered with its list
            refused(lambda: Plan(scenario=scenario).changed((setting,), 1), one, value)
    if one.signal:
        exercise = ExerciseParticipant("exercise", scenario)
        refused(lambda: exercise.set(one.signal, np.array([value])), one, value)
        inputs = {key: signal for key, signal in signals_of(scenario).items() if signal.is_input}
        board = SignalBoard("orders", inputs, assembly.parts)
        saved: Any = board.save_state()
        refused(lambda: board.set(one.signal, np.array([value])), one, value)
        assert board.save_state() == saved  # nothing is taken of a value that is refused
        forged = {"values": {**saved["values"], one.signal: value}, "given": [one.signal]}
        refused(lambda: board.restore_state(forged), one, value)
    if one.assign is not None:
        refused(lambda: one.assign(assembly, value), one, value)


def test_every_input_of_a_run_is_in_the_table(scenario: Scenario) -> None:
    inputs = {name for name, signal in signals_of(scenario).items() if signal.is_input}
    assert inputs == {one.signal for one in INPUTS.values() if one.signal}


@pytest.mark.parametrize("flow", [(5e4, 0.0), (1.0, math.nan), (-0.1, 0.0)])
@pytest.mark.parametrize("kind", ["wind", "current"])
def test_a_saved_sea_has_the_same_limits(kind: str, flow: tuple[float, float], assembly: Assembly) -> None:
    saved = assembly.sea.save_state()
    with pytest.raises(ValueError, match="allowed: "):
        assembly.sea.restore_state({"signaled": {kind: flow}})
    assembly.sea.restore_state(saved)


@pytest.mark.parametrize("vessel", ["legged", "pushed"])
def test_a_saved_helmsman_has_the_same_limits(vessel: str, assembly: Assembly) -> None:
    control = assembly.parts.controls[vessel]
    saved: Any = control.save_state()
    control.restore_state(saved)
    for name, wrong in ((f"{vessel}.pose", np.zeros(2)), (next(iter(saved["values"])), np.array("x"))):
        with pytest.raises(ValueError):
            control.restore_state({**saved, "values": {**saved["values"], name: wrong}})
    if "state" in saved:
        with pytest.raises(ValueError, match="speed_order is 21"):
            control.restore_state({**saved, "state": {**saved["state"], "speed_order": 21.0}})


@pytest.mark.parametrize(
    ("start", "value"),
    [("base = 4.0, peak = 1e5, start = 0.0", "116.2"), pytest.param("base = -4.0", "-2.05", marks=pytest.mark.slow)],
)
def test_an_fmu_cannot_drive_a_wind_that_a_file_cannot_have(
    start: str, value: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The run ends at once with signal, value, source, time and limits, and keeps its recording."""
    monkeypatch.chdir(tmp_path)
    squall = Path(__file__).parents[3] / "docs" / "fmus" / "squall.py"
    assert main(["build-fmu", str(squall), "-o", "squall.fmu"]) == 0
    fmu = f'\n[fmus.squall]\nfile = "squall.fmu"\nstart = {{ {start} }}\noutputs = {{ speed = "sea.wind.speed" }}\n'
    (tmp_path / "storm.toml").write_text(TEXT + fmu)
    capsys.readouterr()
    assert main(["run", "storm.toml", "--record", "storm.rrd"]) == 1
    said = " ".join(capsys.readouterr().err.split())
    for part in ("sea.wind.speed", value, "fmus.squall:speed", "failed at 0", "0 or more and at most 100 m/s"):
        assert part in said, said
    assert "Traceback" not in said
    recording = Replay(tmp_path / "storm.rrd")
    assert "failed" in recording.end_reason


EXTREMES = (0.0, 5e-324, 1e-300, 1e300, -1e300, 1e12, -1e12, 10**400, 2**63, math.nan, math.inf, -math.inf)


@pytest.mark.parametrize("value", EXTREMES)
def test_every_number_of_a_scenario_may_be_given_any_value(value: float, scenario: Scenario) -> None:
    """It is refused in words, or can be checked further: no overflow, no traceback; steps that nobody can count are refused."""
    data = as_data(scenario)
    numbers = [path for path, old in paths_of(data) if isinstance(old, int | float) and not isinstance(old, bool)]
    assert len(numbers) > 60
    for path in numbers:
        with contextlib.suppress(ScenarioError):
            taken = scenario_from(with_override(data, tuple(path.split(".")), value))
            assert 1 <= taken.run.duration / taken.run.communication_step <= 1e9
            require_memory(resolve(taken))
