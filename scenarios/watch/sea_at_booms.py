"""The sea at the booms: the rise of its surface, its current, and its edge, which a boom leaves or beyond which the sea repeats."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from coupling.bullet.rigid_body_world import RigidBodyWorld
from scenarios.schema.liquid import Tank

if TYPE_CHECKING:
    from oilsim.sea import Sea

Array = NDArray[np.float64]


def sides_passed(
    tank: Tank, places: NDArray[np.float64], slack: float, *, repeats: bool = True
) -> Iterator[tuple[str, str, bool]]:
    """Yield each side that some of the places (N, 2) [m] are beyond, what that means in words, and whether it ends the scoring.

    Places up to `slack` [m] beyond a side do not count: an end that is made fast there swings a little. repeats: whether the water repeats
    beyond the tank's periodic sides; a sea by formulas goes on there.
    """
    for place, axis, low, high in zip(places.T, "xy", tank.lower, tank.upper, strict=False):
        for side, way in ((f"-{axis}", low - place.min()), (f"+{axis}", place.max() - high)):
            if way > slack and axis in tank.periodic and repeats:
                text = f"sails past side {side} of the sea, which repeats every {high - low:g} m"
                yield side, f"{text}: from here on it may meet its own wake and oil that it has lost", False
            elif way > slack and side in tank.open:
                yield side, f"has left the simulated sea through its open side {side}: its scoring ends here", True


def rise_of(world: RigidBodyWorld, time: float) -> float:
    """Return the height [m] of the still water at `time` [s] above that at the start, by the tide of the sea that loads the bodies."""
    sea = _sea_of(world)
    return 0.0 if sea is None else sea.rise(time)


def current_of(world: RigidBodyWorld, level: float, time: float, driven: Array) -> Array:
    """Return the current (3,) [m/s] at a level [m] and a time [s]: of the sea that loads the bodies, else that which drives the liquid."""
    sea = _sea_of(world)
    return driven if sea is None else np.array([*sea.current([level], time)[0], 0.0])


def _sea_of(world: RigidBodyWorld) -> Sea | None:
    """Return the sea that loads the bodies of a world; None in a run of particles alone."""
    sea: Sea | None = getattr(world.environment, "sea", None)
    return sea
