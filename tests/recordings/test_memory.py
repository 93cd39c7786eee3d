"""Recordings take little memory, however many chunks they have: while they are written, and when they are opened."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import rerun as rr

from recordings.files.messages import damage
from recordings.model.frame import MeshDescription
from recordings.replay.recording import Replay
from recordings.replay.repair import has_footer, is_whole
from recordings.sink.recorder import Recorder
from recordings.sink.rerun_sink import FORMAT_VERSION, open_stream

CHUNKS, SERIES = 2500, 25  # Rerun's own index of them takes 70 MB
OPEN = """
import sys
from pathlib import Path
from recordings.replay.recording import Replay

def resident():
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 2**20

Replay(sys.argv[2])  # loads what is loaded once
before = resident()
replay = Replay(sys.argv[1])
print(resident() - before, len(list(replay.chunks("/metrics/**"))))
"""

BLOCKS, NAMES = 400, 25  # 10,000 chunks, of which Rerun's own file keeps 30 MB
RECORD = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from writing_program import describe
from recordings.model.sample import Sample
from recordings.sink.rerun_sink import RerunFile

def resident():
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 2**20

file = RerunFile(Path(sys.argv[2]), describe(), {})
for index in range(int(sys.argv[3])):
    scalars = {f"s{name}": 1.0 for name in range(int(sys.argv[4]))}
    file.add(Sample(index=index, time=0.1 * index, phases={}, bodies={}, tensions={}, held_speeds={}, lost=None, scalars=scalars))
    file.write()
    if index == 50:
        before = resident()
print(resident() - before)
"""


def write(path: Path, chunks: int) -> Path:
    stream = open_stream(path.stem)
    stream.save(path)
    stream.send_property("recording", rr.AnyValues(format_version=FORMAT_VERSION, particle_spacing=0.1))
    for index in range(chunks):
        times = [rr.TimeColumn("time", duration=[0.1 * index]), rr.TimeColumn("frame", sequence=[index])]
        series = index % SERIES
        values = {f"v{series}_{k}": np.full(1, float(k)) for k in range(4)}
        stream.send_columns(f"/metrics/s{series}", times, rr.AnyValues.columns(**values))
    stream.flush()
    stream.disconnect()
    return path


def test_memory_of_an_open_recording_is_a_fifth_of_a_kilobyte_a_chunk(tmp_path: Path) -> None:
    many, few = write(tmp_path / "many.rrd", CHUNKS), write(tmp_path / "few.rrd", 10)
    done = subprocess.run([sys.executable, "-c", OPEN, str(many), str(few)], capture_output=True, text=True, check=True)
    grown, found = map(float, done.stdout.split())
    assert found == CHUNKS
    assert grown < 10.0  # MB


def test_memory_of_a_run_that_is_recorded_does_not_grow_with_its_chunks(tmp_path: Path) -> None:
    program = [sys.executable, "-c", RECORD, str(Path(__file__).parent), str(tmp_path / "long.rrd")]
    done = subprocess.run([*program, str(BLOCKS), str(NAMES)], capture_output=True, text=True, check=True)
    assert float(done.stdout) < 5.0  # MB


def test_a_long_recording_is_put_in_order_when_it_ends(made_up: ModuleType, tmp_path: Path) -> None:
    """Few chunks, a footer, every bit, and checksums that tell of what a disk has lost."""
    path, frames = tmp_path / "long.rrd", [made_up.make_frame(index, 50) for index in range(80)]
    large = MeshDescription(vertices=np.random.default_rng(0).random((9000, 3)), faces=np.arange(9000).reshape(-1, 3))
    run = replace(made_up.describe(), meshes=made_up.describe().meshes | {"rock": large})
    with Recorder(path, frame_rate=1.0 / made_up.STEP) as recorder:
        recorder.initialized(run)
        for frame in frames:
            recorder.step_completed(frame)
            recorder.save_state()  # writes a block
        assert len(damage(path).chunks) > 1000
    assert len(damage(path).chunks) < 60 and has_footer(path) and is_whole(path)
    assert [one.name for one in tmp_path.iterdir()] == [path.name]
    replay = Replay(path)
    assert replay.end_reason == "completed"
    assert {name: len(mesh.faces) for name, mesh in replay.run.meshes.items()} == {
        name: len(mesh.faces) for name, mesh in run.meshes.items()
    }
    for name, series in replay.scalars.items():
        assert series.value.tolist() == [frame.scalars[name] for frame in frames]
    for index, _, phase in replay.phase_frames("ocean"):
        assert phase.position.tobytes() == made_up.positions("ocean", index, 50).tobytes()
    data = bytearray(path.read_bytes())
    place = next(one for one in damage(path).chunks if one.entity_path == "/fluid/ocean" and not one.is_static)
    middle = (place.start + place.end) // 2
    data[middle : middle + 8] = bytes(8)
    path.write_bytes(data)
    assert damage(path).broken == 1


def test_a_recording_that_cannot_be_put_in_order_stays_as_it_was_written(
    made_up: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("recordings.sink.stream_file.ORDERED_MESSAGES", 0)
    monkeypatch.setattr("recordings.sink.stream_file.viewer_executable", lambda: "false")
    path = tmp_path / "short.rrd"
    slow = pytest.warns(
        UserWarning, match=r"short\.rrd: opens slowly, because it was not put in order: .*`oilsim repair`"
    )
    with slow, Recorder(path, frame_rate=1.0 / made_up.STEP) as recorder:
        recorder.initialized(made_up.describe())
        recorder.step_completed(made_up.make_frame(0))
    found = damage(path)
    assert found.is_ended and not found.has_end and is_whole(path)
    assert [one.name for one in tmp_path.iterdir()] == [path.name]
    assert len(Replay(path).scalars) == 3
