"""A pipe that pours liquid into the run, layer by layer."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from oilsim.backend.arrays import Array, Index, Real
from oilsim.core.initial_conditions import cylinder
from oilsim.core.quantity import SHORTEST_DIRECTION, LimitedAttributes, Quantity, require

Vector = tuple[float, float, float]

# [d] way before the mouth over which the jet is held at its speed; tuned; not on record
HOLD = 3.0


class PipeEmitter(LimitedAttributes):
    """Pours `phase` out of a round pipe mouth at a constant speed.

    mouth [m], direction (made a unit vector), radius [m], speed [m/s], spacing d [m]; start [s] and volume [m3] bound it,
    volume None pours for ever. A layer of particles enters HOLD spacings before the mouth whenever the jet has moved one
    spacing, a rate of (particles of a layer) d^2 speed [m3/s]; on the way to the mouth these keep the jet's velocity.
    `speed` may be changed at any time; at 0 the pipe is shut where layers enter, and liquid in front of that is free to run out.
    ValueError for a pipe that cannot be.
    """

    QUANTITIES: ClassVar[Mapping[str, Quantity]] = MappingProxyType(
        {
            "mouth": Quantity(unit="m"),
            "direction": Quantity(),
            "radius": Quantity(unit="m", above=0.0),
            "speed": Quantity(unit="m/s", at_least=0.0, at_most=100.0),
            "spacing": Quantity(unit="m", above=0.0),
            "start": Quantity(unit="s", at_least=0.0),
            "volume": Quantity(unit="m3", above=0.0),
        }
    )

    def __init__(
        self, *, phase: str, mouth: Vector, direction: Vector, radius: float, speed: float, spacing: float,
        start: float = 0.0, volume: float | None = None,
    ) -> None:  # fmt: skip
        given = {
            "mouth": mouth, "direction": direction, "radius": radius, "speed": speed, "spacing": spacing, "start": start,
            "volume": volume,
        }  # fmt: skip
        require("pipe", PipeEmitter, given, self._problems(mouth, direction, radius, spacing))
        length = math.sqrt(sum(c * c for c in direction))
        self.phase, self.radius, self.speed, self.spacing, self.start = phase, radius, speed, spacing, start
        self.mouth = np.asarray(mouth, np.float64)
        self.direction = np.asarray(direction, np.float64) / length
        self._layer = cylinder(-HOLD * spacing * self.direction, self.direction, radius, spacing, spacing)
        self.particles_left = None if volume is None else round(volume / spacing**3)
        self._travelled = spacing
        self._inside = np.empty(0, np.uint32)  # ids of particles that have entered and not come out

    @staticmethod
    def _problems(mouth: Vector, direction: Vector, radius: float, spacing: float) -> Iterator[str]:
        if not np.shape(mouth) == np.shape(direction) == (3,):
            yield f"mouth is {mouth}, direction {direction}, allowed: three numbers each"
        elif math.hypot(*direction) < SHORTEST_DIRECTION:
            yield f"direction is {direction}, allowed: a direction, not all zero"
        if radius < 0.5 * spacing:
            yield f"radius is {radius:g} m, allowed: {0.5 * spacing:g} m or more, half the particle spacing"

    def is_running(self, time: float) -> bool:
        """Tell whether liquid moves through the pipe at `time` [s]: it is open, and its last layer has not left the mouth."""
        poured = self.particles_left == 0 and self._travelled > HOLD * self.spacing
        return time >= self.start and self.speed > 0.0 and not poured

    def emit(self, time: float, time_step: float) -> Array:
        """Return the positions (n, 3) [m] of the particles that have entered by `time` [s]; the jet goes on for `time_step` [s] then.

        They are where the jet has brought them by then, so that layers lie a spacing apart whatever the steps are.
        """
        if not self.is_running(time):
            return np.empty((0, 3))
        layers = []
        while self._travelled >= self.spacing and self.particles_left != 0:
            self._travelled -= self.spacing
            layer = self.mouth + self._layer + self._travelled * self.direction
            if self.particles_left is not None:
                layer = layer[: self.particles_left]
                self.particles_left -= len(layer)
            layers.append(layer)
        self._travelled += self.speed * time_step
        return np.concatenate(layers) if layers else np.empty((0, 3))

    @property
    def entrance(self) -> Array:
        """Positions (n, 3) [m] of a layer that enters, and of one at the mouth: between them the pipe needs room."""
        layer = self.mouth + self._layer
        return np.concatenate([layer, layer + HOLD * self.spacing * self.direction])

    @property
    def velocity(self) -> Array:
        """Velocity of the jet (3,) [m/s]."""
        return self.speed * self.direction

    def fill(self, ids: Index) -> None:
        """Add the particles of `ids` (n,), which have entered, to those held inside the pipe."""
        self._inside = np.concatenate([self._inside, ids])

    def hold(self, time: float, ids: Index, position: Real, velocity: Real) -> None:
        """Set the velocities of the particles that have entered a running pipe and are still inside to the jet's, in place.

        ids (N,), position (3, N) [m], velocity (3, N) [m/s]: all particles of the fluid, at `time` [s].

        Other particles there are left alone: the pipe is no wall, and water around a mouth that lies under water is not pumped.
        """
        if not self.is_running(time):
            self._inside = self._inside[:0]
            return
        direction = self.direction.astype(np.float32)
        own = np.flatnonzero(np.isin(ids, self._inside))
        relative = position[:, own] - self.mouth.astype(np.float32)[:, None]
        along = direction @ relative
        offset = relative - along * direction[:, None]
        inside = own[(along < 0.0) & (np.sqrt((offset**2).sum(axis=0)) < self.radius + self.spacing)]
        velocity[:, inside] = self.velocity.astype(np.float32)[:, None]
        self._inside = ids[inside]

    def save(self) -> dict[str, Any]:
        """Return the position of the jet and the ids of the particles inside, for `restore`."""
        return {
            "particles_left": self.particles_left, "travelled": self._travelled, "speed": self.speed, "inside": self._inside,
        }  # fmt: skip

    def restore(self, saved: dict[str, Any]) -> None:
        """Restore the jet that `save` returned."""
        self.particles_left, self._travelled, self.speed = saved["particles_left"], saved["travelled"], saved["speed"]
        self._inside = saved["inside"]
