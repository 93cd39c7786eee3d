"""Terminal speed of a single drop in still liquid, by its size and both liquids.

A small drop is a sphere: its Reynolds number Re follows from the Best number N = 4 rho drho g D^3 / (3 mu^2) (Clift, Grace and Weber
1978, table 5.3), and w = Re mu / (rho D). A large drop is flattened by its own rise, and w = sqrt(2) (sigma g drho / rho^2)^(1/4) whatever
its size (Ishii and Zuber 1979). The smaller of the two holds. A drop larger than the largest stable one would break into drops that rise
at the same speed. rho, mu: density and viscosity of the liquid around.
"""

from __future__ import annotations

import math

import numpy as np

# [1] limits of N, and factors of the powers of log10 N that give log10 Re; theory; Clift, Grace and Weber 1978, table 5.3
_LOGARITHMIC = (
    (73.0, 580.0, (-1.7095, 1.33438, -0.11591)),
    (580.0, 1.55e7, (-1.81391, 1.34671, -0.12427, 0.006344)),
    (1.55e7, 5e10, (5.33283, -1.21728, 0.19007, -0.007005)),
)
# [1] factors of the powers of N that give Re below the first of these limits; theory; the same table
_SMALL = (0.0, 1.0 / 24.0, -1.7569e-4, 6.9252e-7, -2.3027e-10)

# [Pa s] as which no viscosity counts; numerical; any drop of a millimetre then feels a constant drag coefficient
IDEAL = 1e-9


def sphere_reynolds(best: float) -> float:
    """Compute the Reynolds number [1] of a rigid sphere at its terminal speed from its Best number N [1], 0 or more.

    Beyond the range of the fit its drag coefficient stays.
    """
    if best < _LOGARITHMIC[0][0]:
        return float(np.polyval(_SMALL[::-1], best))
    covered = min(best, _LOGARITHMIC[-1][1])
    _, _, factors = next(row for row in _LOGARITHMIC if covered <= row[1])
    return 10.0 ** float(np.polyval(factors[::-1], math.log10(covered))) * math.sqrt(best / covered)


def terminal_speed(
    diameter: float, density: float, viscosity: float, difference: float, tension: float, gravity: float
) -> float:
    """Compute the terminal speed [m/s] of a drop.

    diameter [m] of the sphere of its volume; density [kg/m3] and viscosity [Pa s] of the liquid around, 0 if it is ideal; difference
    [kg/m3] of the densities, without sign; tension [N/m] between both; gravity [m/s2].
    """
    if difference <= 0.0 or gravity <= 0.0:
        return 0.0
    flattened = math.sqrt(2.0) * (tension * gravity * difference / density**2) ** 0.25
    viscosity = max(viscosity, IDEAL)
    best = 4.0 * density * difference * gravity * diameter**3 / (3.0 * viscosity**2)
    return min(sphere_reynolds(best) * viscosity / (density * diameter), flattened)


def hindered_exponent(reynolds: float) -> float:
    """Compute n of w (1 - c)^n [1], at which drops of a volume share c rise (Richardson and Zaki 1954); reynolds [1] of a single drop."""
    if reynolds < 1.0:
        return 4.65 if reynolds < 0.2 else 4.35 * reynolds**-0.03
    return max(4.45 * reynolds**-0.1, 2.39)
