"""Added mass and wave damping of a floating section, per metre of its length.

A section of beam B and draft T that is half an ellipse, afloat in deep water (Newman 1977, Marine Hydrodynamics, sections 4.13 and 6.18):

    heave  a_33 = rho pi / 8 B^2   the limit of fast motion, where the surface has the pressure of air
    sway   a_22 = rho pi / 2 T^2   the limit of slow motion, where the surface acts as a wall; a plate has the same

Between these limits added mass depends on the frequency: that of a half-immersed cylinder in heave falls to 0.6 of the limit
about k B / 2 = 0.8. The limits are used at every frequency.

The waves that a section sends out take away energy. With A the height of the waves over that of the motion,
b_33 = rho g^2 A^2 / omega^3, and A = 2 sin(k B / 2) exp(-k T), k = omega^2 / g (Yamamoto, Fujino and Fukasawa 1980).
"""

from __future__ import annotations

import math

from oilsim.core.physical_constants import GRAVITY


def heave_added_mass(density: float, beam: float) -> float:
    """Return a_33 [kg/m] of a section of `beam` [m] in water of `density` [kg/m3]."""
    return density * math.pi / 8.0 * beam**2


def sway_added_mass(density: float, draft: float) -> float:
    """Return a_22 [kg/m] of a section of `draft` [m] in water of `density` [kg/m3]."""
    return density * math.pi / 2.0 * draft**2


def heave_wave_damping(density: float, beam: float, draft: float, frequency: float, gravity: float = GRAVITY) -> float:
    """Return b_33 [kg/s per m] of a section of `beam` and `draft` [m] that heaves at `frequency` [rad/s]; gravity [m/s2]."""
    wave_number = frequency**2 / gravity
    height = 2.0 * math.sin(min(0.5 * wave_number * beam, 0.5 * math.pi)) * math.exp(-wave_number * draft)
    return density * gravity**2 * height**2 / frequency**3
