"""The pools of oil before booms, and the interface of the closures that say how fast they lose it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, Protocol

import numpy as np

from oilsim.backend.arrays import Array, Flags, Ints
from oilsim.oil.fates import LossCause


class Pools(NamedTuple):
    """The oil ahead of P pools: pool 2 s lies left of segment s (from its start to its end), pool 2 s + 1 right of it.

    segment, side         (P,) the segment; 1 left, -1 right
    length, front         (P,) [m] of the segment, and of its projection across the flow
    normal_speed          (P,) [m/s] of the water towards the segment, relative to it; negative where it flows away
    speed                 (P,) [m/s] of the water relative to the segment
    draft                 (P,) [m] from the surface down to the skirt's foot
    lean                  (P,) [rad] of the skirt from the vertical
    freeboard             (P,) [m] of the top above the local surface, negative under it; infinite if nothing tells it
    is_submerged          (P,) whether the top lies below the still water; is_sealed (P,) whether the foot lies tight on the ground
    volume                (P,) [m3] held
    volume_per_front      (P,) [m2] held volume over `front`
    front_thickness       (P,) [m] of the oil at the pool's head; thickness (P,) [m] at the segment
    reach                 (P,) [m] from the segment to the pool's head
    density, viscosity, interfacial_tension  (P,) [kg/m3], [Pa s], [N/m] means of the held oil by volume; 0 without oil
    water_density         [kg/m3]
    sustained_speed       (P,) [m/s] of the water against the segment, a mean over the time in which it passes the draft; 0 or more
    """

    segment: Ints
    side: Ints
    length: Array
    front: Array
    normal_speed: Array
    speed: Array
    draft: Array
    lean: Array
    freeboard: Array
    is_submerged: Flags
    is_sealed: Flags
    volume: Array
    volume_per_front: Array
    front_thickness: Array
    thickness: Array
    reach: Array
    density: Array
    viscosity: Array
    interfacial_tension: Array
    water_density: float
    sustained_speed: Array


# [m/s] at which the water counts at least when the time d / U is asked for; numerical; no closure loses oil below it
SLOWEST = 0.2


def passed_share(sustained: Array, draft: Array | float, duration: float) -> Array:
    """Return the share (P,) [1] of a draft d [m] that the water passes in `duration` [s], 1 - exp(-dt U / d).

    sustained U (P,) [m/s]. By that share a mean over d / U follows what it is a mean of. U is the mean itself, since water that swings to
    and fro within a draft passes nothing.
    """
    return np.asarray(-np.expm1(-duration * np.maximum(np.abs(sustained), SLOWEST) / draft))


class LossRate(Protocol):
    """The closures of a boom: they say how fast each pool loses oil, by cause.

    A slick calls it once a step, with all pools, and those without oil have a volume of 0. It must be a function of its arguments alone,
    so that a restored slick repeats its steps.
    """

    def __call__(self, pools: Pools) -> Mapping[LossCause, Array]:
        """Return the rates (P,) [m3/s], 0 or more, of every cause that acts."""


def no_loss(pools: Pools) -> Mapping[LossCause, Array]:
    """Return no rate (P,) [m3/s] at all: the booms of a slick hold whatever meets them."""
    return {}
