"""The program between a run and its live viewer: frames arrive on standard input and leave to the viewer.

It is a separate program because Rerun waits without limit for a viewer that has stopped reading, at the latest when the program ends.
`live` can end this program at any time, and nothing else depends on it.
"""

from __future__ import annotations

import pickle
import sys
from typing import BinaryIO

from recordings.sink.blueprint import Layout
from recordings.sink.rerun_sink import RerunWriter, connect_stream

_PATIENCE_SECONDS = 1e9  # [s], without limit: the run ends this program when it has waited long enough


def feed(messages: BinaryIO, address: str, recording_id: str, layout: Layout) -> None:
    """Pass on pickled (verb, arguments) pairs until the input ends; they come from the parent program only."""
    stream = connect_stream(address, recording_id)
    writer = RerunWriter(stream, layout=layout)
    while True:
        try:
            verb, arguments = pickle.load(messages)
        except EOFError:
            break
        getattr(writer, verb)(*arguments)
        stream.flush(timeout_sec=_PATIENCE_SECONDS)
    stream.disconnect()


if __name__ == "__main__":
    feed(sys.stdin.buffer, sys.argv[1], sys.argv[2], "embedded" if sys.argv[3] == "embedded" else "live")
