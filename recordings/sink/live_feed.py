"""The program between a run and its live viewer: frames come in on standard input and go out to the viewer.

It is a program of its own because Rerun waits for a viewer that has stopped reading, at the latest when the program
ends, and for ever. This one can be ended by `live` at any time, and nothing else depends on it.
"""

from __future__ import annotations

import pickle
import sys
from typing import BinaryIO

from recordings.sink.rerun_sink import RerunWriter, connect_stream

_PATIENCE_SECONDS = 1e9  # the run ends this program when it has waited long enough


def feed(messages: BinaryIO, address: str, recording_id: str) -> None:
    """Pass on pickled (verb, arguments) pairs until there are no more; they come from the parent, nobody else."""
    stream = connect_stream(address, recording_id)
    writer = RerunWriter(stream, live=True)
    while True:
        try:
            verb, arguments = pickle.load(messages)
        except EOFError:
            break
        getattr(writer, verb)(*arguments)
        stream.flush(timeout_sec=_PATIENCE_SECONDS)
    stream.disconnect()


if __name__ == "__main__":
    feed(sys.stdin.buffer, sys.argv[1], sys.argv[2])
