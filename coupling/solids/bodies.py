"""Shapes and masses of rigid bodies: meshes from files or primitives, mass, centre of mass and inertia from a mesh.

The solids made here are closed meshes in metres, with triangles counter-clockwise as seen from outside. Meshes from files and from users
are read as solids by the rules of `coupling.solids.solid_mesh`.

Reads mesh files, STL, OBJ, PLY and GLB, into triangles as they stand in the file.

Trimesh parses them; nothing is merged, mended or dropped here. Materials and textures are not read. Every fault of a file is raised as a
`ValueError` that names the file.
"""

from __future__ import annotations

import io
import json
import logging
import math
import struct
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from coupling.solids.closed_shells import UnitFrame
from coupling.solids.solid_mesh import SolidMesh, read_objects, told_solid
from oilsim.backend.arrays import Array

FAR = 10.0  # sizes of a mesh from the origin, beyond which its integrals lose digits
TINY = 1e-2  # [m] of a mesh, below which trimesh takes volumes for 0


@dataclass(frozen=True, kw_only=True, eq=False)
class MassProperties:
    """Mass, centre of mass and inertia of a body; ValueError for values that no body can have.

    Attributes:
        mass: [kg], above 0.
        center_of_mass: (3,) [m], in the coordinates of the mesh it was computed from.
        inertia: (3, 3) [kg m2], about the centre of mass, along the axes of the mesh; symmetric, with principal moments above 0,
            none of which exceeds the sum of the two others.
    """

    mass: float
    center_of_mass: Array
    inertia: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "center_of_mass", np.array(self.center_of_mass, dtype=np.float64))
        object.__setattr__(self, "inertia", np.array(self.inertia, dtype=np.float64))
        problems = []
        if not (math.isfinite(self.mass) and self.mass > 0.0):
            problems.append(f"mass is {self.mass} kg, allowed: above 0")
        if self.center_of_mass.shape != (3,) or not np.isfinite(self.center_of_mass).all():
            problems.append(f"center_of_mass is {self.center_of_mass}, allowed: three finite numbers")
        if self.inertia.shape != (3, 3) or not np.isfinite(self.inertia).all():
            problems.append(f"inertia is {self.inertia}, allowed: a finite 3 x 3 matrix")
        elif problem := _inertia_problem(self.inertia):
            problems.append(problem)
        if problems:
            raise ValueError("mass properties: " + "; ".join(problems))

    def principal_axes(self) -> tuple[Array, Array]:
        """Return the principal moments (3,) [kg m2], and the right-handed rotation matrix (3, 3) whose columns are their axes."""
        moments, axes = np.linalg.eigh(self.inertia)
        if np.linalg.det(axes) < 0.0:
            axes[:, 2] *= -1.0
        return moments, axes


def _inertia_problem(inertia: Array) -> str:
    """Describe why no body has this inertia: asymmetry, a moment not above 0, or one above the sum of the others; empty if one can."""
    scale = float(np.abs(inertia).max())
    if not np.allclose(inertia, inertia.T, atol=1e-9 * scale):
        return f"inertia {inertia.tolist()} is not symmetric"
    moments = np.linalg.eigvalsh(inertia)
    if not moments[0] > 0.0:
        return f"inertia has the principal moment {moments[0]} kg m2, allowed: above 0"
    if moments[2] > (moments[0] + moments[1]) * (1.0 + 1e-9):
        return f"inertia has principal moments {moments.tolist()}, the largest is more than the sum of the others"
    return ""


def mass_properties(
    mesh: trimesh.Trimesh | SolidMesh, *, density: float | None = None, mass: float | None = None
) -> MassProperties:
    """Return the mass properties of matter that fills `mesh` evenly; give either its `density` [kg/m3] or its `mass` [kg].

    m = rho V, c = (1 / V) int x dV, I = rho int (|x - c|^2 1 - (x - c)(x - c)^T) dV, exact for flat triangles (divergence theorem). The
    mesh is read as `coupling.solids.solid_mesh` says: sealed hollows hold no matter, and parts that overlap count once. Raises ValueError
    if both or neither of density and mass are given, for one that is not above 0, and for a mesh that is no solid.
    """
    if (density is None) == (mass is None):
        raise ValueError(f"density is {density} and mass is {mass}, allowed: exactly one of them")
    for name, value in (("density", density), ("mass", mass)):
        if value is not None and not (math.isfinite(value) and value > 0.0):
            raise ValueError(f"{name} is {value}, allowed: above 0")
    solid = mesh if isinstance(mesh, SolidMesh) else told_solid(mesh)
    volume, center, moments = _moments(solid.mesh)
    rho = density if density is not None else float(mass or 0.0) / volume
    tensor = moments * rho
    return MassProperties(mass=rho * volume, center_of_mass=center, inertia=0.5 * (tensor + tensor.T))


def _moments(mesh: trimesh.Trimesh) -> tuple[float, Array, Array]:
    """Return the volume [m3], its centre (3,) [m] and the second moments about it (3, 3) [m5].

    Far from the origin, or of a tiny body, rounding would cost too many digits: then a copy of size 1 about the origin is integrated.
    """
    frame = UnitFrame.of(np.asarray(mesh.vertices))
    if np.abs(frame.middle).max() < FAR * frame.size and TINY < frame.size < 1.0 / TINY:
        tensor = np.asarray(mesh.moment_inertia, dtype=np.float64) / float(mesh.density)
        return float(mesh.volume), np.asarray(mesh.center_mass, dtype=np.float64), tensor
    unit = trimesh.Trimesh(frame.unit(np.asarray(mesh.vertices)), mesh.faces, process=False)
    volume, center, tensor = _moments(unit)
    return volume * frame.size**3, frame.back(center), tensor * frame.size**5


def about_center_of_mass(mesh: trimesh.Trimesh, properties: MassProperties) -> trimesh.Trimesh:
    """Copy `mesh` into the frame whose origin is the centre of mass; poses of bodies are given for this frame."""
    moved = mesh.copy()
    moved.apply_translation(-properties.center_of_mass)
    return moved


def convex_vertices(points: Array, count: int = 200) -> Array:
    """Return corners (K, 3) [m] of the convex hull of `points` (N, 3) [m], at most `count` of them.

    If the hull has more corners, those that lie outermost in `count` evenly spread directions are returned.
    """
    corners = np.asarray(trimesh.convex.convex_hull(points).vertices, dtype=np.float64)
    if len(corners) <= count:
        return corners
    turn = np.arange(count) * math.pi * (3.0 - math.sqrt(5.0))  # golden angle: even on the sphere
    height = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    ring = np.sqrt(1.0 - height**2)
    directions = np.column_stack([ring * np.cos(turn), ring * np.sin(turn), height])
    return corners[np.unique(np.argmax(corners @ directions.T, axis=0))]


def load_mesh(path: str | Path, scale: float = 1.0) -> trimesh.Trimesh:
    """Return the surface of the solid in a mesh file, read and refused as by `load_solid`; a warning tells what was mended."""
    solid = load_solid(path, scale)
    if solid.notes:
        warnings.warn(f"mesh {path}: {'; '.join(solid.notes)}", stacklevel=2)
    return solid.mesh


def load_solid(path: str | Path, scale: float = 1.0) -> SolidMesh:
    """Return the solid in an STL, OBJ, PLY or GLB file, in metres: `scale` [m] is the length of the file's unit.

    All objects of a file form one solid. Raises FileNotFoundError for a missing file, and ValueError for a file that holds no solid and for
    a scale that is not above 0.
    """
    path = Path(path)
    if not (math.isfinite(scale) and scale > 0.0):
        raise ValueError(f"scale of mesh {path} is {scale}, allowed: above 0")
    objects = read_mesh_file(path)
    for part in objects:
        part.vertices = np.asarray(part.vertices, dtype=np.float64) * scale
    return read_objects(objects, f"mesh {path}")


def mesh_parts(path: Path) -> list[trimesh.Trimesh]:
    """Return the objects of a mesh file, separated as pybullet separates them; equal corners of each object are joined."""
    parts = read_mesh_file(path)
    for part in parts:
        part.merge_vertices(merge_tex=True, merge_norm=True)
    return parts


def require_closed(mesh: trimesh.Trimesh, what: str) -> None:
    """Require a closed surface whose normals point outwards: TypeError for anything but a mesh, ValueError for another mesh.

    `what` names the mesh in the message. The check mends nothing and does not look for crossings: it is for meshes that have been read
    as solids.
    """
    if not isinstance(mesh, trimesh.Trimesh):
        raise TypeError(f"{what} is of the type {type(mesh).__name__}, allowed: trimesh.Trimesh")
    if not mesh.is_watertight:
        edges = np.sort(mesh.edges, axis=1)
        _, uses = np.unique(edges, axis=0, return_counts=True)
        raise ValueError(f"{what} is not watertight: {int((uses != 2).sum())} edges do not join exactly two triangles")
    if not mesh.is_winding_consistent:
        raise ValueError(f"{what} has triangles of both windings, allowed: all counter-clockwise seen from outside")
    if not float(mesh.volume) > 0.0:
        raise ValueError(
            f"{what} encloses {float(mesh.volume):g} m3, allowed: above 0, with triangles counter-clockwise seen from outside"
        )


def box(size: tuple[float, float, float]) -> trimesh.Trimesh:
    """Create a box of edge lengths `size` (3,) [m] about the origin; ValueError for a length that is not above 0."""
    _require_positive("box size", *size)
    return trimesh.creation.box(extents=size)


def cylinder(radius: float, height: float, sections: int = 48) -> trimesh.Trimesh:
    """Create a cylinder of `radius` r and `height` h [m] along z about the origin; ValueError for a length that is not above 0.

    Its cross-section is a regular n-gon, n = `sections`, whose circumradius R gives the mesh the volume pi r^2 h: the n-gon's area is
    (n / 2) sin(2 pi / n) R^2.
    """
    _require_positive("cylinder radius and height", radius, height)
    circumradius = radius * math.sqrt(math.pi / (0.5 * sections * math.sin(2.0 * math.pi / sections)))
    return trimesh.creation.cylinder(radius=circumradius, height=height, sections=sections)


def sphere(radius: float, subdivisions: int = 3) -> trimesh.Trimesh:
    """Create a sphere of `radius` r [m] about the origin; ValueError for a radius that is not above 0.

    The polyhedron is widened a little, so that its volume is 4/3 pi r^3.
    """
    _require_positive("sphere radius", radius)
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    mesh.apply_scale((4.0 / 3.0 * math.pi * radius**3 / float(mesh.volume)) ** (1.0 / 3.0))
    return mesh


def capsule(radius: float, height: float, sections: int = 32) -> trimesh.Trimesh:
    """Create a capsule of `radius` r [m] along z about the origin; `height` h [m] is the length of its cylindrical part.

    The polyhedron is widened so that its volume is pi r^2 (h + 4/3 r). Raises ValueError for a length that is not above 0.
    """
    _require_positive("capsule radius and height", radius, height)
    mesh = trimesh.creation.capsule(height=height, radius=radius, count=(sections, sections))
    mesh.apply_translation(-mesh.bounds.mean(axis=0))
    widening = math.sqrt(math.pi * radius**2 * (height + 4.0 / 3.0 * radius) / float(mesh.volume))
    mesh.apply_scale((widening, widening, 1.0))
    return mesh


def tube(sections: Array) -> trimesh.Trimesh:
    """Close a tube of loops (S, K, 3) [m] that follow one another; edges and faces of no extent vanish. ValueError if it stays open."""
    count, points = sections.shape[:2]
    index = np.arange(count * points).reshape(count, points)
    a, b = index[:-1], index[1:]
    c, e = np.roll(a, -1, axis=1), np.roll(b, -1, axis=1)
    faces = np.concatenate([np.stack([a, b, c], axis=2).reshape(-1, 3), np.stack([c, b, e], axis=2).reshape(-1, 3)])
    mesh = trimesh.Trimesh(sections.reshape(-1, 3), faces, process=False)
    mesh.merge_vertices(digits_vertex=9)
    corners = mesh.faces
    distinct = (corners[:, 0] != corners[:, 1]) & (corners[:, 1] != corners[:, 2]) & (corners[:, 2] != corners[:, 0])
    mesh.update_faces(distinct)
    mesh.remove_unreferenced_vertices()
    if mesh.volume < 0.0:
        mesh.invert()
    require_closed(mesh, "tube")
    return mesh


def _require_positive(what: str, *lengths: float) -> None:
    if not all(math.isfinite(length) and length > 0.0 for length in lengths):
        raise ValueError(f"{what} is {', '.join(map(str, lengths))} m, allowed: above 0")


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
