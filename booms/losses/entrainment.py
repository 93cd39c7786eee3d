"""Entrainment: droplets that the water tears off a slick's head and carries under the skirt (closure).

Onset: waves grow on the interface from the Kelvin-Helmholtz speed on, 0.11 to 0.16 m/s; loss needs C_1 times that. C_1 = 2.35 gives
0.36 m/s (0.7 kn), at which crews are taught that booms begin to lose oil; evidence spans 2.0 to 3.3, 0.31 to 0.51 m/s.
Rate: q = C_e (U - U_e) h_f phi. C_e = 0.03 is uncertain within a decade; 10 % of a usual pool is lost in a minute at 1.1 kn, as
trials report.
Recapture: the largest drop that the flow does not break is 12 sigma / (rho_w U^2) (a Weber number of 12); the mean is 0.4 of it. It
rises at w (Schiller and Naumann 1933) into the slick above during L / U, from water as deep as the skirt below the slick:
phi = exp(-w L / (U (d - h_b))).
Range: oils thinner than 3000 cSt. Droplets do not scale with a Froude number: a small skirt is no model of a large one.
Sources: Lamb, Hydrodynamics, chapter IX; Miller, Lindenmuth, Lehr and Abrahams 1971; onset ratio, rate and phi are assumed forms.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from booms.losses.liquids import OilOnWater
from booms.losses.slick import boom_thickness, front_thickness, slick_length
from booms.scores import droplet_onset_speed

Array = NDArray[np.float64]

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
