"""The loss of each segment by each closure, from what drives it.

Critical accumulation: oil too viscous for droplets slides under the skirt as a whole (closure, assumed).

Above 3000 cSt no droplets form. From a speed of 0.15 to 0.25 m/s on, the slick shortens, thickens and passes under the skirt (Delvigne
1989; Johnston and others 1993, after reviews). The limit used is min(U_e, 0.20 m/s). No rate is published: q = C_e (U - U_ca) h_b is
assumed, with the coefficient of entrainment and the thickness at the boom.

Splash-over and submergence: what flows over a float whose top is below the local surface (closure on a resolved motion).

The boom's pose gives its top, the particles give the surface before it; f is their difference. While f < 0, water and oil run over the
top as over a broad weir, q = 1.7 (-f)^1.5 [m2/s], and the oil on the surface makes up min(1, h_b / -f) of it. Range: overflow
that is long against its depth; wave length over height above 10. Source: broad-crested weir, (2/3)^1.5 sqrt(g) = 1.7.

Seepage: the oil that its own weight presses through the meshes of a net (closure).

A floating layer of thickness h presses on a wall with 0.5 rho_o g' h^2 per metre more than the water behind it, which is a mean pressure
of Dp = 0.5 rho_o g' h. A thick liquid creeps through a round hole of radius r in a thin sheet with Q = r^3 Dp / (3 mu) (Sampson 1891,
Phil. Trans. A 182:449). With r = w / 2, the circle that fits into a mesh, and one mesh for each p^2, the oil passes at

    v = (w / 2)^3 Dp / (3 mu p^2),    q = v h    [m2/s per metre of boom],

and never faster than the water goes through the net. So a net holds only thick oil: through meshes of 8 mm a layer of 0.1 m (900 kg/m3)
seeps with 13 cm/s if it has 0.1 Pa s, and with 8 mm a minute if it has 100 Pa s. Left out: tension, which keeps oil out of meshes that
water wets; a yield stress, as lumps have; debris that closes meshes. So the closure lets more through than a net does.
Range: creeping flow in the meshes, which thin oil leaves.

The two ways on which closures carry oil out of a boom.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from booms.fast_water import Net
from booms.losses.drainage import drainage_rate, held_thickness
from booms.losses.entrainment import RATE, entrainment_rate, escaping_share, head_share, onset_speed
from booms.losses.liquids import OilOnWater
from booms.losses.resolution import Resolution
from booms.losses.slick import boom_thickness
from booms.scores import PLANING_ANGLE, VISCOUS_LIMIT
from oilsim.core.physical_constants import GRAVITY
from oilsim.core.quantity import quantity, require
from oilsim.slick.loss_cause import LossCause

UNDER_FOOT = (LossCause.ENTRAINMENT, LossCause.DRAINAGE, LossCause.CRITICAL_ACCUMULATION, LossCause.PLANING)
"""The causes by which oil passes under the skirt."""
OVER_TOP = (LossCause.SUBMERGENCE, LossCause.SPLASH_OVER)
"""The causes by which oil passes over the float."""
WAYS = (UNDER_FOOT, OVER_TOP)


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


# [m^0.5/s] of a broad-crested weir, (2/3)^1.5 sqrt(g); theory
WEIR = (2.0 / 3.0) ** 1.5 * GRAVITY**0.5


def overflow_rate(freeboard: ArrayLike, thickness: ArrayLike) -> Array:
    """Compute the oil that runs over the top [m2/s per metre of boom].

    freeboard f (S,) [m] of the top above the local surface, negative under it; thickness h_b (S,) [m] of the oil at the boom.
    """
    depth = np.maximum(0.0, -np.asarray(freeboard, np.float64))
    share = np.minimum(1.0, np.divide(thickness, depth, out=np.ones_like(depth), where=depth > 0.0))
    return np.asarray(WEIR * depth**1.5 * share)


# [m/s] speed from which on it is; assumed: sources span 0.15 to 0.25
ACCUMULATION_SPEED = 0.20


def accumulation_speed(oil: OilOnWater) -> float:
    """Return the speed at which viscous oil begins to be lost, min(U_e, 0.20) [m/s]; assumed."""
    return min(onset_speed(oil), ACCUMULATION_SPEED)


def accumulation_rate(speed: ArrayLike, thickness: ArrayLike, oil: OilOnWater) -> Array:
    """Compute the oil that slides under, q = C_e (U - U_ca) h_b [m2/s per metre]; 0 for oil of up to 3000 cSt.

    speed U (S,) [m/s]; thickness h_b (S,) [m] at the boom.
    """
    if oil.kinematic_viscosity <= VISCOUS_LIMIT:
        return np.zeros(np.broadcast(np.asarray(speed), np.asarray(thickness)).shape)
    return np.asarray(RATE * np.maximum(0.0, np.asarray(speed) - accumulation_speed(oil)) * np.asarray(thickness))


Array = NDArray[np.float64]

SLOWEST = 1e-3  # [m/s] below which the water does not press oil against a boom


@dataclass(frozen=True, kw_only=True, eq=False)
class Drivers:
    """The quantities that drive the closures at S segments.

    speed      (S,) [m/s] of the undisturbed water against the segment, along its normal; 0 where it runs the other way
    draft      (S,) [m] from the local surface down to the foot
    held       (S,) [m2] oil held before the segment, per metre of front
    lean       (S,) [rad] of the skirt
    freeboard  (S,) [m] of the top above the local surface, negative under it
    sunk       (S,) whether the top lies below the still water
    """

    speed: Array
    draft: Array
    held: Array
    lean: Array
    freeboard: Array
    sunk: NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True)
class Closures:
    """The closures of one boom: skirt_depth [m] as built, and what the particles resolve.

    resolution None: nothing is resolved, as in a calculation without particles. net: in the place of the skirt; oil seeps through it, and
    drainage and critical accumulation have the speed of the water that goes under it, U - u (form assumed).
    Raises ValueError for a skirt without depth.
    """

    skirt_depth: float = quantity("m", above=0.0)
    resolution: Resolution | None = None
    net: Net | None = None

    def __post_init__(self) -> None:
        require("closures of a boom", Closures, {"skirt_depth": self.skirt_depth})

    @property
    def decide_alone(self) -> bool:
        """Tell whether the closures alone decide what is lost under the foot, since the particles are too coarse for the flow there."""
        return self.resolution is not None and not self.resolution.drainage

    def rates(self, drivers: Drivers, oil: OilOnWater) -> Array:
        """Compute the losses by cause and segment (causes, S) [m2/s per metre of boom]."""
        result = np.zeros((len(LossCause), len(drivers.speed)))
        wet = (drivers.held > 0.0) & (drivers.speed > SLOWEST)
        speed, held = np.where(wet, drivers.speed, 1.0), np.where(wet, drivers.held, 0.0)
        depth = self.skirt_depth
        # a thin pool has less of a front than the formula of a long slick gives: share of it that is there
        share = np.where(wet, head_share(speed, held, depth, oil), 0.0)
        thickness = np.where(wet, boom_thickness(speed, held, oil), 0.0)
        if oil.kinematic_viscosity <= VISCOUS_LIMIT:  # others form no droplets
            torn = entrainment_rate(speed, depth, oil) * escaping_share(speed, held, np.full_like(speed, depth), oil)
            result[LossCause.ENTRAINMENT] = share * torn
        if self.resolution is None or not self.resolution.drainage:
            under = speed if self.net is None else (1.0 - self.net.through_share) * speed
            limit = held_thickness(under, drivers.draft, oil)
            result[LossCause.DRAINAGE] = share * drainage_rate(under, thickness, limit, depth, oil)
            result[LossCause.CRITICAL_ACCUMULATION] = share * accumulation_rate(
                under, np.minimum(thickness, depth), oil
            )
        planes = drivers.lean > PLANING_ANGLE
        below = list(UNDER_FOOT)
        result[LossCause.PLANING, planes] = result[:, planes][below].sum(axis=0)
        for cause in below:
            if cause is not LossCause.PLANING:
                result[cause, planes] = 0.0
        if self.net is not None:
            result[LossCause.THROUGH] = seepage_rate(np.where(wet, speed, 0.0), thickness, self.net, oil)
        over = self._overflow(drivers, thickness)
        result[LossCause.SUBMERGENCE] = np.where(drivers.sunk, over, 0.0)
        result[LossCause.SPLASH_OVER] = np.where(drivers.sunk, 0.0, over)
        return result

    def _overflow(self, drivers: Drivers, thickness: Array) -> Array:
        """Compute what runs over the top (S,) [m2/s], where the particles do not resolve it.

        The formula of the slick gives it a thickness only in a flow; without one, the particles decide alone.
        """
        rate = overflow_rate(drivers.freeboard, thickness)
        if self.resolution is None:
            return rate
        return np.where(-drivers.freeboard < self.resolution.overflow_depth, rate, 0.0)
