"""The loss of each segment by each closure, from what drives it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from booms.fast_water.net import Net
from booms.losses.accumulation import VISCOUS_LIMIT, accumulation_rate
from booms.losses.drainage import SUCTION, drainage_rate, held_thickness
from booms.losses.entrainment import ONSET_RATIO, RATE, entrainment_rate, escaping_share, head_share
from booms.losses.liquids import OilOnWater
from booms.losses.overflow import overflow_rate
from booms.losses.resolution import Resolution
from booms.losses.seepage import seepage_rate
from booms.losses.slick import FRICTION, boom_thickness
from booms.losses.ways import UNDER_FOOT
from oilsim.quantity import quantity, require
from oilsim.slick.loss_cause import LossCause

Array = NDArray[np.float64]

SLOWEST = 1e-3  # [m/s] below which the water does not press oil against a boom


@dataclass(frozen=True, kw_only=True)
class Coefficients:
    """The closures' coefficients, with the range that evidence spans: see the modules that define them."""

    friction: float = quantity("", default=FRICTION, at_least=0.003, at_most=0.016)
    suction: float = quantity("", default=SUCTION, at_least=1.0, at_most=2.0)
    onset_ratio: float = quantity("", default=ONSET_RATIO, at_least=2.0, at_most=3.3)
    rate: float = quantity("", default=RATE, at_least=0.003, at_most=0.3)

    def __post_init__(self) -> None:
        require("closures", Coefficients, vars(self))


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
    """The closures of one boom: skirt_depth [m] as built, planing_angle [rad], coefficients, and what the particles resolve.

    resolution None: nothing is resolved, as in a calculation without particles. net: in the place of the skirt; oil seeps through it, and
    drainage and critical accumulation have the speed of the water that goes under it, U - u (form assumed).
    Raises ValueError for a skirt without depth.
    """

    skirt_depth: float = quantity("m", above=0.0)
    planing_angle: float = math.radians(45.0)
    coefficients: Coefficients = Coefficients()
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
        friction = self.coefficients.friction
        # a thin pool has less of a front than the formula of a long slick gives: share of it that is there
        share = np.where(wet, head_share(speed, held, oil, friction), 0.0)
        thickness = np.where(wet, boom_thickness(speed, held, oil, friction), 0.0)
        result[LossCause.ENTRAINMENT] = share * self._entrained(speed, held, oil)
        if self.resolution is None or not self.resolution.drainage:
            under = speed if self.net is None else (1.0 - self.net.through_share) * speed
            limit = held_thickness(under, drivers.draft, oil, self.coefficients.suction)
            result[LossCause.DRAINAGE] = share * drainage_rate(thickness, limit, oil)
            result[LossCause.CRITICAL_ACCUMULATION] = share * accumulation_rate(under, thickness, oil)
        planes = drivers.lean > self.planing_angle
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

    def _entrained(self, speed: Array, held: Array, oil: OilOnWater) -> Array:
        """Compute the droplets lost (S,) [m2/s]; none of oil too viscous for droplets, and none where particles resolve them."""
        if oil.kinematic_viscosity > VISCOUS_LIMIT or (
            self.resolution is not None and self.resolution.entrainment(oil)
        ):
            return np.zeros_like(speed)
        torn = entrainment_rate(speed, oil, ratio=self.coefficients.onset_ratio, rate=self.coefficients.rate)
        return torn * escaping_share(
            speed, held, np.full_like(speed, self.skirt_depth), oil, self.coefficients.friction
        )

    def _overflow(self, drivers: Drivers, thickness: Array) -> Array:
        """Compute what runs over the top (S,) [m2/s], where the particles do not resolve it.

        The formula of the slick gives it a thickness only in a flow; without one, the particles decide alone.
        """
        rate = overflow_rate(drivers.freeboard, thickness)
        if self.resolution is None:
            return rate
        return np.where(-drivers.freeboard < self.resolution.overflow_depth, rate, 0.0)
