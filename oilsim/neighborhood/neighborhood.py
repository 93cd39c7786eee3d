"""The argument that every kernel with a sum over neighbours takes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from oilsim.neighborhood.neighbor_search import Pairs


class Neighborhood(NamedTuple):
    """Places of the particles, lists of their neighbours, and the constants of the smoothing kernel.

    points (N, 4)         place x_i [m] and weight rho_ref / rho_0 [1] of the particles
    wall_points (M, 4)    place x_b [m] and volume V_b [m3; m2 in a plane] of the wall particles
    period                lengths [m] of the axes that repeat, 0 for the others; None if none repeats
    fluid, walls          lists of fluid and of wall neighbours (see `Pairs`)
    sigma, support        constant [1/m3; 1/m2 in a plane] and support radius H [m] of the kernel W
    volume                V, the volume of a particle at rest [m3; m2 in a plane]
    """

    points: NDArray[np.float32]
    wall_points: NDArray[np.float32]
    period: tuple[np.float32, np.float32, np.float32] | None
    fluid: Pairs
    walls: Pairs
    sigma: np.float32
    support: np.float32
    volume: np.float32
