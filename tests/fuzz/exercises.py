"""A recorded exercise whose checkpoints, exports and sweeps are spoiled, and whose commands are given options that nobody wants."""

from __future__ import annotations

import copy
import io
import json
import math
import random
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import netcdf_file
from shapely.geometry import shape

from recordings.export import geojson, netcdf, vtk_files  # noqa: F401  loaded once for all trials
from recordings.files.checkpoint import Checkpoint, load_checkpoint, save_checkpoint
from scenarios.cli import main
from scenarios.sweeps import charts, sweep  # noqa: F401  loaded once for all trials
from tests.fuzz.damaged_files import spoiled
from tests.fuzz.scenario_files import EXTREMES, OTHERS
from tests.scenarios.small_tow import small_tow

NUMBERS = (0.0, -1.0, 1e300, -1e300, 1e-300, math.nan, math.inf)


@dataclass(frozen=True)
class Exercises:
    """Recordings, each with the checkpoint that a run goes on from and the hash of the state in which it then ends; and a sweep."""

    recordings: tuple[Path, ...]
    checkpoints: tuple[Path, ...]
    ends: tuple[str, ...]
    sweep: Path
    swept: tuple[str, ...]


RUNS = {
    "u-sweep": ("--fidelity", "none", "--set", "run.communication_step=1.0", "--set", "recording.checkpoint_interval=1.0"),
    "floating-box": (
        "--set", "fluid.particle_spacing=0.15", "--set", "run.communication_step=0.02", "--set", "recording.checkpoint_interval=0.02",
    ),
}  # fmt: skip
LENGTHS = {"u-sweep": (1.0, 2.0), "floating-box": (0.02, 0.04)}  # s: of the recorded run, and of the resumed one


def make_exercises(folder: Path) -> Exercises:
    """Record a slick with vessels and a boom, and a tank of particles; go on from each; and sweep a small tow."""
    recordings, checkpoints, ends = [], [], []
    for name, settings in RUNS.items():
        recordings.append(folder / f"{name}.rrd")
        begun, until = LENGTHS[name]
        _made("run", name, *settings, "--threads", "1", "--until", f"{begun}", "--record", str(recordings[-1]))
        checkpoints.append(sorted((folder / f"{name}.checkpoints").glob("*.npz"))[-1])
        end = folder / f"{name}-end.json"
        _made("run", "--resume", str(checkpoints[-1]), "--until", f"{until}", "--no-record", "--summary", str(end))
        ends.append(_end_of(end))
    tow = folder / "tow.toml"
    tow.write_text(small_tow(duration=0.1, communication_step=0.1, frame_rate=10), encoding="utf-8")
    swept = ("sweep", str(tow), "--vary", "tow.speed=0.2,0.3", "--workers", "1")
    _made(*swept, "--to", str(folder / "sweep"))
    for checkpoint, (_, until) in zip(
        checkpoints, LENGTHS.values(), strict=True
    ):  # loads modules and kernels once for all trials
        with redirect_stdout(io.StringIO()):
            assert main(["run", "--resume", str(checkpoint), "--until", f"{until}", "--no-record"]) == 0
    return Exercises(tuple(recordings), tuple(checkpoints), tuple(ends), folder / "sweep", swept)


def _made(*arguments: str) -> None:
    subprocess.run([sys.executable, "-m", "scenarios.cli", *arguments], check=True, capture_output=True)


def _end_of(summary: Path) -> str:
    """The hash of the state in which a run has ended."""
    return str(json.loads(summary.read_text(encoding="utf-8"))["state_hash"])


def entries(state: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths of all entries of nested tables and lists."""
    items = state.items() if isinstance(state, dict) else enumerate(state) if isinstance(state, list | tuple) else ()
    for key, value in items:
        yield (*path, key)
        yield from entries(value, (*path, key))


def _other(value: Any, chance: random.Random) -> Any:
    """Return something in place of a value."""
    if isinstance(value, np.ndarray) and value.size and chance.random() < 0.7:
        flat = value.copy().reshape(-1)
        if np.issubdtype(flat.dtype, np.floating) and chance.random() < 0.6:
            flat[chance.randrange(flat.size)] = chance.choice(NUMBERS)
            return flat.reshape(value.shape)
        whole = value if value.ndim else value[None]
        return chance.choice(
            (whole[:-1], np.concatenate([whole, whole]), value[..., None], value.astype(str), value.astype(complex))
        )
    return chance.choice(
        (None, True, "x", "nan", [], {}, (), b"x", 0, -1, 2**70, *NUMBERS, np.zeros(3), np.zeros((0, 3)), {"a": 1})
    )


def _spoil(state: dict[str, Any], chance: random.Random) -> None:
    """Spoil one entry."""
    path = chance.choice(list(entries(state)))
    table: Any = state
    for key in path[:-1]:
        if isinstance(table[key], tuple):
            table[key] = list(table[key])  # which counts alike
        table = table[key]
    key, how = path[-1], chance.random()
    print(f"spoiled: {'/'.join(map(str, path))}")
    if how < 0.15:
        del table[key]
    elif how < 0.2 and isinstance(table, dict):
        table[f"{key}x"] = table[key]
    else:
        table[key] = _other(table[key], chance)


def resume_trial(seed: int, exercises: Exercises) -> int:
    """Go on from a checkpoint whose contents are spoiled: the run is refused, or ends as it would have.

    Half of them are made up with a hash that is right: those end in words, wherever they go.
    """
    chance = random.Random(seed)
    which = chance.randrange(len(exercises.checkpoints))
    sound = exercises.checkpoints[which]
    checkpoint = load_checkpoint(sound)
    parts = {"scenario_hash": checkpoint.scenario_hash, "index": checkpoint.index, "time": checkpoint.time}
    parts |= {"run": copy.deepcopy(checkpoint.run), "state": copy.deepcopy(checkpoint.state)}
    if chance.random() < 0.1:
        key = chance.choice(("scenario_hash", "index", "time"))
        parts[key] = _other(parts[key], chance)
        print(f"spoiled: {key} is {parts[key]!r}")
    else:
        _spoil(parts["run" if chance.random() < 0.15 else "state"], chance)
    source, until = Path("step-000000001.npz"), LENGTHS[list(RUNS)[which]][1]
    is_made_up = chance.random() < 0.5
    try:
        save_checkpoint(source, Checkpoint(**parts))
    except (TypeError, AttributeError):
        return 0  # cannot be written either
    if not is_made_up:
        with np.load(source) as now, np.load(sound) as before:
            members = {name: (before if name == "hash" else now)[name] for name in now.files}
        np.savez(source, **members)  # type: ignore[arg-type]
    try:
        code = main(["run", "--resume", str(source), "--until", f"{until}", "--no-record", "--summary", "end.json"])
        assert code != 0 or is_made_up or _end_of(Path("end.json")) == exercises.ends[which], (
            "a damaged checkpoint was taken, and the run ended elsewhere"
        )
        return code
    finally:
        _clear(source, Path("end.json"))


def _clear(*places: Path) -> None:
    for place in places:
        shutil.rmtree(place) if place.is_dir() else place.unlink(missing_ok=True)


SITES = (
    "0,0",
    "60,5",
    "89,0",
    "-89,179.9999",
    "45,-180",
    "45,180",
    "12,360",
    "90,0",
    "nan,0",
    "0,inf",
    "1e300,1",
    "1",
    "1,2,3",
    "",
    "x,y",
    "0,361",
)
STARTS = (
    "2026-05-01T08:00:00Z", "0001-01-01", "9999-12-31T23:59:59Z", "1582-10-10", "2026-05-01T08:00:00+23:59", "2026-02-30", "1", "nan", "",
    "x" * 300, "2300-01-01", "1678-01-01T00:00:00-23:00",
)  # fmt: skip


def export_trial(seed: int, exercises: Exercises) -> int:
    """Export a recording, sound or spoiled, with hostile options, and read back what was written."""
    chance = random.Random(seed)
    words = chance.sample(["--geojson", "--geojson", "--netcdf", "--vtk"], chance.choice((1, 1, 2)))
    targets = {
        word: Path("out") / f"exported{ending}"
        for word, ending in (("--geojson", ".geojson"), ("--netcdf", ".nc"), ("--vtk", ""))
    }
    options = [part for word in dict.fromkeys(words) for part in (word, str(targets[word]))]
    options += [f"--site={chance.choice(SITES if chance.random() < 0.25 else SITES[:7])}"]
    options += [f"--start={chance.choice(STARTS)}"] if chance.random() < 0.25 else ["--start=2026-05-01T08:00:00Z"]
    options += [f"--bearing={chance.choice(EXTREMES)}"] if chance.random() < 0.15 else []
    options += [f"--every={chance.choice(EXTREMES)}"] if chance.random() < 0.15 else []
    options += chance.sample(["--particles", "--lost-only"], chance.choice((0, 0, 1)))
    source, place = chance.choice(exercises.recordings), Path("exercise.rrd")
    content = source.read_bytes()
    place.write_bytes(spoiled(content, chance) if chance.random() < 0.4 else content)
    Path("out").mkdir()
    try:
        code = main(["export", str(place), *options])
        if code == 0 and "--geojson" in words:
            read_geojson(targets["--geojson"])
        if code == 0 and "--netcdf" in words:
            read_netcdf(targets["--netcdf"])
        return code
    finally:
        _clear(Path("out"), place, Path("exercise.repaired.rrd"))


def _no_number(word: str) -> float:
    raise AssertionError(f"{word} is no JSON")


def read_geojson(path: Path) -> None:
    """Read a file after RFC 7946: whole numbers, places on Earth, rings that are closed and turn to the left."""
    collection = json.loads(path.read_text(encoding="utf-8"), parse_constant=_no_number)
    assert collection["type"] == "FeatureCollection"
    for feature in collection["features"]:
        assert feature["type"] == "Feature"
        assert all(math.isfinite(value) for value in feature["properties"].values() if isinstance(value, float))
        geometry = feature["geometry"]
        if geometry is None:
            continue
        kind, places = geometry["type"], np.array(list(_places(geometry["coordinates"])))
        assert (np.abs(places) <= (180.0, 90.0)).all() if places.size else True, f"{kind} beyond the Earth"
        if kind == "MultiPolygon":
            for ring in (ring for rings in geometry["coordinates"] for ring in rings):
                assert len(ring) >= 4 and ring[0] == ring[-1], "a ring that is open"
        if kind == "LineString":
            assert len(places) >= 2
        shape(geometry)


def _places(coordinates: Any) -> Iterator[list[float]]:
    if coordinates and isinstance(coordinates[0], int | float):
        yield coordinates
    else:
        for part in coordinates:
            yield from _places(part)


def read_netcdf(path: Path) -> None:
    """Read a file for far-field models: finite places on Earth, and times that go on."""
    with netcdf_file(path, "r", mmap=False) as file:
        columns = {name: np.array(file.variables[name][:], dtype=float) for name in ("time", "longitude", "latitude")}
    assert all(np.isfinite(values).all() for values in columns.values())
    assert (np.diff(columns["time"]) > 0.0).all()
    assert (np.abs(columns["latitude"]) <= 90.0).all()


KEYS = (
    "tow.speed",
    "tow.heading",
    "name",
    "run.seed",
    "booms.main.segments",
    "vessels.port.position",
    "sea.depth",
    "title",
    "x",
    "",
    "tow..speed",
    "run",
)
TEXTS = (*EXTREMES, *OTHERS, '"' + "\u4e2d" * 99 + '"', "\U00020000" * 99,
    "\udcff", "a/b", "..", "0.1:0.2:0.3", ":", "0.3:0.1", "0.1:0.3", "-inf:inf", "-1.7e308:1.7e308")  # fmt: skip


def sweep_trial(seed: int, exercises: Exercises) -> int:
    """Sweep with options that nobody wants, where no run can begin; or go on in a folder whose files are spoiled."""
    chance = random.Random(seed)
    return _swept_again(chance, exercises) if chance.random() < 0.3 else _swept(chance, exercises)


def _swept(chance: random.Random, exercises: Exercises) -> int:
    """Give hostile options: the folder is a file, so that a sweep which is sound ends before its first run."""
    words = list(exercises.swept[:2])
    for _ in range(chance.choice((1, 1, 2, 3))):
        many = chance.choice((1, 2, 3, 3, 400 if chance.random() < 0.1 else 2))
        listed = ",".join(chance.choice(TEXTS) for _ in range(many))
        words += [f"--vary={chance.choice(KEYS)}={listed}"]
    for _ in range(chance.choice((0, 0, 1, 2))):
        span = chance.choice(
            ("0.1:0.3", "1:2", chance.choice(TEXTS), f"{chance.choice(EXTREMES)}:{chance.choice(EXTREMES)}")
        )
        words += [f"--range={chance.choice(KEYS)}={span}"]
    for option, values in {
        "--runs": ("1", "2", "3", *EXTREMES), "--seed": EXTREMES, "--workers": EXTREMES, "--until": EXTREMES, "--threads": EXTREMES,
        "--method": ("monte-carlo", "latin-hypercube", "x"),
    }.items():  # fmt: skip
        if chance.random() < (0.6 if option == "--runs" else 0.1):
            words += [f"{option}={chance.choice(values)}"]
    Path("blocked").touch()
    try:
        return main([*words, "--to", "blocked/results"])
    finally:
        Path("blocked").unlink()


def _swept_again(chance: random.Random, exercises: Exercises) -> int:
    """Go on with a sweep, one of whose summaries is spoiled as bytes or as data."""
    folder = Path("results")
    shutil.copytree(exercises.sweep, folder)
    file = chance.choice(sorted(folder.iterdir()))
    if file.suffix == ".json" and chance.random() < 0.7:
        summary = json.loads(file.read_text(encoding="utf-8"))
        for _ in range(chance.choice((1, 1, 3))):
            _spoil(summary, chance)
        made = chance.choice((summary, summary, summary, None, [], 3, "x", {}))
        file.write_text(json.dumps(made, default=str), encoding="utf-8")
    else:
        file.write_bytes(spoiled(file.read_bytes(), chance))
    try:
        return main([*exercises.swept, "--to", str(folder)])
    finally:
        shutil.rmtree(folder)
