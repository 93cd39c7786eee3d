"""What oil slicks on water, round or in a channel, have in common: how they begin, and how their spreading is followed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from oilsim import Fluid
from tests.validation.case import Bench
from tests.validation.scenes import OIL_DENSITY, WATER_DENSITY, position, set_velocity, velocity

Double = NDArray[np.float64]

REDUCED = 1.0 - OIL_DENSITY / WATER_DENSITY  # Delta
SHARE = 0.95  # of the oil within the distance that is read
ROUNDS, INSTANT = 20, 1e-5  # rounds in which the water comes to move with the oil, and their steps [s]


def launch(
    bench: Bench, fluid: Fluid, points: Double, thickness: Double, depth: float, strain: tuple[float, float]
) -> int:
    """Fill a tank's `points` (n, 3) [m] with water of `depth` [m] and a slick of `thickness` (n,) [m] afloat in it, in motion.

    The oil moves out from the origin at strain[0] x, strain[1] y [1/s] and up as its thickness shrinks, the water as it must. Returns the
    number of the oil's particles.
    """
    top = depth + REDUCED * thickness  # the freeboard of what floats
    oil = (points[:, 2] < top) & (points[:, 2] > top - thickness)
    fluid.add_particles(points[oil], phase="oil")
    fluid.add_particles(points[points[:, 2] < top - thickness], phase="water")
    for _ in range(ROUNDS):
        x, y, z = position(fluid)
        spreading = np.stack([strain[0] * x, strain[1] * y, (strain[0] + strain[1]) * (depth - z)])
        set_velocity(fluid, np.where(fluid.particles.phase == 0, spreading, velocity(fluid)))
        bench.advance(fluid, INSTANT)
        fluid.finish_step()
    return int(np.count_nonzero(oil))


def follow(
    bench: Bench,
    fluid: Fluid,
    size: Callable[[Fluid], float],
    ages: tuple[float, float],
    largest: float,
    reading: float,
) -> Double:
    """Age [s] and size [m] (2, n) every `reading` [s], from the first of `ages` to the last or until the size is `largest` [m]."""
    rows = [(ages[0], size(fluid))]
    while rows[-1][0] < ages[1] and rows[-1][1] < largest:
        bench.advance(fluid, reading)
        rows.append((rows[-1][0] + reading, size(fluid)))
    return np.array(rows).T
