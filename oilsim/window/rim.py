"""The rim of a window, in which what the particles carry beyond the sea comes to rest, so that it leaves and does not come back.

The box repeats, so its four sides are one zone between a box and its image. There dv/dt = -r s(x) v, with s = sin^2 rising from 0 at the
inner edge, a width W from the side, to 1 at the side. A disturbance leaves through the whole zone, 2 W wide, before it enters again at the
opposite side. Damped by r in the mean half as much as its velocity, a wave of group velocity c keeps exp(-r W / (2 c)) of its height. With

    r = PASSES sqrt(pi g / W),

PASSES times the frequency of the wave twice as long as W in deep water, c = sqrt(g W / pi) / 2, that is exp(-pi PASSES). Shorter waves
keep less.

A window inside an outer one comes to the motion V of the water there in place of rest: dv/dt = -r s(x) (v - V).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from oilsim.backend.arrays import Array, Real
from oilsim.forcing import ForcingView

# [1] r over the frequency of the wave twice as long as the rim is wide; theory; that wave keeps exp(-pi PASSES) of its height, 0.9 %
PASSES = 1.5


def share_kept(width: float, length: float) -> float:
    """Return the share [1] of its height that a wave of some `length` [m] keeps on its way through both zones, each of a `width` [m]."""
    return math.exp(-math.pi * PASSES * math.sqrt(2.0 * width / length))


class Rim:
    """Brings what moves beyond the sea to rest around a box of size (2,) [m] whose middle may be moved through the particles' domain.

    width W [m] of the zone along each side; gravity [m/s2]; along: the axes that have sides, (0,) in two dimensions; around: the motion V
    (N, 3) [m/s] of the water around at places at rest (N, 3) [m], by default none.
    """

    def __init__(
        self,
        size: tuple[float, float],
        width: float,
        gravity: float,
        along: tuple[int, ...] = (0, 1),
        around: Callable[[Array], Array] | None = None,
    ) -> None:
        self.size, self.width, self.along, self.gravity, self._around = size, width, along, gravity, around
        self.center = np.zeros(2)
        self.rate = PASSES * math.sqrt(math.pi * gravity / width)

    def inward(self, points: Array | Real) -> Array:
        """Return the way (N,) [m] from points (N, 2 or 3) [m] to the nearest side; it is 0 or more, as the box repeats."""
        ways = []
        for axis in self.along:
            period = self.size[axis]
            offset = points[:, axis] - self.center[axis]
            ways.append(0.5 * period - np.abs(offset - period * np.round(offset / period)))
        return np.min(ways, axis=0)

    def about_center(self, points: Array | Real) -> Array:
        """Return points (N, 3) [m] with each brought to its image nearest to the middle."""
        near = np.array(points, np.float64)
        for axis in self.along:
            offset = near[:, axis] - self.center[axis]
            near[:, axis] -= self.size[axis] * np.round(offset / self.size[axis])
        return near

    def apply(self, view: ForcingView) -> None:
        """Change the velocities in the rim by dv/dt = -r s (v - V).

        Gravity has acted on them in this step already, and is spared: it would be less in the rim than beside it.
        """
        inward = self.inward(view.position.T)
        chosen = np.flatnonzero(inward < self.width)
        strength = np.cos(0.5 * math.pi * inward[chosen] / self.width) ** 2
        loss = -np.expm1(-self.rate * view.time_step * strength).astype(np.float32)
        end = np.array([[0.0], [0.0], [-self.gravity * view.time_step]], np.float32)
        if self._around is not None:
            end = end + self._around(self.about_center(view.position[:, chosen].T)).T.astype(np.float32)
        view.velocity[:, chosen] -= loss * (view.velocity[:, chosen] - end)

    def save(self) -> dict[str, Any]:
        """Return where the middle is, for `restore`."""
        return {"center": self.center.copy()}

    def restore(self, saved: dict[str, Any]) -> None:
        """Restore the middle that `save` returned."""
        self.center = np.array(saved["center"])
