"""Seepage: the oil that its own weight presses through the meshes of a net (closure).

A floating layer of thickness h presses on a wall with 0.5 rho_o g' h^2 per metre more than the water behind it, which is a mean pressure
of Dp = 0.5 rho_o g' h. A thick liquid creeps through a round hole of radius r in a thin sheet with Q = r^3 Dp / (3 mu) (Sampson 1891,
Phil. Trans. A 182:449). With r = w / 2, the circle that fits into a mesh, and one mesh for each p^2, the oil passes at

    v = (w / 2)^3 Dp / (3 mu p^2),    q = v h    [m2/s per metre of boom],

and never faster than the water goes through the net. So a net holds only thick oil: through meshes of 8 mm a layer of 0.1 m (900 kg/m3)
seeps with 13 cm/s if it has 0.1 Pa s, and with 8 mm a minute if it has 100 Pa s. Left out: tension, which keeps oil out of meshes that
water wets; a yield stress, as lumps have; debris that closes meshes. So the closure lets more through than a net does.
Range: creeping flow in the meshes, which thin oil leaves.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from booms.fast_water.net import Net
from booms.losses.liquids import OilOnWater

Array = NDArray[np.float64]


def seepage_speed(speed: ArrayLike, thickness: ArrayLike, net: Net, oil: OilOnWater) -> Array:
    """Compute the speed v [m/s] at which oil passes a net, at most that of the water there.

    speed U (S,) [m/s] of the undisturbed water; thickness h_b (S,) [m] of the oil at the boom.
    """
    viscosity = oil.kinematic_viscosity * oil.oil_density
    pressure = 0.5 * oil.oil_density * oil.reduced_gravity * np.asarray(thickness, np.float64)
    hole = (0.5 * net.mesh_opening) ** 3 / (3.0 * net.mesh_pitch**2)
    with np.errstate(divide="ignore", invalid="ignore"):
        creeping = np.where(pressure > 0.0, hole * pressure / viscosity, 0.0)
    return np.asarray(np.minimum(creeping, net.through_share * np.asarray(speed)))


def seepage_rate(speed: ArrayLike, thickness: ArrayLike, net: Net, oil: OilOnWater) -> Array:
    """Compute the oil that passes a net, q = v h_b (S,) [m2/s per metre of boom]; arguments as of `seepage_speed`."""
    return np.asarray(seepage_speed(speed, thickness, net, oil) * np.asarray(thickness))
