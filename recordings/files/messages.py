"""The messages of a Rerun file, looked at one by one: which can be decoded, and where the next one is after one that cannot.

A file of Rerun 0.41 is a head of 12 bytes and messages: kind and length, 8 bytes each, and the content, by protobuf. Rerun gives up at
the first message that it cannot decode, and keeps no checksums: positions that a disk has lost are read as zeros. So the recorder's last
chunk holds the checksums of all messages before it. A run that was killed has none; there only what cannot be decoded is noticed.
"""

from __future__ import annotations

import struct
import sys
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pyarrow.ipc

HEAD = b"RRF2"
HEAD_BYTES = 12
END, STORE, CHUNK, ACTIVATION = range(4)  # kinds of messages
_FRAME = struct.Struct("<QQ")
_LARGEST = 2**32  # bytes of a message; those of a run have less than a thousandth
_UNCOMPRESSED, _LZ4 = (0, 1), 2
_ENTITY, _KIND, _INDEX = b"rerun:entity_path", b"rerun:kind", b"index"  # metadata of a chunk, of its columns, of times
_OF_RUN = 1  # kind of the store that holds the run; the viewer's layout is in another one
_SEARCHED = 2**20  # bytes looked through at a time
_CHUNK_KIND = CHUNK.to_bytes(8, "little")
_LAST = 8  # chunks from the end, among which the one with the checksums is
SUMS = "crc32"  # its component
_UNDECODABLE = (ValueError, LookupError, TypeError, OSError, MemoryError, struct.error, pa.ArrowException)


@dataclass(frozen=True, slots=True)
class ChunkPlace:
    """One chunk of the run: where its message begins and ends in the file [bytes], and its entity; static ones hold for all time."""

    start: int
    end: int
    entity_path: str
    is_static: bool


@dataclass(frozen=True)
class Damage:
    """The damage of a file: bytes that belong to no message, and messages that cannot be decoded.

    Attributes:
        lost_bytes: number of bytes that belong to no message.
        broken: number of messages that cannot be decoded, or whose checksum is wrong.
        sound: number of all other messages, without the closing one.
        cut: number of bytes, at the end of the file, of a message that is not complete.
        has_end: true if the file has the closing message, with its footer.
        is_ended: true if the file was closed in order: it has that message, or checksums.
        chunks: the sound chunks of the run, in the file's order.
    """

    lost_bytes: int
    broken: int
    sound: int
    cut: int
    has_end: bool
    is_ended: bool
    chunks: tuple[ChunkPlace, ...] = ()

    @property
    def keeps_from_reading(self) -> bool:
        """True if Rerun gives up before the file's end. Rerun reads a file that only lacks the closing message, if as a whole."""
        return bool(self.lost_bytes or self.broken or self.cut)

    def __str__(self) -> str:
        if not (self.lost_bytes or self.broken):
            return "" if self.is_ended else "was cut off"
        where = f"{self.lost_bytes:,} bytes are lost" if self.lost_bytes else ""
        broken = f"{self.broken:,} of {self.broken + self.sound:,} messages cannot be read" if self.broken else ""
        return f"is damaged: {' and '.join(part for part in (where, broken) if part)}"


def damage(path: Path, copy: BinaryIO | None = None) -> Damage:
    """Find the damage of a file; its sound messages go into ``copy``, if given, without checksums and without an end."""
    lost_bytes = tail = broken = sound = 0
    has_end, chunks = False, list[ChunkPlace]()
    with path.open("rb") as file:
        size = path.stat().st_size
        head = file.read(HEAD_BYTES)
        if not head.startswith(HEAD):
            lost_bytes += len(head)
        if copy is not None:
            copy.write(head if head.startswith(HEAD) else _head_of_this_version())
        known, place_of_sums = _known_sums(file, size)
        for start, end, kind in frames(file, size):
            lost_bytes, tail = lost_bytes + tail, 0
            if kind is None:
                tail = end - start  # at the file's end this is the message in which it was cut off
                continue
            message = _read(file, start, end)
            is_known = known is None or kind != CHUNK or start == place_of_sums or zlib.crc32(message) in known
            place = _sound_place(kind, message[_FRAME.size :], start, end) if is_known else None
            if place is None:
                broken += 1
            elif kind == END:
                has_end = True  # what follows only says where the end is
            else:
                sound += 1
                if place.entity_path:
                    chunks.append(place)
                if copy is not None and start != place_of_sums:
                    copy.write(message)
    is_ended = has_end or (known is not None and not tail)
    return Damage(lost_bytes, broken, sound, tail, has_end, is_ended, tuple(chunks))


def read_chunk(file: BinaryIO, place: ChunkPlace) -> pa.RecordBatch:
    """Read the rows of a chunk; ValueError, or another error of Arrow's, if the file was changed since its place was found."""
    (batch,) = _batches(dict(_fields(_read(file, place.start, place.end)[_FRAME.size :])))
    return batch


def checksums(path: Path) -> npt.NDArray[np.uint32]:
    """Compute the checksum (CRC-32) of each chunk that the file holds so far (n,)."""
    size = path.stat().st_size
    with path.open("rb") as file:
        sums = [zlib.crc32(_read(file, start, end)) for start, end, kind in frames(file, size) if kind == CHUNK]
    return np.array(sums, dtype=np.uint32)


def insert_before_end(path: Path, messages: bytes) -> None:
    """Put messages before the closing one, behind which a file says last where that is."""
    with path.open("r+b") as file:
        *_, (place, end, _) = frames(file, path.stat().st_size)
        closing, last = _read(file, place, end), file.read()
        moved = int.from_bytes(last[:8], "little") + len(messages)
        file.seek(place)
        file.write(messages + closing + moved.to_bytes(8, "little") + last[8:])


def _known_sums(file: BinaryIO, size: int) -> tuple[frozenset[int] | None, int]:
    """Read the checksums that a file holds, and where the message with them begins; None if it holds none."""
    chunks = [(start, end) for start, end, kind in frames(file, size) if kind == CHUNK]
    for start, end in reversed(chunks[-_LAST:]):
        try:
            (batch,) = _batches(dict(_fields(_read(file, start, end)[_FRAME.size :])))
            if SUMS in batch.schema.names:
                return frozenset(batch.column(SUMS).flatten().to_pylist()), start
        except _UNDECODABLE:
            continue
    return None, -1


def _read(file: BinaryIO, start: int, end: int) -> bytes:
    file.seek(start)
    return file.read(end - start)


def frames(file: BinaryIO, size: int) -> Iterator[tuple[int, int, int | None]]:
    """Yield where messages of ``size`` bytes begin and end, and their kinds, up to the closing one; what is no message has None."""
    place = HEAD_BYTES
    while place < size:
        file.seek(place)
        frame = file.read(_FRAME.size)
        kind, length = _FRAME.unpack(frame) if len(frame) == _FRAME.size else (-1, 0)
        end = place + _FRAME.size + length
        if kind in (STORE, CHUNK, ACTIVATION, END) and 0 < length < _LARGEST and end <= size:
            yield place, end, kind
            if kind == END:
                return
        else:
            end = _next_chunk(file, place + 1, size)
            yield place, end, None
        place = end


def _next_chunk(file: BinaryIO, place: int, size: int) -> int:
    """Where the next chunk may begin: behind its kind comes a length that fits, and the first field of its content."""
    while place < size:
        file.seek(place)
        block = file.read(_SEARCHED + _FRAME.size)
        at = block.find(_CHUNK_KIND)
        while 0 <= at < _SEARCHED:
            frame = block[at : at + _FRAME.size + 1]
            if len(frame) > _FRAME.size and frame[-1:] == b"\n":
                length = _FRAME.unpack_from(frame)[1]
                if 0 < length < _LARGEST and place + at + _FRAME.size + length <= size:
                    return place + at
            at = block.find(_CHUNK_KIND, at + 1)
        place += _SEARCHED
    return size


def _sound_place(kind: int, content: bytes, start: int, end: int) -> ChunkPlace | None:
    """Return the place of a message that can be decoded, without an entity unless it is a chunk of the run; None if it cannot."""
    entity, is_static = "", False
    try:
        fields = dict(_fields(content))
        if kind == CHUNK:
            for batch in _batches(fields):
                batch.validate(full=True)
                if _is_of_run(fields):
                    entity = sys.intern((batch.schema.metadata or {}).get(_ENTITY, b"").decode())
                    is_static = not any((field.metadata or {}).get(_KIND) == _INDEX for field in batch.schema)
    except _UNDECODABLE:
        return None
    return ChunkPlace(start, end, entity, is_static)


def _is_of_run(fields: dict[int, int | bytes]) -> bool:
    """Tell whether a chunk belongs to the run, by the kind (1) of its store (1)."""
    store = fields.get(1, b"")
    return isinstance(store, bytes) and dict(_fields(store)).get(1) == _OF_RUN


def _batches(fields: dict[int, int | bytes]) -> list[pa.RecordBatch]:
    """Decode the rows of a chunk from compression (2), size (3) and payload (5); ValueError if they cannot be decoded."""
    compression, size, payload = fields.get(2, 0), fields.get(3, 0), fields[5]
    if not (isinstance(compression, int) and isinstance(size, int) and isinstance(payload, bytes)):
        raise ValueError("fields of other types")
    if not 0 < size < _LARGEST:
        raise ValueError(f"a size of {size} bytes")
    if compression == _LZ4:
        payload = pa.decompress(payload, decompressed_size=size, codec="lz4_raw", asbytes=True)
    elif compression not in _UNCOMPRESSED:
        raise ValueError(f"compression {compression}")
    return list(pa.ipc.open_stream(payload))


def _fields(content: bytes) -> Iterator[tuple[int, int | bytes]]:
    """Yield the fields of a protobuf message by number."""
    place = 0
    while place < len(content):
        key, place = _varint(content, place)
        number, wire = key >> 3, key & 7
        if wire == 0:
            value, place = _varint(content, place)
            yield number, value
            continue
        length, place = (8, place) if wire == 1 else (4, place) if wire == 5 else _varint(content, place)
        if wire not in (1, 2, 5) or place + length > len(content):
            raise ValueError("no protobuf")
        yield number, content[place : place + length]
        place += length


def _varint(content: bytes, place: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, 70, 7):
        byte = content[place]
        place += 1
        value |= (byte & 127) << shift
        if byte < 128:
            return value, place
    raise ValueError("no protobuf")


def _head_of_this_version() -> bytes:
    """Make the head that the installed Rerun writes: its version, then compression by LZ4 and content by protobuf."""
    from importlib.metadata import version

    major, minor, patch = (int(part) for part in version("rerun-sdk").split(".")[:3])
    return HEAD + bytes((major, minor, patch, 0, 1, 2, 0, 0))
