"""One even layer of wall particles inside the surface of any closed mesh, with what their volumes must stand for.

Points lie half a particle spacing d inside the surface, sqrt(area per point) = 0.64 d. A probe lies d / 2 outside the surface
in front of each point, and the point's share is the kernel's integral over the solid as seen from its probe,

    gamma = integral of W(probe - y) dy over the solid,

by quadrature on a fine lattice from the exact signed distance. `oilsim.boundary.calibrate_volumes` turns shares into
volumes.

Thin parts, where d / 2 does not fit, get one layer on their middle plane, d / 2 short of their rim. A plate thinner than a
particle cannot be seen by particles as thin as it is: the solid is taken to be `minimum_thickness` thick there, with its
rim unmoved. `excess_volume` says by how much the sampled solid is larger than the mesh.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import trimesh
from numba import njit
from scipy.spatial import cKDTree

from coupling.errors import UnresolvedSolidError
from coupling.even_points import choose_evenly, push_apart
from coupling.signed_distance import SignedDistance
from oilsim.boundary import SAMPLING, BoundaryParticles, area_per_volume, calibrate_volumes, lattice_wall_factor
from oilsim.smoothing_kernels import SUPPORT, kernel, normalisation

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

CANDIDATE_STEP = 0.2  # lattice step of candidates, in particle spacings
QUADRATURE_STEP = 0.2  # lattice step of the kernel integrals, in particle spacings
RELAXATIONS = 30  # rounds of pushing apart
CORNER_REACH = 1.2  # a box's corner is sqrt(3) / 2 d from the inset layer, and candidates are sparse; farther is thin


@dataclass(frozen=True, kw_only=True, eq=False)
class SurfaceSampling:
    """Wall points of one solid, in the coordinates of its mesh.

    Attributes:
        position: (M, 3) points inside the solid [m].
        probe: (M, 3) points half a spacing outside the sampled solid [m].
        share: (M,) gamma at each probe, 0.2 to 0.3 in front of a flat wall.
        depth: (M,) distance of the points below the surface [m]: spacing / 2, less in thin parts.
        area: of the layer [m2].
        excess_volume: sampled solid minus mesh [m3], to about a tenth; above 0 if there are parts thinner than a particle.
        particle_spacing: d [m].
    """

    position: Array
    probe: Array
    share: Array
    depth: Array
    area: float
    excess_volume: float
    particle_spacing: float


@dataclass(frozen=True, eq=False)
class _Layer:
    """Places for points: `inset` ones at depth d / 2, `middle` ones in thin parts, each with the area it stands for."""

    inset: Array
    middle: Array
    rim: Array  # surface points on the rim of thin parts
    area: float


def boundary_particles(
    name: str, mesh: trimesh.Trimesh, particle_spacing: float, *, no_slip: bool = False
) -> BoundaryParticles:
    """Wall particles of a closed mesh, in the coordinates of the mesh, ready for `Fluid.add_boundary`."""
    return particles_of(name, sample_surface(mesh, particle_spacing), no_slip=no_slip)


def particles_of(name: str, sampling: SurfaceSampling, *, no_slip: bool = False) -> BoundaryParticles:
    """Wall particles from a sampling; bodies of one shape share the sampling."""
    target = lattice_wall_factor(3) * sampling.share
    volume = calibrate_volumes(sampling.position, target, sampling.probe, sampling.particle_spacing, 3)
    area = volume * (area_per_volume(3) / sampling.particle_spacing)
    return BoundaryParticles(name=name, position=sampling.position, volume=volume, area=area, no_slip=no_slip)


def sample_surface(
    mesh: trimesh.Trimesh, particle_spacing: float, *, minimum_thickness: float | None = None
) -> SurfaceSampling:
    """Sample a closed mesh for particles of spacing d [m]; parts thinner than `minimum_thickness` (d) count as that thick.

    ValueError for an impossible spacing or thickness, UnresolvedSolidError for a solid smaller than a particle.
    """
    spacing = particle_spacing
    thickness = spacing if minimum_thickness is None else minimum_thickness
    if not (np.isfinite(spacing) and spacing > 0.0):
        raise ValueError(f"particle_spacing is {spacing} m, allowed: above 0")
    if not 0.0 <= thickness <= spacing:
        raise ValueError(f"minimum_thickness is {thickness} m, allowed: 0 to the particle spacing, {spacing} m")
    solid = SignedDistance(mesh)
    layer = _find_layer(mesh, solid, spacing)
    count = round(layer.area / (SAMPLING * spacing) ** 2)
    if count < 4:
        raise UnresolvedSolidError(f"mesh of size {mesh.extents} m is too small for particles of {spacing} m")
    position = _spread(solid, layer, count, spacing)
    swollen = _SwollenSolid(solid, layer.middle, 0.5 * thickness)
    probe = _probes(swollen, position, spacing)
    share, excess = _shares(swollen, probe, spacing)
    return SurfaceSampling(
        position=position,
        probe=probe,
        share=share,
        depth=-solid.phi(position),
        area=layer.area,
        excess_volume=excess,
        particle_spacing=spacing,
    )


class _SwollenSolid:
    """The solid as particles see it: the mesh, and a ball of radius `half` about every point of thin middle planes."""

    def __init__(self, solid: SignedDistance, middle: Array, half: float) -> None:
        self.solid = solid
        self._middle = cKDTree(middle) if len(middle) else None
        self._half = half

    @property
    def is_swollen(self) -> bool:
        return self._middle is not None

    def phi(self, points: Array) -> Array:
        """Signed distance (K,) to the swollen solid [m]."""
        phi = self.solid.phi(points)
        if self._middle is None:
            return phi
        return np.minimum(phi, self._middle.query(points)[0] - self._half)

    def outward(self, points: Array) -> Array:
        """Unit gradient of phi (K, 3)."""
        outward = self.solid.outward(points)
        if self._middle is None:
            return outward
        gap, index = self._middle.query(points)
        away = (points - self._middle.data[index]) / np.maximum(gap, 1e-9 * self._half)[:, None]
        is_ball = (gap - self._half < self.solid.phi(points)) & (gap > 1e-6 * self._half)
        return np.where(is_ball[:, None], away, outward)

    def lattice(self, step: float, low: float, high: float) -> tuple[Array, Array]:
        """Lattice points with low <= phi <= high, and phi."""
        points, phi = self.solid.lattice(step, low, high + (self._half if self.is_swollen else 0.0))
        if self._middle is not None:
            phi = np.minimum(phi, self._middle.query(points)[0] - self._half)
        keep = (phi >= low) & (phi <= high)
        return points[keep], phi[keep]


def _find_layer(mesh: trimesh.Trimesh, solid: SignedDistance, spacing: float) -> _Layer:
    """Candidates everywhere on the layer.

    Lattice points in a shell one step thick are step^2 of its area each (co-area formula), which measures the layer.
    """
    step, half = CANDIDATE_STEP * spacing, 0.5 * spacing
    jitter = np.random.default_rng(0)  # candidates in rows would leave only few distances to choose from
    near, _ = solid.lattice(step, -half - 0.5 * step, -half + 0.5 * step)
    inset, settled = _settle_inset(solid, near + step * jitter.uniform(-0.5, 0.5, near.shape), half)
    inset = inset[settled]
    near, _ = solid.lattice(step, 0.0, step)  # outside, where the faces of a thin plate are apart
    surface = solid.nearest(near + step * jitter.uniform(-0.5, 0.5, near.shape))
    reach = CORNER_REACH * spacing
    thin = np.ones(len(near), dtype=bool) if len(inset) == 0 else cKDTree(inset).query(surface.point)[0] > reach
    surface_point, surface_normal = surface.point[thin], surface.normal[thin]
    middle, is_plate, is_face = _middle_of(solid, surface_point, surface_normal, half)
    plate, rim = middle[is_plate], np.concatenate([surface_point[is_face & ~is_plate], _sharp_edges(mesh, step)])
    clear = np.ones(len(plate), dtype=bool) if len(rim) == 0 else cKDTree(rim).query(plate)[0] > half
    kept = plate[clear]
    # rods and tips have no plate that clears their rim: what is left uncovered is taken as it is
    left = np.concatenate([plate[~clear], middle[is_face & ~is_plate]])
    covered = np.concatenate([inset, kept])
    if len(left) and len(covered):
        left = left[cKDTree(covered).query(left)[0] > reach]
    middle = np.concatenate([kept, left])
    return _Layer(inset, middle, rim, step**2 * (len(inset) + 0.5 * len(middle)))


def _sharp_edges(mesh: trimesh.Trimesh, step: float) -> Array:
    """Points (K, 3) about `step` apart along convex edges where the surface turns by 60 degrees or more."""
    sharp = (np.asarray(mesh.face_adjacency_angles) > np.pi / 3.0) & np.asarray(mesh.face_adjacency_convex)
    ends = np.asarray(mesh.vertices)[np.asarray(mesh.face_adjacency_edges)[sharp]]
    rows = [
        begin
        + np.linspace(0.0, 1.0, max(2, int(np.ceil(np.linalg.norm(end - begin) / step)) + 1))[:, None] * (end - begin)
        for begin, end in ends
    ]
    return np.concatenate(rows) if rows else np.zeros((0, 3))


def _settle_inset(solid: SignedDistance, points: Array, half: float) -> tuple[Array, Flags]:
    """Move points to the depth `half` below the surface; and which of them came there."""
    for _ in range(3):
        points = points - (solid.phi(points) + half)[:, None] * solid.outward(points)
    return points, np.abs(solid.phi(points) + half) < 0.02 * half


def _middle_of(solid: SignedDistance, surface: Array, normal: Array, half: float) -> tuple[Array, Flags, Flags]:
    """Middle plane below surface points, at most `half` deep; whether the other side lies opposite, as in a plate; and
    whether the point lies on a face (there is no straight way down from an edge or corner).

    Going inward from s by t, phi = -t until another part of the surface is as near, which is the middle plane.
    """
    if len(surface) == 0:
        return surface, np.zeros(0, dtype=bool), np.zeros(0, dtype=bool)
    low, high = np.zeros(len(surface)), np.full(len(surface), half)
    for _ in range(30):
        depth = 0.5 * (low + high)
        above = depth + solid.phi(surface - depth[:, None] * normal) <= 0.02 * depth
        low, high = np.where(above, depth, low), np.where(above, high, depth)
    middle = surface - low[:, None] * normal
    beyond = solid.nearest(surface - 1.1 * low[:, None] * normal)
    is_face = low > 1e-4 * half
    return middle, is_face & ((beyond.normal * normal).sum(axis=1) < -0.7), is_face


def _spread(solid: SignedDistance, layer: _Layer, count: int, spacing: float) -> Array:
    """`count` points, evenly over the layer."""
    candidates = np.concatenate([layer.inset, layer.middle])
    is_inset = np.arange(len(candidates)) < len(layer.inset)
    chosen = choose_evenly(candidates, count, layer.area)
    points, is_inset = candidates[chosen], is_inset[chosen]
    half = 0.5 * spacing
    rim = cKDTree(layer.rim) if len(layer.rim) else None
    for _ in range(RELAXATIONS):
        moved = points + push_apart(points, SAMPLING * spacing)
        settled, good = _settle_inset(solid, moved[is_inset], half)
        points[is_inset] = np.where(good[:, None], settled, points[is_inset])
        if not is_inset.all():
            surface = solid.nearest(moved[~is_inset])
            settled, good, _ = _middle_of(solid, surface.point, surface.normal, half)
            if rim is not None:
                good &= rim.query(settled)[0] >= half
            points[~is_inset] = np.where(good[:, None], settled, points[~is_inset])
    return points


def _probes(swollen: _SwollenSolid, points: Array, spacing: float) -> Array:
    """Where the signed distance is d / 2, out of each point.

    The way out is the gradient of phi averaged over 0.15 d, which on an edge or corner points between its faces, or simply
    the gradient in a thin part; from there it follows the gradient, which in a concave corner leads away from both walls.
    """
    offsets = 0.15 * spacing * np.concatenate([np.eye(3), -np.eye(3)])
    around = (points[:, None] + offsets).reshape(-1, 3)
    outward = swollen.outward(around).reshape(len(points), 6, 3)
    direction = outward.mean(axis=1)
    length = np.linalg.norm(direction, axis=1, keepdims=True)
    is_thin = swollen.solid.phi(points) > -0.45 * spacing
    straight = is_thin[:, None] | (length < 0.3)
    direction = np.where(straight, swollen.solid.outward(points), direction / np.maximum(length, 1e-9))
    probe = points + (0.5 * spacing - swollen.phi(points))[:, None] * direction
    for _ in range(8):
        probe = probe + (0.5 * spacing - swollen.phi(probe))[:, None] * swollen.outward(probe)
    return probe


@njit(nogil=True, cache=True, error_model="numpy")
def _kernel_integral(probe, origin, step, filled, support, sigma, share):
    """share_b = sum over lattice cells of filled W(probe_b - cell), without the cell volume."""
    for b in range(len(probe)):
        total = 0.0
        low, high = np.empty(3, np.int64), np.empty(3, np.int64)
        for axis in range(3):
            place = (probe[b, axis] - origin[axis]) / step - 0.5
            low[axis] = max(int(np.ceil(place - support / step)), 0)
            high[axis] = min(int(np.floor(place + support / step)), filled.shape[axis] - 1)
        for i in range(low[0], high[0] + 1):
            dx = origin[0] + (i + 0.5) * step - probe[b, 0]
            for j in range(low[1], high[1] + 1):
                dy = origin[1] + (j + 0.5) * step - probe[b, 1]
                for k in range(low[2], high[2] + 1):
                    if filled[i, j, k] > 0.0:
                        dz = origin[2] + (k + 0.5) * step - probe[b, 2]
                        distance = np.sqrt(dx * dx + dy * dy + dz * dz)
                        total += filled[i, j, k] * kernel(distance / support, sigma)
        share[b] = total


def _shares(swollen: _SwollenSolid, probe: Array, spacing: float) -> tuple[Array, float]:
    """gamma of each probe (M,), and the volume by which the swollen solid exceeds the mesh [m3].

    A cell counts by how much of it is solid, clip(1/2 - phi / step, 0, 1); only depths that a probe can see are filled.
    """
    step, support = QUADRATURE_STEP * spacing, SUPPORT * spacing
    points, phi = swollen.lattice(step, -(SUPPORT - 0.4) * spacing, 0.5 * step)
    fraction = np.clip(0.5 - phi / step, 0.0, 1.0)
    excess = 0.0
    if swollen.is_swollen:
        excess = float((fraction - np.clip(0.5 - swollen.solid.phi(points) / step, 0.0, 1.0)).sum()) * step**3
    origin = points.min(axis=0) - 0.5 * step
    place = np.rint((points - origin) / step - 0.5).astype(np.int64)
    filled = np.zeros(place.max(axis=0) + 1, dtype=np.float32)
    filled[tuple(place.T)] = fraction
    share = np.empty(len(probe))
    _kernel_integral(probe, origin, step, filled, support, normalisation(spacing, 3), share)
    return share * step**3, excess
