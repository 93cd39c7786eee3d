"""Loads of a sea on a floating body of any shape that is no hull, from its geometry as it floats.

Axes. z is up where the body is placed; x and y are the horizontal principal axes of what it wets there, the longer one first. They come
from the shape, so it does not matter in which axes the body is drawn. Along them the mesh is cut into cells that are short against the
waves; each carries its own buoyancy, wave pressure and skin.

Added mass. With D the wetted body and its mirror image in the waterplane, and with the ellipsoid whose axes and axis ratios are those of
the second moments of D, a_i^2 = 5 <x_i^2> (Lamb 1932, article 114):

    A_i = k_i rho V,   k_i = alpha_i / (2 - alpha_i),   alpha_i = a b c int_0^inf dl / ((a_i^2 + l) ((a^2 + l)(b^2 + l)(c^2 + l))^(1/2)).

V [m3] is what the body wets. A half-immersed ball has rho V / 2, a long half-immersed cylinder rho V across. The mirror image makes the
surface a wall to sway (slow motion) and a surface without pressure to heave (fast motion), as `oilsim.loads.load_model` does.
Cells share it by what they wet.

Waves that heave makes (Haskind's relation, Newman 1977, section 6.17), k = omega^2 / g, at the frequency of free heave:

    B = k omega / (4 pi rho g^2) int_0^2pi |X(theta)|^2 d theta,
    |X| = rho g S exp(-k T) sinc(k L_1 cos theta / 2) sinc(k L_2 sin theta / 2)

with the waterplane S, the mean draft T = V / S, and the lengths L_i^2 = 12 <x_i^2>. A long body makes the waves of its sections.

Drag. The skin is pressed by the flow across it and rubbed by that along it (`oilsim.loads.morison`). By the law of the cosine squared a
plate across the flow has C_n, a cylinder 2/3 and a ball 1/2 of it, on their areas seen from ahead. Round bodies have no direction.
"""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np
from scipy.special import elliprd
from trimesh import Trimesh

from coupling.solids.hydrostatics import cut_below, waterline_for_volume
from oilsim.backend.arrays import Array, Flags
from oilsim.core.physical_constants import GRAVITY
from oilsim.loads.load_model import LoadModel, Part
from vessels.loads import FRICTION_SPEED, ittc_friction

# [1] C_n; paper (Hoerner 1965, section 3: disc and square plate 1.17, cube 1.05, ball 0.47; plates longer than ten widths 1.3 to 2)
PRESSING = 1.17
# cells of a cube; numerical; the waves of a cube's own length meet three cells
CELLS = 27
# cells along the longest axis at most; numerical; as many as a hull has strips
LONGEST = 10
# [V] volume of a cell below which it is rounding; numerical
SPECK = 1e-12
# [1] how far a count of cells lies from the next half before rounding decides; numerical
EVEN = 1e-6
# directions of waves in Haskind's relation; numerical; a body of ten waves has peaks of 10 degrees
DIRECTIONS = 360


class Moments(NamedTuple):
    """Volume [m3], center (3,) [m] and second moments (3, 3) [m2] about it, over the volume, of a closed surface."""

    volume: float
    center: Array
    second: Array


class _Cell(NamedTuple):
    """A piece of a body: closed triangles (T, 3, 3) [m], and which of them are the body's own surface (T,)."""

    triangles: Array
    is_skin: Flags


def bluff_body_loads(mesh: Trimesh, mass: float, water_density: float, up: Array) -> LoadModel:
    """Return the load model of a body of `mass` [kg] that floats where `up` (3,), a unit vector along its own axes, is up.

    mesh [m], closed, about the centre of mass; water_density [kg/m3]. ValueError for a body that sinks.
    """
    axes = _upright(up)
    placed = Trimesh(np.asarray(mesh.vertices) @ axes, mesh.faces, process=False)
    waterline = waterline_for_volume(placed, mass / water_density)
    cell = _Cell(np.asarray(mesh.vertices, np.float64)[mesh.faces] @ axes, np.ones(len(mesh.faces), np.bool_))
    double = _double_body(_below(cell, np.array((0.0, 0.0, 1.0)), waterline), waterline)
    turn = _principal(double.second)
    cell, double = cell._replace(triangles=cell.triangles @ turn), double._replace(second=turn.T @ double.second @ turn)
    second = np.diag(double.second)
    added = _ellipsoid_coefficients(second) * water_density * double.volume
    area = _waterplane_area(cell.triangles, waterline)
    frequency = math.sqrt(water_density * GRAVITY * area / (mass + added[2]))
    damping = _heave_damping(area, double.volume / area, np.sqrt(12.0 * second[:2]), frequency) * water_density
    friction = ittc_friction(FRICTION_SPEED, math.sqrt(12.0 * float(second.max())))
    parts = []
    for piece in _cells(cell):
        share = moments(_below(piece, np.array((0.0, 0.0, 1.0)), waterline).triangles).volume / double.volume
        is_wet = share > SPECK
        parts.append(
            Part(
                triangles=piece.triangles,
                added_mass=share * added if is_wet else np.zeros(3),
                wave_damping=np.array((0.0, 0.0, share * damping if is_wet else 0.0)),
                design_volume=share * double.volume if is_wet else moments(piece.triangles).volume,
                skin=piece.triangles[piece.is_skin],
                skin_drag=(PRESSING, friction),
            )
        )
    return LoadModel(parts=tuple(parts), axes=axes @ turn)


def moments(triangles: Array) -> Moments:
    """Return the moments of a closed surface of triangles (T, 3, 3) [m], outward, by the tetrahedra that they make with the origin."""
    volume = np.einsum("ti,ti->t", triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2])) / 6.0
    total, corners = float(volume.sum()), triangles.sum(axis=1)
    if not total > 0.0:
        return Moments(0.0, np.zeros(3), np.zeros((3, 3)))
    center = 0.25 * volume @ corners / total
    second = np.einsum("t,tki,tkj->ij", volume, triangles, triangles) + np.einsum(
        "t,ti,tj->ij", volume, corners, corners
    )
    return Moments(total, center, second / (20.0 * total) - np.outer(center, center))


def _upright(up: Array) -> Array:
    """Return axes (3, 3), one a column, whose third is `up` (3,)."""
    aside = np.eye(3)[np.argmin(np.abs(up))]
    x = np.cross(up, aside)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(up, x), up])


def _principal(second: Array) -> Array:
    """Return the turn (3, 3) about z to the horizontal principal axes, the longer one first, as columns."""
    angle = 0.5 * math.atan2(2.0 * second[0, 1], second[0, 0] - second[1, 1])
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def _double_body(wetted: _Cell, waterline: float) -> Moments:
    """Return the moments of what is wetted, with the second moments of it and its mirror image in the waterplane [m]."""
    found = moments(wetted.triangles)
    second = found.second.copy()
    second[2, 2] += (found.center[2] - waterline) ** 2
    second[2, :2], second[:2, 2] = 0.0, 0.0
    return found._replace(second=second)


def _ellipsoid_coefficients(second: Array) -> Array:
    """Return k (3,) of the ellipsoid whose second moments are `second` (3,) [m2], by Carlson's integral R_D."""
    squares = 5.0 * second
    product = math.sqrt(float(squares.prod()))
    alpha = np.array([elliprd(squares[(i + 1) % 3], squares[(i + 2) % 3], squares[i]) for i in range(3)])
    alpha *= 2.0 / 3.0 * product
    return np.asarray(alpha / (2.0 - alpha))


def _heave_damping(area: float, draft: float, lengths: Array, frequency: float) -> float:
    """Return B / rho [m3/s] of a waterplane of `area` [m2] and `lengths` (2,) [m] at a frequency [rad/s], after Haskind."""
    number = frequency**2 / GRAVITY
    angle = 2.0 * math.pi * np.arange(DIRECTIONS) / DIRECTIONS
    phases = 0.5 * number * lengths * np.column_stack([np.cos(angle), np.sin(angle)])
    force = area * math.exp(-number * draft) * np.sinc(phases / math.pi).prod(axis=1)
    return float(0.5 * number * frequency * np.mean(force**2))


def _waterplane_area(triangles: Array, waterline: float) -> float:
    """Return the area [m2] that the plane z = waterline [m] cuts out of a closed surface (T, 3, 3) [m]."""
    x, y = np.moveaxis(cut_below(triangles, triangles[:, :, 2] - waterline).edges[:, :, :2], 2, 0)
    return 0.5 * float(np.sum(x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]))


def _cells(body: _Cell) -> list[_Cell]:
    """Cut a body along its axes x, y and z into cells of about the same length."""
    found = moments(body.triangles)
    lengths = np.sqrt(12.0 * np.diag(found.second))
    size = max(float(lengths.max()) / LONGEST, float(lengths.prod() / CELLS) ** (1.0 / 3.0))
    cells = [body]
    for axis in range(3):
        low, high = body.triangles[:, :, axis].min(), body.triangles[:, :, axis].max()
        count = max(1, round(lengths[axis] / size - EVEN))
        edges = np.linspace(low, high, count + 1)[1:-1]
        cells = [slab for cell in cells for slab in _slabs(cell, np.eye(3)[axis], edges)]
    return [cell for cell in cells if moments(cell.triangles).volume > SPECK * found.volume]


def _slabs(cell: _Cell, normal: Array, edges: Array) -> list[_Cell]:
    """Cut a cell at planes across `normal` (3,) at `edges` (n,) [m]."""
    ends = [-np.inf, *edges, np.inf]
    slabs = []
    for low, high in itertools.pairwise(ends):
        slab = cell if high == np.inf else _below(cell, normal, high)
        slabs.append(slab if low == -np.inf else _below(slab, -normal, -low))
    return slabs


def _below(cell: _Cell, normal: Array, level: float) -> _Cell:
    """Return what of a cell lies below the plane at `level` [m] along `normal` (3,), closed by a lid.

    The lid is a fan over the cut edges. Where the cut is not convex, triangles of the fan overlap with opposite signs, and the integrals
    over the closed surface stay exact.
    """
    kept = cut_below(cell.triangles, cell.triangles @ normal - level)
    if not len(kept.edges):
        return _Cell(kept.triangles, cell.is_skin[kept.source])
    tip = np.broadcast_to(kept.edges[0, 0], kept.edges[:, :1].shape)
    lid = np.concatenate([tip, kept.edges], axis=1)
    is_skin = np.concatenate([cell.is_skin[kept.source], np.zeros(len(lid), np.bool_)])
    return _Cell(np.concatenate([kept.triangles, lid]), is_skin)
