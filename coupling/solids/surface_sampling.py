"""Places two even layers of wall particles inside the surface of a closed mesh, and computes the part of the solid of each particle.

Points lie half a particle spacing d and one and a half inside the surface, a little less than d apart, with points along the edges and
corners of both layers. Each stands for its cell of the solid (`voronoi_shells`): its volume is the cell's volume, and it lies at the
cell's centroid. The kernel sums over the solid, and their gradients, are then those of a lattice of particles.

Thin parts, where d / 2 does not fit, get one layer on their middle plane, d / 2 short of their rim. A plate thinner than a
particle cannot be seen by particles as thin as it is: the solid is taken to be `minimum_thickness` thick there, with its
rim unmoved. `excess_volume` says by how much the sampled solid is larger than the mesh. Solids that do not answer to the liquid are
thickened to HELD spacings where they are thinner than TIGHT (`thin_parts`), so that nothing leaks. Such plates of other
solids get normals, by which the fluid keeps its particles on their side (`oilsim.boundaries.plate_guard`).

Spreads points evenly: chooses some that keep a distance, then lets them push each other apart.

Neither step knows the surface; the caller puts the points back on it.
"""

from __future__ import annotations

import hashlib
from copy import deepcopy
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
import trimesh
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from coupling.master.errors import UnresolvedSolidError
from coupling.solids.even_points import choose_apart, inset_ridges, push_apart, random_distance, sharp_edges
from coupling.solids.signed_distance import Box, SignedDistance
from coupling.solids.solid_mesh import told_solid
from coupling.solids.surface_shape import surface_shape
from coupling.solids.thin_parts import HELD, TIGHT, middle_plane, plate_normals, thinnest_plate
from coupling.solids.voronoi_shells import STEP, Shells
from oilsim import BoundaryParticles
from oilsim.backend.arrays import Array, Flags
from oilsim.core.phases import RIGHT_ANGLE

PITCH = 0.85  # mean distance of points in particle spacings: random choice leaves holes, which a lattice has not, and liquid sinks in
RIDGE_PITCH = 0.9  # least distance of points along an edge, in pitches: what is left of its length is shared out
CANDIDATE_STEP = 0.2  # lattice step of candidates, in particle spacings
RELAXATIONS = 30  # rounds of pushing apart
SETTLINGS = 3  # steps in which a point is moved to its depth
EXACT = 1e-9  # of a depth, that a point may be off it
CENTERINGS = 3  # rounds of moving points to their cells' centroids
CORNER_REACH = (
    1.5  # spacings from the inset layer within which its points' cells cover a corner or edge; farther is thin
)
LARGEST = 1e6  # particles on a surface: a boundary for mistakes, such as millimetres taken for metres
ROUND = 0.1  # spacings that a surface may move by where a solid of revolution turns: facets
ANGLES = (0.39, 1.0, 2.3)  # rad of those turns: no part of a full one
CORE_STEP = 0.5  # lattice step of the core, in particle spacings
CORE_CELLS = 32  # lattice steps along the side of a cube as large as the solid's box at most
KEPT = 64  # samplings that are kept, of the shapes that were asked for last
INNER_DEPTH = 1.1  # spacings: a core that is nowhere deeper is too thin for points of its own


@dataclass(frozen=True, kw_only=True, eq=False)
class SurfaceSampling:
    """Wall points of one solid, in the coordinates of its mesh: the outer layer, then the inner one.

    Attributes:
        position: (M, 3) points inside the solid [m].
        volume: (M,) part of the solid that each stands for [m3].
        area: (M,) part of the surface that each stands for [m2], 0 for inner ones.
        depth: (M,) distance of the points below the surface [m].
        outer: number of points of the outer layer.
        excess_volume: sampled solid minus mesh [m3], to about a tenth; above 0 if there are parts thinner than a particle.
        thinnest_plate: thickness [m] of the thinnest plate, if its thickness does not hold liquid (`thin_parts`); else infinite.
        minimum_thickness: [m] as which thinner parts count.
        plate_normal: (M, 3) unit normals [1] of the points of plates that are too thin to hold liquid by their thickness, 0 of others; None
            if there are none.
        particle_spacing: d [m].
        displaced: (K, 4) places [m] and volumes [m3] that make up the sampled solid, as large as the mesh and its excess together.
        turns: (T, 6) twists [m, 1] that leave the surface where it is, about axes of revolution.
        curvature: (M, 9) normal [1] and shape operator [1/m] of the surface at each point; None where all faces are planes.
    """

    position: Array
    volume: Array
    area: Array
    depth: Array
    outer: int
    excess_volume: float
    thinnest_plate: float
    minimum_thickness: float
    plate_normal: Array | None
    particle_spacing: float
    displaced: Array
    turns: Array
    curvature: Array | None


@dataclass(frozen=True, eq=False)
class _Layer:
    """Places for points: `corner` and `edge` ones of the surface at depth d / 2, `inset` ones all over it, `middle` ones in
    thin parts."""

    corner: Array
    edge: Array
    inset: Array
    middle: Array
    rim: Array  # surface points on the rim of thin parts


def boundary_particles(
    name: str,
    mesh: trimesh.Trimesh,
    particle_spacing: float,
    *,
    no_slip: bool = False,
    contact_angle: float = RIGHT_ANGLE,
) -> BoundaryParticles:
    """Return wall particles of a closed mesh, in its coordinates [m], for `Fluid.add_boundary`; raises the errors of `sample_surface`."""
    return particles_of(name, sample_surface(mesh, particle_spacing), no_slip=no_slip, contact_angle=contact_angle)


def particles_of(
    name: str, sampling: SurfaceSampling, *, no_slip: bool = False, contact_angle: float = RIGHT_ANGLE
) -> BoundaryParticles:
    """Return wall particles from a sampling, in its coordinates [m]; bodies of one shape share the sampling."""
    return BoundaryParticles(
        name=name, position=sampling.position, volume=sampling.volume, area=sampling.area, no_slip=no_slip,
        contact_angle=contact_angle, normal=sampling.plate_normal,
        displaced=sampling.displaced, turns=sampling.turns, curvature=sampling.curvature,
    )  # fmt: skip


def sample_surface(
    mesh: trimesh.Trimesh, particle_spacing: float, *, minimum_thickness: float | None = None, within: Box | None = None
) -> SurfaceSampling:
    """Sample the surface of a solid for particles of spacing d [m]; parts thinner than `minimum_thickness` (d) count as that thick.

    The mesh is read as `solid_mesh` says, and a warning tells what was mended; its hollows are sampled too. `within`: lower and upper
    corner (3,) [m] of the box that is sampled, for a solid far larger than the fluid; None: all of it. Equal shapes are sampled once.
    Raises ValueError for a spacing that is not above 0, a thickness above HELD spacings, a mesh that is no solid and one of more than
    LARGEST particles; UnresolvedSolidError for a mesh smaller than a particle.
    """
    spacing = particle_spacing
    thickness = spacing if minimum_thickness is None else minimum_thickness
    mesh = _sampled_solid(mesh, spacing, thickness, within)
    shape = hashlib.sha256(mesh.vertices.tobytes() + mesh.faces.tobytes()).digest()
    box = None if within is None else (*map(float, within[0]), *map(float, within[1]))
    return deepcopy(_sampled(_Task(shape, spacing, thickness, box, mesh)))


@dataclass(frozen=True)
class _Task:
    """A surface to be sampled: equal tasks have equal results."""

    shape: bytes
    spacing: float
    thickness: float
    box: tuple[float, ...] | None
    mesh: trimesh.Trimesh = field(compare=False)

    @property
    def within(self) -> Box | None:
        return None if self.box is None else (np.array(self.box[:3]), np.array(self.box[3:]))


@lru_cache(KEPT)
def _sampled(task: _Task) -> SurfaceSampling:
    """Sample a surface that was not sampled before; the errors of `sample_surface`."""
    mesh, spacing, thickness = task.mesh, task.spacing, task.thickness
    solid = SignedDistance(mesh, task.within)
    layer = _find_layer(mesh, solid, spacing)
    outer, is_middle = _spread(solid, layer, spacing)
    if len(outer) < 2:
        raise UnresolvedSolidError(f"mesh of size {mesh.extents} m is too small for particles of {spacing} m")
    middle = layer.middle if thickness <= spacing else np.concatenate([layer.middle, _plates(mesh, solid, spacing)])
    swollen = _SwollenSolid(solid, middle, 0.5 * thickness)
    shells = Shells(swollen, spacing)
    inner = _inner_layer(mesh, solid, shells, spacing)
    outer, inner, volume = shells.settle(outer, inner, is_middle, CENTERINGS)
    position = np.concatenate([outer, inner])
    thinnest = thinnest_plate(solid, spacing)
    is_loose = np.isfinite(thinnest) and thickness < TIGHT * spacing
    area = np.concatenate([_areas(mesh, solid, outer, spacing), np.zeros(len(inner))])
    excess = _excess(solid, swollen, shells, spacing)
    displaced = np.concatenate([np.column_stack([position, volume]), _core(solid, spacing)])
    if task.within is None:
        # places on a lattice are up to half a per cent too many, by which a body a tenth heavier than water sinks too slowly
        displaced[:, 3] *= (mesh.volume + excess) / displaced[:, 3].sum()
    return SurfaceSampling(
        position=position,
        volume=volume,
        area=area,
        depth=-solid.phi(position),
        outer=len(outer),
        excess_volume=excess,
        thinnest_plate=thinnest,
        minimum_thickness=thickness,
        plate_normal=plate_normals(solid, position, spacing) if is_loose else None,
        particle_spacing=spacing,
        displaced=displaced,
        turns=_turns(mesh, solid, position, spacing),
        curvature=surface_shape(position, area, spacing),
    )


def _turns(mesh: trimesh.Trimesh, solid: SignedDistance, points: Array, spacing: float) -> Array:
    """Return twists (T, 6) [m, 1], unit turns about the axes of inertia about which the solid can turn and stay where it is.

    Points (N, 3) [m] inside it then keep their depth within ROUND spacings, which particles cannot see.
    """
    if solid.is_cut or not mesh.is_volume:
        return np.empty((0, 6))
    middle, found = np.asarray(mesh.center_mass), []
    for axis in np.asarray(mesh.principal_inertia_vectors):
        turned = [Rotation.from_rotvec(angle * axis).apply(points - middle) + middle for angle in ANGLES]
        off = np.abs(solid.phi(np.concatenate(turned)) - np.tile(solid.phi(points), len(ANGLES)))
        if off.max() < ROUND * spacing:
            found.append(np.concatenate([np.cross(middle, axis), axis]))
    return np.array(found).reshape(-1, 6)


def _core(solid: SignedDistance, spacing: float) -> Array:
    """Return places [m] and volumes [m3], (K, 4), that make up what is deeper than the two layers."""
    step = max(CORE_STEP * spacing, float(np.cbrt(np.prod(solid.upper - solid.lower))) / CORE_CELLS)
    center, phi = solid.lattice(step, -np.inf, -2.0 * spacing + 0.5 * step)
    share = np.clip(0.5 - (phi + 2.0 * spacing) / step, 0.0, 1.0)
    return np.column_stack([center, step**3 * share])[share > 0.0]


def _sampled_solid(mesh: trimesh.Trimesh, spacing: float, thickness: float, within: Box | None) -> trimesh.Trimesh:
    """Return the mesh as a solid; ValueError if it cannot be sampled."""
    if not (np.isfinite(spacing) and spacing > 0.0):
        raise ValueError(f"particle_spacing is {spacing} m, allowed: above 0")
    if not 0.0 <= thickness <= HELD * spacing:
        raise ValueError(
            f"minimum_thickness is {thickness} m, allowed: 0 to {HELD:g} particle spacings, {HELD * spacing:g} m"
        )
    solid = told_solid(mesh, stacklevel=4).mesh
    count = float(solid.area) / spacing**2
    if within is None and count > LARGEST:
        raise ValueError(
            f"mesh of size {solid.extents} m takes {count:.3g} wall particles of {spacing} m, allowed: {LARGEST:g}; scale it down"
        )
    return solid


class _SwollenSolid:
    """The solid as particles see it: the mesh, and a ball of radius `half` about every point of thin middle planes."""

    def __init__(self, solid: SignedDistance, middle: Array, half: float) -> None:
        self.solid = solid
        self._middle = cKDTree(middle) if len(middle) else None
        self._half = half

    @property
    def is_swollen(self) -> bool:
        return self._middle is not None

    def lattice(self, step: float, low: float, high: float) -> tuple[Array, Array]:
        """Return the lattice points (K, 3) [m] with low <= phi <= high [m], and phi (K,) [m] there."""
        points, phi = self.solid.lattice(step, low, high + (self._half if self.is_swollen else 0.0))
        if self._middle is not None:
            phi = np.minimum(phi, self._middle.query(points)[0] - self._half)
        keep = (phi >= low) & (phi <= high)
        return points[keep], phi[keep]


def _find_layer(mesh: trimesh.Trimesh, solid: SignedDistance, spacing: float) -> _Layer:
    """Find candidates everywhere on the outer layer: lattice points near it, moved onto it."""
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
    plate, rim = middle[is_plate], np.concatenate([surface_point[is_face & ~is_plate], sharp_edges(mesh, step)[0]])
    clear = np.ones(len(plate), dtype=bool) if len(rim) == 0 else cKDTree(rim).query(plate)[0] > half
    kept = plate[clear]
    # rods and tips have no plate that clears their rim: what is left uncovered is taken as it is
    left = np.concatenate([plate[~clear], middle[is_face & ~is_plate]])
    covered = np.concatenate([inset, kept])
    if len(left) and len(covered):
        left = left[cKDTree(covered).query(left)[0] > reach]
    middle = np.concatenate([kept, left])
    corner, edge = inset_ridges(mesh, solid, half, 0.5 * step)
    return _Layer(corner, edge, inset, middle, rim)


def _plates(mesh: trimesh.Trimesh, solid: SignedDistance, spacing: float) -> Array:
    """Return places (K, 3) [m] on the middle planes of plates thinner than TIGHT spacings, as far as they are clear of their rim."""
    step, half = CANDIDATE_STEP * spacing, 0.5 * TIGHT * spacing
    surface = solid.nearest(solid.lattice(step, 0.0, step)[0])
    depth, middle, beyond = middle_plane(solid, surface.point, surface.normal, half)
    is_face = depth > 1e-4 * half
    is_plate = is_face & (depth < 0.99 * half) & ((beyond * surface.normal).sum(axis=1) < -0.7)
    rim = np.concatenate([surface.point[is_face & (depth < 0.99 * half) & ~is_plate], sharp_edges(mesh, step)[0]])
    plate = middle[is_plate]
    return plate if len(rim) == 0 or len(plate) == 0 else plate[cKDTree(rim).query(plate)[0] > half]


def _inner_layer(mesh: trimesh.Trimesh, solid: SignedDistance, shells: Shells, spacing: float) -> Array:
    """Return points (K, 3) [m] at depth 3/2 d, and in the middle of cores that are not as deep."""
    depth, step = 1.5 * spacing, CANDIDATE_STEP * spacing
    near = shells.center[np.abs(shells.phi + depth) <= 0.5 * step]
    jitter = np.random.default_rng(1)
    inset, settled = _settle_inset(solid, near + step * jitter.uniform(-0.5, 0.5, near.shape), depth)
    inset = inset[settled]
    core = shells.center[(shells.phi > -depth) & (shells.phi < -INNER_DEPTH * spacing)]
    if len(inset) and len(core):
        core = core[cKDTree(inset).query(core)[0] > spacing]
    corner, edge = inset_ridges(mesh, solid, depth, 0.5 * step)
    layer = _Layer(corner, edge, inset, core, np.zeros((0, 3)))
    return _spread(solid, layer, spacing, depth)[0]


def _settle_inset(solid: SignedDistance, points: Array, half: float) -> tuple[Array, Flags]:
    """Move points to the depth `half` [m] below the surface; return them, and flags of those that reached it."""
    settled, off, moving = points.copy(), np.full(len(points), np.inf), np.arange(len(points))
    for _ in range(SETTLINGS):
        phi, outward = solid.phi_and_outward(settled[moving])
        off[moving] = np.abs(phi + half)
        settled[moving] -= (phi + half)[:, None] * outward
        moving = moving[off[moving] > EXACT * half]  # on flat sides all are where they belong at once
    off[moving] = np.abs(solid.phi(settled[moving]) + half)
    return settled, off < 0.02 * half


def _middle_of(solid: SignedDistance, surface: Array, normal: Array, half: float) -> tuple[Array, Flags, Flags]:
    """Middle plane below surface points, at most `half` deep; whether the other side lies opposite, as in a plate; and
    whether the point lies on a face (there is no straight way down from an edge or corner).
    """
    if len(surface) == 0:
        return surface, np.zeros(0, dtype=bool), np.zeros(0, dtype=bool)
    depth, middle, beyond = middle_plane(solid, surface, normal, half)
    is_face = depth > 1e-4 * half
    return middle, is_face & ((beyond * normal).sum(axis=1) < -0.7), is_face


def _spread(solid: SignedDistance, layer: _Layer, spacing: float, depth: float | None = None) -> tuple[Array, Flags]:
    """Spread points (K, 3) evenly over a layer at `depth` [m] (d / 2); return them, and flags of those on middle planes.

    Corners and edges come first; points on edges then move along them only, and corners stay.
    """
    level = 0.5 * spacing if depth is None else depth
    ridge = np.concatenate([layer.corner, layer.edge])
    ridge = ridge[choose_apart(ridge, RIDGE_PITCH * PITCH * spacing, len(ridge))]
    candidates = np.concatenate([ridge, layer.inset, layer.middle])
    chosen = choose_apart(candidates, random_distance(PITCH * spacing), len(ridge))
    points = candidates[chosen]
    is_ridge, is_middle = chosen < len(ridge), chosen >= len(ridge) + len(layer.inset)
    rim = cKDTree(layer.rim) if len(layer.rim) else None
    edge = cKDTree(layer.edge) if len(layer.edge) else None
    fixed = np.zeros(len(points), dtype=bool)
    if len(layer.corner):
        fixed = cKDTree(layer.corner).query(points)[0] == 0.0
    along, free = is_ridge & ~fixed, ~is_ridge & ~is_middle
    for _ in range(RELAXATIONS):
        moved = points + push_apart(points, PITCH * spacing)
        if edge is not None:
            points[along] = layer.edge[edge.query(moved[along])[1]]
        settled, good = _settle_inset(solid, moved[free], level)
        points[free] = np.where(good[:, None], settled, points[free])
        if is_middle.any() and depth is None:
            surface = solid.nearest(moved[is_middle])
            settled, good, _ = _middle_of(solid, surface.point, surface.normal, level)
            if rim is not None:
                good &= rim.query(settled)[0] >= level
            points[is_middle] = np.where(good[:, None], settled, points[is_middle])
    return points, is_middle


def _areas(mesh: trimesh.Trimesh, solid: SignedDistance, outer: Array, spacing: float) -> Array:
    """Return the part of the surface (K,) [m2] nearest to each outer point.

    Lattice points in a shell one step thick are step^2 of the surface each (co-area formula); they share out the mesh's own
    area, unless it is cut or has parts that overlap, whose hidden surfaces do not count.
    """
    step = CANDIDATE_STEP * spacing
    near, _ = solid.lattice(step, -0.5 * step, 0.5 * step)
    share = np.bincount(cKDTree(outer).query(near)[1], minlength=len(outer))
    total = step**2 * len(near) if solid.is_union or solid.is_cut else float(mesh.area)
    areas: Array = share.astype(np.float64) * (total / max(len(near), 1))
    return areas


def _excess(solid: SignedDistance, swollen: _SwollenSolid, shells: Shells, spacing: float) -> float:
    """Return the volume [m3] by which the swollen solid exceeds the mesh."""
    if not swollen.is_swollen:
        return 0.0
    near = shells.outer > 0.0
    step = STEP * spacing
    share, inside = (np.clip(0.5 - phi / step, 0.0, 1.0) for phi in (shells.phi[near], solid.phi(shells.center[near])))
    return float((share - inside).sum()) * shells.cell_volume
