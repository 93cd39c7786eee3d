"""Resistance of the waves that a hull makes, by the regression of Holtrop and Mennen for displacement hulls.

    R_w = c_1 rho g V exp(m_1 Fn^-0.9 + m_4 cos(lambda Fn^-2)),   Fn = u / sqrt(g L)

with coefficients of the main dimensions. Source: Holtrop and Mennen 1982, An approximate power prediction method, International
Shipbuilding Progress 29, 166; bulb and immersed transom are left out. Range: Fn below 0.4, prismatic coefficient 0.55 to 0.85,
length / beam 3.9 to 9.5, beam / draft 2.1 to 4. Outside it, the values are extrapolated; fuller forms are taken as those of the range's
end. Below Fn = 0.15 it is next to nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from oilsim.core.physical_constants import GRAVITY

# [1] fullest form that is taken; paper (Holtrop and Mennen 1982, range of the data); prismatic and waterplane coefficient
FULLEST, FULLEST_WATERPLANE = 0.85, 0.92
# [1] Froude number under which waves are left out; numerical; the exponent is under -11 there
SLOWEST = 0.1


@dataclass(frozen=True, kw_only=True)
class HullForm:
    """Main dimensions of a hull afloat.

    length, beam, draft [m] of the waterline; volume [m3] displaced; waterplane [m2]; midship: midship section area / (beam draft) [-].
    """

    length: float
    beam: float
    draft: float
    volume: float
    waterplane: float
    midship: float = 1.0

    @property
    def block(self) -> float:
        """Displaced volume over that of the box around it."""
        return self.volume / (self.length * self.beam * self.draft)

    @property
    def prismatic(self) -> float:
        """Prismatic coefficient, at most that of the regression's range."""
        return min(self.block / self.midship, FULLEST)


def entrance_angle(form: HullForm) -> float:
    """Return half the angle of entrance [degrees] of the waterline, by the regression of Holtrop and Mennen 1982."""
    length_beam, prismatic = form.length / form.beam, form.prismatic
    waterplane = min(form.waterplane / (form.length * form.beam), FULLEST_WATERPLANE)
    run = form.length * (1.0 - prismatic)
    exponent = -(length_beam**0.80856) * (1.0 - waterplane) ** 0.30484 * (1.0 - prismatic) ** 0.6367
    exponent *= (run / form.beam) ** 0.34574 * (100.0 * form.volume / form.length**3) ** 0.16302
    return 1.0 + 89.0 * math.exp(exponent)


def wave_resistance(form: HullForm, speed: float, density: float, entrance: float | None = None) -> float:
    """Return the resistance [N], 0 or more, at `speed` [m/s] in water of `density` [kg/m3].

    entrance [degrees] replaces the half angle of entrance of the regression.
    """
    froude = abs(speed) / math.sqrt(GRAVITY * form.length)
    if froude < SLOWEST:
        return 0.0
    half_angle = entrance_angle(form) if entrance is None else entrance
    slender, length_beam = form.beam / form.length, form.length / form.beam
    c7 = 0.229577 * slender**0.33333 if slender < 0.11 else slender if slender < 0.25 else 0.5 - 0.0625 * length_beam
    c1 = 2223105.0 * c7**3.78613 * (form.draft / form.beam) ** 1.07961 * (90.0 - half_angle) ** -1.37565
    prismatic, cube = form.prismatic, form.volume ** (1.0 / 3.0)
    c16 = (
        8.07981 * prismatic - 13.8673 * prismatic**2 + 6.984388 * prismatic**3
        if prismatic < 0.8
        else 1.73014 - 0.7067 * prismatic
    )
    m1 = 0.0140407 * form.length / form.draft - 1.75254 * cube / form.length - 4.79323 * slender - c16
    fineness = form.length**3 / form.volume
    c15 = -1.69385 if fineness < 512.0 else 0.0 if fineness > 1727.0 else -1.69385 + (form.length / cube - 8.0) / 2.36
    m4 = c15 * 0.4 * math.exp(-0.034 * froude**-3.29)
    wave = 1.446 * prismatic - (0.03 * length_beam if length_beam < 12.0 else 0.36)
    return c1 * form.volume * density * GRAVITY * math.exp(m1 * froude**-0.9 + m4 * math.cos(wave * froude**-2))
