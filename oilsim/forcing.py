"""Forces that drive the sea from outside: current, waves and wind. Each object changes the velocities of one time step.

A forcing has `apply(view)`; it changes `view.velocity` in place and reads the rest. Its own random state, if any, is part of
`save()` and `restore(saved)`, so that a run continued from a saved state is the same run.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from oilsim.core.physical_constants import AIR_DENSITY, GRAVITY
from oilsim.core.quantity import LimitedAttributes, Quantity, is_number, quantity, require

Real = NDArray[np.float32]
Vector = tuple[float, float, float]

# [1] component of a unit vector up to which it counts as 0; numerical; far above the rounding of sin(pi), 1e-16
ALONG = 1e-9


class ForcingView(NamedTuple):
    """The view that a forcing has of a time step.

    time, time_step [s]; position, velocity, gradient_sum g_i = sum V grad W (3, N) [m, m/s, 1/m]; phase (N,);
    rest_density per phase [kg/m3]; volume of a particle [m3].
    """

    time: float
    time_step: float
    position: Real
    velocity: Real
    phase: NDArray[np.uint8]
    gradient_sum: Real
    rest_density: NDArray[np.float64]
    volume: float


class Forcing(Protocol):
    """An object that changes the velocities once in each time step."""

    def apply(self, view: ForcingView) -> None:
        """Change view.velocity (3, N) [m/s] in place."""

    def save(self) -> dict[str, Any]:
        """Return what `restore` needs to continue exactly."""

    def restore(self, saved: dict[str, Any]) -> None:
        """Restore the state that `save` returned."""


def heading(direction: float) -> tuple[float, float]:
    """Return the unit vector (x, y) towards `direction` [rad from +x].

    It is exact along the axes, so that a run in the plane stays there: sin(pi) is 1e-16, not 0.
    """
    x, y = math.cos(direction), math.sin(direction)
    return (x if abs(x) > ALONG else 0.0, y if abs(y) > ALONG else 0.0)


@dataclass(frozen=True)
class Zone:
    """A box of the domain [m] in which velocities relax to a target with a time constant [s]; ValueError for one that cannot.

    edge [m]: width of the rim at the sides across x and y in which the relaxation rises smoothly from nothing, sin^2; a graded zone, or
    sponge, reflects less. 0: it acts at once.
    """

    lower: Vector = quantity("m")
    upper: Vector = quantity("m")
    relaxation_time: float = quantity("s", above=0.0)
    edge: float = quantity("m", default=0.0, at_least=0.0)

    def __post_init__(self) -> None:
        require("zone", Zone, vars(self), self._problems())

    def _problems(self) -> Iterator[str]:
        if not np.shape(self.lower) == np.shape(self.upper) == (3,):
            yield f"lower is {self.lower}, upper {self.upper}, allowed: three numbers each"
        elif not all(map(operator.lt, self.lower, self.upper)):
            yield f"lower is {self.lower} m, allowed: below upper = {self.upper} m along every axis"

    def members(self, position: Real) -> NDArray[np.int64]:
        """Return the indices (n,) of the particles inside; position (3, N) [m]."""
        inside = np.ones(position.shape[1], bool)
        for axis in range(3):
            inside &= (position[axis] >= self.lower[axis]) & (position[axis] <= self.upper[axis])
        return np.flatnonzero(inside)

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


class Current:
    """Relaxes the velocity in a zone to `velocity` [m/s]; the vertical component is left free.

    beside: a zone within it, None without one, in which something else keeps the current: waves that it carries, whose orbital motion it
    would brake. speed [m/s], direction [rad from +x]: those of its horizontal part. ValueError for a velocity that is not three finite
    numbers.
    """

    QUANTITIES: ClassVar[Mapping[str, Quantity]] = MappingProxyType(
        {"speed": Quantity(unit="m/s", at_least=0.0, at_most=20.0), "direction": Quantity(unit="rad")}
    )

    def __init__(self, velocity: Vector, zone: Zone, beside: Zone | None = None) -> None:
        self.velocity, self.zone, self.beside = velocity, zone, beside

    @property
    def velocity(self) -> Vector:
        """The present velocity (3,) [m/s]."""
        return self._velocity

    @velocity.setter
    def velocity(self, velocity: Vector) -> None:
        if np.shape(velocity) != (3,) or not all(is_number(number) and math.isfinite(number) for number in velocity):
            raise ValueError(f"current: velocity is {velocity} m/s, allowed: three finite numbers")
        require("current", Current, {"speed": round(math.hypot(*velocity[:2]), 9)})  # whose components are rounded
        self._velocity = velocity

    def apply(self, view: ForcingView) -> None:
        """Change the velocities inside the zone, and outside `beside`, by dv/dt = (u_current - v) / tau."""
        chosen = self.zone.members(view.position)
        if self.beside is not None:
            chosen = np.setdiff1d(chosen, self.beside.members(view.position), assume_unique=True)
        share = self.zone.share(view.time_step, view.position[:, chosen])
        for axis in (0, 1):
            view.velocity[axis, chosen] += share * (np.float32(self.velocity[axis]) - view.velocity[axis, chosen])

    def save(self) -> dict[str, Any]:
        """Return the present velocity of the current, for `restore`."""
        return {"velocity": tuple(self.velocity)}

    def restore(self, saved: dict[str, Any]) -> None:
        """Restore the velocity that `save` returned."""
        self.velocity = saved["velocity"]


def wave_number(period: float, depth: float, gravity: float = GRAVITY) -> float:
    """Solve the linear dispersion relation omega^2 = g k tanh(k h) (Airy waves) for k [1/m], by Newton's method.

    period [s]; depth h [m]; gravity g [m/s2].
    """
    omega = 2.0 * math.pi / period
    k = omega * omega / gravity / math.sqrt(math.tanh(omega * omega * depth / gravity))
    for _ in range(50):
        tanh = math.tanh(k * depth)
        change = (gravity * k * tanh - omega * omega) / (gravity * (tanh + k * depth * (1.0 - tanh * tanh)))
        k -= change
        if abs(change) < 1e-14 * k:
            break
    return k


class AiryWaves(LimitedAttributes):
    """Makes linear waves by relaxing velocities in a zone to the orbital velocities of Airy's theory.

    height crest to trough [m], period [s], direction [rad from +x], still water between bottom and level [m].
    The amplitude grows over the first period. A current `drift` [m/s] is added to the target and carries the waves. The period
    is that seen from the moving water: an observer at rest sees the frequency omega + k . drift (Doppler).
    Only the height and the drift may change: crests would jump by any other change. ValueError for that, and for waves that cannot be.
    """

    QUANTITIES: ClassVar[Mapping[str, Quantity]] = MappingProxyType(
        {
            "height": Quantity(unit="m", at_least=0.0),
            "period": Quantity(unit="s", above=0.0),
            "direction": Quantity(unit="rad"),
            "bottom": Quantity(unit="m"),
            "level": Quantity(unit="m"),
            "drift": Quantity(unit="m/s"),
            "gravity": Quantity(unit="m/s2", above=0.0),
        }
    )

    def __init__(
        self, *, height: float, period: float, direction: float, bottom: float, level: float, zone: Zone,
        drift: tuple[float, float] = (0.0, 0.0), gravity: float = GRAVITY,
    ) -> None:  # fmt: skip
        given = {
            "height": height, "period": period, "direction": direction, "bottom": bottom, "level": level, "drift": drift,
            "gravity": gravity,
        }  # fmt: skip
        require("waves", AiryWaves, given, self._problems(bottom, level, drift))
        self.height, self.period, self.direction = height, period, direction
        self.bottom, self.level, self.zone, self.drift = bottom, level, zone, drift
        self._carried = (0.0, 0.0)  # [m] by the current so far
        self.wave_number = wave_number(period, level - bottom, gravity)

    def __setattr__(self, name: str, value: Any) -> None:
        if name in ("period", "direction", "bottom", "level") and hasattr(self, name):
            raise ValueError(
                f"waves: {name} stays {getattr(self, name)} while they run, allowed to change: height, drift"
            )
        super().__setattr__(name, value)

    @staticmethod
    def _problems(bottom: float, level: float, drift: tuple[float, ...]) -> Iterator[str]:
        if np.shape(drift) != (2,):
            yield f"drift is {drift}, allowed: two numbers, in m/s"
        if not level > bottom:
            yield f"level is {level} m, allowed: above bottom = {bottom} m"

    def velocity(self, x: Real, y: Real, z: Real, time: float) -> tuple[NDArray[Any], NDArray[Any]]:
        """Return the speeds along the direction and upwards, (N,) each [m/s], at places x, y, z (N,) [m] and `time` [s].

        They are a omega cosh(k (z - bottom)) / sinh(k h) cos(theta) and a omega sinh(k (z - bottom)) / sinh(k h) sin(theta), computed by
        exponentials of the depth, which stay finite in water however deep.
        """
        k, omega = self.wave_number, 2.0 * math.pi / self.period
        depth = self.level - self.bottom
        amplitude = 0.5 * self.height * min(time / self.period, 1.0)
        to_x, to_y = heading(self.direction)
        theta = k * ((x - self._carried[0]) * to_x + (y - self._carried[1]) * to_y) - omega * time
        height = np.minimum(z, self.level + 0.5 * self.height) - self.bottom
        down, up = np.exp(k * (height - depth)), np.exp(-k * (height + depth))
        scale = amplitude * omega / -math.expm1(-2.0 * k * depth)
        return scale * (down + up) * np.cos(theta), scale * (down - up) * np.sin(theta)

    @property
    def surface_drift(self) -> float:
        """Stokes drift [m/s] at the surface: a^2 omega k cosh(2 k h) / (2 sinh(k h)^2), Stokes (1847)."""
        k, h = self.wave_number, self.level - self.bottom
        steepness = (0.5 * self.height) ** 2 * 2.0 * math.pi / self.period * k
        return steepness * 0.5 * (1.0 + math.exp(-4.0 * k * h)) / (0.5 * math.expm1(-2.0 * k * h) ** 2)

    def apply(self, view: ForcingView) -> None:
        """Move the waves with the current, then change the velocities inside the zone by dv/dt = (u_airy - v) / tau."""
        self._carried = (
            self._carried[0] + self.drift[0] * view.time_step, self._carried[1] + self.drift[1] * view.time_step,
        )  # fmt: skip
        chosen = self.zone.members(view.position)
        x, y, z = view.position[:, chosen]
        along, up = self.velocity(x, y, z, view.time)
        to_x, to_y = heading(self.direction)
        target = (along * to_x + self.drift[0], along * to_y + self.drift[1], up)
        share = self.zone.share(view.time_step, view.position[:, chosen])
        for axis, value in enumerate(target):
            view.velocity[axis, chosen] += share * (value - view.velocity[axis, chosen])

    def save(self) -> dict[str, Any]:
        """Return the present sea state and the way that the current has carried it, for `restore`."""
        return {"height": self.height, "drift": tuple(self.drift), "carried": self._carried}

    def restore(self, saved: dict[str, Any]) -> None:
        """Restore the sea state that `save` returned."""
        self.height, self.drift, self._carried = saved["height"], saved["drift"], saved["carried"]


class Wind(LimitedAttributes):
    """Wind stress on the free surface, with seeded gusts.

    stress = rho_air C_D |U - v| (U - v) [Pa] (horizontal), U = mean (1 + gust), and gust an Ornstein-Uhlenbeck process of
    standard deviation `gustiness` and correlation time `gust_time` [s], advanced exactly. A surface particle carries the area
    2 V |g_i|: |g_i| is the slope of the smoothed water indicator, half of whose jump lies within the water, so that the
    areas of a column add up to its cross-section.
    """

    QUANTITIES: ClassVar[Mapping[str, Quantity]] = MappingProxyType(
        {
            "speed": Quantity(unit="m/s", at_least=0.0, at_most=100.0),
            "direction": Quantity(unit="rad"),
            "spacing": Quantity(unit="m", above=0.0),
            "gustiness": Quantity(at_least=0.0, at_most=1.0),
            "gust_time": Quantity(unit="s", above=0.0),
            "drag_coefficient": Quantity(at_least=0.0),
        }
    )
    # [1] |g_i| d from which a particle belongs to the surface; tuned; noise inside the water lies below
    SURFACE = 0.1

    def __init__(
        self, *, speed: float, direction: float, spacing: float, seed: int, gustiness: float = 0.0, gust_time: float = 3.0,
        drag_coefficient: float = 1.3e-3,
    ) -> None:  # fmt: skip
        """Take the speed [m/s] at 10 m towards `direction` [rad from +x]; drag coefficient 1.3e-3 as at 5-10 m/s (Large & Pond 1981)."""
        given = {
            "speed": speed, "direction": direction, "spacing": spacing, "gustiness": gustiness, "gust_time": gust_time,
            "drag_coefficient": drag_coefficient,
        }  # fmt: skip
        require("wind", Wind, given)
        self.speed, self.direction, self.spacing = speed, direction, spacing
        self.gustiness, self.gust_time, self.drag_coefficient = gustiness, gust_time, drag_coefficient
        self._random = np.random.default_rng(seed)
        self.gust = 0.0

    def apply(self, view: ForcingView) -> None:
        """Advance the gust, then dv = dt stress area / mass on surface particles that face up."""
        if self.gustiness > 0.0:
            memory = math.exp(-view.time_step / self.gust_time)
            kick = self.gustiness * math.sqrt(1.0 - memory * memory)
            self.gust = memory * self.gust + kick * self._random.standard_normal()
        g = view.gradient_sum
        size = np.sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2])
        chosen = np.flatnonzero((size > self.SURFACE / self.spacing) & (g[2] < -0.5 * size))
        speed = self.speed * (1.0 + self.gust)
        to_x, to_y = heading(self.direction)
        u = speed * to_x - view.velocity[0, chosen]
        v = speed * to_y - view.velocity[1, chosen]
        density = view.rest_density[view.phase[chosen]]
        per_speed = AIR_DENSITY * self.drag_coefficient * np.hypot(u, v) * 2.0 * size[chosen] / density
        rate = view.time_step * per_speed
        view.velocity[0, chosen] += (rate * u).astype(np.float32)
        view.velocity[1, chosen] += (rate * v).astype(np.float32)

    def save(self) -> dict[str, Any]:
        """Return the mean wind, the gust and the state of the random generator, for `restore`."""
        return {
            "gust": self.gust,
            "speed": self.speed,
            "direction": self.direction,
            "random": self._random.bit_generator.state,
        }

    def restore(self, saved: dict[str, Any]) -> None:
        """Restore the wind that `save` returned."""
        self.gust, self.speed, self.direction = saved["gust"], saved["speed"], saved["direction"]
        self._random.bit_generator.state = saved["random"]
