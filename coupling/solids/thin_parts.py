"""Thickness of the plates of a solid, compared with the particle spacing.

A wall of one layer of particles holds liquid only up to a pressure. Measured with water that stands 8 spacings d high on one side of a held
plate, in 2 s: 6.7 % of it passes a plate of 1.0 d, 4.5 % one of 1.05 d, 3.1 % one of 1.1 d, nothing one of 1.2 d; no plate lets anything
through where the water stands 2 d high.

Liquid sinks into thinner plates because the coverage of the kernel tells the distance from a thick wall
(`oilsim.boundaries.wall_contact`): a plate of 1.0 d seems 0.15 d farther than it is, and from 0.1 d below its face on the slopes of its two
sides cancel. Solids that do not answer to the liquid can be thickened: of plates of 0.2 to 1.2 d, taken for HELD d, nothing passed in 2 s.
Solids that float cannot, since their lift would grow: their plates get normals (`plate_normals`), by which the fluid keeps its particles on
their side (`oilsim.boundaries.plate_guard`).
"""

from __future__ import annotations

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from coupling.solids.signed_distance import SignedDistance
from oilsim.backend.arrays import Array, Flags

TIGHT = 1.2  # spacings: plates from this thickness on let nothing through
HELD = 1.3  # spacings: as which thinner plates of solids count that do not answer to the liquid; at 1.2 one particle of 1120 passed
PARALLEL = -0.98  # product of the normals of the two sides of a plate; bows and edges are sharper than that
STEP = 0.5  # lattice step of the points that look, in spacings
LOOKS = 24  # places at which a way of 1.2 spacings or less looks whether it is outside, 0.05 spacings apart
RIM = 1.5  # spacings, within which a point beside a plate's rim takes the plate's normal
LEAST_AREA = 4.0  # squares of a spacing that a plate has at least


def middle_plane(solid: SignedDistance, surface: Array, normal: Array, half: float) -> tuple[Array, Array, Array]:
    """Look straight down from surface points for the place where another side is as near.

    surface: (N, 3) [m]; normal: (N, 3) outward, there; half: greatest depth [m]. Returns the depth found (N,) [m], the place (N, 3) [m] and
    the outward normal (N, 3) of the side beyond. Going inward from s by t, phi = -t until another part of the surface is as near.
    """
    low, high = np.zeros(len(surface)), np.full(len(surface), half)
    for _ in range(30):
        depth = 0.5 * (low + high)
        above = depth + solid.phi(surface - depth[:, None] * normal) <= 0.02 * depth
        low, high = np.where(above, depth, low), np.where(above, high, depth)
    beyond = solid.nearest(surface - 1.1 * low[:, None] * normal)
    return low, surface - low[:, None] * normal, beyond.normal


def thinnest_plate(solid: SignedDistance, particle_spacing: float) -> float:
    """Return the thickness [m] of the thinnest plate of a solid if it is below TIGHT spacings, else infinity.

    A plate has two sides that are nearly parallel and as large as a few particles. Edges and bows are no plates.
    """
    step, half = STEP * particle_spacing, 0.5 * TIGHT * particle_spacing
    near, _ = solid.lattice(step, 0.0, step)
    surface = solid.nearest(near)
    below = solid.phi(surface.point - half * surface.normal) > -0.98 * half
    if not below.any():
        return np.inf
    depth, _, beyond = middle_plane(solid, surface.point[below], surface.normal[below], half)
    is_plate = (beyond * surface.normal[below]).sum(axis=1) < PARALLEL
    thickness = np.sort(2.0 * depth[is_plate & (depth > 1e-4 * half) & (depth < 0.99 * half)])
    least = int(np.ceil(2.0 * LEAST_AREA / STEP**2))  # points on both sides
    return float(thickness[least - 1]) if len(thickness) >= least else np.inf


def plate_normals(solid: SignedDistance, points: Array, particle_spacing: float) -> Array:
    """Return unit normals (N, 3) [1] of plates below TIGHT spacings at points (N, 3) [m] inside them, and 0 at other points.

    A point of a plate has a side straight above and one straight below, TIGHT spacings apart at most. Points beside a rim and where plates
    meet take theirs from the plates around (`_borrowed_normals`).
    """
    near = solid.nearest(points)
    depth = np.linalg.norm(near.point - points, axis=1)
    leaves, beyond = _way_out(solid, points, -near.normal, TIGHT * particle_spacing - depth)
    is_plate = leaves & ((solid.nearest(beyond).normal * near.normal).sum(axis=1) < PARALLEL)
    normals = np.where(is_plate[:, None], near.normal, 0.0)
    if is_plate.any() and not is_plate.all():
        normals[~is_plate] = _borrowed_normals(
            solid, points[~is_plate], points[is_plate], near.normal[is_plate], particle_spacing
        )
    return normals


def _way_out(solid: SignedDistance, points: Array, along: Array, reach: Array) -> tuple[Flags, Array]:
    """Tell which straight ways of `reach` (N,) [m] along unit vectors (N, 3) leave the solid, and the first places (N, 3) [m] outside."""
    ways = np.linspace(0.0, 1.0, LOOKS + 1)[1:, None] * reach
    outside = np.stack([solid.phi(points + way[:, None] * along) > -1e-3 * reach for way in ways])
    first = np.take_along_axis(ways, outside.argmax(axis=0)[None], axis=0)[0]
    return np.asarray(outside.any(axis=0)), points + first[:, None] * along


def _borrowed_normals(
    solid: SignedDistance, points: Array, plates: Array, normal: Array, particle_spacing: float
) -> Array:
    """Return unit normals (N, 3) [1] at points (N, 3) [m] from the plates within RIM spacings, and 0 where none of the following holds.

    plates, normal (K, 3): points of plates [m] and their normals [1], of either sign. TIGHT spacings along a plate's normal,
    both ways leave the solid:  beside its rim or its foot; the nearest such normal
    one way does:               in a corner, where it is the outer side of both plates; the mean of two or three unlike normals
    no way does:                where the plate ends at another, if one way along the other's normal leaves it; the nearest such normal
    """
    found, reach = np.zeros_like(points), TIGHT * particle_spacing
    for n, near in enumerate(cKDTree(plates).query_ball_point(points, RIM * particle_spacing)):
        near = sorted(near, key=lambda k: float(np.sum((plates[k] - points[n]) ** 2)))
        along = normal[near].reshape(-1, 3)
        ahead, behind = (solid.phi(points[n] + side * reach * along) > 0.0 for side in (1.0, -1.0))
        outward = np.where(ahead[:, None], along, -along)[ahead != behind]
        if (ahead & behind).any():
            found[n] = along[ahead & behind][0]
        elif len(outward):
            found[n] = _mean_of_unlike(outward)
            ending = along[~(ahead | behind)]
            if not found[n].any() and len(ending):
                found[n] = ending[0]
    return found


def _mean_of_unlike(normals: Array) -> Array:
    """Return the unit mean (3,) of the first of unit normals (K, 3) and of the one or two that are most unlike it and each other.

    It is 0 where all are parallel.
    """
    chosen = normals[:1]
    while len(chosen) < 3:
        alike = np.abs(normals @ chosen.T).max(axis=1)
        if alike.min() > -PARALLEL:
            break
        chosen = np.vstack([chosen, normals[alike.argmin()]])
    total = chosen.sum(axis=0)
    return total / np.linalg.norm(total) if len(chosen) > 1 else np.zeros(3)


def plates_of(mesh: trimesh.Trimesh, particle_spacing: float) -> float:
    """Return the thickness [m] of the thinnest plate of a closed mesh, as `thinnest_plate` does."""
    return thinnest_plate(SignedDistance(mesh), particle_spacing)
