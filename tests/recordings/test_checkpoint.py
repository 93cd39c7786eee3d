"""Checkpoints give back every bit, and refuse what does not belong."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from recordings.files import checkpoint as module
from recordings.files.checkpoint import (
    Checkpoint,
    CheckpointError,
    load_checkpoint,
    packed,
    save_checkpoint,
    state_hash,
)

HASH = "5c1e" * 16
RUN = {"scenario": {"name": "made-up"}, "actions": []}
ARRAYS = hnp.arrays(
    dtype=st.sampled_from([np.float32, np.float64, np.uint32, np.int64, np.bool_]),
    shape=hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4),
)
PLAIN = st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.binary() | ARRAYS
KEYS = st.text(min_size=1, max_size=6).filter(lambda key: not key.startswith("__"))
STATES = st.dictionaries(
    KEYS,
    st.recursive(
        PLAIN, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=3), max_leaves=8
    ),
    max_size=4,
)


def _checkpoint(state: dict[str, Any]) -> Checkpoint:
    return Checkpoint(scenario_hash=HASH, index=17, time=0.1 + 0.2, run=RUN, state=state)


def _opened(path: Path) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Structure and arrays of a checkpoint, without their hash."""
    with np.load(path) as file:
        arrays = dict(file)
    del arrays["hash"]
    return json.loads(arrays.pop("structure").tobytes()), arrays


def _assert_same(read: Any, written: Any) -> None:
    """Equal to the last bit and of the same type; NaN equals itself."""
    assert type(read) is type(written)
    if isinstance(written, dict):
        assert list(read) == list(written)
        for key in written:
            _assert_same(read[key], written[key])
    elif isinstance(written, list | tuple):
        assert len(read) == len(written)
        for left, right in zip(read, written, strict=True):
            _assert_same(left, right)
    elif isinstance(written, np.ndarray | np.generic):
        assert read.dtype == written.dtype and read.shape == written.shape
        assert read.tobytes() == written.tobytes()
    elif isinstance(written, float):
        assert read.hex() == written.hex()
    else:
        assert read == written


@settings(max_examples=60, deadline=None)
@given(state=STATES)
def test_any_state_comes_back_bit_for_bit(tmp_path_factory: pytest.TempPathFactory, state: dict[str, Any]) -> None:
    path = tmp_path_factory.mktemp("checkpoint") / "run.npz"
    save_checkpoint(path, _checkpoint(state))
    read = load_checkpoint(path)
    _assert_same(read.state, state)
    assert (read.index, read.time, read.run, read.scenario_hash) == (17, 0.1 + 0.2, RUN, HASH)
    assert state_hash(read.state) == state_hash(state)


def test_a_random_generator_goes_on_where_it_stopped(tmp_path: Path) -> None:
    generator = np.random.default_rng(7)
    generator.normal(size=1001)
    save_checkpoint(tmp_path / "run.npz", _checkpoint({"wind": generator.bit_generator.state}))
    expected = generator.normal(size=5)
    restored = np.random.default_rng()
    restored.bit_generator.state = load_checkpoint(tmp_path / "run.npz").state["wind"]
    np.testing.assert_array_equal(restored.normal(size=5), expected)


def test_all_bytes_count_in_the_state_hash() -> None:
    assert state_hash({"bullet": b"one", "time": 1.0}) == state_hash({"time": 1.0, "bullet": b"one"})
    assert state_hash({"bullet": b"one", "time": 1.0}) != state_hash({"bullet": b"two", "time": 1.0})
    assert state_hash({"bullet": b"one", "time": 1.0}) != state_hash({"bullet": b"one", "time": 2.0})


def test_one_bit_changes_the_state_hash() -> None:
    state = {"position": np.zeros(9, dtype=np.float32), "rate": 1.0}
    other = {"position": np.zeros(9, dtype=np.float32), "rate": math.nextafter(1.0, 2.0)}
    assert state_hash(state) == state_hash({"rate": 1.0, "position": np.zeros(9, dtype=np.float32)})
    assert state_hash(state) != state_hash(other)
    other = {"position": np.zeros(9, dtype=np.float32), "rate": 1.0}
    other["position"][4] = np.nextafter(np.float32(0.0), np.float32(1.0))
    assert state_hash(state) != state_hash(other)


@pytest.mark.parametrize("place", [0, 500, -1])
def test_every_place_of_an_array_counts_in_the_state_hash(place: int) -> None:
    state, other = ({"parts": [{"position": np.zeros((333, 3), dtype=np.float32)}]} for _ in range(2))
    other["parts"][0]["position"].flat[place] = np.nextafter(np.float32(0.0), np.float32(1.0))
    assert state_hash(state) != state_hash(other)


def test_another_format_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "FORMAT_VERSION", 99)
    save_checkpoint(tmp_path / "run.npz", _checkpoint({}))
    monkeypatch.undo()
    with pytest.raises(
        CheckpointError, match=f"has format version 99, allowed: version {module.FORMAT_VERSION}, which"
    ):
        load_checkpoint(tmp_path / "run.npz")


@pytest.mark.parametrize("content", [b"", b"dear trainer", b"PK\x03\x04"])
def test_what_is_no_checkpoint_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "run.npz").write_bytes(content)
    with pytest.raises(CheckpointError, match=r"run.npz: is not a checkpoint, or was cut off"):
        load_checkpoint(tmp_path / "run.npz")


@pytest.mark.parametrize(
    ("name", "value"),
    [("scenario_hash", 1.5), ("index", "2"), ("index", True), ("index", None), ("run", []), ("state", [1])],
)
def test_a_checkpoint_with_a_part_of_another_type_is_refused(tmp_path: Path, name: str, value: Any) -> None:
    path = tmp_path / "run.npz"
    save_checkpoint(path, _checkpoint({"position": np.arange(3.0)}))
    structure, arrays = _opened(path)
    np.savez(path, **packed(structure | {name: value}, arrays))
    with pytest.raises(CheckpointError, match=f"was cut off: its {name} is a {type(value).__name__}, allowed: a "):
        load_checkpoint(path)


@pytest.mark.parametrize("name", ["array-0", "scenario_hash", "index", "time", "run", "state"])
def test_a_checkpoint_that_lacks_something_is_refused(tmp_path: Path, name: str) -> None:
    path = tmp_path / "run.npz"
    save_checkpoint(path, _checkpoint({"position": np.arange(3.0)}))
    structure, arrays = _opened(path)
    del (arrays if name in arrays else structure)[name]
    np.savez(path, **packed(structure, arrays))
    with pytest.raises(CheckpointError, match=f"is not a checkpoint, or was cut off: .*{name}"):
        load_checkpoint(path)


def test_a_bare_array_is_no_checkpoint(tmp_path: Path) -> None:
    with (tmp_path / "run.npz").open("wb") as file:
        np.save(file, np.arange(3.0))
    with pytest.raises(CheckpointError, match="is not a checkpoint"):
        load_checkpoint(tmp_path / "run.npz")


def test_a_cut_checkpoint_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.npz"
    save_checkpoint(path, _checkpoint({"position": np.arange(3000.0)}))
    os.truncate(path, path.stat().st_size // 2)
    with pytest.raises(CheckpointError, match="is not a checkpoint, or was cut off"):
        load_checkpoint(path)


def test_a_failed_save_leaves_the_one_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "run.npz"
    save_checkpoint(path, _checkpoint({"step": 1}))

    def full_disk(handle: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(module.os, "fsync", full_disk)
    with pytest.raises(CheckpointError, match="cannot be written: No space left on device"):
        save_checkpoint(path, _checkpoint({"step": 2}))
    monkeypatch.undo()
    assert load_checkpoint(path).state == {"step": 1}
    assert [file.name for file in tmp_path.iterdir()] == ["run.npz"]


@pytest.mark.parametrize(
    ("state", "message"),
    [
        ({"fluid": {"solver": object()}}, "checkpoint state/fluid/solver is a object"),
        ({"names": np.array([{}], dtype=object)}, "checkpoint state/names is an array of Python objects"),
        ({3: 1.0}, "checkpoint state has the key 3"),
        ({"__array__": "x"}, "checkpoint state has the key '__array__'"),
    ],
)
def test_what_cannot_be_kept_is_refused(tmp_path: Path, state: dict[Any, Any], message: str) -> None:
    with pytest.raises(TypeError, match=message):
        save_checkpoint(tmp_path / "run.npz", _checkpoint(state))
    assert list(tmp_path.iterdir()) == []
