"""Hull shapes, and hulls afloat: shape, displacement and mass properties that fit together.

Shapes are closed meshes in the design frame: x forward from midships, y to port, z up from the design waterline. A `Hull` holds the
mesh in the body frame, whose origin is the centre of mass.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh

from coupling.solids.bodies import MassProperties, tube
from coupling.solids.hydrostatics import Hydrostatics, hydrostatics
from oilsim.backend.arrays import Array
from vessels.hull_size import HullSize


@dataclass(frozen=True, kw_only=True)
class Hull:
    """A hull afloat at its design draft, in the body frame (origin at the centre of mass, x forward, z up).

    length, beam, depth [m]: extent of the mesh; draft [m]: keel below the waterline; waterline [m]: height of the waterplane above the
    centre of mass; water_density [kg/m3]; metacentric_height [m]: transverse GM.
    """

    mesh: trimesh.Trimesh
    mass_properties: MassProperties
    draft: float
    waterline: float
    water_density: float
    hydrostatics: Hydrostatics

    @property
    def length(self) -> float:
        """Length over all [m]."""
        return float(self.mesh.extents[0])

    @property
    def beam(self) -> float:
        """Beam over all [m]."""
        return float(self.mesh.extents[1])

    @property
    def depth(self) -> float:
        """Height from keel to deck [m]."""
        return float(self.mesh.extents[2])

    def deck_point(self, forward: float, height: float | None = None) -> Array:
        """Return a point (3,) [m] on the centreline, `forward` [m] of midships and `height` [m] above the waterline, in the body frame.

        Midships is the middle of the length. Without a height the point lies on the deck.
        """
        low, high = self.mesh.bounds
        z = float(high[2]) if height is None else self.waterline + height
        return np.array([0.5 * (low[0] + high[0]) + forward, 0.0, z])


def wigley_hull(
    length: float, beam: float, draft: float, depth: float, *, station_count: int = 40, level_count: int = 12
) -> trimesh.Trimesh:
    """Build Wigley's parabolic hull, closed by vertical sides above the waterline and a flat deck.

    y = B / 2 (1 - (2 x / L)^2) (1 - (z / T)^2) for -T <= z <= 0; above, the sides keep the waterline's breadth up to the deck at
    z = depth - T. Exact values below the waterline: volume 4 / 9 L B T (block coefficient 4 / 9), waterplane area 2 / 3 L B, its second
    moment 4 / 105 L B^3, centre of buoyancy 3 / 8 T down. The mesh is inscribed, so its volume is short by
    O(1 / stations^2 + 1 / levels^2). Wigley (1942). Lengths in m; ValueError for one that is not above 0.
    """
    HullSize(length=length, beam=beam, draft=draft, depth=depth)
    x = 0.5 * length * np.linspace(-1.0, 1.0, station_count + 1)
    z = np.append(draft * (np.linspace(0.0, 1.0, level_count + 1) - 1.0), depth - draft)
    fullness = 1.0 - (np.minimum(z, 0.0) / draft) ** 2
    half_breadth = 0.5 * beam * (1.0 - (2.0 * x / length) ** 2)[:, None] * fullness[None, :]
    half_breadth[[0, -1], :] = 0.0
    section = np.concatenate([half_breadth[:, ::-1], -half_breadth[:, 1:]], axis=1)
    height = np.concatenate([z[::-1], z[1:]])
    vertices = np.stack(np.broadcast_arrays(x[:, None], section, height[None, :]), axis=2)
    return tube(vertices)


def raked_barge(length: float, beam: float, draft: float, depth: float, *, rake: float = 0.0) -> trimesh.Trimesh:
    """Build a box barge whose two ends slope from the deck down to the flat bottom: a simple workboat.

    `rake` [m]: horizontal extent of each slope, 0 <= rake < L / 2. Waterline length L_w = L - 2 rake (1 - T / D); displaced volume
    B T (L_w + L - 2 rake) / 2. Lengths in m; raises ValueError for a length that is not above 0 and for a rake outside its limits.
    """
    HullSize(length=length, beam=beam, draft=draft, depth=depth)
    if not 0.0 <= rake < 0.5 * length:
        raise ValueError(f"rake is {rake:g} m, allowed: 0 m or more and less than half the length of {length:g} m")
    x = np.array([-0.5 * length, rake - 0.5 * length, 0.5 * length - rake, 0.5 * length])
    z = np.array([depth - draft, -draft, -draft, depth - draft])
    vertices = np.array([[[x[k], side, z[k]] for k in range(4)] for side in (0.5 * beam, -0.5 * beam)])
    sides = [[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]]
    shell = [f for k in range(4) for f in ([k, k + 4, (k + 1) % 4], [(k + 1) % 4, k + 4, (k + 1) % 4 + 4])]
    mesh = trimesh.Trimesh(vertices.reshape(-1, 3), sides + shell, process=False)
    mesh.invert()  # the triangles are listed as seen from inside
    return mesh


def float_hull(
    mesh: trimesh.Trimesh,
    draft: float,
    *,
    water_density: float,
    center_of_gravity_height: float | None = None,
) -> Hull:
    """Give a closed mesh the mass properties with which it floats upright at `draft` [m] above its lowest point.

    mass = water_density x displaced volume; water_density [kg/m3]. The centre of gravity lies over the centre of buoyancy (no trim, no
    list), `center_of_gravity_height` [m] above the keel. Its default is 0.6 of the depth, or lower, where GM is a tenth of the beam. The
    inertia is m k^2 with the radii of gyration 0.37 B, 0.25 L and 0.25 L [m] about x, y and z, which are usual for ships in seakeeping.
    Raises ValueError unless the draft is less than the depth and GM = I_roll / V + z_B - z_G is positive.
    """
    low, high = mesh.bounds
    if not 0.0 < draft < high[2] - low[2]:
        raise ValueError(
            f"draft is {draft:g} m, allowed: above 0 m and below the depth of the hull, {high[2] - low[2]:g} m"
        )
    form = hydrostatics(mesh, float(low[2]) + draft)
    keel, beam, length = float(low[2]), float(high[1] - low[1]), float(high[0] - low[0])
    if center_of_gravity_height is None:
        metacenter = form.metacentric_height(keel)
        center_of_gravity_height = min(0.6 * float(high[2] - low[2]), metacenter - 0.1 * beam)
    _check_stable(form, keel, center_of_gravity_height)
    center = np.array([*form.center_of_buoyancy[:2], keel + center_of_gravity_height])
    mass = water_density * form.displaced_volume
    radii = np.array((0.37 * beam, 0.25 * length, 0.25 * length))
    body = mesh.copy()
    body.apply_translation(-center)
    waterline = draft - center_of_gravity_height
    return Hull(
        mesh=body,
        mass_properties=MassProperties(mass=mass, center_of_mass=np.zeros(3), inertia=np.diag(mass * radii**2)),
        draft=draft,
        waterline=waterline,
        water_density=water_density,
        hydrostatics=hydrostatics(body, waterline),
    )


def _check_stable(form: Hydrostatics, keel: float, center_of_gravity_height: float) -> None:
    """Raise ValueError for a centre of gravity below the keel or above the metacentre."""
    highest = form.metacentric_height(keel)
    if not 0.0 < center_of_gravity_height < highest:
        raise ValueError(
            f"the centre of gravity is {center_of_gravity_height:g} m above the keel, allowed: above 0 m and below the"
            f" metacentre at {highest:g} m; above it the hull capsizes"
        )
