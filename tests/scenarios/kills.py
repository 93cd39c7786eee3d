"""Real runs of `oilsim` that are killed, and what is left of them: for a test, and for a benchmark's table."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from recordings.files.writing import RecordingError
from recordings.replay.recording import Replay, Series
from recordings.replay.series import BodySeries
from scenarios.running.checkpoints import find_restart

STARTED = 3  # frames; before, kernels are loaded
SETTINGS = (
    "fluid.particle_spacing=0.1",
    "run.communication_step=0.005",
    "recording.frame_rate=200",
    "run.duration=1000",
)


@dataclass(frozen=True, kw_only=True)
class Kill:
    """What a killed run had said and what its recording still holds.

    said: simulated time [s] that the run is known to have reached a second before its end; kept: that of the last frame that can
    be replayed, of every series and phase; checkpoint: that of the last checkpoint; repaired: whether the file had to be.
    """

    after: float
    said: float
    kept: float
    frames: int
    checkpoint: float
    repaired: bool

    @property
    def lost(self) -> float:
        """Simulated time [s] older than a second that is lost; 0 is what is promised."""
        return max(0.0, self.said - self.kept)


def started_run(clock: Path, *arguments: str, ignoring: tuple[int, ...] = ()) -> subprocess.Popen[str]:
    """Start `oilsim run` with these arguments, let it note its times in ``clock``, and wait until it has made its first steps.

    Ctrl-C and a closed terminal are in effect even where the tests run in the background or under nohup, except for the signals it
    is to be started `ignoring`.
    """

    def set_signals() -> None:
        for number in (signal.SIGINT, signal.SIGHUP):
            signal.signal(number, signal.SIG_DFL)
        for number in ignoring:
            signal.signal(number, signal.SIG_IGN)

    command = [sys.executable, str(Path(__file__).with_name("clocked_run.py")), str(clock), *arguments]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, preexec_fn=set_signals)
    while not clock.is_file() or clock.read_text().count("\n") < STARTED:
        assert process.poll() is None, process.stderr.read() if process.stderr else ""
        time.sleep(0.005)
    return process


def killed_run(folder: Path, seconds: float, scenario: str = "two-layer", settings: tuple[str, ...] = SETTINGS) -> Kill:
    """Start a run, kill it without warning some seconds after its first steps, and replay it."""
    record, clock = folder / "killed.rrd", folder / "clock"
    terms = [part for setting in settings for part in ("--set", setting)]
    process = started_run(clock, scenario, *terms, "--threads", "1", "--record", str(record))
    time.sleep(seconds)
    process.kill()
    killed = time.monotonic()
    process.communicate()
    marks = np.loadtxt(_whole_lines(clock), ndmin=2)
    old = marks[marks[:, 0] < killed - 1.0]
    replay = Replay(record)
    return Kill(
        after=seconds,
        said=float(old[-1, 1]) if len(old) else 0.0,
        kept=_last_whole_frame(replay),
        frames=len(replay.scalars["kinetic_energy"].index),
        checkpoint=find_restart(record).time,
        repaired=replay.repaired_from is not None,
    )


def _whole_lines(clock: Path) -> list[str]:
    """The last line may have been cut as well."""
    return clock.read_text().splitlines()[:-1] or ["0 0"]


def _last_whole_frame(replay: Replay) -> float:
    """Time [s] up to which every phase, body and series was kept without a gap; RecordingError for a gap."""
    found: list[tuple[Series | BodySeries, int]] = [
        (replay.phase_times(phase.name), replay.thinning.get(phase.name, 1)) for phase in replay.run.phases
    ]
    found += [(series, 1) for series in (replay.scalars["ledger/fluid/kinetic_energy"], *replay.bodies.values())]
    frames = min(every * len(series.index) for series, every in found)
    for series, every in found:
        expected = np.arange(0, frames, every)
        if not np.array_equal(series.index[: len(expected)], expected):
            raise RecordingError(replay.path, "has a gap")
    return float(replay.scalars["ledger/fluid/kinetic_energy"].time[frames - 1])
