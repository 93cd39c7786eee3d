"""Checkpoints: files with the whole state of a run, from which it continues as if it had never stopped.

A state is a nested dict of arrays and plain values. A .npz file holds its arrays bit for bit, and its structure as JSON text. A
checkpoint contains no code: one from an unknown source can be wrong but cannot execute anything. The file holds a hash of all else that it
holds, so damage is seen before a run goes on, whatever it makes of a number.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from recordings.files.writing import RecordingError

FORMAT_VERSION = 21
_STRUCTURE, _HASH = "structure", "hash"
_ARRAY, _TUPLE, _BYTES, _HUGE, _REAL = "__array__", "__tuple__", "__bytes__", "__int__", "__float__"
_MARKS = (_ARRAY, _TUPLE, _BYTES, _HUGE, _REAL)
_KINDS = {
    "scenario_hash": (str, "a text"), "index": (int, "a whole number"), "run": (dict, "a table"), "state": (dict, "a table"),
}  # fmt: skip
_EXACT_INTEGERS = 2**63
DAMAGED = "is damaged: what it holds has another hash than what was saved"


class CheckpointError(RecordingError):
    """A checkpoint that cannot be written, read or used for this run."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Checkpoint:
    """A state, with the run and the time that it belongs to.

    Attributes:
        scenario_hash: identifies the scenario.
        index: communication step; time: simulated time [s].
        run: description of the run by the program that runs it, sufficient to start it again.
        state: nested dicts of arrays and plain values.
    """

    scenario_hash: str
    index: int
    time: float
    run: dict[str, Any]
    state: dict[str, Any]


def state_hash(state: Mapping[str, Any]) -> str:
    """Compute a hash of a whole state, every byte of it, that is equal for states that are equal bit for bit.

    Lists and tuples count alike. Raises TypeError for a state that holds more than arrays and plain values.
    """
    arrays: dict[str, np.ndarray] = {}
    structure = json.dumps(_take_apart(_as_lists(state), "state", arrays), sort_keys=True)
    return _digest(structure.encode(), arrays)


def _digest(begin: bytes, arrays: Mapping[str, np.ndarray]) -> str:
    """Compute a hash of bytes and of every byte, type and shape of arrays."""
    digest = hashlib.sha256(begin)
    for name in sorted(arrays):
        array = arrays[name]
        digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def state_to_bytes(state: Mapping[str, Any]) -> bytes:
    """Write a state to bytes, bit for bit; TypeError for a state that holds more than arrays and plain values."""
    arrays: dict[str, np.ndarray] = {}
    structure = _take_apart(state, "state", arrays)
    buffer = io.BytesIO()
    np.savez(buffer, **packed(structure, arrays))  # type: ignore[arg-type]
    return buffer.getvalue()


def state_from_bytes(data: bytes) -> dict[str, Any]:
    """Read a state from the bytes of `state_to_bytes`; ValueError for other bytes."""
    try:
        structure, arrays, is_whole = _unpacked(io.BytesIO(data))
    except (KeyError, EOFError, AttributeError, zipfile.BadZipFile) as error:
        raise ValueError(f"the bytes are not a saved state: {error}") from error
    if not is_whole:
        raise ValueError(f"the saved state {DAMAGED}")
    state: dict[str, Any] = _put_together(structure, arrays)
    return state


def save_checkpoint(path: str | Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint; if the run is killed meanwhile, the previous file stays whole. CheckpointError if it cannot be written."""
    target = Path(path)
    arrays: dict[str, np.ndarray] = {}
    structure = {
        "format_version": FORMAT_VERSION,
        "scenario_hash": checkpoint.scenario_hash,
        "index": checkpoint.index,
        "time": checkpoint.time.hex(),
        "run": checkpoint.run,
        "state": _take_apart(checkpoint.state, "state", arrays),
    }
    content = packed(structure, arrays)
    unfinished = target.with_name(f".{target.name}.{os.getpid()}")
    try:
        with unfinished.open("wb") as file:
            np.savez(file, **content)  # type: ignore[arg-type]
            file.flush()
            os.fsync(file.fileno())
        unfinished.replace(target)
        _sync_folder(target.parent)
    except OSError as error:
        unfinished.unlink(missing_ok=True)
        raise CheckpointError(target, f"cannot be written: {error.strerror or error}") from error


def load_checkpoint(path: str | Path) -> Checkpoint:
    """Read a checkpoint; CheckpointError if it cannot be read or has another format."""
    source = Path(path)
    try:
        return _read(source)
    except OSError as error:
        raise CheckpointError(source, f"cannot be read: {error.strerror or error}") from error
    except (
        ValueError, TypeError, LookupError, EOFError, AttributeError, ArithmeticError, RecursionError, MemoryError,
        NotImplementedError, zipfile.BadZipFile, zlib.error,
    ) as error:  # fmt: skip
        raise CheckpointError(source, f"is not a checkpoint, or was cut off: {error}") from error


def _read(source: Path) -> Checkpoint:
    """Read the checkpoint in a file that numpy has written; other files raise various errors."""
    structure, arrays, is_whole = _unpacked(source)
    version = structure.get("format_version")
    if version != FORMAT_VERSION:
        raise CheckpointError(
            source, f"has format version {version}, allowed: version {FORMAT_VERSION}, which this program reads"
        )
    if not is_whole:
        raise CheckpointError(source, DAMAGED)
    for key, (kind, allowed) in _KINDS.items():
        if type(structure[key]) is not kind:
            raise ValueError(f"its {key} is a {type(structure[key]).__name__}, allowed: {allowed}")
    return Checkpoint(
        scenario_hash=structure["scenario_hash"],
        index=structure["index"],
        time=float.fromhex(structure["time"]),
        run=structure["run"],
        state=_put_together(structure["state"], arrays),
    )


def packed(structure: Any, arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return arrays, in their shapes and units, with a structure as JSON text (n,) and the hash of all of it (64,), both bytes: a file."""
    text = json.dumps(structure).encode()
    hashed = _digest(text, arrays).encode()
    return {**arrays, _STRUCTURE: np.frombuffer(text, np.uint8), _HASH: np.frombuffer(hashed, np.uint8)}


def _unpacked(source: Path | io.BytesIO) -> tuple[Any, dict[str, np.ndarray], bool]:
    """Read what `packed` made: structure, arrays, and whether they have their hash; other files raise various errors."""
    try:
        with np.load(source, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
    except (SyntaxError, tokenize.TokenError) as error:  # numpy reads an array's header as Python's text
        raise ValueError(f"an array's header is damaged: {error}") from error
    text, hashed = arrays.pop(_STRUCTURE).tobytes(), arrays.pop(_HASH, np.empty(0)).tobytes()
    return json.loads(text), arrays, hashed == _digest(text, arrays).encode()


def _as_lists(value: Any) -> Any:
    """Return the value with lists in place of tuples."""
    if isinstance(value, Mapping):
        return {key: _as_lists(item) for key, item in value.items()}
    return [_as_lists(item) for item in value] if isinstance(value, list | tuple) else value


def _take_apart(value: Any, where: str, arrays: dict[str, np.ndarray]) -> Any:
    """Turn a value into JSON and move its arrays to ``arrays``; numbers keep every bit, and keys must be texts."""
    if isinstance(value, np.ndarray | np.generic):
        return _take_array(np.asarray(value), isinstance(value, np.generic), where, arrays)
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str) or key in _MARKS:
                raise TypeError(
                    f"checkpoint {where} has the key {key!r}, allowed: texts other than {', '.join(_MARKS)}"
                )
        return {key: _take_apart(item, f"{where}/{key}", arrays) for key, item in value.items()}
    if isinstance(value, list | tuple):
        items = [_take_apart(item, f"{where}/{place}", arrays) for place, item in enumerate(value)]
        return {_TUPLE: items} if isinstance(value, tuple) else items
    if isinstance(value, bytes):
        return {_BYTES: value.hex()}
    if isinstance(value, float):
        return {_REAL: value.hex()}
    if isinstance(value, int) and abs(value) >= _EXACT_INTEGERS:
        return {_HUGE: str(value)}
    if value is None or isinstance(value, bool | int | str):
        return value
    raise TypeError(f"checkpoint {where} is a {type(value).__name__}, allowed: arrays and plain values")


def _take_array(array: np.ndarray, scalar: bool, where: str, arrays: dict[str, np.ndarray]) -> dict[str, Any]:
    """Move one array to ``arrays`` and return a reference to it."""
    if array.dtype.hasobject:
        raise TypeError(f"checkpoint {where} is an array of Python objects, allowed: arrays of numbers")
    name = f"array-{len(arrays)}"
    arrays[name] = array
    return {_ARRAY: name, "scalar": scalar}


def _put_together(value: Any, arrays: Mapping[str, np.ndarray]) -> Any:
    """Rebuild the value that `_take_apart` took apart."""
    if isinstance(value, list):
        return [_put_together(item, arrays) for item in value]
    if not isinstance(value, dict):
        return value
    if _ARRAY in value:
        array = arrays[value[_ARRAY]]
        return array[()] if value["scalar"] else array
    if _TUPLE in value:
        return tuple(_put_together(item, arrays) for item in value[_TUPLE])
    if _BYTES in value:
        return bytes.fromhex(value[_BYTES])
    if _REAL in value:
        return float.fromhex(value[_REAL])
    if _HUGE in value:
        return int(value[_HUGE])
    return {key: _put_together(item, arrays) for key, item in value.items()}


def _sync_folder(folder: Path) -> None:
    """Make the new file name survive a power failure."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
