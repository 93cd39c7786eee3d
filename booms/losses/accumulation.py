"""Critical accumulation: oil too viscous for droplets slides under the skirt as a whole (closure, assumed).

Above 3000 cSt no droplets form. From a speed of 0.15 to 0.25 m/s on, the slick shortens, thickens and passes under the skirt (Delvigne
1989; Johnston and others 1993, after reviews). The limit used is min(U_e, 0.20 m/s). No rate is published: q = C_e (U - U_ca) h_b is
assumed, with the coefficient of entrainment and the thickness at the boom.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from booms.losses.entrainment import RATE, onset_speed
from booms.losses.liquids import OilOnWater
from booms.scores import VISCOUS_LIMIT

Array = NDArray[np.float64]

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
