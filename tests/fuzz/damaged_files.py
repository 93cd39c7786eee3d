"""Sound files of every kind that oilsim reads, spoiled in a few bytes, cut off, or cut in the middle."""

from __future__ import annotations

import json
import random
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from scipy.io import netcdf_file

from scenarios.cli import main

WATER = """
name = "mesh"
[run]
duration = 0.1
[fluid]
particle_spacing = 0.1
[phases.water]
density = 1000.0
dynamic_viscosity = 1.0e-3
[tank]
lower = [-1.0, -1.0, -1.0]
upper = [1.0, 1.0, 1.0]
[fill.pool]
shape = "slab"
phase = "water"
bottom = -1.0
top = 0.0
"""
ROCK = """
[bodies.rock]
shape = "mesh"
file = {file}
position = [0.0, 0.0, 0.0]
density = 500.0
"""
MESH_TANK = WATER + ROCK
FMU = """
[fmus.one]
file = {file}
"""
NUMBERS = (b"0", b"-1", b"nan", b"inf", b"1e300", b"-1e300", b"1e-300", b"99999999999", b"")


def spoiled(content: bytes, chance: random.Random) -> bytes:
    """Bytes changed, lost, doubled or made up in some places."""
    data, kind = bytearray(content), chance.randrange(5)
    if kind == 0:
        return bytes(data[: chance.randrange(len(data) + 1)])
    if kind == 1:
        return bytes(data[chance.randrange(len(data) + 1) :])
    for _ in range(chance.choice((1, 1, 2, 8, 64))):
        place, length = chance.randrange(len(data) + 1), chance.choice((1, 1, 4, 64))
        if kind == 2:
            data[place : place + length] = chance.randbytes(length)
        elif kind == 3:
            del data[place : place + length]
        else:
            data[place:place] = chance.choice((bytes(data[place : place + length]), chance.choice(NUMBERS)))
    return bytes(data)


@dataclass(frozen=True)
class Samples:
    """Sound files in one folder: meshes, an FMU, a recording and a checkpoint of it."""

    meshes: tuple[Path, ...]
    fmu: Path
    recording: Path
    checkpoint: Path


def make_meshes(folder: Path) -> tuple[Path, ...]:
    """Write one ball in every format that is read."""
    shape, files = trimesh.creation.icosphere(subdivisions=2, radius=0.4), []
    for ending in ("stl", "obj", "ply", "glb"):
        files.append(folder / f"rock.{ending}")
        shape.export(files[-1])
    return tuple(files)


def make_samples(folder: Path) -> Samples:
    """Write the sound files; this runs the smallest scene that has all of it."""
    meshes = make_meshes(folder)
    (folder / "model.py").write_text(
        "from coupling.fmu.scalar_model import ScalarModel, given, parameter\n\n\nclass Gust(ScalarModel):\n"
        '    base = parameter("m/s", 4.0)\n    speed = given("m/s", 4.0)\n\n'
        "    def advance(self, time, step_size):\n        self.speed = self.base\n",
        encoding="utf-8",
    )
    _made("build-fmu", str(folder / "model.py"), "-o", str(folder / "gust.fmu"))
    terms = ["fluid.particle_spacing=0.15", "run.communication_step=0.02", "run.duration=0.08", "run.threads=1"]
    terms += ["recording.checkpoint_interval=0.04"]
    settings = [word for term in terms for word in ("--set", term)]
    _made("run", "floating-box", "--record", str(folder / "box.rrd"), *settings)
    checkpoint = sorted((folder / "box.checkpoints").glob("*.npz"))[0]
    return Samples(meshes, folder / "gust.fmu", folder / "box.rrd", checkpoint)


def _made(*arguments: str) -> None:
    """Run a command in a process of its own, which leaves no threads in this one."""
    subprocess.run([sys.executable, "-m", "scenarios.cli", *arguments], check=True, capture_output=True)


def _with(content: bytes, name: str, call: Callable[[Path], int]) -> int:
    """Call with a file of that content, and delete it."""
    file = Path(name)
    file.write_bytes(content)
    try:
        return call(file)
    finally:
        file.unlink(missing_ok=True)


def mesh_trial(seed: int, meshes: tuple[Path, ...]) -> int:
    """Check a scene with a body of a spoiled mesh."""
    chance = random.Random(seed)
    mesh = chance.choice(meshes)
    return _with(spoiled(mesh.read_bytes(), chance), mesh.name, lambda file: _checked(MESH_TANK, file))


def fmu_trial(seed: int, samples: Samples) -> int:
    """Check a scene with a spoiled FMU."""
    content = spoiled(samples.fmu.read_bytes(), random.Random(seed))
    return _with(content, "gust.fmu", lambda file: _checked(WATER + FMU, file))


def _checked(text: str, file: Path) -> int:
    scene = text.format(file=json.dumps(str(file.resolve()))).encode()
    return _with(scene, "scene.toml", lambda scenario: main(["check", str(scenario)]))


READERS = (
    ["report", "{}", "--csv", "out"],
    ["repair", "{}", "--to", "out/mended.rrd"],
    ["compare", "{}", "{}", "--table"],
    ["export", "{}", "--netcdf", "out/box.nc", "--start", "2026-05-01T08:00:00Z", "--site", "1,2"],
    ["export", "{}", "--vtk", "out/films"],
)


def recording_trial(seed: int, samples: Samples) -> int:
    """Read a spoiled recording by one of the commands; what the command is asked to write is taken away."""
    chance = random.Random(seed)
    command = chance.choice(READERS)
    Path("out").mkdir()

    def read(file: Path) -> int:
        try:
            return main([word.format(file) for word in command])
        finally:
            shutil.rmtree("out", ignore_errors=True)
            Path("box.repaired.rrd").unlink(missing_ok=True)  # of which the message tells

    return _with(spoiled(samples.recording.read_bytes(), chance), "box.rrd", read)


def checkpoint_trial(seed: int, samples: Samples) -> int:
    """Go on from a spoiled checkpoint."""
    content = spoiled(samples.checkpoint.read_bytes(), random.Random(seed))
    return _with(content, samples.checkpoint.name, lambda file: main(["run", "--resume", str(file), "--no-record"]))


SHORE = """
[site]
latitude = 60.0
longitude = 5.0
start = "2026-05-01T08:00:00Z"
[sea]
depth = 5.0
[sea.wind]
kind = "file"
file = {file}
"""
WIND = "time [h], speed [kn], from_direction [deg]\n# a report\n0, 5, 90\n0.5, 7.5, 95\n1, 6, 100\n"


def make_winds(folder: Path) -> tuple[Path, ...]:
    """Write one wind in every format that is read: times since the start, dates, and classic CF NetCDF."""
    files = tuple(folder / name for name in ("wind.csv", "dated.csv", "wind.nc"))
    files[0].write_text(WIND, encoding="utf-8")
    dated = "time [UTC], eastward_velocity [m/s], northward_velocity [m/s]\n"
    dated += "".join(f"2026-05-01T0{hour}:00:00Z, {hour}, -2.5\n" for hour in (8, 9))
    files[1].write_text(dated, encoding="utf-8")
    with netcdf_file(files[2], "w") as file:
        file.createDimension("time", 3)
        for name, unit, standard, values in (
            ("t", "hours since 2026-05-01 08:00:00", "time", (0.0, 0.5, 1.0)),
            ("u10", "m s-1", "eastward_wind", (1.0, 2.0, 3.0)),
            ("v10", "m s-1", "northward_wind", (-1.0, 0.0, 1.0)),
        ):
            variable = file.createVariable(name, "d", ("time",))
            variable[:], variable.units, variable.standard_name = values, unit, standard
        file.variables["t"].calendar = "standard"
        file.variables["u10"].scale_factor, file.variables["u10"].valid_range = 0.5, np.array([-100.0, 100.0])
    return files


def wind_trial(seed: int, winds: tuple[Path, ...]) -> int:
    """Check a scene with a spoiled file of a wind."""
    chance = random.Random(seed)
    wind = chance.choice(winds)
    return _with(spoiled(wind.read_bytes(), chance), wind.name, lambda file: _checked(WATER + SHORE, file))
