"""Walls and solid surfaces as one layer of particles whose volumes make their surface act where the geometry has it.

The points lie half a spacing inside the solid, so that the wall itself is midway between them and a lattice of fluid half a
spacing outside. A volume is what the layer must stand for: with probes half a spacing outside the wall,

    sum_b V_b W(probe - b) = c gamma(probe),    gamma = integral of W over the solid,

approached by a few rounds of V_b <- V_b [c gamma / sum]^(1/2). (Akinci et al. 2012 take V_b from the points' own spacing, which
puts the wall 0.1 to 0.6 spacings too far out.) c is the ratio of a lattice sum to the integral for a half space: a lattice against
a flat wall then has density error 0.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from oilsim.neighbors import NeighborSearch, make_grid
from oilsim.parallel import Team
from oilsim.smoothing_kernels import FAST, kernel, normalisation

SAMPLING = 0.64  # mean distance of wall points in particle spacings
SIDES = ("-x", "+x", "-y", "+y", "-z", "+z")
CALIBRATIONS = 6  # rounds; more weaken edges to please their probes: after 60 a tank leaked along its edges


@dataclass(frozen=True, kw_only=True)
class BoundaryParticles:
    """The sampled surface of one solid.

    position  (M, 3) [m]  in the body's frame about its centre of mass; in the world frame for what never moves
    volume    (M,)  [m3; m2 in two dimensions]
    no_slip   viscous liquids stick to this surface; otherwise they slide along it without friction
    """

    name: str
    position: NDArray[np.float64]
    volume: NDArray[np.float64]
    no_slip: bool = False

    def __post_init__(self) -> None:
        if self.position.ndim != 2 or self.position.shape[1] != 3:
            raise ValueError(f"boundary {self.name!r}: position has shape {self.position.shape}, allowed: (M, 3)")
        if self.volume.shape != self.position.shape[:1]:
            raise ValueError(f"boundary {self.name!r}: volume has shape {self.volume.shape}, allowed: (M,) as position")
        if not (np.isfinite(self.position).all() and np.isfinite(self.volume).all() and (self.volume >= 0.0).all()):
            raise ValueError(f"boundary {self.name!r}: positions and volumes must be finite, volumes 0 or more")


def lattice_offsets(step: float, dimension: int, reach: float = 2.0) -> NDArray[np.float64]:
    """Lattice points (K, 3) within `reach` of the origin, in particle spacings, spaced `step`."""
    axis = np.arange(-np.ceil(reach / step), np.ceil(reach / step) + 1) * step
    plane = axis if dimension == 3 else np.zeros(1)
    return np.stack(np.meshgrid(axis, plane, axis, indexing="ij"), axis=-1).reshape(-1, 3)


@lru_cache
def lattice_wall_factor(dimension: int) -> float:
    """c: lattice sum over integral of the kernel beyond a plane half a spacing away (0.80 in three dimensions)."""
    sigma = normalisation(2.0, dimension)
    lattice = lattice_offsets(1.0, dimension)
    beyond = lattice[lattice[:, 2] < -0.5]
    return _kernel_sum(beyond, sigma) / half_space_integral(0.5, dimension)


def _kernel_sum(points: NDArray[np.float64], sigma: float) -> float:
    return float(sum(kernel(q, sigma) for q in np.linalg.norm(points, axis=1) / 2.0))


@lru_cache
def half_space_integral(distance: float, dimension: int) -> float:
    """Integral of the kernel (spacing 1, support 2) beyond a plane `distance` spacings away."""
    step = 1.0 / 16.0
    points = lattice_offsets(step, dimension) + np.array([0.5, 0.5 if dimension == 3 else 0.0, 0.5]) * step
    beyond = points[points[:, 2] < -distance]
    return _kernel_sum(beyond, normalisation(2.0, dimension)) * step**dimension


@lru_cache
def wall_coverage(distance: float, dimension: int) -> float:
    """sum_b V_b W of a flat calibrated wall at `distance` spacings from it."""
    return (
        lattice_wall_factor(dimension)
        * half_space_integral(0.5, dimension)
        * _plane(distance + 0.5, dimension)
        / _plane(1.0, dimension)
    )


@lru_cache
def wall_area_per_volume(dimension: int) -> float:
    """Wall area that a boundary volume stands for on a flat wall, times the spacing."""
    return _plane(1.0, dimension) / (lattice_wall_factor(dimension) * half_space_integral(0.5, dimension))


def _plane(distance: float, dimension: int) -> float:
    """Integral of the kernel (spacing 1, support 2) over a plane `distance` away; over a line in two dimensions."""
    across = np.linspace(0.0, 2.0, 601)
    around = 2.0 * np.pi * across if dimension == 3 else np.full_like(across, 2.0)
    sigma = normalisation(2.0, dimension)
    values = np.array([kernel(min(q, 1.0), sigma) for q in np.hypot(distance, across) / 2.0])
    return float(np.trapezoid(values * around, across))


@njit(**FAST)
def _probe_ratio(begin, end, probe, point, volume, start, count, index, sigma, inverse_support, target, ratio):
    """ratio = target / sum_k V_k W(probe_b - point_k) for the probes begin to end."""
    for b in range(begin, end):
        covered = 0.0
        for n in range(start[b], start[b] + np.int64(count[b])):
            k = index[n]
            dx, dy, dz = probe[0, b] - point[0, k], probe[1, b] - point[1, k], probe[2, b] - point[2, k]
            covered += volume[k] * kernel(np.sqrt(dx * dx + dy * dy + dz * dz) * inverse_support, sigma)
        ratio[b] = target[b] / covered if covered > 0.0 else 1.0


def calibrate_volumes(
    point: ArrayLike, target: ArrayLike, probe: ArrayLike, spacing: float, dimension: int = 3
) -> NDArray[np.float64]:
    """Volumes (M,) with which the wall points cover each probe's target share of the kernel.

    point (M, 3) [m], target (M,) = c gamma at each probe, probe (M, 3) [m], spacing d [m].
    """
    points = np.ascontiguousarray(np.asarray(point, np.float64).T, dtype=np.float32)
    probes = np.asarray(probe, np.float64).T.astype(np.float32)
    count = points.shape[1]
    support = 2.0 * spacing
    everything = np.concatenate([points, probes], axis=1)
    low, high = everything.min(axis=1) - support, everything.max(axis=1) + support
    grid = make_grid(_vector(low), _vector(high), (False, False, False), support, dimension)
    search = NeighborSearch(grid, Team(1), None)
    order, cell_start = search.order_by_cell(points)
    points = np.ascontiguousarray(points[:, order])
    probes = np.ascontiguousarray(probes[:, order])
    targets = np.asarray(target, np.float64)[order]
    pairs = search.list_neighbors("walls", probes, points, cell_start)
    volume = np.full(count, (SAMPLING * spacing) ** (dimension - 1) * spacing)
    ratio = np.empty(count)
    sigma = normalisation(support, dimension)
    for _ in range(CALIBRATIONS):
        _probe_ratio(0, count, probes, points, volume, *pairs, sigma, 1.0 / support, targets, ratio)
        volume *= np.sqrt(ratio)
        if np.abs(ratio - 1.0).max() < 1e-4:
            break
    result = np.empty(count)
    result[order] = volume
    return result


def _vector(values: ArrayLike) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in np.asarray(values))
    return x, y, z


def _surface_points(
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    spacing: float,
    sides: tuple[str, ...],
    periodic: tuple[bool, ...],
) -> NDArray[np.float64]:
    """Points (M, 3) about SAMPLING spacings apart on the closed sides of a box, each edge and corner once."""
    axes, ends = [], []
    for axis in range(3):
        length = upper[axis] - lower[axis]
        intervals = max(1, round(length / (SAMPLING * spacing)))
        if length == 0.0:
            axes.append(lower[axis : axis + 1])
        elif periodic[axis]:
            axes.append(lower[axis] + (np.arange(intervals) + 0.5) * length / intervals)
        else:
            axes.append(np.linspace(lower[axis], upper[axis], intervals + 1))
        ends.append(len(axes[axis]) - 1)
    faces = []
    for side in sides:
        axis = "xyz".index(side[1])
        chosen = [np.arange(len(values)) for values in axes]
        chosen[axis] = np.array([0 if side[0] == "-" else ends[axis]])
        faces.append(np.stack(np.meshgrid(*chosen, indexing="ij"), axis=-1).reshape(-1, 3))
    places = np.unique(np.concatenate(faces), axis=0)
    return np.stack([axes[axis][places[:, axis]] for axis in range(3)], axis=1)


def _outside_box(
    probe: NDArray[np.float64], lower: NDArray[np.float64], upper: NDArray[np.float64], dimension: int
) -> NDArray[np.float64]:
    """gamma (M,): share of the kernel around each probe that lies outside the box; all in particle spacings."""
    step = 1.0 / 8.0
    shift = np.array([0.5, 0.5 if dimension == 3 else 0.0, 0.5]) * step
    offsets = lattice_offsets(step, dimension) + shift
    distance = np.linalg.norm(offsets, axis=1)
    offsets = offsets[distance < 2.0]
    sigma = normalisation(2.0, dimension)
    weights = np.array([kernel(q, sigma) for q in distance[distance < 2.0] / 2.0])
    weights /= weights.sum()
    room = np.minimum(np.stack([probe - lower, upper - probe], axis=-1), 2.0).round(6)
    unique, inverse = np.unique(room.reshape(len(probe), 6), axis=0, return_inverse=True)
    gamma = np.empty(len(unique))
    for n, (xl, xh, yl, yh, zl, zh) in enumerate(unique):
        inside = (offsets > (-xl, -yl, -zl)).all(axis=1) & (offsets < (xh, yh, zh)).all(axis=1)
        gamma[n] = 1.0 - weights[inside].sum()
    return gamma[inverse.ravel()]


def tank_walls(
    lower: ArrayLike,
    upper: ArrayLike,
    spacing: float,
    *,
    sides: tuple[str, ...] = SIDES,
    periodic: tuple[bool, bool, bool] = (False, False, False),
    dimension: int = 3,
    name: str = "tank",
    no_slip: bool = False,
) -> BoundaryParticles:
    """Wall particles of a box tank whose inside is lower to upper [m]; `sides` are the closed ones.

    ValueError for an unknown side or one across a periodic axis.
    """
    for side in sides:
        if side not in SIDES or (dimension == 2 and side[1] == "y"):
            raise ValueError(f"tank {name!r}: side {side!r}, allowed: {', '.join(SIDES)} (no y in two dimensions)")
        if periodic["xyz".index(side[1])]:
            raise ValueError(f"tank {name!r}: side {side!r} is closed, allowed: open, its axis is periodic")
    low, high = np.asarray(lower, np.float64).copy(), np.asarray(upper, np.float64).copy()
    if dimension == 2:
        low[1] = high[1] = 0.0
    closed_low = np.array([f"-{axis}" in sides for axis in "xyz"])
    closed_high = np.array([f"+{axis}" in sides for axis in "xyz"])
    half = 0.5 * spacing
    points = _surface_points(low - half * closed_low, high + half * closed_high, spacing, sides, periodic)
    room_low = np.where(closed_low, low, -np.inf)
    room_high = np.where(closed_high, high, np.inf)
    probes = np.clip(points, room_low + half, room_high - half)
    gamma = _outside_box(probes / spacing, room_low / spacing, room_high / spacing, dimension)
    target = lattice_wall_factor(dimension) * gamma
    volume = calibrate_volumes(points, target, probes, spacing, dimension)
    return BoundaryParticles(name=name, position=points, volume=volume, no_slip=no_slip)


def sides_of(periodic: tuple[bool, bool, bool], dimension: int = 3) -> tuple[str, ...]:
    """Every side that can be closed."""
    return tuple(
        sign + axis
        for (axis, repeats), sign in itertools.product(zip("xyz", periodic, strict=True), "-+")
        if not repeats and not (dimension == 2 and axis == "y")
    )
