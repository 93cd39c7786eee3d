"""Density, viscosity and interfacial tension of an oil at a temperature, fresh or weathered.

Sources. Between measurements, density is linear in the temperature, and ln(viscosity) in 1 / T: nu = A exp(B / T), as in NOAA's adios_db
(`Density`, `KinematicViscosity`). Beyond them, both go on with the slope that fits all of them. Evaporation: rho = rho_0 (1 + C_d F) and
nu = nu_0 exp(C_v F), F the evaporated share of the mass (Mackay et al. 1980, EE-8; Buchanan and Hurford 1988). Emulsion: Mooney (1951),
nu = nu_0 exp(2.5 Y / (1 - 0.65 Y)), Y the share of water in the volume; densities mix by volume.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from oilsim.core.physical_constants import SEA_WATER_DENSITY

ZERO_CELSIUS = 273.15  # [K]
EXPANSION = 0.8  # [kg/m3 a degree] of an oil measured at one temperature; crudes expand by 0.0007 to 0.0009 a degree
STEEPEST_EXPANSION = 3.0  # [kg/m3 a degree] above which a line through two densities is a measuring error
API_TEMPERATURE = 15.56  # [degrees C] 60 F, at which API gravity is defined
WATER_AT_60F = 999.016  # [kg/m3] fresh water at 60 F (ASTM D1250)
DENSITY_GAIN = 0.18  # [-] C_d of an oil without weathered samples (Buchanan and Hurford 1988)
GAIN_OFFSET, GAIN_SLOPE = (
    27.1,
    -0.510,
)  # [-] C_v = offset + slope API, of oils without weathered samples; fit (Theil, Sen) to 115 others
GAINS = (1.0, 25.0)  # [-] the range of C_v that this fit covers
MOONEY_SLOPE = 2.5  # [-] Einstein's coefficient of a suspension of spheres
MOONEY_CROWDING = 0.65  # [-] self-crowding factor that Mackay et al. 1980 take for water in oil
MOST_WATER = 0.9  # [-] share of water of the wettest stable emulsions
MOST_EVAPORATED = 0.75  # [-] share up to which the laws of evaporation are used
SLOPE_OFFSET, SLOPE_GAIN = (
    14070.0,
    2130.0,
)  # [K] B = offset + gain log10(nu at 15 C), of oils measured once; fit to 652 others
SLOPES = (500.0, 16000.0)  # [K] the range of B that this fit covers
VISCOSITY_GAINS = (
    0.5,
    40.0,
)  # [-] of C_v from weathered samples; beyond, a sample or its share is wrong, and that of the fit is taken


@dataclass(frozen=True)
class Measurement:
    """A laboratory value: `quantity` "density" [kg/m3] or "viscosity" (kinematic) [m2/s] at `temperature` [K], `evaporated` by a share."""

    quantity: str
    temperature: float
    evaporated: float
    value: float


@dataclass(frozen=True, kw_only=True)
class OilRecord:
    """One oil of the library: its record and name, and its measurements; pour_point [K], interfacial_tension [N/m], api [degrees API].

    relatives: records of the same oil, by its name, that have weathered samples.
    """

    record: str
    name: str
    location: str
    product: str
    reference: str
    api: float | None
    pour_point: float | None
    interfacial_tension: float | None
    measurements: tuple[Measurement, ...]
    relatives: tuple[OilRecord, ...] = ()

    def density_at(self, temperature: float, *, evaporated: float = 0.0, water_content: float = 0.0) -> float:
        """Compute the density [kg/m3] at a temperature [degrees C], after evaporation of a share of its mass and uptake of water."""
        dry = self._fresh_density(temperature + ZERO_CELSIUS)
        if evaporated:
            dry *= 1.0 + self.density_gain * evaporated
        return (1.0 - water_content) * dry + water_content * SEA_WATER_DENSITY

    def kinematic_viscosity_at(
        self, temperature: float, *, evaporated: float = 0.0, water_content: float = 0.0
    ) -> float:
        """Compute the kinematic viscosity [m2/s] at a temperature [degrees C], after evaporation and uptake of water."""
        dynamic = self.viscosity_at(temperature, evaporated=evaporated, water_content=water_content)
        return dynamic / self.density_at(temperature, evaporated=evaporated, water_content=water_content)

    def viscosity_at(self, temperature: float, *, evaporated: float = 0.0, water_content: float = 0.0) -> float:
        """Compute the dynamic viscosity [Pa s] at a temperature [degrees C], after evaporation and uptake of water.

        Mooney's factor multiplies the dynamic viscosity of the oil between the drops.
        """
        dry = self._fresh_viscosity(temperature + ZERO_CELSIUS)
        if evaporated:
            dry *= math.exp(self.viscosity_gain * evaporated)
        return dry * self.density_at(temperature, evaporated=evaporated) * emulsion_factor(water_content)

    @property
    def gravity(self) -> float:
        """API gravity [degrees] of the fresh oil, stated or by its density at 60 F."""
        return api_gravity(self.density_at(API_TEMPERATURE)) if self.api is None else self.api

    @cached_property
    def viscosity_slope(self) -> float:
        """B [K] of nu = A exp(B / T), fitted to all measurements of the fresh oil; of one measurement, the library's usual B."""
        temperatures, values = self._means("viscosity")
        if len(temperatures) == 1:
            return usual_slope(math.log(values[0]), temperatures[0])
        return _slope(1.0 / temperatures, np.log(values))

    @cached_property
    def density_gain(self) -> float:
        """C_d [-] of rho = rho_0 (1 + C_d F), from weathered samples, else a typical one."""
        return self._of_samples("density") or DENSITY_GAIN

    @cached_property
    def viscosity_gain(self) -> float:
        """C_v [-] of nu = nu_0 exp(C_v F), from weathered samples, else the library's usual one for its API gravity."""
        return self._of_samples("viscosity") or self._usual_gain

    def _of_samples(self, quantity: str) -> float:
        """Gain [-] of a quantity by the record's weathered samples, else the median by those of its relatives; 0 without any."""
        gains = [one.own_gain(quantity) for one in self.relatives]
        measured = [gain for gain in gains if gain]
        return self.own_gain(quantity) or (float(np.median(measured)) if measured else 0.0)

    def own_gain(self, quantity: str) -> float:
        """Return the gain [-] of density or viscosity by the record's own weathered samples; 0 without any that can be."""
        points = self._weathered(quantity)
        if quantity == "density":
            return _slope_through_zero(
                [(p.evaporated, p.value / self._fresh_density(p.temperature) - 1.0) for p in points]
            )
        found = _slope_through_zero(
            [(p.evaporated, math.log(p.value / self._fresh_viscosity(p.temperature))) for p in points]
        )
        return found if VISCOSITY_GAINS[0] <= found <= VISCOSITY_GAINS[1] else 0.0

    @property
    def _usual_gain(self) -> float:
        """C_v [-] of oils of this gravity: heavy ones thicken faster."""
        return min(max(GAIN_OFFSET + GAIN_SLOPE * self.gravity, GAINS[0]), GAINS[1])

    def temperatures(self, quantity: str) -> tuple[float, ...]:
        """List the temperatures [degrees C] at which a quantity of the fresh oil was measured."""
        return tuple(round(kelvin - ZERO_CELSIUS, 1) for kelvin in self._means(quantity)[0].tolist())

    def _fresh_density(self, kelvin: float) -> float:
        """Density [kg/m3] of the fresh oil; without a measurement, by its API gravity."""
        temperatures, values = self._means("density")
        if not len(temperatures):
            assert self.api is not None, "an oil has a density or an API gravity"
            temperatures, values = np.array([API_TEMPERATURE + ZERO_CELSIUS]), np.array([api_density(self.api)])
        slope = _slope(temperatures, values) if len(temperatures) > 1 else -EXPANSION
        slope = slope if -STEEPEST_EXPANSION < slope < 0.0 else -EXPANSION
        return _along(kelvin, temperatures, values, slope)

    def _fresh_viscosity(self, kelvin: float) -> float:
        """Kinematic viscosity [m2/s] of the fresh oil."""
        temperatures, values = self._means("viscosity")
        if kelvin in temperatures:
            return float(values[temperatures == kelvin][0])
        places, logs = -1.0 / temperatures, np.log(values)
        return math.exp(_along(-1.0 / kelvin, places, logs, -self.viscosity_slope))

    def _means(self, quantity: str) -> tuple[np.ndarray, np.ndarray]:
        """Temperatures [K], ascending, and the mean of what was measured of the fresh oil at each."""
        points: dict[float, list[float]] = {}
        for point in self.measurements:
            if point.quantity == quantity and point.evaporated == 0.0:
                points.setdefault(point.temperature, []).append(point.value)
        ordered = sorted(points)
        return np.array(ordered), np.array([sum(points[key]) / len(points[key]) for key in ordered])

    def _weathered(self, quantity: str) -> list[Measurement]:
        return [point for point in self.measurements if point.quantity == quantity and point.evaporated > 0.0]


def usual_slope(log_viscosity: float, kelvin: float) -> float:
    """Compute B [K] of an oil from one viscosity, by B = b0 + b1 log10(nu_15), where nu_15 follows from nu by B itself."""
    difference = 1.0 / (15.0 + ZERO_CELSIUS) - 1.0 / kelvin
    slope = (SLOPE_OFFSET + SLOPE_GAIN * log_viscosity / math.log(10.0)) / (
        1.0 - SLOPE_GAIN * difference / math.log(10.0)
    )
    return min(max(slope, SLOPES[0]), SLOPES[1])


def emulsion_factor(water_content: float) -> float:
    """Compute by how much water drops thicken an oil: Mooney (1951), exp(2.5 Y / (1 - 0.65 Y)), Y the share of water in the volume."""
    return math.exp(MOONEY_SLOPE * water_content / (1.0 - MOONEY_CROWDING * water_content))


def api_density(api: float) -> float:
    """Turn an API gravity [degrees] into a density [kg/m3] at 60 F: 141.5 / (API + 131.5) times that of water."""
    return 141.5 / (api + 131.5) * WATER_AT_60F


def api_gravity(density: float) -> float:
    """Turn a density [kg/m3] at 60 F into an API gravity [degrees]."""
    return 141.5 * WATER_AT_60F / density - 131.5


def _slope(places: np.ndarray, values: np.ndarray) -> float:
    """Fit a straight line by least squares and return its slope."""
    apart = places - places.mean()
    return float((apart * (values - values.mean())).sum() / (apart**2).sum())


def _along(place: float, places: np.ndarray, values: np.ndarray, slope: float) -> float:
    """Interpolate between ascending places; beyond the first and the last, go on with a slope."""
    nearest = min(max(place, places[0]), places[-1])
    return float(np.interp(nearest, places, values)) + slope * (place - float(nearest))


def _slope_through_zero(points: Sequence[tuple[float, float]]) -> float:
    """Fit y = C x by least squares; 0 without points, or if the fit is not positive."""
    if not points:
        return 0.0
    return max(0.0, sum(x * y for x, y in points) / sum(x * x for x, _ in points))
