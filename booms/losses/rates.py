"""The loss of each segment by each closure, from what drives it.

Critical accumulation: oil too viscous for droplets slides under the skirt as a whole (closure, assumed).

Above 3000 cSt no droplets form. From a speed of 0.15 to 0.25 m/s on, the slick shortens, thickens and passes under the skirt (Delvigne
1989; Johnston and others 1993, after reviews). The limit used is min(U_e, 0.20 m/s). No rate is published: q = C_e (U - U_ca) h_b is
assumed, with the coefficient of entrainment and the thickness at the boom.

Splash-over and submergence: what flows over a float whose top is below the local surface (closure on a resolved motion).

The boom's pose gives its top, the particles give the surface before it; f is their difference. While f < 0, water and oil run over the
top as over a broad weir, q = 1.7 (-f)^1.5 [m2/s], and the oil on the surface makes up min(1, h_b / -f) of it. Range: overflow
that is long against its depth; wave length over height above 10. Source: broad-crested weir, (2/3)^1.5 sqrt(g) = 1.7.

The two ways on which closures carry oil out of a boom.

Entrainment: droplets that the water tears off a slick's head and carries under the skirt (closure).

Onset: waves grow on the interface from the Kelvin-Helmholtz speed on, 0.11 to 0.16 m/s; loss needs C_1 times that. C_1 = 2.35 gives
0.36 m/s (0.7 kn), at which crews are taught that booms begin to lose oil; evidence spans 2.0 to 3.3, 0.31 to 0.51 m/s.
Rate: q = C_e (U - U_e) h_f phi. C_e = 0.03 is uncertain within a decade; 10 % of a usual pool is lost in a minute at 1.1 kn, as
trials report.
Recapture: the largest drop that the flow does not break is 12 sigma / (rho_w U^2) (a Weber number of 12); the mean is 0.4 of it. It
rises at w (Schiller and Naumann 1933) into the slick above during L / U, from water as deep as the skirt below the slick:
phi = exp(-w L / (U (d - h_b))).
Range: oils thinner than 3000 cSt. Droplets do not scale with a Froude number: a small skirt is no model of a large one.
Sources: Lamb, Hydrodynamics, chapter IX; Miller, Lindenmuth, Lehr and Abrahams 1971; onset ratio, rate and phi are assumed forms.

The closures of booms for oil that is no particles: the pools of a slick of parcels ahead of each segment (`oilsim.slick`).

Nothing is resolved there, so every closure acts, and all that is lost is modelled. The pose of each segment and the surface of the sea
above it give draft, lean and freeboard, as they do beside particles.

Drainage: oil that is sucked under the skirt's foot, or that the slick's own weight pushes under it (closure).

The water runs along the slick's underside and round the foot at k U. By Bernoulli's law along the interface, oil is held at the foot while
(k^2 - 1) U^2 / (2 g') is less than the water between slick and foot, so the slick may be h_c = d - (k^2 - 1) h_f thick at the boom. A
front that is itself sucked under, k^2 h_f > d, bounds the speed: U = sqrt(2 g' d) / k. A plate with a base pressure of -1 has k = sqrt 2;
runs of this program with 2.5 to 16 particles of draft give 1.6 to 1.9. Thicker oil runs out like an outlet of its own depth, and no slower
than the water that takes it along (form assumed): so oil that hardly floats goes with the water.
Range: upright or leaning plate in water deeper than five drafts. Source: own derivation; the rate's form and its 0.6 are assumed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from booms.boom import Pocket
from booms.losses.liquids import OilOnWater, boom_thickness, front_thickness, slick_length
from booms.losses.resolution import Resolution
from booms.scores import PLANING_ANGLE, VISCOUS_LIMIT, droplet_onset_speed
from oilsim.backend.arrays import Array, Flags, Ints
from oilsim.core.physical_constants import GRAVITY
from oilsim.core.quantity import quantity, require
from oilsim.oil.fates import LossCause
from oilsim.slick.loss_rate import Pools

# [-] k, speed at the foot over that of the undisturbed water; theory: a plate with a base pressure coefficient of -1
SUCTION = math.sqrt(2.0)
# [-] of an outlet; assumed: that of a sharp edge
OUTFLOW = 0.6


def suction_limit(draft: ArrayLike, oil: OilOnWater, suction: float = SUCTION) -> Array:
    """Compute the speed at which the slick's front is sucked under the foot, sqrt(2 g' d) / k [m/s]; draft d (S,) [m]."""
    return np.asarray(np.sqrt(2.0 * oil.reduced_gravity * np.asarray(draft)) / suction)


def held_thickness(speed: ArrayLike, draft: ArrayLike, oil: OilOnWater, suction: float = SUCTION) -> Array:
    """Compute the thickness that a skirt holds, h_c = d - (k^2 - 1) h_f [m], 0 where suction takes it all.

    speed U (S,) [m/s]; draft d (S,) [m], from the waterline down to the foot.
    """
    return np.asarray(np.maximum(0.0, np.asarray(draft) - (suction**2 - 1.0) * front_thickness(speed, oil)))


def drainage_rate(speed: ArrayLike, thickness: ArrayLike, held: ArrayLike, depth: float, oil: OilOnWater) -> Array:
    """Compute the oil that drains, q = 0.6 min(h_b - h_c, d) max(sqrt(g' h), U) [m2/s per metre of boom], 0 while h_b <= h_c.

    speed U (S,) [m/s] of the water that goes under the foot; thickness h_b (S,) [m] at the boom, h its part above the foot; held h_c (S,)
    [m]; depth d [m] of the skirt.
    """
    deep = np.asarray(thickness)
    excess = np.clip(deep - np.asarray(held), 0.0, depth)
    return np.asarray(OUTFLOW * excess * np.maximum(np.sqrt(oil.reduced_gravity * np.minimum(deep, depth)), speed))


# [-] C_1, speed of first loss over that of growing waves; calibrated: 0.36 m/s with medium crude
ONSET_RATIO = 2.35
# [-] C_e; calibrated: the order of magnitude of losses above 1.1 kn
RATE = 0.03
# [-] Weber number of the largest drop; theory: Hinze 1955
WEBER = 12.0
# [-] mean size of drops, of the largest; assumed
MEAN_SIZE = 0.4
# [m2/s] kinematic viscosity of sea water at 15 C; measured
WATER_VISCOSITY = 1.19e-6
# [h_b] length of slick from which on its head wave is whole; assumed: the range of the slender profile
WHOLE_HEAD = 5.0


def onset_speed(oil: OilOnWater) -> float:
    """Compute the speed from which droplets are lost, U_e = C_1 U_KH [m/s]."""
    return ONSET_RATIO * droplet_onset_speed(oil.oil_density, oil.water_density, oil.interfacial_tension)


def largest_drop(speed: ArrayLike, oil: OilOnWater) -> Array:
    """Compute the diameter of the largest stable drop, 12 sigma / (rho_w U^2) [m]; speed U (S,) [m/s], above 0."""
    return np.asarray(WEBER * oil.interfacial_tension / (oil.water_density * np.square(speed)))


def rise_speed(diameter: ArrayLike, oil: OilOnWater) -> Array:
    """Compute the speed at which drops (S,) of a diameter D [m] rise [m/s]: w^2 = 4 g' D / (3 C_D).

    C_D = 24 / Re (1 + 0.15 Re^0.687), Re = w D / nu_w, of a rigid sphere up to Re = 800 (Schiller and Naumann 1933), and at least 0.44.
    """
    size = np.asarray(diameter, np.float64)
    rise = oil.reduced_gravity * size**2 / (18.0 * WATER_VISCOSITY)  # Stokes
    for _ in range(60):
        reynolds = np.maximum(rise * size / WATER_VISCOSITY, 1e-12)
        drag = np.maximum(24.0 / reynolds * (1.0 + 0.15 * reynolds**0.687), 0.44)
        rise = np.sqrt(rise * np.sqrt(4.0 * oil.reduced_gravity * size / (3.0 * drag)))
    return np.asarray(rise)


def escaping_share(speed: ArrayLike, held: ArrayLike, draft: ArrayLike, oil: OilOnWater) -> Array:
    """Compute the share of droplets that the slick does not catch again, phi = exp(-w L / (U (d - h_b))) [-].

    speed U (S,) [m/s], above 0; held V' (S,) [m2]; draft d (S,) [m] of the skirt as built: the depth over which droplets are spread. The
    draft of a leaning skirt would let fewer droplets out, which nobody has seen. Where the slick reaches the foot, all drops that
    rise at all are caught.
    """
    length = slick_length(speed, held, oil)
    water = np.maximum(np.asarray(draft) - boom_thickness(speed, held, oil), 1e-6)
    rise = rise_speed(MEAN_SIZE * largest_drop(speed, oil), oil)
    return np.asarray(np.exp(-rise * length / (np.asarray(speed) * water)))


def head_share(speed: ArrayLike, held: ArrayLike, depth: ArrayLike, oil: OilOnWater) -> Array:
    """Return how much of a head wave the slick has, min(1, L / (5 h_b)) (S,) [-]; a little oil has little head. Form assumed.

    speed U (S,) [m/s]; held V' (S,) [m2]; depth d (S,) [m] of the skirt: oil below its foot is not held up, so h_b counts as d at most,
    and the slick is V' / d long at least.
    """
    thickness = np.minimum(boom_thickness(speed, held, oil), depth)
    length = np.maximum(slick_length(speed, held, oil), np.asarray(held) / depth)
    whole = WHOLE_HEAD * thickness
    return np.asarray(np.minimum(1.0, np.divide(length, whole, out=np.zeros_like(length), where=whole > 0.0)))


def entrainment_rate(speed: ArrayLike, depth: ArrayLike, oil: OilOnWater) -> Array:
    """Compute the oil that is torn off, q = C_e (U - U_e) h_f [m2/s per metre of front], before recapture.

    speed U (S,) [m/s]; depth d (S,) [m] of the skirt, as which h_f counts at most.
    """
    excess = np.maximum(0.0, np.asarray(speed) - onset_speed(oil))
    return np.asarray(RATE * excess * np.minimum(front_thickness(speed, oil), depth))


UNDER_FOOT = (LossCause.ENTRAINMENT, LossCause.DRAINAGE, LossCause.CRITICAL_ACCUMULATION, LossCause.PLANING)
"""The causes by which oil passes under the skirt."""
OVER_TOP = (LossCause.SUBMERGENCE, LossCause.SPLASH_OVER)
"""The causes by which oil passes over the float."""
WAYS = (UNDER_FOOT, OVER_TOP)


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
    sunk: Flags


@dataclass(frozen=True, kw_only=True)
class Closures:
    """The closures of one boom: skirt_depth [m] as built, and what the particles resolve.

    resolution None: nothing is resolved, as in a calculation without particles. Raises ValueError for a skirt without depth.
    """

    skirt_depth: float = quantity("m", above=0.0)
    resolution: Resolution | None = None

    def __post_init__(self) -> None:
        require("closures of a boom", Closures, {"skirt_depth": self.skirt_depth})

    def rates(self, drivers: Drivers, oil: OilOnWater) -> Array:
        """Compute the losses by cause and segment (causes, S) [m2/s per metre of boom]."""
        result = np.zeros((len(LossCause), len(drivers.speed)))
        wet = (drivers.held > 0.0) & (drivers.speed > SLOWEST)
        speed, held = np.where(wet, drivers.speed, 1.0), np.where(wet, drivers.held, 0.0)
        depth = self.skirt_depth
        # a thin pool has less of a front than the formula of a long slick gives: share of it that is there
        share = np.where(wet, head_share(speed, held, depth, oil), 0.0)
        thickness = np.where(wet, boom_thickness(speed, held, oil), 0.0)
        resolved = self.resolution
        if oil.kinematic_viscosity <= VISCOUS_LIMIT and not (
            resolved and resolved.entrainment
        ):  # thicker oils form no droplets
            torn = entrainment_rate(speed, depth, oil) * escaping_share(speed, held, np.full_like(speed, depth), oil)
            result[LossCause.ENTRAINMENT] = share * torn
        if not (resolved and resolved.drainage):
            limit = held_thickness(speed, drivers.draft, oil)
            result[LossCause.DRAINAGE] = share * drainage_rate(speed, thickness, limit, depth, oil)
            result[LossCause.CRITICAL_ACCUMULATION] = share * accumulation_rate(
                speed, np.minimum(thickness, depth), oil
            )
        planes = drivers.lean > PLANING_ANGLE
        below = list(UNDER_FOOT)
        result[LossCause.PLANING, planes] = result[:, planes][below].sum(axis=0)
        for cause in below:
            if cause is not LossCause.PLANING:
                result[cause, planes] = 0.0
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


@dataclass(frozen=True, kw_only=True)
class PooledBoom:
    """A boom of a slick: the rows of its segments there, its closures, its pocket, and the rows of the segments that are in it."""

    rows: slice
    closures: Closures
    pocket: Pocket | None = None
    pocket_rows: slice | None = None


class SlickLosses:
    """The `LossRate` of a slick whose booms have closures."""

    def __init__(self, booms: Sequence[PooledBoom]) -> None:
        self._booms = tuple(booms)

    def __call__(self, pools: Pools) -> Mapping[LossCause, Array]:
        """Return the rates (P,) [m3/s] by which each pool loses oil, of every cause that acts."""
        total = np.zeros((len(LossCause), len(pools.volume)))
        for boom in self._booms:
            held = np.zeros(len(pools.volume), np.bool_)
            held[2 * boom.rows.start : 2 * boom.rows.stop] = True
            rows = np.flatnonzero(held & (pools.volume > 0.0))
            if len(rows):
                rates = boom.closures.rates(_drivers(pools, rows), _mean_oil(pools, rows))
                rates[np.array(UNDER_FOOT, np.int64)[:, None], np.flatnonzero(pools.is_sealed[rows])] = 0.0
                total[:, rows] = rates * pools.length[rows]
                if boom.pocket is not None and boom.pocket_rows is not None:
                    inside = slice(2 * boom.pocket_rows.start, 2 * boom.pocket_rows.stop)
                    _in_pocket(total, pools, boom.pocket, inside)
        return {cause: total[cause] for cause in LossCause if total[cause].any()}


def _in_pocket(total: Array, pools: Pools, pocket: Pocket, rows: slice) -> None:
    """Change the rates (causes, P) [m3/s] of a pocket's pools: nothing passes its cover, and what is too much drains out of it."""
    total[list(OVER_TOP), rows] = 0.0
    volume = pools.volume[rows]
    held = float(volume.sum())
    if held > 0.0:
        speed = float(np.average(pools.normal_speed[rows], weights=volume))
        total[LossCause.DRAINAGE, rows] += pocket.overflow(held, speed) * volume / held


def _drivers(pools: Pools, rows: Ints) -> Drivers:
    return Drivers(
        speed=pools.sustained_speed[rows],
        draft=pools.draft[rows],
        held=pools.volume_per_front[rows],
        lean=pools.lean[rows],
        freeboard=pools.freeboard[rows],
        sunk=pools.is_submerged[rows],
    )


def _mean_oil(pools: Pools, rows: Ints) -> OilOnWater:
    """Return the mean of the oil that these pools hold, weighted by volume; of the viscosity, the geometric mean."""
    weights = pools.volume[rows]
    density, tension = (
        float(np.average(values[rows], weights=weights)) for values in (pools.density, pools.interfacial_tension)
    )
    viscosity = float(np.exp(np.average(np.log(np.maximum(pools.viscosity[rows], 1e-9)), weights=weights)))
    return OilOnWater(
        oil_density=density,
        water_density=pools.water_density,
        kinematic_viscosity=viscosity / density,
        interfacial_tension=tension,
    )
