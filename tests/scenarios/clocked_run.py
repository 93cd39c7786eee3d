"""`oilsim run` that notes, beside the run, when it reached which simulated time: the victim of the kills.

Arguments: the file for the notes, then those of `oilsim run`. Each line is the machine's clock [s] and the simulated time [s].
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

from recordings.model.frame import Frame
from scenarios.cli import main
from scenarios.watch.progress import ProgressDisplay


def note_times(clock: Path) -> None:
    """Have the display of progress write down every step it is shown; it is the last observer but the recorder."""
    shown = ProgressDisplay.step_completed
    file = clock.open("w", buffering=1)

    def noting(self: ProgressDisplay, frame: Frame) -> None:
        shown(self, frame)
        file.write(f"{time.monotonic()!r} {frame.time!r}\n")

    ProgressDisplay.step_completed = noting  # type: ignore[method-assign]


if __name__ == "__main__":
    note_times(Path(sys.argv[1]))
    sys.exit(main(["run", *sys.argv[2:]]))
