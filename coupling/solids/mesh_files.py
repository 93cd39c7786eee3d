"""Reads mesh files, STL, OBJ, PLY and GLB, into triangles as they stand in the file.

Trimesh parses them; nothing is merged, mended or dropped here. Materials and textures are not read. Every fault of a file is raised as a
`ValueError` that names the file.
"""

from __future__ import annotations

import io
import json
import logging
import struct
from pathlib import Path

import numpy as np
import numpy.typing as npt
import trimesh

Array = npt.NDArray[np.float64]

logging.getLogger("trimesh").addHandler(
    logging.NullHandler()
)  # else its words, with a traceback, reach the terminal by themselves
MESH_SUFFIXES = (".stl", ".obj", ".ply", ".glb")
LARGEST_FILE = 1 << 30  # bytes; parsing takes some 20 times as much memory
BINARY_STL_HEADER = 84  # bytes: 80 of comment and the number of triangles
BINARY_STL_TRIANGLE = 50  # bytes
BYTE_ORDER_MARK = b"\xef\xbb\xbf"
ASCII = bytes(range(128)) + b"?" * 128  # names and comments may be in any encoding; numbers and keywords are ASCII
UNREADABLE = ("draco", "meshopt")  # compressed GLB, whose triangles come out as zeros without a decoder


def read_mesh_file(path: Path) -> list[trimesh.Trimesh]:
    """Return the objects of a mesh file, one mesh each, with the scene's transforms applied, in the file's unit.

    The list holds at least one mesh with at least one triangle. Raises FileNotFoundError for a missing file and ValueError for a file of
    another kind, a damaged one, and one without triangles.
    """
    suffix = path.suffix.lower()
    if suffix not in MESH_SUFFIXES:
        raise ValueError(f"mesh {path} is of the kind {path.suffix!r}, allowed: {', '.join(MESH_SUFFIXES)}")
    if not path.is_file():
        raise FileNotFoundError(f"mesh {path} does not exist")
    if path.stat().st_size > LARGEST_FILE:
        raise ValueError(f"mesh {path} has {path.stat().st_size:,} bytes, allowed: {LARGEST_FILE:,}; simplify it")
    try:
        data = path.read_bytes()
        _require_whole(data, suffix)
    except (OSError, ValueError) as cause:
        raise ValueError(f"mesh {path} cannot be read: {cause}") from cause
    try:
        objects = _parsed(_plain(data, suffix), suffix)
    except Exception as cause:  # whatever a parser raises on damaged input
        said = f"{type(cause).__name__} {' '.join(str(cause).split())[:200]}".strip()
        kind = suffix[1:].upper()
        raise ValueError(f"mesh {path} cannot be read: it is damaged, cut short or no {kind} file ({said})") from cause
    if not objects:
        raise ValueError(f"mesh {path} holds no triangles, allowed: a closed surface of triangles")
    return objects


def _require_whole(data: bytes, suffix: str) -> None:
    """Refuse an empty file, a binary STL or GLB of another length than its header says, and a GLB that is compressed."""
    if not data.strip():
        raise ValueError("the file is empty")
    if suffix == ".stl" and not _is_text_stl(data):
        if len(data) < BINARY_STL_HEADER or (data.isascii() and b"\0" not in data):
            raise ValueError("it is no STL file, neither in text nor in binary")
        count = struct.unpack_from("<I", data, 80)[0]
        expected = BINARY_STL_HEADER + BINARY_STL_TRIANGLE * count
        if len(data) != expected:
            raise ValueError(
                f"it has {len(data)} bytes, and a binary STL of {count} triangles, as it says, has {expected}"
            )
    if suffix == ".glb":
        _require_readable_glb(data)


def _is_text_stl(data: bytes) -> bool:
    """Tell text from binary; some binary files begin with the word "solid" as well."""
    return b"facet" in data[:4096] and b"vertex" in data[:4096] and b"\0" not in data[:4096]


def _require_readable_glb(data: bytes) -> None:
    if len(data) < 20 or data[:4] != b"glTF":
        raise ValueError("it does not begin as a GLB file does")
    version, length, json_length = struct.unpack_from("<III", data, 4)
    if version != 2:
        raise ValueError(f"it is a GLB of version {version}, allowed: 2")
    if length > len(data) or 20 + json_length > len(data):
        raise ValueError(f"it has {len(data)} bytes, and its header says {max(length, 20 + json_length)}")
    header = json.loads(data[20 : 20 + json_length])
    used = [str(name) for name in header.get("extensionsRequired", [])]
    compressed = [name for name in used if any(word in name.lower() for word in UNREADABLE)]
    if compressed:
        raise ValueError(f"its triangles are compressed by {', '.join(compressed)}, allowed: an uncompressed GLB")


def _plain(data: bytes, suffix: str) -> bytes:
    """Replace what is not ASCII in text, in which only names and comments can hold it."""
    if suffix == ".obj" or (suffix == ".stl" and _is_text_stl(data)):
        return data.removeprefix(BYTE_ORDER_MARK).translate(ASCII)
    if suffix == ".ply":
        head, mark, rest = data.removeprefix(BYTE_ORDER_MARK).partition(b"end_header")
        return head.translate(ASCII) + mark + rest
    return data


def _parsed(data: bytes, suffix: str) -> list[trimesh.Trimesh]:
    """Let trimesh parse the bytes; objects without triangles, such as lines, are no solids."""
    options = {"skip_materials": True, "split_objects": True, "group_material": False} if suffix == ".obj" else {}
    with np.errstate(all="ignore"):  # of numbers that overflow: they come out as infinite, and are told
        scene = trimesh.load_scene(io.BytesIO(data), file_type=suffix[1:], process=False, **options)
        parts = scene.dump()
    objects = [part for part in parts if isinstance(part, trimesh.Trimesh) and len(part.faces)]
    for part in objects:
        least, most = int(np.min(part.faces)), int(np.max(part.faces))
        if least < 0 or most >= len(part.vertices):
            raise ValueError(f"triangles have the corners {least} to {most} of {len(part.vertices)}")
    return objects
