"""Points that lie evenly on a surface: along its edges and corners, and between them by random choice and by pushing apart.

Points spread evenly over the inset surface of a box leave its edges to chance; the kernel's integral in front of an edge is
then off by a tenth. A point at depth h below an edge between faces of normals n and m is e - h (n + m) / (1 + n . m); one
below a corner solves n_k . x = -h for all its faces.
"""

from __future__ import annotations

import math

import numpy as np
import trimesh
from scipy.sparse import coo_array
from scipy.spatial import cKDTree

from coupling.solids.signed_distance import SignedDistance
from oilsim.backend.arrays import Array, Flags, Ints
from oilsim.backend.jit import njit

SHARP = np.pi / 4.0  # angle between faces from which their edge counts as one
ROUND = 0.3  # smallest over largest singular value of the normals at a corner; below, the faces meet in an edge


def convex_edges(mesh: trimesh.Trimesh) -> Flags:
    """Mark the pairs (A,) of adjacent faces of the mesh that meet in a sharp convex edge."""
    return np.asarray((mesh.face_adjacency_angles > SHARP) & mesh.face_adjacency_convex)


def sharp_edges(mesh: trimesh.Trimesh, step: float) -> tuple[Array, Array]:
    """Return points (K, 3) [m], `step` [m] apart or less, along sharp convex edges, and the way (K, 3) to depth 1 below both faces."""
    sharp = convex_edges(mesh)
    ends = np.asarray(mesh.vertices)[np.asarray(mesh.face_adjacency_edges)[sharp]]
    first, second = (np.asarray(mesh.face_normals)[mesh.face_adjacency[sharp, side]] for side in (0, 1))
    inward = -(first + second) / np.maximum(1.0 + (first * second).sum(axis=1), 1e-3)[:, None]
    counts = [max(2, int(np.ceil(np.linalg.norm(end - begin) / step)) + 1) for begin, end in ends]
    rows = [
        begin + np.linspace(0.0, 1.0, n)[:, None] * (end - begin) for (begin, end), n in zip(ends, counts, strict=True)
    ]
    if not rows:
        return np.zeros((0, 3)), np.zeros((0, 3))
    return np.concatenate(rows), np.repeat(inward, counts, axis=0)


def inset_ridges(mesh: trimesh.Trimesh, solid: SignedDistance, depth: float, step: float) -> tuple[Array, Array]:
    """Return corners (K, 3) and edge points (L, 3) [m], about `step` apart, of the surface `depth` [m] below the mesh.

    Those outside the box in which `solid` looks are left out.
    """
    edge, inward = sharp_edges(mesh, step)
    corner, way = _corners(mesh)
    ridges = []
    for points in (corner + depth * way, edge + depth * inward):
        points = points[solid.holds(points)]
        is_there = np.abs(solid.phi(points) + depth) < 0.02 * depth if len(points) else np.zeros(0, dtype=bool)
        ridges.append(points[is_there])
    return ridges[0], ridges[1]


def _corners(mesh: trimesh.Trimesh) -> tuple[Array, Array]:
    """Return the vertices (K, 3) where sharp edges meet, and the way (K, 3) from each to depth 1 below all its faces."""
    sharp = convex_edges(mesh)
    faces_at: dict[int, set[int]] = {}
    for ends, faces in zip(mesh.face_adjacency_edges[sharp], mesh.face_adjacency[sharp], strict=True):
        for vertex in ends:
            faces_at.setdefault(int(vertex), set()).update(int(face) for face in faces)
    places, ways = [], []
    for vertex, faces in faces_at.items():
        normals = np.asarray(mesh.face_normals)[sorted(faces)]
        size = np.linalg.svd(normals, compute_uv=False)
        if len(size) == 3 and size[2] > ROUND * size[0]:
            places.append(mesh.vertices[vertex])
            ways.append(np.linalg.lstsq(normals, -np.ones(len(normals)), rcond=None)[0])
    return np.array(places).reshape(-1, 3), np.array(ways).reshape(-1, 3)


PACKING = 0.7  # count times distance^2 over area of what random choice at a least distance reaches on a plane


@njit(nogil=True, cache=True, error_model="numpy")
def _choose(order, start, neighbor, chosen):
    """Go through candidates in `order` and choose each that has no chosen neighbour."""
    for candidate in order:
        free = True
        for k in range(start[candidate], start[candidate + 1]):
            if chosen[neighbor[k]]:
                free = False
                break
        chosen[candidate] = free


def random_distance(pitch: float) -> float:
    """Return the least distance [m] at which random choice leaves one point per pitch^2 of a surface."""
    return math.sqrt(PACKING) * pitch


def choose_apart(candidates: Array, least: float, ordered: int = 0) -> Ints:
    """Return the indices of candidates (K, 3) [m] that are `least` [m] or more apart and leave no room for another.

    The first `ordered` of them are asked first and in their order, the others in a fixed random one (Poisson-disk choice).
    """
    count = len(candidates)
    if count == 0:
        return np.zeros(0, dtype=np.int64)
    pairs = cKDTree(candidates).query_pairs(least, output_type="ndarray")
    near = coo_array((np.ones(len(pairs), dtype=np.bool_), pairs.T), shape=(count, count))
    near = (near + near.T).tocsr()
    others = ordered + np.random.default_rng(0).permutation(count - ordered)
    chosen = np.zeros(count, dtype=np.bool_)
    _choose(np.concatenate([np.arange(ordered), others]), near.indptr, near.indices, chosen)
    return np.flatnonzero(chosen)


def push_apart(points: Array, distance: float) -> Array:
    """Return displacements (N, 3) [m] that spread the points (N, 3) [m] evenly.

    A point's displacement is the sum over neighbours nearer than 1.5 `distance` [m] of 0.15 distance (1 - r / (1.5 distance))^2 along the
    line from the neighbour.
    """
    reach = 1.5 * distance
    pairs = cKDTree(points).query_pairs(reach, output_type="ndarray")
    between = points[pairs[:, 0]] - points[pairs[:, 1]]
    gap = np.maximum(np.linalg.norm(between, axis=1), 1e-9 * distance)
    push = (0.15 * distance * np.clip(1.0 - gap / reach, 0.0, 1.0) ** 2 / gap)[:, None] * between
    moves = np.zeros_like(points)
    np.add.at(moves, pairs[:, 0], push)
    np.add.at(moves, pairs[:, 1], -push)
    return moves
