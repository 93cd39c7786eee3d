"""Opening a recording takes little memory, however many chunks it has."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import rerun as rr

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
