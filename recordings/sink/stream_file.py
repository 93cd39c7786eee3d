"""The file of a Rerun stream, which this program writes itself.

Rerun's own file keeps 3 kB of each chunk in memory until it is closed, for the table of chunks in the file's footer: a megabyte in a second
of an exercise. Here a file has no footer while it is written. When it ends, Rerun's own program writes it anew, with the same rows in a
hundredth of the chunks, and with a footer, so that a viewer loads what it shows only.
"""

from __future__ import annotations

import io
import os
import shutil
import subprocess
import warnings
from pathlib import Path
from typing import NoReturn

import rerun as rr

from recordings.files.messages import END, HEAD_BYTES, SUMS, checksums, frames, insert_before_end
from recordings.files.writing import RecordingError
from recordings.sink.viewer import ViewerError, viewer_environment, viewer_executable

RESERVED_BYTES = 32 << 20  # disk space kept free for the log and other programs
ORDERED_MESSAGES = 1000  # of a recording that is worth the half second of putting it in order
ORDERED_SHARE = 0.25  # of the memory, that a file may have which is put in order; that takes 1.4 times its size
ORDERING_SECONDS = 90.0  # [s] that the end of a run may wait for it; 2.5 GB take 64 s of processor time


class StreamFile:
    """The file of one stream; RecordingError if it cannot be written, and then it is closed."""

    def __init__(self, stream: rr.RecordingStream, path: Path) -> None:
        """Create the file for all that the stream will get."""
        self.path = path
        self.message_count = 0
        self._stream, self._bytes = stream, stream.binary_stream()
        try:
            self._file = path.open("wb", buffering=0)
        except OSError as error:
            raise RecordingError(path, f"cannot be written: {error.strerror or error}") from error

    @property
    def closed(self) -> bool:
        """True if nothing can be written any more."""
        return self._file.closed

    def write(self) -> None:
        """Write all that the stream has got."""
        data = self._bytes.read() or b""
        messages = _messages(data)
        waiting = memoryview((b"" if self.message_count else data[:HEAD_BYTES]) + b"".join(messages))
        self.message_count += len(messages)
        try:
            while waiting:
                waiting = waiting[self._file.write(waiting) :]
        except OSError as error:
            self.give_up(f"cannot be written any more: {error.strerror or error}", error)

    def require(self, wanted: int = 0) -> None:
        """Raise RecordingError unless the file still has its name, and the disk has room for so many bytes [1] more."""
        try:
            there = self.path.stat()
        except OSError as error:
            self.give_up(f"is no longer there: {error.strerror or error}", error)
        if not os.path.samestat(there, os.fstat(self._file.fileno())):
            self.give_up("was replaced by another file while it was written")
        free = shutil.disk_usage(self.path.parent).free
        if wanted and free < wanted + RESERVED_BYTES:
            self.give_up(f"the disk is full ({free >> 20} MiB left); the frames written so far can be replayed")

    def give_up(self, why: str, cause: OSError | None = None) -> NoReturn:
        """Close the file as it is, and tell why."""
        self._file.close()
        raise RecordingError(self.path, why) from cause

    def close(self) -> None:
        """Write the rest, put the file in order if that is worth it, and write its checksums."""
        self.write()
        self.require()
        if not (self.message_count > ORDERED_MESSAGES and self._try_ordering()):
            self._send_checksums(self.path)
            self.write()
        self._file.close()

    def _try_ordering(self) -> bool:
        """Put the file in order; False, and a warning, if it stays as it was."""
        try:
            self._put_in_order()
        except (RecordingError, OSError) as error:
            why = error.reason if isinstance(error, RecordingError) else error.strerror or error
            warnings.warn(
                f"{self.path}: opens slowly, because it was not put in order: {why}; `oilsim repair` has more time for it", stacklevel=3
            )  # fmt: skip
            return False
        return True

    def _put_in_order(self) -> None:
        """Replace the file by one in order; RecordingError if it is too large, or Rerun cannot."""
        path, size = self.path.resolve(), os.fstat(self._file.fileno()).st_size
        memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
        room = int(min(ORDERED_SHARE * memory, shutil.disk_usage(path.parent).free - RESERVED_BYTES))
        if size > room:
            raise RecordingError(path, f"it has {size >> 20} MiB, allowed: {room >> 20} MiB, by memory and disk")
        ordered = path.with_name(f".{os.getpid()}-{path.name}")
        try:
            put_in_order(path, ordered, ORDERING_SECONDS)
            self._send_checksums(ordered)
            insert_before_end(ordered, b"".join(_messages(self._bytes.read() or b"")))
            shutil.copymode(path, ordered)
            ordered.replace(path)
        finally:
            ordered.unlink(missing_ok=True)

    def _send_checksums(self, path: Path) -> None:
        """Send the stream the checksums of all chunks of a file; a reader takes chunks with others for broken ones."""
        self._stream.send_property("checksums", rr.AnyValues(**{SUMS: checksums(path)}))


def put_in_order(source: Path, target: Path, patience: float) -> None:
    """Let Rerun write the messages of ``source`` in few chunks, with a footer; RecordingError if it cannot within `patience` [s]."""
    try:
        # otherwise large components are put into chunks of their own, and a mesh would be parted from the names of its bodies
        together = ["--split-size-ratio", "1e12"]
        command = [viewer_executable(), "rrd", "optimize", str(source), "-o", str(target), *together]
        done = subprocess.run(
            command, env=viewer_environment(), capture_output=True, text=True, timeout=patience, check=False
        )
    except subprocess.TimeoutExpired as error:
        raise RecordingError(source, f"cannot be put in order within {patience:g} s") from error
    except ViewerError as error:
        raise RecordingError(source, f"cannot be put in order: {error}") from error
    if done.returncode != 0 or not target.is_file():
        raise RecordingError(source, f"cannot be put in order: {done.stderr.strip()[-300:]}")


def _messages(data: bytes) -> list[bytes]:
    """Split what a stream gives into its messages, without head and end."""
    return [data[start:end] for start, end, kind in frames(io.BytesIO(data), len(data)) if kind not in (None, END)]
