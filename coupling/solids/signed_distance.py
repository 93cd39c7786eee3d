"""Exact signed distance to a triangle mesh: negative inside, by closest point and angle-weighted normals.

The closest point is found in a tree of bounding boxes. The sign is that of (x - c) . n with n the normal of the face, edge
or corner that c lies on; edges and corners take the sum of their faces' normals, corners weighted by angle, which makes
the sign right everywhere for a closed mesh (Baerentzen and Aanaes 2005). An open mesh, such as a terrain, is solid behind
its faces near them.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
import trimesh

from oilsim.backend.arrays import Array, Flags, Ints
from oilsim.backend.jit import njit

Box = tuple[Array, Array]

LEAF_SIZE = 6
ALONE = 10_000  # points of which one processor is asked: fewer are not worth a second one
LATTICE_SHIFT = np.array(
    [0.31, 0.37, 0.43]
)  # of a step: keeps lattice planes off the planes of meshes in round numbers
SMALL = 0.01  # [m] of a mesh, below which trimesh takes some of its triangles for lines
FACE, CORNER_A, CORNER_B, CORNER_C, EDGE_AB, EDGE_BC, EDGE_CA = range(7)


class _Tree(NamedTuple):
    """Boxes (N, 3) with child nodes; a leaf has no left child and holds `size` faces from `start`."""

    lower: Array
    upper: Array
    left: Ints
    right: Ints
    start: Ints
    size: Ints
    triangle: Array  # (F, 3, 3), in the order of leaves
    normal: Array  # (F, 7, 3): of the face, its corners and its edges


class Nearest(NamedTuple):
    """Per point: signed distance (K,) [m], closest surface point (K, 3) [m], outward normal there (K, 3)."""

    distance: Array
    point: Array
    normal: Array


class SignedDistance:
    """Signed distance field of one mesh; `phi` below. Closed parts that overlap count as their union."""

    def __init__(self, mesh: trimesh.Trimesh, within: Box | None = None) -> None:
        """`within`: lower and upper corner (3,) [m] of the box in which `lattice` looks; None: wherever the mesh is.

        ValueError if no triangle has an area.
        """
        keep = np.asarray(mesh.area_faces) > 1e-14 * float(np.max(mesh.extents)) ** 2
        if not keep.any():
            raise ValueError("mesh has no triangle with an area above 0")
        self.lower, self.upper = (np.asarray(bound, dtype=np.float64) for bound in mesh.bounds)
        self.is_cut = within is not None
        if within is not None:
            self.lower, self.upper = np.maximum(self.lower, within[0]), np.minimum(self.upper, within[1])
        triangle = np.ascontiguousarray(mesh.triangles[keep], dtype=np.float64)
        normal = _feature_normals(_unit_sized(mesh))[keep]
        self._trees = [_build_tree(triangle[part], normal[part]) for part in _solid_parts(mesh, keep)]

    @property
    def is_union(self) -> bool:
        """Return whether there are several closed parts, which may overlap."""
        return len(self._trees) > 1

    def holds(self, points: Array) -> Flags:
        """Return which of the points (K, 3) [m] lie where `lattice` looks."""
        return np.asarray(((points >= self.lower) & (points <= self.upper)).all(axis=1))

    def nearest(self, points: Array) -> Nearest:
        """Return distance, closest point and normal for points (K, 3) [m]."""
        points = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 3)
        nearest = self._nearest_to(self._trees[0], points)
        for tree in self._trees[1:]:
            # phi is no less than the way to the part's box, which spares most parts most points
            outside = np.maximum(np.maximum(tree.lower[0] - points, points - tree.upper[0]), 0.0)
            near = np.flatnonzero((outside**2).sum(axis=1) <= np.maximum(nearest.distance, 0.0) ** 2)
            other = self._nearest_to(tree, points[near])
            deeper = other.distance < nearest.distance[near]
            for known, found in zip(nearest, other, strict=True):
                known[near[deeper]] = found[deeper]
        return nearest

    @staticmethod
    def _nearest_to(tree: _Tree, points: Array) -> Nearest:
        """Look for the nearest points on one closed part, on all processors, each for points of its own."""
        nearest = Nearest(np.empty(len(points)), np.empty_like(points), np.empty_like(points))
        shares = min(os.cpu_count() or 1, 1 + len(points) // ALONE)
        if shares == 1:
            _query(points, tree, nearest)
            return nearest
        parts = [slice(len(points) * n // shares, len(points) * (n + 1) // shares) for n in range(shares)]

        def look(part: slice) -> None:
            _query(points[part], tree, Nearest(*(found[part] for found in nearest)))

        with ThreadPoolExecutor(shares) as pool:
            list(pool.map(look, parts))  # a list, so that errors come out
        return nearest

    def phi(self, points: Array) -> Array:
        """Return the signed distance (K,) [m] of points (K, 3) [m]."""
        return self.nearest(points).distance

    def phi_and_outward(self, points: Array) -> tuple[Array, Array]:
        """Return the signed distance (K,) [m] and its unit gradient (K, 3); the surface normal for points on the surface itself."""
        nearest = self.nearest(points)
        away = points - nearest.point
        length = np.linalg.norm(away, axis=1)
        scale = 1e-9 * float(np.max(self.upper - self.lower))
        away = away * (np.sign(nearest.distance) / np.maximum(length, scale))[:, None]
        return nearest.distance, np.where((length > scale)[:, None], away, nearest.normal)

    def lattice(self, step: float, low: float, high: float) -> tuple[Array, Array]:
        """Return all points (K, 3) [m] of the cubic lattice with `step` [m] (cell centres) where low <= phi <= high, and phi (K,).

        Found by halving cells: phi changes by no more than a cell's half diagonal within it.
        """
        halvings = 4
        coarse = step * 2**halvings
        count = np.ceil((self.upper - self.lower + 2.0 * max(high, 0.0)) / coarse).astype(int) + 1
        origin = np.floor((self.lower - max(high, 0.0)) / coarse) * coarse - LATTICE_SHIFT * step
        cells = np.stack(np.meshgrid(*(np.arange(n) for n in count), indexing="ij"), axis=-1).reshape(-1, 3)
        edge = coarse
        while True:
            centers = origin + (cells + 0.5) * edge
            phi = self.phi(centers)
            margin = 0.0 if edge <= step * 1.5 else 0.5 * np.sqrt(3.0) * edge
            keep = (phi >= low - margin) & (phi <= high + margin)
            if margin == 0.0:
                return centers[keep], phi[keep]
            corner = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), axis=-1).reshape(-1, 3)
            cells = (2 * cells[keep][:, None, :] + corner).reshape(-1, 3)
            edge *= 0.5


def _solid_parts(mesh: trimesh.Trimesh, keep: Flags) -> list[Ints]:
    """Indices among the kept faces of each closed part; all of them together if any part is open or a hollow."""
    everything = [np.arange(int(keep.sum()))]
    labels = trimesh.graph.connected_component_labels(mesh.face_adjacency, node_count=len(mesh.faces))
    if labels.max() == 0 or not mesh.is_watertight:
        return everything
    a, b, c = np.moveaxis(
        np.asarray(mesh.triangles) - mesh.bounds.mean(axis=0), 1, 0
    )  # far away, only rounding would be left
    volumes = np.bincount(labels, weights=np.einsum("fi,fi->f", a, np.cross(b, c)))
    if (volumes <= 0.0).any():
        return everything
    labels = labels[keep]
    return [np.flatnonzero(labels == label) for label in np.unique(labels)]


def _unit_sized(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """A mesh with the same angles, so large that trimesh does not take its triangles for degenerate."""
    size = float(np.max(mesh.extents))
    if size > SMALL:
        return mesh
    vertices = (np.asarray(mesh.vertices) - mesh.bounds.mean(axis=0)) / size
    return trimesh.Trimesh(vertices, mesh.faces, process=False)


def _feature_normals(mesh: trimesh.Trimesh) -> Array:
    """(F, 7, 3) unit normals of each face, its three corners (weighted by angle) and its three edges."""
    faces, face_normals = np.asarray(mesh.faces), np.asarray(mesh.face_normals, dtype=np.float64)
    corners = np.zeros((len(mesh.vertices), 3))
    angles = np.asarray(mesh.face_angles)
    for corner in range(3):
        np.add.at(corners, faces[:, corner], angles[:, corner, None] * face_normals)
    edge_of_face = np.asarray(mesh.edges_unique_inverse).reshape(-1, 3)
    edges = np.zeros((len(mesh.edges_unique), 3))
    for edge in range(3):
        np.add.at(edges, edge_of_face[:, edge], face_normals)
    stacked = np.concatenate([face_normals[:, None], corners[faces], edges[edge_of_face]], axis=1)
    length = np.linalg.norm(stacked, axis=2, keepdims=True)
    return np.where(length > 1e-12, stacked / np.maximum(length, 1e-12), face_normals[:, None])


def _build_tree(triangle: Array, normal: Array) -> _Tree:
    """Halve the faces at the median along the longest side of their box until few are left."""
    low, high = triangle.min(axis=1), triangle.max(axis=1)
    middle = 0.5 * (low + high)
    order = np.arange(len(triangle))
    boxes: list[tuple[Array, Array]] = []
    children: list[list[int]] = []
    spans: list[tuple[int, int]] = []
    waiting = [(0, len(order), -1, 0)]
    while waiting:
        begin, end, parent, side = waiting.pop()
        node, members = len(boxes), order[begin:end]
        if parent >= 0:
            children[parent][side] = node
        boxes.append((low[members].min(axis=0), high[members].max(axis=0)))
        children.append([-1, -1])
        spans.append((begin, end - begin))
        if end - begin > LEAF_SIZE:
            axis = int(np.argmax(np.ptp(middle[members], axis=0)))
            order[begin:end] = members[np.argsort(middle[members, axis], kind="stable")]
            half = (begin + end) // 2
            waiting += [(begin, half, node, 0), (half, end, node, 1)]
    lower, upper = (np.array(side) for side in zip(*boxes, strict=True))
    left, right = np.array(children, dtype=np.int64).T.copy()
    start, size = np.array(spans, dtype=np.int64).T.copy()
    return _Tree(lower, upper, left, right, start, size, triangle[order], normal[order])


@njit(inline="always", nogil=True, cache=True, error_model="numpy")
def _dot(ax, ay, az, bx, by, bz):
    return ax * bx + ay * by + az * bz


@njit(nogil=True, cache=True, error_model="numpy")
def _closest_on_triangle(px, py, pz, t):
    """Weights u, v of the point a + u (b - a) + v (c - a) of triangle t = (a, b, c) that is closest to p, and the
    feature it lies on (Ericson 2005, 5.1.5)."""
    abx, aby, abz = t[1, 0] - t[0, 0], t[1, 1] - t[0, 1], t[1, 2] - t[0, 2]
    acx, acy, acz = t[2, 0] - t[0, 0], t[2, 1] - t[0, 1], t[2, 2] - t[0, 2]
    d1 = _dot(abx, aby, abz, px - t[0, 0], py - t[0, 1], pz - t[0, 2])
    d2 = _dot(acx, acy, acz, px - t[0, 0], py - t[0, 1], pz - t[0, 2])
    if d1 <= 0.0 and d2 <= 0.0:
        return 0.0, 0.0, CORNER_A
    d3 = _dot(abx, aby, abz, px - t[1, 0], py - t[1, 1], pz - t[1, 2])
    d4 = _dot(acx, acy, acz, px - t[1, 0], py - t[1, 1], pz - t[1, 2])
    if d3 >= 0.0 and d4 <= d3:
        return 1.0, 0.0, CORNER_B
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        return d1 / (d1 - d3), 0.0, EDGE_AB
    d5 = _dot(abx, aby, abz, px - t[2, 0], py - t[2, 1], pz - t[2, 2])
    d6 = _dot(acx, acy, acz, px - t[2, 0], py - t[2, 1], pz - t[2, 2])
    if d6 >= 0.0 and d5 <= d6:
        return 0.0, 1.0, CORNER_C
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        return 0.0, d2 / (d2 - d6), EDGE_CA
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        share = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return 1.0 - share, share, EDGE_BC
    scale = 1.0 / (va + vb + vc)
    return vb * scale, vc * scale, FACE


@njit(nogil=True, cache=True, error_model="numpy")
def _box_distance2(px, py, pz, lower, upper, node):
    """Squared distance from p to the box of a node."""
    dx = max(lower[node, 0] - px, px - upper[node, 0], 0.0)
    dy = max(lower[node, 1] - py, py - upper[node, 1], 0.0)
    dz = max(lower[node, 2] - pz, pz - upper[node, 2], 0.0)
    return dx * dx + dy * dy + dz * dz


@njit(nogil=True, cache=True, error_model="numpy")
def _nearest_in_leaf(px, py, pz, begin, end, triangle, best, closest):
    """Best squared distance, face and feature among the faces begin to end; face -1 if none beats `best`."""
    best_face, best_feature = -1, 0
    for face in range(begin, end):
        t = triangle[face]
        u, v, feature = _closest_on_triangle(px, py, pz, t)
        x = t[0, 0] + u * (t[1, 0] - t[0, 0]) + v * (t[2, 0] - t[0, 0])
        y = t[0, 1] + u * (t[1, 1] - t[0, 1]) + v * (t[2, 1] - t[0, 1])
        z = t[0, 2] + u * (t[1, 2] - t[0, 2]) + v * (t[2, 2] - t[0, 2])
        gap2 = (px - x) ** 2 + (py - y) ** 2 + (pz - z) ** 2
        if gap2 < best:
            best, best_face, best_feature = gap2, face, feature
            closest[0], closest[1], closest[2] = x, y, z
    return best, best_face, best_feature


@njit(nogil=True, cache=True, error_model="numpy")
def _query(points, tree, found):
    """Fill `found` for every point (K, 3); the nearer child is looked into first."""
    lower, upper, left, right, start, size, triangle, normal = tree
    distance, closest, outward = found
    stack, bound = np.empty(128, np.int64), np.empty(128)
    for k in range(len(points)):
        px, py, pz = points[k, 0], points[k, 1], points[k, 2]
        best, best_face, best_feature = np.inf, 0, 0
        stack[0], bound[0], depth = 0, 0.0, 1
        while depth > 0:
            depth -= 1
            node = stack[depth]
            if bound[depth] >= best:
                continue
            if left[node] < 0:
                gap2, face, feature = _nearest_in_leaf(
                    px, py, pz, start[node], start[node] + size[node], triangle, best, closest[k]
                )
                if face >= 0:
                    best, best_face, best_feature = gap2, face, feature
                continue
            near, far = left[node], right[node]
            near_bound = _box_distance2(px, py, pz, lower, upper, near)
            far_bound = _box_distance2(px, py, pz, lower, upper, far)
            if near_bound > far_bound:
                near, far, near_bound, far_bound = far, near, far_bound, near_bound
            stack[depth], bound[depth] = far, far_bound
            stack[depth + 1], bound[depth + 1] = near, near_bound
            depth += 2
        outward[k] = normal[best_face, best_feature]
        side = _dot(
            px - closest[k, 0], py - closest[k, 1], pz - closest[k, 2], outward[k, 0], outward[k, 1], outward[k, 2]
        )
        distance[k] = np.sqrt(best) if side >= 0.0 else -np.sqrt(best)
