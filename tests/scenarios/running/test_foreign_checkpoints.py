"""Checkpoints from elsewhere, damaged or made up, end in one clear error: no crash, no traceback, nothing left behind."""

from __future__ import annotations

import json
import math
import random
import zipfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from recordings.files.checkpoint import DAMAGED, packed
from scenarios.cli import main
from scenarios.running.run import RunOptions, run_scenario
from scenarios.spec.load import load_scenario

Change = Callable[[dict[str, Any], dict[str, np.ndarray]], None]
Resume = Callable[[Change], str]
ODD: tuple[Any, ...] = (
    None, True, -1, 0, 10**30, "", "x", [], {}, [1, 2], {"__float__": "nan"}, {"__float__": "0x1p+900"}, {"__bytes__": "00"},
    {"__bytes__": "zz"}, {"__array__": "array-0", "scalar": False}, {"__array__": "nowhere", "scalar": True},
)  # fmt: skip


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The state of a floating box after two steps, of a run of four."""
    folder = tmp_path_factory.mktemp("run")
    terms = ["fluid.particle_spacing=0.15", "run.communication_step=0.02", "run.duration=0.08", "run.threads=1"]
    scenario = load_scenario("floating-box", overrides=[*terms, "recording.checkpoint_interval=0.04"]).scenario
    assert run_scenario(scenario, options=RunOptions(record=folder / "whole.rrd")) == 0
    return folder / "whole.checkpoints" / "step-000000002.npz"


def resumed(file: Path, capsys: pytest.CaptureFixture[str], folder: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Resume from a checkpoint and return the messages; an error leaves no file, and no more than a few lines."""
    monkeypatch.chdir(folder)
    before = {path.name for path in folder.iterdir()}
    code = main(["run", "--resume", str(file), "--no-record"])
    said = capsys.readouterr().err
    assert code in (0, 1, 2)
    assert "Traceback" not in said
    if code:
        assert {path.name for path in folder.iterdir()} == before
        assert str(file) in said.replace("\n", "") or "oilsim: " in said
    return said if code else ""


def changed(source: Path, target: Path, change: Change) -> Path:
    """A copy of a checkpoint with its structure and its arrays changed, as if it had been saved so."""
    with np.load(source) as file:
        arrays = {name: file[name] for name in file.files}
    structure = json.loads(arrays.pop("structure").tobytes())
    del arrays["hash"]
    change(structure, arrays)
    np.savez(target, **packed(structure, arrays))  # type: ignore[arg-type]
    return target


@pytest.fixture
def resume(
    checkpoint: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> Resume:
    """Resume from the checkpoint with a change in it, and return the messages."""
    return lambda change: resumed(changed(checkpoint, tmp_path / "odd.npz", change), capsys, tmp_path, monkeypatch)


def places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Every place in a structure, as what holds it and the key there."""
    keys = value.keys() if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
    for key in keys:
        yield value, key
        yield from places(value[key])


def refusals(
    resume: Resume, seeds: int, change: Callable[[random.Random, dict[str, Any], dict[str, np.ndarray]], None]
) -> int:
    """Return how many of so many changes by chance, one for each seed, are refused."""
    return sum(bool(resume(partial(change, random.Random(seed)))) for seed in range(seeds))


def test_made_up_values_are_refused_in_words(resume: Resume) -> None:
    """Most of them; some are what a run may have, as the number 0 where there was another."""

    def change(chance: random.Random, structure: dict[str, Any], arrays: dict[str, np.ndarray]) -> None:
        holder, key = chance.choice(list(places(structure if chance.random() < 0.2 else structure["state"])))
        holder[key] = chance.choice(ODD)

    assert refusals(resume, 12, change) > 4  # 8 of them, measured


def test_made_up_arrays_are_refused_in_words(resume: Resume) -> None:
    """Arrays of another length or type, or with numbers that no run has, are refused: kernels never check an index."""

    def change(chance: random.Random, structure: dict[str, Any], arrays: dict[str, np.ndarray]) -> None:
        name = chance.choice([name for name, values in arrays.items() if values.size])
        values = arrays[name]
        arrays[name] = chance.choice(
            (
                values.ravel()[: values.size // 2],
                np.concatenate([values, values], axis=-1) if values.ndim else values,
                values.astype(np.float16),
                np.full_like(values, 255 if values.dtype == np.uint8 else np.iinfo(np.uint32).max)
                if values.dtype.kind == "u"
                else np.full(values.shape, np.nan),
            )
        )

    assert refusals(resume, 12, change) > 2  # 4


def half(values: np.ndarray) -> np.ndarray:
    return values[..., : values.shape[-1] // 2]


def filled(value: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda values: np.full_like(values, value)


def one_of(value: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda values: np.concatenate([values.ravel()[:-1], [value]]).astype(values.dtype).reshape(values.shape)


FLUID, BODIES = "simulation/participants/fluid/fluid", "simulation/participants/bodies/world/arrays"


@pytest.mark.parametrize(
    ("place", "change"),
    [
        *((f"{FLUID}/state/{name}", half) for name in ("position", "velocity", "phase", "id", "pressure_impulse")),
        *((f"{FLUID}/state/{name}", one_of(math.nan)) for name in ("position", "velocity")),
        (f"{FLUID}/state/phase", one_of(255)),
        *((f"{FLUID}/state/id", change) for change in (filled(7), one_of(2**32 - 1))),
        (f"{BODIES}/pose", half),
        (f"{BODIES}/pose", one_of(math.nan)),
    ],
)
def test_arrays_that_no_run_has_are_refused(
    place: str, change: Callable[[np.ndarray], np.ndarray], resume: Resume
) -> None:
    def changed(structure: dict[str, Any], arrays: dict[str, np.ndarray]) -> None:
        holder = structure["state"]
        for key in place.split("/"):
            holder = holder[key]
        arrays[holder["__array__"]] = change(arrays[holder["__array__"]])

    assert resume(changed)


def test_damaged_engine_states_are_refused_in_words(resume: Resume) -> None:
    """Ten of 256 such files once ended the process in the engine's own reader."""

    def change(chance: random.Random, structure: dict[str, Any], arrays: dict[str, np.ndarray]) -> None:
        holder = next(holder for holder, key in places(structure["state"]) if key == "__bytes__")
        content = bytearray.fromhex(holder["__bytes__"])
        for _ in range(chance.choice((1, 16, 256))):
            content[chance.randrange(len(content))] = chance.randrange(256)
        holder["__bytes__"] = content.hex()

    assert refusals(resume, 10, change) >= 1  # 2


@pytest.mark.parametrize("name", ["structure", "hash", "array-0", "array-7"])
def test_a_damaged_checkpoint_is_refused_whatever_it_holds(
    name: str, checkpoint: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A number that a run might have, in a file that is whole, once made a run end elsewhere without a word."""
    with np.load(checkpoint) as file:
        arrays = {key: file[key].copy() for key in file.files}
    if name == "structure":  # where the run goes on
        text = arrays[name].tobytes()
        arrays[name] = np.frombuffer(text.replace(b'"index": 2', b'"index": 3', 1), np.uint8)
        assert arrays[name].tobytes() != text
    else:
        arrays[name].reshape(-1).view(np.uint8)[-1] ^= 1
    np.savez(tmp_path / "odd.npz", **arrays)  # type: ignore[arg-type]
    said = resumed(tmp_path / "odd.npz", capsys, tmp_path, monkeypatch)
    assert DAMAGED in " ".join(said.split())


@pytest.mark.parametrize(
    ("path", "value"), [("remarks/made", [{"__tuple__": ["drops"]}]), ("figures/steps", {"__float__": "0x0.0p+0"})]
)
def test_values_that_only_a_later_step_or_the_summary_meets_are_refused(path: str, value: Any, resume: Resume) -> None:
    def change(structure: dict[str, Any], arrays: dict[str, np.ndarray]) -> None:
        table, key = path.split("/")
        found = [holder for holder, name in places(structure["state"]) if name == table]
        assert found
        found[0][table][key] = value

    assert resume(change)


def test_an_array_with_a_damaged_header_is_refused(
    checkpoint: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    with zipfile.ZipFile(checkpoint) as whole, zipfile.ZipFile(tmp_path / "odd.npz", "w") as odd:
        for name in whole.namelist():
            content = whole.read(name)
            odd.writestr(name, content.replace(b"'shape': (", b"'shape': ((", 1) if name == "array-0.npy" else content)
    assert resumed(tmp_path / "odd.npz", capsys, tmp_path, monkeypatch)


def test_a_number_that_is_none_is_refused(resume: Resume) -> None:
    """Every one of them; only what a run begins with as None may be so."""

    def change(chance: random.Random, structure: dict[str, Any], arrays: dict[str, np.ndarray]) -> None:
        numbers = [
            (holder, key) for holder, key in places(structure["state"])
            if isinstance(holder, dict) and isinstance(holder[key], dict) and "__float__" in holder[key]
            and key != "first"  # a boom's first loss, which no run begins with
        ]  # fmt: skip
        holder, key = chance.choice(numbers)
        holder[key] = None

    assert refusals(resume, 12, change) == 12


@pytest.mark.parametrize("kept", [0.0, 0.3, 0.9, 0.999])
def test_files_cut_off_or_of_another_kind_are_refused(
    kept: float, checkpoint: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    content = checkpoint.read_bytes()
    (tmp_path / "cut.npz").write_bytes(content[: int(kept * len(content))])
    assert "is not a checkpoint, or was cut off" in resumed(tmp_path / "cut.npz", capsys, tmp_path, monkeypatch)
    with zipfile.ZipFile(tmp_path / "other.npz", "w") as archive:
        archive.writestr("structure.npy", b"no array")
    assert "is not a checkpoint" in resumed(tmp_path / "other.npz", capsys, tmp_path, monkeypatch)


def test_a_checkpoint_nested_without_end_is_refused(
    checkpoint: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    text = b'{"format_version": 10, "state": ' + b"[" * 100_000 + b"]" * 100_000 + b"}"
    np.savez(tmp_path / "deep.npz", structure=np.frombuffer(text, dtype=np.uint8))
    assert "is not a checkpoint" in resumed(tmp_path / "deep.npz", capsys, tmp_path, monkeypatch)
