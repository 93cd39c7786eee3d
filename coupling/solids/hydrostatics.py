"""Hydrostatics of a closed mesh: displaced volume, centre of buoyancy, waterplane, metacentric heights.

The integrals run over the wetted triangles only. With heights measured from the waterplane, every integrand used for
the volume and its moments is zero on the waterplane, so that the lid that would close the wetted surface adds nothing
(divergence theorem). Triangles across the waterplane are clipped; the quadrature is exact for flat triangles.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import trimesh

from oilsim.backend.arrays import Array, Flags, Ints


@dataclass(frozen=True, kw_only=True)
class Hydrostatics:
    """Volume and waterplane of a hull at one draft, in the coordinates of its mesh (z up).

    displaced_volume [m3]; center_of_buoyancy (3,) [m]; waterplane_area [m2]; waterplane_center (2,) [m],
    0 if there is no waterplane;
    roll_second_moment and pitch_second_moment [m4]: second moments of the waterplane about its own x and y axis.
    """

    displaced_volume: float
    center_of_buoyancy: Array
    waterplane_area: float
    waterplane_center: Array
    roll_second_moment: float
    pitch_second_moment: float

    def metacentric_height(self, center_of_mass_height: float) -> float:
        """Compute the transverse metacentric height GM = I_roll / V + z_B - z_G [m]; above 0 the body rights itself from a heel."""
        return self.roll_second_moment / self.displaced_volume + self.center_of_buoyancy[2] - center_of_mass_height


def hydrostatics(mesh: trimesh.Trimesh, waterline: float) -> Hydrostatics:
    """Return the hydrostatics of a watertight mesh that floats with the plane z = waterline [m] as the still-water surface.

    With z' = z - waterline and the outward surface element n dS of the wetted triangles:
    V = int z' n_z dS, V x_B = int x z' n_z dS, V z'_B = int z'^2 / 2 n_z dS, A = -int n_z dS,
    I_roll = -int y^2 n_z dS - A y_c^2 (and x for pitch). Raises ValueError for an open mesh and a waterline below it.
    """
    if not mesh.is_watertight:
        raise ValueError("mesh is not watertight: its displaced volume is undefined, a closed surface is needed")
    triangles = np.asarray(mesh.vertices, dtype=np.float64)[mesh.faces]
    triangles[:, :, 2] -= waterline
    wetted = cut_below(triangles, triangles[:, :, 2]).triangles
    if len(wetted) == 0:
        raise ValueError(f"waterline {waterline:g} m lies below the mesh, lowest point {mesh.bounds[0, 2]:g} m")
    vertical_area = 0.5 * np.cross(wetted[:, 1] - wetted[:, 0], wetted[:, 2] - wetted[:, 0])[:, 2]
    x, y, z = np.moveaxis(0.5 * (wetted + np.roll(wetted, 1, axis=1)), 2, 0)

    def integral(values: Array) -> float:
        return float(np.sum(values.mean(axis=1) * vertical_area))

    volume = integral(z)
    moment = np.array([integral(x * z), integral(y * z), integral(0.5 * z * z)])
    area = -integral(np.ones_like(z))
    is_cut = mesh.bounds[1, 2] > waterline and area > 0.0  # of what lies all under water only rounding would be left
    center = -np.array([integral(x), integral(y)]) / area if is_cut else np.zeros(2)
    return Hydrostatics(
        displaced_volume=volume,
        center_of_buoyancy=moment / volume + np.array([0.0, 0.0, waterline]),
        waterplane_area=area,
        waterplane_center=center,
        roll_second_moment=-integral(y * y) - area * float(center[1]) ** 2,
        pitch_second_moment=-integral(x * x) - area * float(center[0]) ** 2,
    )


def waterline_for_volume(mesh: trimesh.Trimesh, displaced_volume: float) -> float:
    """Return the height z [m] of the waterplane at which the upright mesh displaces `displaced_volume` [m3].

    Raises ValueError for a volume that is not between 0 and the mesh's.
    """
    from scipy.optimize import brentq  # a third of a second, for those who need it

    if not 0.0 < displaced_volume < mesh.volume:
        raise ValueError(
            f"displaced volume {displaced_volume:g} m3 must lie between 0 and the mesh's {mesh.volume:g} m3"
        )
    low, high = (float(z) for z in mesh.bounds[:, 2])

    def excess(z: float) -> float:
        cut = low < z < high
        return (hydrostatics(mesh, z).displaced_volume if cut else mesh.volume * (z >= high)) - displaced_volume

    return float(brentq(excess, low, high))


class Cut(NamedTuple):
    """The pieces of a surface below a plane.

    triangles (N, 3, 3) [m], wound as before; source (N,): the triangle that each is a piece of; edges (E, 2, 3) [m]: where the plane cuts
    triangles, wound as a lid on the plane is.
    """

    triangles: Array
    source: Ints
    edges: Array


def cut_below(triangles: Array, height: Array) -> Cut:
    """Return the parts of triangles (T, 3, 3) [m] below a plane; height (T, 3) [m] of their corners over it."""
    below = height < 0.0
    count = below.sum(axis=1)
    whole, one, two = (np.flatnonzero(count == corners) for corners in (3, 1, 2))
    tip, tip_height = _first_vertex_first(triangles[one], height[one], below[one])
    cut, cut_height = _first_vertex_first(triangles[two], height[two], ~below[two])
    right, left = (_crossing(tip, tip_height, end) for end in (1, 2))
    leaving, entering = (_crossing(cut, cut_height, end) for end in (1, 2))
    tips = np.stack([tip[:, 0], right, left], axis=1)
    lower = np.stack([leaving, cut[:, 1], cut[:, 2]], axis=1)
    upper = np.stack([leaving, cut[:, 2], entering], axis=1)
    return Cut(
        triangles=np.concatenate([triangles[whole], tips, lower, upper]),
        source=np.concatenate([whole, one, two, two]),
        edges=np.concatenate([np.stack([left, right], axis=1), np.stack([leaving, entering], axis=1)]),
    )


def _first_vertex_first(triangles: Array, height: Array, marked: Flags) -> tuple[Array, Array]:
    """Rotate each triangle, and its heights, so that its one marked vertex comes first; the orientation stays."""
    order = (np.argmax(marked, axis=1)[:, None] + np.arange(3)) % 3
    return np.take_along_axis(triangles, order[:, :, None], axis=1), np.take_along_axis(height, order, axis=1)


def _crossing(triangles: Array, height: Array, end: int) -> Array:
    """Return the points (N, 3) [m] in which the edges from the first corner to the corner `end` meet height 0."""
    fraction = height[:, 0] / (height[:, 0] - height[:, end])
    return triangles[:, 0] + fraction[:, None] * (triangles[:, end] - triangles[:, 0])
