"""A boom segment as a rigid body: its closed mesh, mass properties and hydrostatics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh

from booms.boom import Boom
from coupling.solids.bodies import MassProperties, mass_properties, tube
from coupling.solids.hydrostatics import Hydrostatics, hydrostatics
from oilsim.backend.arrays import Array


@dataclass(frozen=True, kw_only=True)
class BoomSegment:
    """A segment in its body frame: origin at the centre of mass, x along the boom, z up.

    waterline [m]: height of the design waterplane above the centre of mass; joint_points (2, 3) [m]: the joints at the -x and +x ends.
    """

    mesh: trimesh.Trimesh
    mass_properties: MassProperties
    waterline: float
    joint_points: Array
    hydrostatics: Hydrostatics


def boom_segment(boom: Boom) -> BoomSegment:
    """Build the segment of a boom, afloat at its design waterline: mass = rho_water x displaced volume.

    The mass (1 - ballast_fraction) m is spread evenly over the volume. The rest is a thin straight chain along the skirt's foot (a rod:
    I_y = I_z = m l^2 / 12). The parallel-axis theorem brings both to the common centre of mass. Raises ValueError unless
    GM = I_roll / V + z_B - z_G is positive.
    """
    mesh = segment_mesh(boom)
    afloat = hydrostatics(mesh, 0.0)
    mass = boom.water_density * afloat.displaced_volume
    properties = _with_ballast(mesh, mass, boom)
    if not afloat.metacentric_height(properties.center_of_mass[2]) > 0.0:
        raise ValueError(
            f"the boom's segments would capsize: GM is {afloat.metacentric_height(properties.center_of_mass[2]):.3g} m, allowed:"
            f" above 0 m; raise ballast_fraction ({boom.ballast_fraction:g}) or float_width ({boom.float_width:g} m)"
        )
    body = mesh.copy()
    body.apply_translation(-properties.center_of_mass)
    half, joint_height = 0.5 * boom.segment_length, boom.height_of_joints
    ends = np.array([[-half, 0.0, joint_height], [half, 0.0, joint_height]]) - properties.center_of_mass
    waterline = -float(properties.center_of_mass[2])
    return BoomSegment(
        mesh=body,
        mass_properties=MassProperties(mass=mass, center_of_mass=np.zeros(3), inertia=properties.inertia),
        waterline=waterline,
        joint_points=ends,
        hydrostatics=hydrostatics(body, waterline),
    )


def segment_mesh(boom: Boom) -> trimesh.Trimesh:
    """Build the closed mesh in the design frame: the section extruded along x, with ends that narrow to a vertical edge.

    The edges of neighbours meet on the joint's axis. The narrow part is short (see `Boom.taper`), so that no oil passes.
    """
    profile = boom.profile()
    loop = np.concatenate([profile * (-1.0, 1.0), profile[::-1]])
    half, taper = 0.5 * boom.segment_length, boom.taper
    stations = [(-half, 0.0), (taper - half, 1.0), (half - taper, 1.0), (half, 0.0)]
    rings = np.array([[[x, scale * y, z] for y, z in loop] for x, scale in stations])
    return tube(rings)


def _with_ballast(mesh: trimesh.Trimesh, mass: float, boom: Boom) -> MassProperties:
    """Combine an even body and a rod along the foot; the centre of mass is in the design frame, the inertia about it."""
    even = mass_properties(mesh, mass=(1.0 - boom.ballast_fraction) * mass)
    ballast = boom.ballast_fraction * mass
    foot = np.array([0.0, 0.0, -boom.skirt_depth])
    rod = ballast * boom.segment_length**2 / 12.0 * np.diag([0.0, 1.0, 1.0])
    center = (even.mass * even.center_of_mass + ballast * foot) / mass
    inertia = even.inertia + _shift(even.mass, even.center_of_mass - center) + rod + _shift(ballast, foot - center)
    return MassProperties(mass=mass, center_of_mass=center, inertia=inertia)


def _shift(mass: float, arm: Array) -> Array:
    """Compute Steiner's term m (|r|^2 1 - r r^T) [kg m2] for an arm (3,) [m]."""
    return mass * (float(arm @ arm) * np.eye(3) - np.outer(arm, arm))
