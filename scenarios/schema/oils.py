"""A table of oils that a scenario may name: density and dynamic viscosity of fresh oil at a stated temperature.

The values are rounded laboratory values from the public-domain ADIOS oil library of NOAA (United States); the number is that of the
record. Most were measured by Environment Canada. An exercise may name an oil. A study of a real spill states its own oil's values in
the scenario file, because they differ from cargo to cargo and change with weathering.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

EXPANSION = 0.8  # [kg/m3 a degree]
VISCOSITY_SLOPE = 2100.0  # [K]
ZERO_CELSIUS = 273.15  # [K]
COLDEST, WARMEST = -2.0, 40.0  # [degrees C] of the sea


@dataclass(frozen=True, kw_only=True)
class Oil:
    """One oil: density [kg/m3] and dynamic viscosity [Pa s], both at `temperature` [degrees C], and their source."""

    density: float
    dynamic_viscosity: float
    description: str
    source: str
    temperature: float = 15.0

    def density_at(self, temperature: float) -> float:
        """Compute the density [kg/m3] at a temperature [degrees C]: it falls by 0.8 kg/m3 a degree.

        Crudes expand by 0.0007 to 0.0009 of their volume a degree.
        """
        return self.density - EXPANSION * (temperature - self.temperature)

    def viscosity_at(self, temperature: float) -> float:
        """Compute the dynamic viscosity [Pa s] at a temperature [degrees C]: nu = nu_0 exp(B (1 / T - 1 / T_0)), T absolute, B = 2100 K.

        B is the one that NOAA's adios_db takes for an oil that was measured at one temperature (`KinematicViscosity`).
        """
        kelvin = [degrees + ZERO_CELSIUS for degrees in (temperature, self.temperature)]
        thinner = math.exp(VISCOSITY_SLOPE * (1.0 / kelvin[0] - 1.0 / kelvin[1]))
        return self.dynamic_viscosity * thinner * self.density_at(temperature) / self.density


def _adios(record: str, density: float, dynamic_viscosity: float, description: str) -> Oil:
    source = f"ADIOS oil library, record {record}"
    return Oil(density=density, dynamic_viscosity=dynamic_viscosity, description=description, source=source)


OILS: Mapping[str, Oil] = MappingProxyType(
    {
        "gasoline": _adios("AD00466", 739.0, 6.0e-4, "motor gasoline"),
        "diesel": _adios("AD02084", 836.0, 4.0e-3, "diesel fuel"),
        "brent": _adios("AD00192", 835.0, 6.0e-3, "light North Sea crude"),
        "statfjord": _adios("AD01040", 835.0, 7.0e-3, "light North Sea crude"),
        "gullfaks": _adios("AD00515", 870.0, 1.3e-2, "medium North Sea crude"),
        "arabian-light": _adios("AD00051", 866.0, 1.4e-2, "light Gulf crude"),
        "alaska-north-slope": _adios("AD02574", 875.0, 1.54e-2, "medium Alaskan crude"),
        "arabian-medium": _adios("AD00059", 878.0, 2.9e-2, "medium Gulf crude"),
        "maya": _adios("AD00730", 926.0, 0.28, "heavy Mexican crude"),
        "heavy-fuel-300": _adios("AD02184", 986.0, 14.5, "intermediate fuel oil 300, a ship's bunker"),
        "bunker-c": _adios("AD02051", 983.0, 45.0, "heavy fuel oil number 6"),
        "boscan": _adios("AD02042", 993.0, 486.0, "extra-heavy Venezuelan crude"),
    }
)
