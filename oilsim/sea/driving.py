"""The sea as it drives the particles of a tank: its waves and current in zones, its wind on the surface."""

from __future__ import annotations

import math
import operator
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from oilsim.core.physical_constants import AIR_DENSITY
from oilsim.core.quantity import quantity, require
from oilsim.forcing import ForcingView
from oilsim.sea.sea import Sea
from oilsim.sea.wind_stress import drag_coefficient

Double = NDArray[np.float64]
Real = NDArray[np.float32]
Vector = tuple[float, float, float]

# [1] |g_i| d from which a particle belongs to the surface; tuned; noise inside the water lies below
SURFACE = 0.1
# [s] within which lost shear comes back; numerical; a tenth of the time in which the particles' mixing takes it away
KEEPING = 1.0


@dataclass(frozen=True)
class Zone:
    """A box of the domain [m] in which velocities relax to those of a sea with a time constant [s]; ValueError for one that cannot.

    edge [m]: width of the rim at the sides across x and y in which the relaxation rises smoothly from nothing, sin^2; a graded zone, or
    sponge, reflects less. 0: it acts at once. waves: whether water follows the sea's waves too; else its swing is left alone.
    """

    lower: Vector = quantity("m")
    upper: Vector = quantity("m")
    relaxation_time: float = quantity("s", default=0.5, above=0.0)
    edge: float = quantity("m", default=0.0, at_least=0.0)
    waves: bool = True

    def __post_init__(self) -> None:
        require("zone", Zone, vars(self), self._problems())

    def _problems(self) -> Iterator[str]:
        if not np.shape(self.lower) == np.shape(self.upper) == (3,):
            yield f"lower is {self.lower}, upper {self.upper}, allowed: three numbers each"
        elif not all(map(operator.lt, self.lower, self.upper)):
            yield f"lower is {self.lower} m, allowed: below upper = {self.upper} m along every axis"

    def holds(self, position: Real) -> NDArray[np.bool_]:
        """Tell which particles (N,) are inside; position (3, N) [m]."""
        inside = np.ones(position.shape[1], bool)
        for axis in range(3):
            inside &= (position[axis] >= self.lower[axis]) & (position[axis] <= self.upper[axis])
        return inside

    def share(self, time_step: float, position: Real) -> np.float32 | Real:
        """Return the share of the difference that one step of `time_step` [s] takes away, 1 - exp(-dt / tau).

        In a zone with an edge it differs from particle to particle, (N,), with tau / sin^2(pi s / (2 edge)) at a way s from the nearest
        side; position (3, N) [m] of particles inside.
        """
        if self.edge == 0.0:
            return np.float32(-math.expm1(-time_step / self.relaxation_time))
        ways = [way for a in (0, 1) for way in (position[a] - self.lower[a], self.upper[a] - position[a])]
        depth = np.clip(np.min(ways, axis=0) / self.edge, 0.0, 1.0)
        strength = np.sin(0.5 * math.pi * depth) ** 2
        return np.asarray(-np.expm1(-time_step / self.relaxation_time * strength), dtype=np.float32)


class SeaForcing:
    """Lets a sea drive the particles of a tank, a `oilsim.forcing.Forcing`; `sea` may be replaced between advances.

    zones    dv/dt = (u - v) / tau with u the velocity of the sea's waves and current; the current alone leaves the vertical velocity free.
             A particle in several zones belongs to the first of them
    wind     dv = dt stress area / mass on surface particles that face up, stress = rho_air C_D |U - v| (U - v) [Pa] with U the wind, gusts
             included, and C_D of `oilsim.sea.wind_stress` for |U - v|. A particle carries the area 2 V |g_i|: |g_i| is the slope of the
             smoothed water indicator, half of whose jump lies within the water, so that areas of a column add up to its cross-section
    drift    the particles' own mixing would even out the shear of the wind's drift within a minute. Each step takes the share
             1 - exp(-dt / KEEPING) of what the liquid's shear lacks: du = share (1 - a) (s - mean s), with s the drift (2,) at each
             particle's depth and a = sum u (s - mean s) / sum (s - mean s)^2. It adds no momentum: the stress of the wind does that
    """

    def __init__(self, sea: Sea, *, spacing: float, zones: Sequence[Zone] = ()) -> None:
        """Take a sea, the spacing [m] of the particles, and the zones in which they follow its waves and current."""
        self.zones, self.spacing = tuple(zones), spacing
        self.sea = sea

    @property
    def sea(self) -> Sea:
        """The sea that drives the particles."""
        return self._sea

    @sea.setter
    def sea(self, sea: Sea) -> None:
        self._sea = sea
        self._stream = Sea(replace(sea.description, wind=None, langmuir=None))  # without the drift of the wind

    @property
    def acts(self) -> bool:
        """True if it may change a velocity: in zones, or by a wind."""
        return bool(self.zones) or self.sea.description.wind is not None

    @property
    def drives_water(self) -> bool:
        """True if the sea has waves or a current, which its zones follow."""
        return self.sea.description.waves is not None or self.sea.description.current is not None

    def stream(self, points: NDArray[Any], time: float) -> Double:
        """Return the velocity (N, 3) [m/s] of waves and current at points (N, 3) [m]."""
        return self._stream.velocity(points, time)

    def drift(self, height: NDArray[Any], time: float) -> Double:
        """Return the drift of the wind (N, 2) [m/s] at heights (N,) [m]; the uppermost layer of particles is the surface."""
        depth = self.sea.still_level(time) - 0.5 * self.spacing - np.asarray(height, np.float64)
        return self.sea.wind_drift(np.maximum(depth, 0.0), time)

    def apply(self, view: ForcingView) -> None:
        """Change the velocities in the zones, then those of the surface under the wind, and give back the shear that has been lost."""
        self._relax(view)
        if self.sea.description.wind is not None:
            self._drag(view)
            self._keep_shear(view)

    def _relax(self, view: ForcingView) -> None:
        free = np.ones(view.position.shape[1], bool)
        for zone in self.zones:
            chosen = np.flatnonzero(free & zone.holds(view.position))
            free[chosen] = False
            place = view.position[:, chosen]
            share = zone.share(view.time_step, place)
            if zone.waves and self.sea.description.waves is not None:
                target = self.stream(place.T, view.time)
            else:
                target = self.sea.current(place[2], view.time)
            for axis, speed in enumerate(target.T.astype(np.float32)):
                view.velocity[axis, chosen] += share * (speed - view.velocity[axis, chosen])

    def _drag(self, view: ForcingView) -> None:
        g = view.gradient_sum
        size = np.sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2])
        chosen = np.flatnonzero((size > SURFACE / self.spacing) & (g[2] < -0.5 * size))
        slip = self.sea.wind(view.position[:2, chosen].T, view.time) - view.velocity[:2, chosen].T
        speed = np.hypot(*slip.T)
        density = view.rest_density[view.phase[chosen]]
        rate = view.time_step * AIR_DENSITY * drag_coefficient(speed) * speed * 2.0 * size[chosen] / density
        for axis in (0, 1):
            view.velocity[axis, chosen] += (rate * slip[:, axis]).astype(np.float32)

    def _keep_shear(self, view: ForcingView) -> None:
        shear = self.drift(view.position[2], view.time)
        shear -= shear.mean(axis=0) if len(shear) else 0.0
        whole = float((shear * shear).sum())
        if whole == 0.0:
            return
        there = float((shear * view.velocity[:2].T).sum()) / whole
        change = -math.expm1(-view.time_step / KEEPING) * (1.0 - there) * shear
        for axis in (0, 1):
            view.velocity[axis] += change[:, axis].astype(np.float32)

    def save(self) -> dict[str, Any]:
        """Return nothing: the motion of a sea is a formula of the time."""
        return {}

    def restore(self, saved: dict[str, Any]) -> None:
        """Do nothing: there is nothing to restore."""
