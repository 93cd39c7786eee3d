"""Langmuir cells: rows along the wind into which the surface water converges, and with it what floats (Langmuir 1938; Leibovich 1983).

With y across the wind from the nearest row, the surface velocity is -V sin(2 pi y / spacing) across the wind and J cos(2 pi y / spacing)
along it. Cells form where the turbulent Langmuir number La = (u*_water / u_stokes)^0.5 is below about 0.5 (McWilliams et al. 1997) and the
wind blows with 3 m/s or more (Leibovich 1983). They are modelled: regular, of one spacing, fixed to the water, without end,
and along the mean wind, also where a table turns the wind.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from oilsim.core.quantity import quantity, require
from oilsim.sea.wind_stress import friction_speed

Double = NDArray[np.float64]

# [1] turbulent Langmuir number below which cells form; paper (McWilliams et al. 1997); about 0.3 in open seas, shear wins above 0.5
LARGEST_NUMBER = 0.5
# [m/s] weakest wind with cells; paper (Leibovich 1983); 3 m/s
WEAKEST_WIND = 3.0


def langmuir_number(wind_speed: float, stokes_drift: float, density: float) -> float:
    """Return the turbulent Langmuir number (u*_water / u_stokes)^0.5 [-]; infinite without a Stokes drift [m/s]."""
    return math.sqrt(friction_speed(wind_speed, density) / stokes_drift) if stokes_drift > 0.0 else math.inf


@dataclass(frozen=True, kw_only=True)
class LangmuirCells:
    """Rows of converging water.

    spacing      [m] between rows
    convergence  V over the wind speed [-]; about 1 % is observed for the downwelling of cells as deep as wide
    jet          J over the wind speed [-]: the rows drift so much faster than the mean
    seed         of the place of the rows
    Raises ValueError for values that are not allowed.
    """

    spacing: float = quantity("m", default=10.0, above=0.0)
    convergence: float = quantity("", default=0.01, at_least=0.0, at_most=0.1)
    jet: float = quantity("", default=0.01, at_least=0.0, at_most=0.1)
    seed: int = quantity("", default=1, at_least=0, whole=True)

    def __post_init__(self) -> None:
        require("langmuir cells", LangmuirCells, vars(self))

    def velocity(self, points: Double, to: Double, speed: float) -> Double:
        """Compute the surface velocity of the cells (N, 2) [m/s] at `points` (N, 2) [m], which move with the current.

        to (2,): unit vector along the wind, which gives the rows; speed [m/s] of the wind.
        """
        offset = np.random.default_rng(self.seed).uniform(0.0, self.spacing)
        across = points[:, 1] * to[0] - points[:, 0] * to[1] - offset
        angle = (2.0 * np.pi / self.spacing) * across
        sideways = -self.convergence * speed * np.sin(angle)
        ahead = self.jet * speed * np.cos(angle)
        return np.stack([ahead * to[0] - sideways * to[1], ahead * to[1] + sideways * to[0]], -1)
