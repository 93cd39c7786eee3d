"""A run goes on from a whole state or not at all: an entry dropped or spoiled is refused in words or changes nothing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from recordings.files.checkpoint import load_checkpoint, save_checkpoint
from scenarios.cli import main

RUN = ["--until", "0.05", "--threads", "1"]


def entries(state: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths of all entries of nested tables."""
    for key, value in state.items():
        yield (*path, key)
        if isinstance(value, dict):
            yield from entries(value, (*path, key))


def spoiled(value: Any) -> Any:
    """Another type in place of a value."""
    if isinstance(value, np.ndarray):
        return value.astype(np.float64)[..., None] * np.nan
    return {} if not isinstance(value, dict) else 1.0


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    settings = ["--set", "fluid.particle_spacing=0.1", "--set", "recording.checkpoint_interval=0.02"]
    assert main(["run", "floating-box", *settings, *RUN, "--record", str(folder / "run.rrd")]) == 0
    return sorted((folder / "run.checkpoints").glob("*.npz"))[1]


@pytest.mark.parametrize("what", ["dropped", pytest.param("spoiled", marks=pytest.mark.slow)])
def test_no_entry_that_is_dropped_or_spoiled_ends_in_an_error_of_python(
    what: str, checkpoint: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = load_checkpoint(checkpoint)
    paths = list(entries(whole.state))
    assert len(paths) > 50
    target = tmp_path / "step-000000001.npz"
    for path in paths[:: 1 if what == "spoiled" else 14]:
        state = load_checkpoint(checkpoint).state
        table = state
        for key in path[:-1]:
            table = table[key]
        if what == "dropped":
            del table[path[-1]]
        else:
            table[path[-1]] = spoiled(table[path[-1]])
        changed = type(whole)(
            scenario_hash=whole.scenario_hash, index=whole.index, time=whole.time, run=whole.run, state=state
        )
        save_checkpoint(target, changed)
        assert main(["run", "--resume", str(target), "--no-record", "--until", "0.06"]) in (0, 1, 2), path
        assert "Traceback" not in capsys.readouterr().err


@pytest.mark.parametrize("versions", [3.0, [], "x", None])
def test_versions_that_are_no_table_count_as_others(
    versions: Any, checkpoint: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = load_checkpoint(checkpoint)
    save_checkpoint(tmp_path / "step-000000001.npz", replace(whole, run=whole.run | {"versions": versions}))
    assert main(["run", "--resume", str(tmp_path / "step-000000001.npz"), "--no-record", "--until", "0.06"]) == 0
    told = " ".join(capsys.readouterr().err.split())  # the console wraps lines wherever a path is long
    assert "results may differ in the last bits: oilsim None then" in told


@pytest.mark.parametrize(
    "change",
    [{"overrides": [1]}, {"overrides": 1}, {"text": 2.5}, {"actions": [{"index": "1", "set": ["tow.speed=1"]}]}, {"actions": [3]},
     {"actions": [{"index": 1, "set": [None]}]}, {"actions": None}],
)  # fmt: skip
def test_a_plan_of_other_types_is_refused(
    change: dict[str, Any], checkpoint: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = load_checkpoint(checkpoint)
    save_checkpoint(tmp_path / "step-000000001.npz", replace(whole, run=whole.run | change))
    assert main(["run", "--resume", str(tmp_path / "step-000000001.npz"), "--no-record", "--until", "0.06"]) == 2
    assert "has no scenario that this program can run: " in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize("change", [{"text": b"x"}, {"time": "x"}, {"time": float("nan")}, {"source": 1}])
def test_events_of_other_types_are_refused(
    change: dict[str, Any], checkpoint: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = load_checkpoint(checkpoint)
    whole.state["summary"]["events"][0] |= change
    save_checkpoint(tmp_path / "step-000000001.npz", whole)
    asked = ["run", "--resume", str(tmp_path / "step-000000001.npz"), "--no-record", "--until", "0.06"]
    assert main([*asked, "--summary", str(tmp_path / "summary.json")]) == 1
    assert "summary/events" in capsys.readouterr().err
