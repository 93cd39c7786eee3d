"""The two liquids at a boom: their densities, the oil's viscosity, and the tension between them.

The profile of a slick that a current presses against a boom (closure: a force balance, no thickness read from particles).

The water flows at U under oil at rest. At the slick's front, where the water stops, the surface rises by U^2 / (2 g). The oil's surface
stands as high, so that Delta h_f = U^2 / (2 g): the front is h_f thick. Behind it, the friction 0.5 rho_w C_f U^2 on the slick's underside
is carried by the force of a floating layer, 0.5 rho_o g' h^2 per metre of front. Hence, at the distance x behind the front,

    h^2 = h_f^2 + K x,    K = C_f (rho_w / rho_o) U^2 / g'  [m].

Range: slender slicks, longer than five times their thickness at the boom, in water deeper than five drafts, and below the onset of
entrainment. Sources: front in deep water by Bernoulli's law at the stagnation point; thickening by friction after Wilkinson, J. Hydraul.
Div. ASCE 99 (1973) 701. C_f falls along the slick and rises with the oil's viscosity and with waves on the interface.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from oilsim.backend.arrays import Array
from oilsim.core.physical_constants import GRAVITY
from oilsim.core.quantity import quantity, quantity_of, require
from oilsim.slick.oil import Oil

# [N/m] of fresh crude on sea water, if nothing else is given; assumed: measured values of crudes lie between 0.015 and 0.030
ASSUMED_TENSION = 0.020


@dataclass(frozen=True, kw_only=True)
class OilOnWater:
    """Oil that floats on water: densities [kg/m3], kinematic viscosity of the oil [m2/s], interfacial tension [N/m].

    Raises ValueError for values out of range and for oil that is not lighter than the water.
    """

    oil_density: float = quantity("kg/m3", above=0.0)
    water_density: float = quantity("kg/m3", above=0.0)
    kinematic_viscosity: float = quantity("m2/s", default=1e-5, at_least=0.0)
    interfacial_tension: float = quantity_of(Oil, "interfacial_tension", default=ASSUMED_TENSION)

    def __post_init__(self) -> None:
        problems = []
        if not self.oil_density < self.water_density:
            problems.append(f"oil_density is {self.oil_density:g} kg/m3, allowed: below {self.water_density:g} kg/m3")
        require("oil on water", OilOnWater, vars(self), problems)

    @property
    def density_difference(self) -> float:
        """Relative difference of the densities, Delta = (rho_w - rho_o) / rho_w [-]."""
        return 1.0 - self.oil_density / self.water_density

    @property
    def reduced_gravity(self) -> float:
        """Reduced gravity g' = g Delta [m/s2]."""
        return GRAVITY * self.density_difference


def mixed(oils: Sequence[OilOnWater], volumes: Sequence[float]) -> OilOnWater:
    """Return the mean of several oils on one water, weighted by their volumes [m3]; of the viscosity, the geometric mean.

    Raises ValueError if all volumes are 0.
    """
    total = math.fsum(volumes)
    if not total > 0.0:
        raise ValueError("oils: volumes are all 0, allowed: at least one above 0")
    shares = [volume / total for volume in volumes]

    def mean(values: Sequence[float]) -> float:
        return math.fsum(share * value for share, value in zip(shares, values, strict=True))

    least = 1e-9  # [m2/s], so that an inviscid oil has a logarithm
    return OilOnWater(
        oil_density=mean([oil.oil_density for oil in oils]),
        water_density=oils[0].water_density,
        kinematic_viscosity=math.exp(mean([math.log(max(oil.kinematic_viscosity, least)) for oil in oils])),
        interfacial_tension=mean([oil.interfacial_tension for oil in oils]),
    )


# [-] C_f of a slick's underside; assumed: evidence spans 0.003 to 0.016; a flat plate has 0.0036 at a Reynolds number of 3.5e6
FRICTION = 0.005


def front_thickness(speed: ArrayLike, oil: OilOnWater) -> Array:
    """Compute the thickness of a slick's front, h_f = U^2 / (2 g') [m]; speed U (S,) [m/s]."""
    return np.asarray(np.square(speed) / (2.0 * oil.reduced_gravity))


def thickening(speed: ArrayLike, oil: OilOnWater) -> Array:
    """Compute K = C_f (rho_w / rho_o) U^2 / g' [m], by which h^2 grows for each metre behind the front; speed U (S,) [m/s]."""
    ratio = oil.water_density / oil.oil_density
    return np.asarray(FRICTION * ratio * np.square(speed) / oil.reduced_gravity)


def boom_thickness(speed: ArrayLike, held: ArrayLike, oil: OilOnWater) -> Array:
    """Compute the thickness at the boom, h_b = (h_f^3 + 3/2 K V')^(1/3) [m].

    speed U (S,) [m/s]; held V' (S,) [m2], oil per metre of front: the integral of h over the slick is 2 (h_b^3 - h_f^3) / (3 K).
    """
    front = front_thickness(speed, oil)
    return np.asarray(np.cbrt(front**3 + 1.5 * thickening(speed, oil) * np.asarray(held)))


def slick_length(speed: ArrayLike, held: ArrayLike, oil: OilOnWater) -> Array:
    """Compute the length of the slick before the boom, L = (h_b^2 - h_f^2) / K [m]; 0 without flow or oil.

    speed U (S,) [m/s]; held V' (S,) [m2].
    """
    front, growth = front_thickness(speed, oil), thickening(speed, oil)
    rise = boom_thickness(speed, held, oil) ** 2 - front**2
    return np.asarray(np.divide(rise, growth, out=np.zeros_like(rise), where=growth > 0.0))
