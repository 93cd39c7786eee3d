"""The argument that every kernel with a sum over neighbours takes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from oilsim.neighborhood.neighbor_search import Pairs


class Neighborhood(NamedTuple):
    """Lists of the particles' neighbours, and the constants of the smoothing kernel.

    period          lengths [m] of the axes that repeat, 0 for the others; None if none repeats
    fluid, walls    lists of fluid and of wall neighbours (see `Pairs`)
    sigma, support  constant [1/m3; 1/m2 in a plane] and support radius H [m] of the kernel W
    volume          V, the volume of a particle at rest [m3; m2 in a plane]
    """

    period: tuple[np.float32, np.float32, np.float32] | None
    fluid: Pairs
    walls: Pairs
    sigma: np.float32
    support: np.float32
    volume: np.float32
