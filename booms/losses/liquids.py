"""The two liquids at a boom: their densities, the oil's viscosity, and the tension between them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

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
