"""Walls and solid surfaces as particles, whose volumes put the wall's surface where the geometry has it.

Two layers continue a lattice of liquid into the wall, half a spacing and one and a half behind its surface. That is as far as the kernel
reaches, so that liquid at a wall has a full kernel. Each particle has the volume of the wall that it stands for. (Akinci et al. 2012 take
one layer on the surface and volumes from the points' own spacing, which puts the wall 0.1 to 0.6 spacings too far out.) In front of a flat
wall

    sum_b V_b W = c gamma,    gamma = integral of W over the solid,

c being the ratio of a lattice sum to the integral for a half space. `coupling.solids.surface_sampling` makes the particles of meshes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from oilsim.core.phases import Wetting
from oilsim.core.quantity import quantity_of, require
from oilsim.neighborhood.smoothing_kernels import SUPPORT, kernel, normalisation

SIDES = ("-x", "+x", "-y", "+y", "-z", "+z")
# [1] layers of wall particles; theory; they fill the support of 2.75 spacings
LAYERS = 2


@dataclass(frozen=True, kw_only=True)
class BoundaryParticles:
    """The sampled surface of one solid.

    position  (M, 3) [m], in the body's frame about its centre of mass; in the world frame for solids that never move
    volume    (M,) [m3; m2 in two dimensions]
    area      (M,) wall to which liquids adhere and stick, that a particle stands for [m2; m in two dimensions]
    no_slip   whether viscous liquids stick to this surface; otherwise they slide along it without friction
    contact_angle  [deg] at which interfaces meet this surface, through the liquid with the larger interfacial tension
    normal    (M, 3) unit normals [1] of points of plates that no particle may cross (see `plate_guard`), 0 of others; None: there are none
    displaced (K, 4) places [m] and volumes [m3] that make up the whole solid, which liquid at rest lifts (see `rest_pressure`); None: not
              known, those of the particles in well-balanced water
    turns     (T, 6) twists [m, 1] that leave the surface where it is: unit turns about axes at right angles of a solid of revolution.
              Pressure neither brakes nor drives them, however the particles lie; None: there are none
    curvature (M, 9) unit normal [1] and shape operator [1/m] of the surface at each point, the latter as xx, xy, xz, yy, yz, zz: see
              `wall_curvature`; None where all faces are planes

    ValueError for arrays of other shapes, and for numbers that are not finite or, of volume and area, negative.
    """

    name: str
    position: NDArray[np.float64]
    volume: NDArray[np.float64]
    area: NDArray[np.float64]
    no_slip: bool = False
    contact_angle: float = quantity_of(Wetting, "contact_angle")
    normal: NDArray[np.float64] | None = None
    displaced: NDArray[np.float64] | None = None
    turns: NDArray[np.float64] | None = None
    curvature: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        require(f"boundary {self.name!r}", BoundaryParticles, {"contact_angle": self.contact_angle})
        if self.position.ndim != 2 or self.position.shape[1] != 3:
            raise ValueError(f"boundary {self.name!r}: position has shape {self.position.shape}, allowed: (M, 3)")
        for what in ("volume", "area"):
            values = getattr(self, what)
            if values.shape != self.position.shape[:1]:
                raise ValueError(f"boundary {self.name!r}: {what} has shape {values.shape}, allowed: (M,) as position")
            if not (np.isfinite(values).all() and (values >= 0.0).all()):
                raise ValueError(f"boundary {self.name!r}: {what} must be finite, 0 or more")
        if not np.isfinite(self.position).all():
            raise ValueError(f"boundary {self.name!r}: position must be finite")
        if self.normal is not None and self.normal.shape != self.position.shape:
            raise ValueError(
                f"boundary {self.name!r}: normal has shape {self.normal.shape}, allowed: (M, 3) as position, or None"
            )

    @property
    def whole(self) -> NDArray[np.float64]:
        """Return places [m] and volumes [m3] that make up the solid, (K, 4)."""
        return np.column_stack([self.position, self.volume]) if self.displaced is None else self.displaced

    def part(self, name: str, chosen: NDArray[np.bool_]) -> BoundaryParticles:
        """Return the `chosen` (M,) bool of these particles as a boundary of its own."""
        return BoundaryParticles(
            name=name,
            position=self.position[chosen],
            volume=self.volume[chosen],
            area=self.area[chosen],
            no_slip=self.no_slip,
            contact_angle=self.contact_angle,
            normal=None if self.normal is None else self.normal[chosen],
            curvature=None if self.curvature is None else self.curvature[chosen],
        )


@lru_cache
def wall_coverage(distance: float, dimension: int) -> float:
    """Return sum_b V_b W [1] of a flat wall at `distance` [d] from it."""
    return sum(plane_integral(distance + layer + 0.5, dimension) for layer in range(LAYERS))


def plane_integral(distance: float, dimension: int) -> float:
    """Return the integral of the kernel (spacing 1) over a plane `distance` [d] away [1/d]; over a line in two dimensions."""
    across = np.linspace(0.0, SUPPORT, 601)
    around = 2.0 * np.pi * across if dimension == 3 else np.full_like(across, 2.0)
    sigma = normalisation(1.0, dimension)
    values = kernel(np.hypot(distance, across) / SUPPORT, sigma)
    return float(np.trapezoid(values * around, across))


def _axis_places(
    low: float, high: float, spacing: float, closed: tuple[bool, bool]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return coordinates across a tank from low to high [m], LAYERS more beyond each closed end, and the length of each [m]."""
    if low == high:
        return np.array([low]), np.ones(1)
    count = max(1, round((high - low) / spacing))
    step = (high - low) / count
    inside = low + (np.arange(count) + 0.5) * step
    beyond = (np.arange(LAYERS) + 0.5) * spacing
    before = low - beyond[::-1] if closed[0] else np.empty(0)
    after = high + beyond if closed[1] else np.empty(0)
    places = np.concatenate([before, inside, after])
    lengths = np.concatenate([np.full(before.size, spacing), np.full(count, step), np.full(after.size, spacing)])
    return places, lengths


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
    """Return the wall particles of a box tank whose inside reaches from lower to upper (3,) [m]; `sides` are the closed ones.

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
    axes = [
        _axis_places(low[n], high[n], spacing, (f"-{axis}" in sides, f"+{axis}" in sides))
        for n, axis in enumerate("xyz")
    ]
    position = np.stack(np.meshgrid(*(places for places, _ in axes), indexing="ij"), axis=-1).reshape(-1, 3)
    lengths = np.stack(np.meshgrid(*(length for _, length in axes), indexing="ij"), axis=-1).reshape(-1, 3)
    depth = np.maximum(low - position, position - high)
    walls = (depth > 0.0).any(axis=1)
    position, lengths, depth = position[walls], lengths[walls], depth[walls]
    volume = lengths.prod(axis=1)
    # the first layer faces the liquid; edges, which lie behind two sides at once, face none
    facing = ((depth > 0.0).sum(axis=1) == 1) & (depth.max(axis=1) < spacing)
    return BoundaryParticles(
        name=name, position=position, volume=volume, area=np.where(facing, volume / spacing, 0.0), no_slip=no_slip,
    )  # fmt: skip


def solid_box(
    size: ArrayLike, spacing: float, *, dimension: int = 3, name: str = "box", no_slip: bool = False
) -> BoundaryParticles:
    """Return the wall particles of a box of `size` (3,) [m] about its centre: the outer layers of the lattice that fills it.

    Sides that are no multiple of the spacing [m] stretch the lattice a little. In two dimensions the length along y is ignored.
    """
    extent = np.asarray(size, np.float64)
    axes = [
        _axis_places(
            -0.5 * length, 0.5 * length if n != 1 or dimension == 3 else -0.5 * length, spacing, (False, False)
        )
        for n, length in enumerate(extent)
    ]
    position = np.stack(np.meshgrid(*(places for places, _ in axes), indexing="ij"), axis=-1).reshape(-1, 3)
    lengths = np.stack(np.meshgrid(*(length for _, length in axes), indexing="ij"), axis=-1).reshape(-1, 3)
    if dimension == 2:
        position[:, 1] = 0.0
    depth = 0.5 * extent - np.abs(position)
    if dimension == 2:
        depth[:, 1] = np.inf
    chosen = depth.min(axis=1) < LAYERS * spacing
    whole = np.column_stack([position, lengths.prod(axis=1)])
    position, lengths, depth = position[chosen], lengths[chosen], depth[chosen]
    # area: every side a particle faces, an edge faces two
    facing = np.where(depth < spacing, lengths.prod(axis=1)[:, None] / lengths, 0.0).sum(axis=1)
    return BoundaryParticles(
        name=name, position=position, volume=lengths.prod(axis=1), area=facing, no_slip=no_slip, displaced=whole,
    )  # fmt: skip
