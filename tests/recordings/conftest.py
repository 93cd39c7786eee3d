"""Fixtures of the recording tests."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

from recordings.sink.recorder import Recorder

PROGRAM = Path(__file__).with_name("writing_program.py")


@pytest.fixture(scope="session")
def made_up() -> ModuleType:
    """The made-up run of `writing_program.py`."""
    spec = importlib.util.spec_from_file_location("writing_program", PROGRAM)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def record(made_up: ModuleType, tmp_path: Path) -> Callable[..., Path]:
    """Record some frames of the made-up run; returns the file."""

    def write(frame_count: int = 35, **terms: object) -> Path:
        path = tmp_path / "made-up.rrd"
        recorder = Recorder(path, **({"frame_rate": 1.0 / made_up.STEP} | terms))
        recorder.initialized(made_up.describe())
        for index in range(frame_count):
            recorder.step_completed(made_up.make_frame(index))
        recorder.terminated("completed")
        return path

    return write
