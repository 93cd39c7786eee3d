"""The engine's own file of bodies and contacts, read as numbers, checked, and written anew for the client that restores it.

pybullet's `restoreState` trusts its file: a damaged one can end the process. So no file from outside reaches it. `rebuilt` takes the
motion of the bodies and the contacts out of a saved file, checks each number, and writes them into a file that this client has just
saved. Bullet's `btMultiBodyWorldImporter` reads nothing else of a file when it restores a world of the same bodies.

A file is a head of 12 bytes and chunks: a code, a length, the address the chunk had, the number of its type, a count, and the data.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

_HEAD = b"BULLETd-v"  # double precision, pointers of 64 bits, little endian
_HEAD_BYTES = 12
_CHUNK = struct.Struct("<4siQii")
_BODY, _COLLIDER, _CONTACT, _SHAPE, _TYPES = b"MBDY", b"MBLC", b"CONT", b"SHAP", b"DNA1"
_MANIFOLD_TYPE = 1025  # BT_PERSISTENT_MANIFOLD_TYPE
_FARTHEST = 1e9  # [m, m/s, rad/s]: no body of a run comes so far, and no body is clipped to it
_CACHED = 4  # points of a contact
_POINTS: dict[str, tuple[str, tuple[int, ...]]] = {
    **dict.fromkeys(
        ("local_a", "local_b", "world_a", "world_b", "normal", "lateral_1", "lateral_2"), ("<f8", (_CACHED, 4))
    ),
    "distance": ("<f8", (_CACHED,)),
    "impulse": ("<f8", (_CACHED,)),
    "terms": ("<f8", (5, _CACHED)),  # right-hand side, friction, rolling and spinning friction, restitution
    "marks": ("<i4", (5, _CACHED)),  # parts and triangles of both shapes, flags
    "lateral_impulse": ("<f8", (2, _CACHED)),
    "softness": ("<f8", (7, _CACHED)),
    "age": ("<i4", (_CACHED,)),
}
_MANIFOLD = np.dtype(
    [
        *((name, kind, shape) for name, (kind, shape) in _POINTS.items()),
        ("count", "<i4"),
        ("companions", "<i4", (3,)),
        ("type", "<i4"),
        ("thresholds", "<f8", (2,)),
        ("padding", "<i4"),
        ("bodies", "<u8", (2,)),  # addresses of the two colliders' chunks
    ],
    align=True,
)  # btPersistentManifoldDoubleData
_MOTION = np.dtype([(name, "<f8", (4,)) for name in ("position", "orientation", "velocity", "rate")])
_BODY_BYTES = 200  # btMultiBodyDoubleData: the motion, then what restoring does not read
_MATTERS = ("local_a", "local_b", "world_a", "world_b", "normal", "distance", "impulse", "lateral_impulse")


@dataclass(frozen=True)
class _Chunk:
    code: bytes
    address: int
    kind: int
    count: int
    data: bytes

    def __bytes__(self) -> bytes:
        return _CHUNK.pack(self.code, len(self.data), self.address, self.kind, self.count) + self.data


def rebuilt(saved: bytes, own: bytes) -> bytes:
    """Return the file ``own``, which a client of the same bodies has saved, with the motion and the contacts of the file ``saved``.

    Raises ValueError if a file is damaged, if ``saved`` is of other bodies, or if it has numbers that no engine has written.
    """
    theirs, ours = list(_chunks(saved)), list(_chunks(own))
    for code, what in ((_BODY, "bodies"), (_COLLIDER, "colliders")):
        found, expected = len(_of(theirs, code)), len(_of(ours, code))
        if found != expected:
            raise ValueError(f"engine's state has {found} {what}, allowed: {expected}")
    addresses = [chunk.address for chunk in _of(ours, _COLLIDER)]
    place = {chunk.address: at for chunk, at in zip(_of(theirs, _COLLIDER), addresses, strict=True)}
    motions = iter([_motion(chunk) for chunk in _of(theirs, _BODY)])
    contacts = [_manifold(chunk, place) for chunk in _of(theirs, _CONTACT)]
    kind = _structures(ours).index("btPersistentManifoldDoubleData")
    free_address = 1 + max(chunk.address for chunk in ours)
    parts = [own[:_HEAD_BYTES]]
    for chunk in ours:
        if chunk.code == _TYPES:
            parts += [bytes(_Chunk(_CONTACT, free_address + n, kind, 1, data)) for n, data in enumerate(contacts)]
        data = next(motions) + chunk.data[_MOTION.itemsize :] if chunk.code == _BODY else chunk.data
        if chunk.code != _CONTACT:
            parts.append(bytes(_Chunk(chunk.code, chunk.address, chunk.kind, chunk.count, data)))
    return b"".join(parts)


def essence(content: bytes) -> bytes:
    """Return what `rebuilt` takes out of a file that an engine has saved, as a file of the same form.

    Motion, colliders by their number, and contacts with the points that they have: without addresses, the engine's own types, and what
    its memory held where nothing is written. So it is equal for engines that go on equally. ValueError for a file that is damaged.
    """
    chunks = list(_chunks(content))
    place = {chunk.address: number for number, chunk in enumerate(_of(chunks, _COLLIDER))}
    motions = [_motion(chunk).ljust(_BODY_BYTES, b"\0") for chunk in _of(chunks, _BODY)]
    contacts = [_manifold(chunk, place) for chunk in _of(chunks, _CONTACT)]
    kept = [
        *(_Chunk(_BODY, 0, 0, 1, data) for data in motions),
        *(_Chunk(_COLLIDER, number, 0, 1, b"") for number in place.values()),
        *(_Chunk(_CONTACT, 0, 0, 1, data) for data in contacts),
        _Chunk(_TYPES, 0, 0, 1, b""),
    ]
    return content[:_HEAD_BYTES] + b"".join(map(bytes, kept))


def _chunks(content: bytes) -> Iterator[_Chunk]:
    """The chunks of a file, the description of the types last."""
    if not content.startswith(_HEAD):
        raise ValueError(f"engine's state begins with {content[: len(_HEAD)]!r}, allowed: {_HEAD!r}")
    place = _HEAD_BYTES
    while place + _CHUNK.size <= len(content):
        code, length, address, kind, count = _CHUNK.unpack_from(content, place)
        begin = place + _CHUNK.size
        place = begin + length
        if length < 0 or place > len(content):
            break
        yield _Chunk(code, address, kind, count, content[begin:place])
        if code == _TYPES:
            return
    raise ValueError("engine's state is cut off, or damaged")


def _of(chunks: Sequence[_Chunk], code: bytes) -> list[_Chunk]:
    return [chunk for chunk in chunks if chunk.code == code]


def _motion(chunk: _Chunk) -> bytes:
    """The motion in a body's chunk, checked."""
    if len(chunk.data) != _BODY_BYTES:
        raise ValueError(f"engine's state has a body of {len(chunk.data)} bytes, allowed: {_BODY_BYTES}")
    motion = np.frombuffer(chunk.data, _MOTION, 1)[0]
    for name in ("position", "velocity", "rate"):
        if not (np.abs(motion[name][:3]) < _FARTHEST).all():
            raise ValueError(
                f"engine's state has a {name} of {motion[name][:3].tolist()}, allowed: below {_FARTHEST:g}"
            )
    if not (np.abs(motion["orientation"]) < 2.0).all() or not abs(np.linalg.norm(motion["orientation"]) - 1.0) < 1e-6:
        raise ValueError(
            f"engine's state has the orientation {motion['orientation'].tolist()}, allowed: a unit quaternion"
        )
    return chunk.data[: _MOTION.itemsize]


def _manifold(chunk: _Chunk, place: Mapping[int, int]) -> bytes:
    """The data of a contact's chunk, checked, with the addresses of its colliders in ``place`` of those it has."""
    if len(chunk.data) != _MANIFOLD.itemsize:
        raise ValueError(f"engine's state has a contact of {len(chunk.data)} bytes, allowed: {_MANIFOLD.itemsize}")
    given: npt.NDArray[np.void] = np.frombuffer(chunk.data, _MANIFOLD, 1)
    manifold: npt.NDArray[np.void] = np.zeros(1, _MANIFOLD)  # also between the fields, where memory holds anything
    for name in _MANIFOLD.names or ():
        manifold[name] = given[name]
    count, kind = int(manifold["count"][0]), int(manifold["type"][0])
    if not 0 <= count <= _CACHED or kind != _MANIFOLD_TYPE:
        raise ValueError(f"engine's state has a contact of {count} points and type {kind}, allowed: up to {_CACHED}")
    bodies = manifold["bodies"][0].tolist()
    if not set(bodies) <= set(place):
        raise ValueError("engine's state has a contact of a body that is not there")
    if not all(np.isfinite(manifold[name]).all() for name in (*_MATTERS, "thresholds")):
        raise ValueError("engine's state has a contact with numbers that are not finite")
    manifold["bodies"][0] = [place[body] for body in bodies]
    manifold["padding"] = 0
    for name, (_, shape) in _POINTS.items():  # beyond the contact's points lies what memory held
        points = manifold[name][0]
        (points if shape[0] == _CACHED else points.T)[count:] = 0
    return manifold.tobytes()


def kinds_of_shapes(content: bytes) -> set[str]:
    """Return the names of Bullet's structures for all collision shapes in a file that an engine has just saved."""
    chunks = list(_chunks(content))
    names = _structures(chunks)
    return {names[chunk.kind] for chunk in _of(chunks, _SHAPE)}


def _structures(chunks: Sequence[_Chunk]) -> list[str]:
    """The names of all structures that a file describes, in order of their numbers."""
    types = _of(chunks, _TYPES)[0].data
    names, place = _names(types, types.index(b"TYPE"))
    place = types.index(b"STRC", place + 2 * len(names))
    (count,) = struct.unpack_from("<i", types, place + 4)
    place += 8
    found = []
    for _ in range(count):
        kind, fields = struct.unpack_from("<2h", types, place)
        found.append(names[kind])
        place += 4 + 4 * fields
    return found


def _names(types: bytes, place: int) -> tuple[list[str], int]:
    """The list of names that begins at ``place``, and where it ends."""
    (count,) = struct.unpack_from("<i", types, place + 4)
    names = types[place + 8 :].split(b"\0", count)[:count]
    return [name.decode() for name in names], place + 8 + sum(len(name) + 1 for name in names)
