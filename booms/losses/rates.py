"""The loss of each segment by each closure, from what drives it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from booms.fast_water.net import Net
from booms.losses.accumulation import accumulation_rate
from booms.losses.drainage import drainage_rate, held_thickness
from booms.losses.entrainment import entrainment_rate, escaping_share, head_share
from booms.losses.liquids import OilOnWater
from booms.losses.overflow import overflow_rate
from booms.losses.resolution import Resolution
from booms.losses.seepage import seepage_rate
from booms.losses.slick import boom_thickness
from booms.losses.ways import UNDER_FOOT
from booms.scores import PLANING_ANGLE, VISCOUS_LIMIT
from oilsim.core.quantity import quantity, require
from oilsim.slick.loss_cause import LossCause

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
