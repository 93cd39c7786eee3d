"""Description of a regular wave train, and the check that such waves can be."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from oilsim.core.quantity import quantity, require
from oilsim.sea.dispersion_relation import (
    current_share,
    steepest_height,
    wave_number,
    wave_number_on_current,
)
from oilsim.sea.flows import Flow, SteadyFlow, heading
from oilsim.sea.wave_components import StillWater, WaveComponents

STRETCHINGS = ("wheeler", "none")
SEEN_FROM = ("water", "ground")


def chosen(name: str, value: object, allowed: tuple[str, ...]) -> Iterator[str]:
    """Yield a problem if a named choice is none of those allowed."""
    if value not in allowed:
        yield f"{name} is {value!r}, allowed: {', '.join(allowed)}"


def water_numbers(
    periods: np.ndarray,
    directions: np.ndarray,
    seen_from: str,
    water: StillWater,
    flow: Flow | None,
    shear_exponent: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Solve the dispersion relation: wave number [1/m], frequency seen from the water [rad/s], share of the current [-], each (M,).

    periods (M,) [s] and directions (M,) [rad]. Periods seen from the ground need a steady current: ValueError for another, and for
    waves that it blocks.
    """
    omega = 2.0 * np.pi / periods
    k = np.array([wave_number(period, water.depth, water.gravity) for period in periods.tolist()])
    if seen_from == "ground" and flow is not None:
        if not isinstance(flow, SteadyFlow):
            raise ValueError(
                "waves: seen_from is 'ground' on a current that changes with time, allowed: 'water', or a steady current"
            )
        u, v = flow.velocity(0.0)
        along = u * np.cos(directions) + v * np.sin(directions)
        k = wave_number_on_current(omega, k, along, water.depth, water.gravity, shear_exponent)
        omega = np.sqrt(water.gravity * k * np.tanh(k * water.depth))
    return k, omega, current_share(k, water.depth, shear_exponent)


@dataclass(frozen=True, kw_only=True)
class RegularWaves:
    """A regular wave train.

    height     [m] crest to trough
    period     [s] as seen from the water, which carries its waves along, or from the ground: `seen_from`
    direction  [rad] it runs to, counter-clockwise from +x
    phase      [rad] of the crest at the origin at time 0
    stretching "wheeler", or "none": the values at the still level hold above it
    Raises ValueError for values that are not allowed.
    """

    height: float = quantity("m", at_least=0.0)
    period: float = quantity("s", above=0.0)
    direction: float = quantity("rad", default=0.0)
    phase: float = quantity("rad", default=0.0)
    stretching: str = "wheeler"
    seen_from: str = "water"

    def __post_init__(self) -> None:
        require("waves", RegularWaves, vars(self), self._problems())

    def _problems(self) -> Iterator[str]:
        yield from chosen("stretching", self.stretching, STRETCHINGS)
        yield from chosen("seen_from", self.seen_from, SEEN_FROM)

    def components(self, water: StillWater, flow: Flow | None, shear_exponent: float) -> WaveComponents:
        """Return the wave as one component, each array (1,): [m], [1/m], [rad/s], [rad] as in `WaveComponents`.

        Raises ValueError for a wave that is too steep for the water.
        """
        periods, directions = np.array([self.period]), np.array([self.direction])
        k, sigma, share = water_numbers(periods, directions, self.seen_from, water, flow, shear_exponent)
        self._check_steepness(float(k[0]), water.depth)
        to_x, to_y = heading(self.direction)
        numbers = (0.5 * self.height, k[0], sigma[0], self.phase, to_x, to_y, share[0])
        return WaveComponents(*(np.array([number], np.float64) for number in numbers))

    def _check_steepness(self, k: float, depth: float) -> None:
        limit = steepest_height(k, depth)
        if not self.height < limit:
            raise ValueError(
                f"waves: height is {self.height:g} m, allowed: below {limit:.4g} m, where waves of {2.0 * math.pi / k:.4g} m break "
                f"in water of {depth:g} m (Miche 1944)"
            )
