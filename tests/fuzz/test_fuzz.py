"""A few trials of `make fuzz`, and the stand itself: it sees every kind of fault."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from scenarios.cli import main
from tests.fuzz import trials
from tests.fuzz.damaged_files import MESH_TANK, make_meshes, make_winds, mesh_trial, wind_trial
from tests.fuzz.exercises import export_trial, make_exercises, resume_trial, sweep_trial
from tests.fuzz.hostile_numbers import criteria_trial, make_exercise, order_trial, signal_trial
from tests.fuzz.scenario_files import scenario_trial
from tests.fuzz.trials import tried

SEEDS = range(7000, 7005)  # `make fuzz` draws thousands


def found(call: Callable[[int], int], seeds: range = SEEDS) -> dict[int, str]:
    """The faults by seed."""
    outcomes = {seed: tried(lambda seed=seed: call(seed)) for seed in seeds}
    return {seed: outcome.fault for seed, outcome in outcomes.items() if outcome.fault}


def test_spoiled_scenarios_are_refused_in_words_or_work() -> None:
    assert found(scenario_trial) == {}


def test_spoiled_meshes_are_refused_in_words_or_work(tmp_path: Path) -> None:
    meshes = make_meshes(tmp_path)
    for mesh in meshes:
        (tmp_path / "scene.toml").write_text(MESH_TANK.format(file=f'"{mesh}"'))
        assert main(["check", str(tmp_path / "scene.toml")]) == 0  # the sound one
    assert found(lambda seed: mesh_trial(seed, meshes)) == {}


def test_spoiled_winds_are_refused_in_words_or_work(tmp_path: Path) -> None:
    winds = make_winds(tmp_path)
    assert found(lambda seed: wind_trial(seed, winds), range(7000, 7020)) == {}


@pytest.mark.slow
def test_spoiled_exercises_are_refused_in_words_or_go_on_right(tmp_path: Path) -> None:
    exercises = make_exercises(tmp_path)
    for trial in (resume_trial, export_trial, sweep_trial):
        assert found(lambda seed, trial=trial: trial(seed, exercises)) == {}


def test_hostile_orders_signals_and_criteria_are_refused_in_words_or_work() -> None:
    exercise = make_exercise()
    assert found(lambda seed: order_trial(seed, exercise[0])) == {}
    assert found(lambda seed: signal_trial(seed, exercise), range(7000, 7010)) == {}
    assert found(criteria_trial, range(7000, 7010)) == {}


def dies() -> int:
    os.abort()


def sleeps() -> int:
    time.sleep(60.0)
    return 0


def hangs() -> int:
    while True:
        pass


def devours() -> int:
    return int(np.ones(2 * trials.LARGEST // 8).sum())


def litters() -> int:
    Path("litter").touch()
    return 0


@pytest.mark.parametrize(
    ("call", "fault"),
    [
        (dies, "was ended by SIGABRT"), (sleeps, "slept for 0.5 s"), (hangs, "took more than 1 s"),
        (devours, "ended in a traceback"), (litters, "left work/litter"),
        (lambda: 1 // 0, "ended in a traceback"), (lambda: 7, "ended with exit code 7"), (lambda: 2, "ended with exit code 2 and no word"),
        (lambda: 0, ""),
    ],
)  # fmt: skip
def test_the_stand_sees_every_kind_of_fault(
    call: Callable[[], int], fault: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    if call is sleeps:
        monkeypatch.setattr(trials, "WAITED", 0.5)
    monkeypatch.setattr(trials, "LONGEST", 1)
    assert tried(call).fault.startswith(fault)
    if not fault:
        assert tried(call).fault == ""
