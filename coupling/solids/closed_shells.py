"""Sorts triangles into closed shells: joins corners, drops double triangles, pairs faces at their edges, and gives each shell one winding.

A shell is a connected closed surface. Where more than two triangles meet in an edge, each triangle goes with the next one through solid
matter, so that parts that touch along edges or faces come apart into shells of their own. Triangles that do not close are refused, with
the place of the gap.

Finds triangles of a surface that pass through each other.

Two triangles cross if an edge of one passes through the other: its ends lie on both sides of the other's plane, and it meets that plane
in the triangle. Triangles that share corners or touch do not cross. The pairs that may cross are found by a sweep along one axis over the
triangles' boxes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components
from scipy.spatial import cKDTree

from oilsim.backend.arrays import Array, Flags, Ints
from oilsim.backend.jit import njit

JOINED = (
    0.0,
    1e-8,
    1e-7,
    1e-6,
    1e-5,
)  # of the mesh's size: how far corners may lie apart that are joined, tried in this order
TOLD = 1e-7  # of the mesh's size: corners that are joined over a longer way are told of
FLAT = 1e-9  # of area^(3/2): a shell that encloses less is a sheet


@dataclass(frozen=True, eq=False)
class UnitFrame:
    """Coordinates in which a mesh is one unit large and lies about the origin: x = middle + size u.

    Attributes:
        middle: (3,) [m].
        size: longest side of the mesh's box [m].
    """

    middle: Array
    size: float

    @staticmethod
    def of(points: Array) -> UnitFrame:
        """Return the frame of points (N, 3) [m], which must not all lie in one place."""
        low, high = points.min(axis=0), points.max(axis=0)
        return UnitFrame(0.5 * low + 0.5 * high, float((high - low).max()))

    def unit(self, points: Array) -> Array:
        """Return points (N, 3) [m] in units of the frame."""
        return (points - self.middle) / self.size

    def back(self, points: Array) -> Array:
        """Return points (N, 3), given in units of the frame, in m."""
        return points * self.size + self.middle

    def place(self, points: Array) -> str:
        """Say where the middle of points (N, 3), given in units of the frame, lies [m], to 1e-4 of the size."""
        low, high = self.back(points.min(axis=0)), self.back(points.max(axis=0))
        step = 10.0 ** math.floor(math.log10(1e-3 * self.size))
        x, y, z = (float(f"{round(value / step) * step:.9g}") for value in 0.5 * low + 0.5 * high)
        return f"({x:g}, {y:g}, {z:g})" if max(abs(x), abs(y), abs(z)) < 1e5 * step else f"({x:.9g}, {y:.9g}, {z:.9g})"

    def volume(self, value: float) -> str:
        """Say a volume, given in units of the frame, in m3."""
        return f"{value * self.size**3:.3g} m3"


@dataclass(frozen=True, eq=False)
class Shell:
    """One closed, connected surface wound one way.

    Attributes:
        faces: (F, 3) corners, indices of the vertices of all shells.
        volume: signed volume, above 0 if the normals point out of the shell.
        is_mended: true if triangles were turned over or dropped to close it.
    """

    faces: Ints
    volume: float
    is_mended: bool


@dataclass(frozen=True, eq=False)
class Shells:
    """The shells of a mesh, and a sentence on each thing that was mended."""

    shells: tuple[Shell, ...]
    notes: tuple[str, ...]


def closed_shells(vertices: Array, faces: Ints, frame: UnitFrame) -> Shells:
    """Sort triangles into closed shells.

    vertices: (V, 3) in the dimensionless units of `frame`; faces: (F, 3). Raises ValueError, which gives places in m, for triangles that
    leave a gap, cannot be wound one way, enclose nothing or pass through each other.
    """
    kept, notes = _watertight(vertices, faces, frame)
    label, partner = _paired(vertices, kept)
    is_mended = len(kept) != len(faces)
    shells, turned = [], 0
    for members in np.split(np.argsort(label, kind="stable"), np.cumsum(np.bincount(label))[:-1]):
        wound, flips = _wound(kept, members, partner)
        turned += flips
        shells.append(_shell(vertices, wound, is_mended or flips > 0, frame))
    if turned:
        notes.append(f"{counted(turned, 'triangle')} wound against the neighbours turned over")
    return Shells(tuple(shells), tuple(notes))


def counted(number: int, thing: str) -> str:
    """Write a number with its noun, as in "1 part" and "2 parts"."""
    return f"{number} {thing}" + ("s" if number != 1 else "")


def _watertight(vertices: Array, faces: Ints, frame: UnitFrame) -> tuple[Ints, list[str]]:
    """Return faces with joined corners, an even number of which meets in each edge, and notes; ValueError if there is a gap."""
    for distance in JOINED:  # no further than is needed: fine detail stays
        joined = _with_area(_joined(vertices, faces, distance))
        single = _single(joined)
        for kept in (joined, single):
            if len(kept) and not (_uses(_edges(kept)[0])[2] % 2).any():
                notes = [f"corners up to {distance * frame.size:.2g} m apart joined"] if distance > TOLD else []
                if len(kept) < len(joined):
                    notes.append(f"{counted(len(joined) - len(kept), 'double triangle')} left out")
                return kept, notes
    raise ValueError(_gap(vertices, faces, frame))


def _joined(vertices: Array, faces: Ints, distance: float) -> Ints:
    """Return faces whose corners within `distance` of each other have one index; 0: corners at exactly one place."""
    if distance == 0.0:
        first, group = _distinct(vertices + 0.0)  # -0 and 0 are one place
        return first[group][faces]
    pairs = cKDTree(vertices).query_pairs(distance, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(vertices),) * 2)
    label = connected_components(graph, directed=False)[1]
    return np.unique(label, return_index=True)[1].astype(np.int64)[label][faces]


def _distinct(rows: npt.NDArray) -> tuple[Ints, Ints]:
    """Return the index of the first of each distinct row, and for each row the number of the distinct row that it equals."""
    order = np.lexsort(rows.T[::-1])
    is_new = np.r_[True, (np.diff(rows[order], axis=0) != 0).any(axis=1)] if len(rows) else np.zeros(0, dtype=bool)
    group = np.empty(len(rows), dtype=np.int64)
    group[order] = np.cumsum(is_new) - 1
    return order[is_new].astype(np.int64), group  # lexsort is stable: the first of equals comes first


def _with_area(faces: Ints) -> Ints:
    """Drop triangles that have shrunk to a line or a point."""
    return faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]


def _single(faces: Ints) -> Ints:
    """Keep one of triangles with the same corners and the same winding."""
    if len(faces) == 0:
        return faces
    first: Ints = np.asarray(faces.argmin(axis=1))
    kept = _distinct(np.take_along_axis(faces, (first[:, None] + np.arange(3)) % 3, axis=1))[0]
    return faces[np.sort(kept)]


def _edges(faces: Ints) -> tuple[Ints, Flags]:
    """Return edges (3 F, 2), lower corner first, ordered by face; and flags (3 F,) of those that run from the lower corner."""
    edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    return np.sort(edges, axis=1), edges[:, 0] < edges[:, 1]


def _uses(edges: Ints) -> tuple[Ints, Ints, Ints]:
    """Return the distinct edges by the index of their first use, the edge of each use, and the number of uses of each edge."""
    scale = int(edges.max(initial=0)) + 1
    _, first, edge, uses = np.unique(
        edges @ np.array((scale, 1)), return_index=True, return_inverse=True, return_counts=True
    )
    return first, edge, uses


def _gap(vertices: Array, faces: Ints, frame: UnitFrame) -> str:
    """Say where a surface is open."""
    kept = _single(_with_area(_joined(vertices, faces, JOINED[1])))
    if len(kept) == 0:
        return "encloses no volume: all its triangles are lines or points, allowed: a closed surface"
    edges = _edges(kept)[0]
    first, _, uses = _uses(edges)
    odd = edges[first[uses % 2 == 1]]
    return (
        f"is not watertight: {len(odd)} edges do not join exactly two triangles, the first at {frame.place(vertices[odd[0]])} m, "
        "allowed: a closed surface"
    )


def _paired(vertices: Array, faces: Ints) -> tuple[Ints, Ints]:
    """Return the shell of each face (F,), and the neighbour of each face across its three edges (F, 3)."""
    edges, forward = _edges(faces)
    edge = _uses(edges)[1]
    order = np.argsort(edge, kind="stable")
    starts = np.flatnonzero(np.r_[True, np.diff(edge[order]) > 0])
    sizes = np.diff(np.r_[starts, len(order)])
    partner = np.empty(len(edge), dtype=np.int64)
    simple = starts[sizes == 2]
    one, other = order[simple], order[simple + 1]
    partner[one], partner[other] = other // 3, one // 3
    for start, size in zip(starts[sizes > 2], sizes[sizes > 2], strict=True):
        for first, second in _around(vertices, faces, order[start : start + size], edges, forward):
            partner[first], partner[second] = second // 3, first // 3
    graph = coo_array((np.ones(len(edge)), (np.repeat(np.arange(len(faces)), 3), partner)), shape=(len(faces),) * 2)
    return connected_components(graph, directed=False)[1].astype(np.int64), partner.reshape(-1, 3)


def _around(vertices: Array, faces: Ints, uses: Ints, edges: Ints, forward: Flags) -> list[tuple[int, int]]:
    """Pair the uses of one edge by more than two faces: the two sides of each wedge of solid matter.

    Seen along the edge, matter lies behind a face that runs along it and before one that runs against it, in the sense of turning. Each
    face against the edge goes with the next free one along it.
    """
    low, high = vertices[edges[uses[0]]]
    axis = (high - low) / max(float(np.linalg.norm(high - low)), 1e-300)
    across = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    across /= np.linalg.norm(across)
    away = vertices[faces[uses // 3]].mean(axis=1) - low
    angle = np.arctan2(away @ np.cross(axis, across), away @ across)
    angle = np.where(angle > np.pi - 1e-9, -np.pi, np.round(angle, 9))
    # at one angle those along the edge come first; of faces in one place the later ones bound the narrower wedge, all round
    turn = np.lexsort((np.where(forward[uses], -uses, uses), ~forward[uses], angle))
    waiting: list[int] = []
    pairs: list[tuple[int, int]] = []
    for use in np.concatenate([uses[turn], uses[turn]]):  # twice round, for wedges across the start
        if any(use in pair for pair in pairs):
            continue
        if forward[use] and waiting:
            pairs.append((waiting.pop(), int(use)))
        elif not forward[use] and use not in waiting:
            waiting.append(int(use))
    rest = [int(use) for use in uses if not any(use in pair for pair in pairs)]
    return pairs + list(zip(rest[::2], rest[1::2], strict=True))  # of mixed winding, which is mended later


def _wound(faces: Ints, members: Ints, partner: Ints) -> tuple[Ints, int]:
    """Return the faces of one shell with one winding, and how many were turned over; ValueError if no winding fits all."""
    own, size = faces[members], len(members)
    index = np.zeros(len(faces), dtype=np.int64)
    index[members] = np.arange(size)
    near = index[partner[members]]
    # a neighbour has the same winding if it runs the other way along the edge that both share
    begin, end = own, np.roll(own, -1, axis=1)
    runs_same = np.zeros((size, 3), dtype=bool)
    for side in range(3):
        runs_same |= (own[near][:, :, side] == begin) & (np.roll(own, -1, axis=1)[near][:, :, side] == end)
    if not runs_same.any():
        return own, 0
    rows = np.repeat(np.arange(size), 3)
    graph = coo_array((np.ones(rows.size), (rows, near.ravel())), shape=(size, size)).tocsr()
    order, before = breadth_first_order(graph, 0, directed=False)
    against = {
        (int(row), int(to)): bool(same) for row, to, same in zip(rows, near.ravel(), runs_same.ravel(), strict=True)
    }
    flip = np.zeros(size, dtype=bool)
    for face in order[1:]:
        flip[face] = flip[before[face]] ^ against[int(before[face]), int(face)]
    if (runs_same != (flip[near] ^ flip[:, None])).any():
        raise ValueError(
            "has a side that turns into its own back, as a Moebius strip does, allowed: a surface with an inside"
        )
    if 2 * flip.sum() > size:
        flip = ~flip
    return np.where(flip[:, None], own[:, ::-1], own), int(flip.sum())


def _shell(vertices: Array, faces: Ints, is_mended: bool, frame: UnitFrame) -> Shell:
    """Create a shell, and check that it encloses a volume and does not pass through itself; ValueError if not."""
    a, b, c = np.moveaxis(vertices[faces] - vertices[faces[0, 0]], 1, 0)
    volume = float(np.einsum("fi,fi->", a, np.cross(b, c))) / 6.0
    area = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
    if abs(volume) <= FLAT * area**1.5:
        raise ValueError(
            f"has a part of {len(faces)} triangles about {frame.place(vertices[faces.ravel()])} m that "
            "encloses no volume, allowed: parts with a thickness"
        )
    crossing = crossing_triangles(vertices, faces)
    if crossing is not None:
        raise ValueError(
            f"crosses itself about {frame.place(vertices[faces[crossing[0]]])} m: two triangles of one part "
            "pass through each other, allowed: parts that cross each other, each sound in itself"
        )
    return Shell(faces, volume, is_mended)


TOUCHING = 1e-7  # of the surface's size: how far an edge must reach to both sides to pass through
ROUNDING = 1e-12  # of the surface's size: an edge so near a border of two triangles passes through one of them, in spite of rounding


def crossing_triangles(vertices: Array, faces: Ints) -> tuple[int, int] | None:
    """Return the indices of two triangles that pass through each other, None if there are none.

    vertices: (V, 3); faces: (F, 3). The unit is free.
    """
    triangles = np.ascontiguousarray(vertices[faces], dtype=np.float64)
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    size = float(np.max(high.max(axis=0) - low.min(axis=0)))
    axis = int(np.argmin((high - low).sum(axis=0) / np.maximum(np.ptp(low, axis=0), 1e-300)))
    order = np.argsort(low[:, axis], kind="stable")
    first = _sweep(axis, low[order], high[order], triangles[order], faces[order].astype(np.int64), TOUCHING * size)
    return None if first[0] < 0 else (int(order[first[0]]), int(order[first[1]]))


@njit(nogil=True, cache=True, error_model="numpy")
def _sweep(axis, low, high, triangles, faces, tolerance):
    """Return the first pair of crossing triangles, in the order of `low` along `axis`; (-1, -1) if there is none."""
    one, other = (axis + 1) % 3, (axis + 2) % 3
    for i in range(len(low)):
        for j in range(i + 1, len(low)):
            if low[j, axis] > high[i, axis]:
                break
            if low[j, one] > high[i, one] or low[i, one] > high[j, one]:
                continue
            if low[j, other] > high[i, other] or low[i, other] > high[j, other]:
                continue
            shared = 0
            for corner in range(3):
                own = faces[i, corner]
                shared += own == faces[j, 0] or own == faces[j, 1] or own == faces[j, 2]
            if shared >= 2:  # neighbours meet in their edge only
                continue
            if _passes(i, j, triangles, faces, tolerance) or _passes(j, i, triangles, faces, tolerance):
                return i, j
    return -1, -1


@njit(nogil=True, cache=True, error_model="numpy", inline="always")
def _cross(ax, ay, az, bx, by, bz):
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@njit(nogil=True, cache=True, error_model="numpy")
def _passes(i, j, triangles, faces, tolerance):
    """Tell whether an edge of triangle i that has no corner of j passes through triangle j."""
    t = triangles[j]
    nx, ny, nz = _cross(
        t[1, 0] - t[0, 0], t[1, 1] - t[0, 1], t[1, 2] - t[0, 2], t[2, 0] - t[0, 0], t[2, 1] - t[0, 1], t[2, 2] - t[0, 2]
    )
    area = np.sqrt(nx * nx + ny * ny + nz * nz)
    if area <= tolerance * tolerance:
        return False
    nx, ny, nz = nx / area, ny / area, nz / area
    for corner in range(3):
        following = (corner + 1) % 3
        begin, end = faces[i, corner], faces[i, following]
        if begin == faces[j, 0] or begin == faces[j, 1] or begin == faces[j, 2]:
            continue
        if end == faces[j, 0] or end == faces[j, 1] or end == faces[j, 2]:
            continue
        p, q = triangles[i, corner], triangles[i, following]
        above = nx * (p[0] - t[0, 0]) + ny * (p[1] - t[0, 1]) + nz * (p[2] - t[0, 2])
        below = nx * (q[0] - t[0, 0]) + ny * (q[1] - t[0, 1]) + nz * (q[2] - t[0, 2])
        if above * below >= 0.0 or min(abs(above), abs(below)) <= tolerance:
            continue
        share = above / (above - below)
        x, y, z = p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1]), p[2] + share * (q[2] - p[2])
        if _is_within(x, y, z, t, nx, ny, nz, tolerance * (ROUNDING / TOUCHING)):
            return True
    return False


@njit(nogil=True, cache=True, error_model="numpy")
def _is_within(x, y, z, t, nx, ny, nz, tolerance):
    """Tell whether a point of the plane of triangle t, which has the unit normal n, lies in t or within `tolerance` of it."""
    for side in range(3):
        a, b = t[side], t[(side + 1) % 3]
        ex, ey, ez = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        length = max(np.sqrt(ex * ex + ey * ey + ez * ez), 1e-300)
        cx, cy, cz = _cross(ex, ey, ez, x - a[0], y - a[1], z - a[2])
        if (cx * nx + cy * ny + cz * nz) / length < -tolerance:
            return False
    return True
