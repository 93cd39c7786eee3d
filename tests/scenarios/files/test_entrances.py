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
from scenarios.controls.signals import Signal, SignalBoard, signals_of
from scenarios.running.assembly import Assembly, build
from scenarios.running.exercise_fmu import ExerciseParticipant
from scenarios.running.plan import Plan
from scenarios.schema.parsing.overrides import with_override
from scenarios.schema.parsing.structuring import as_data
from scenarios.setup.cost import require_memory
from scenarios.spec.load import scenario_from
from scenarios.spec.resolve import resolve
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import ScenarioError
from tests.fuzz.scenario_files import paths_of

TEXT = (Path(__file__).parent / "all_inputs.toml").read_text(encoding="utf-8")


@dataclass(frozen=True)
class Input:
    """One input of a run. key: in the file, in orders and as a signal; assign: sets it on the part behind."""

    allowed: str
    wrong: tuple[float, ...]
    key: str
    assign: Callable[[Assembly, float], None] | None = None


def ordered(vessel: str, order: str) -> Callable[[Assembly, float], None]:
    return lambda assembly, value: assembly.parts.helms[vessel].set(f"{vessel}.{order}", np.array(value))


def pipe_speed(assembly: Assembly, value: float) -> None:
    assembly.fluid.emitters[0].speed = value


NEVER = (math.nan, math.inf, 2e12)
SPEED, ANGLE, PUSH = "allowed: 0 or more and at most 100 m/s", "allowed: finite, in rad", "allowed: finite, in N"
INPUTS = {
    "wind": Input(SPEED, (-1.0, 5e4), "sea.wind.speed"),
    "wind direction": Input(ANGLE, (), "sea.wind.direction"),
    "gusts": Input("allowed: 0 or more and at most 0.5", (-0.1, 0.6), "sea.wind.gust_intensity"),
    "waves": Input("allowed: 0 or more m", (-0.1,), "sea.waves.height"),
    "current": Input(SPEED, (101.0,), "sea.current.speed"),
    "current direction": Input(ANGLE, (), "sea.current.direction"),
    "pipe": Input(SPEED, (-0.1, 1e6), "emitters.pipe.speed", pipe_speed),
    "tow": Input("allowed: 0 or more and at most 20 m/s", (-0.5, 21.0), "tow.speed"),
    "tow heading": Input(ANGLE, (), "tow.heading", ordered("follower", "heading_order")),
    "leg": Input(
        "allowed: -20 or more and at most 20 m/s", (-21.0, 21.0), "vessels.legged.legs.0.speed", ordered("legged", "speed_order")
    ),
    "leg heading": Input(ANGLE, (), "vessels.legged.legs.0.heading", ordered("legged", "heading_order")),
    "thrust": Input(PUSH, (), "vessels.pushed.thrust_order", ordered("pushed", "thrust_order")),
    "side thrust": Input(PUSH, (), "vessels.pushed.side_thrust_order", ordered("pushed", "side_thrust_order")),
    "moment": Input(PUSH, (), "vessels.pushed.yaw_moment_order", ordered("pushed", "yaw_moment_order")),
}  # fmt: skip


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return scenario_from(tomllib.loads(TEXT))


@pytest.fixture(scope="module")
def assembly(scenario: Scenario) -> Assembly:
    return build(scenario)


def inputs_of(scenario: Scenario) -> dict[str, Signal]:
    return {name: signal for name, signal in signals_of(scenario.parts).items() if signal.is_input}


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
    data = tomllib.loads(TEXT)
    refused(lambda: scenario_from(with_override(data, tuple(one.key.split(".")), value)), one, value)
    refused(lambda: Plan(scenario=scenario).changed((f"{one.key}={value!r}",), 1), one, value)
    if one.key in inputs_of(scenario):
        exercise = ExerciseParticipant("exercise", scenario)
        refused(lambda: exercise.set(one.key, np.array([value])), one, value)
        board = SignalBoard("orders", inputs_of(scenario), assembly.parts)
        refused(lambda: board.set(one.key, np.array([value])), one, value)
        assert board.save_state() == {}  # nothing is taken of a value that is refused
        refused(lambda: board.restore_state({one.key: value}), one, value)
        refused(lambda: assembly.controls.restore_state({"signaled": {one.key: value}}), one, value)
    if one.assign is not None:
        refused(lambda: one.assign(assembly, value), one, value)


def test_every_input_of_a_run_is_in_the_table(scenario: Scenario) -> None:
    assert inputs_of(scenario).keys() <= {one.key for one in INPUTS.values()}


@pytest.mark.parametrize("vessel", ["legged", "pushed"])
def test_a_saved_helmsman_has_the_same_limits(vessel: str, assembly: Assembly) -> None:
    control = assembly.parts.helms[vessel]
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
