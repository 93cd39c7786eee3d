"""Description of a regular wave train, and the check that such waves can be.

Wave number of linear waves on a current that may be sheared, the steepest wave that does not break, and its second harmonic.

Without a current, `wave_number` solves sigma^2 = g k tanh(k h). On a current the frequency seen from the ground is
omega = sigma + k . U. A sheared current U(z) carries a wave of number k by its mean with the weight cosh 2k(h + z) (Stewart and Joy 1974;
Kirby and Chen 1989, first order), written here as a share of the current at the surface.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from oilsim.core.physical_constants import GRAVITY
from oilsim.core.quantity import quantity, require
from oilsim.sea.flows import Flow, SteadyFlow, heading
from oilsim.sea.wave_components import StillWater, WaveComponents

Double = NDArray[np.float64]

# [1] points of the Gauss-Legendre rule over the depth; numerical; the share is exact to 1e-5 for exponents from 0 to 1
NODES, WEIGHTS = np.polynomial.legendre.leggauss(64)
# [1] steepest wave in deep water, height over length; paper (Miche 1944); 0.142
MICHE = 0.142
# [1] wave numbers over that in still water, among which an opposing current's is searched; numerical; deep water blocks at 4
SEARCHED = np.linspace(1.0, 6.0, 501)
# [1] steps of the bisection; numerical; each halves the interval
BISECTIONS = 60


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


def current_share(wave_number: Double, depth: float, shear_exponent: float) -> Double:
    """Compute the share of the surface current U_s that carries waves, (M,) [-], for a current U_s (1 + z / h)^n.

    share = 2k / sinh(2kh) integral over the depth of (1 + z / h)^n cosh 2k(h + z) dz (Stewart and Joy 1974, in finite depth).
    wave_number (M,) [1/m]; depth h [m]; shear_exponent n [-], where 0 is a uniform current with the share 1.
    """
    k = np.asarray(wave_number, np.float64)
    if shear_exponent == 0.0:
        return np.ones_like(k)
    reach = -np.expm1(-2.0 * k * depth)  # q = 1 - exp(2kz) runs from 0 at the surface to this at the bottom
    q = reach[..., None] * 0.5 * (NODES + 1.0)
    below = -np.log1p(-q) / (2.0 * k[..., None])
    height = np.maximum(1.0 - below / depth, 0.0)
    mirrored = 1.0 + np.exp(-4.0 * k[..., None] * depth * height)
    integral = (height**shear_exponent * mirrored * WEIGHTS).sum(-1) * 0.5 * reach
    return integral / -np.expm1(-4.0 * k * depth)


def wave_number_on_current(
    frequency: Double, still: Double, along: Double, depth: float, gravity: float, shear_exponent: float
) -> Double:
    """Solve omega = (g k tanh kh)^0.5 + k U share(k) for the wave number k (M,) [1/m], by bisection.

    frequency   omega (M,) [rad/s] as seen from the ground
    still       (M,) [1/m] wave number at this frequency in still water
    along       U (M,) [m/s] surface current along the direction of the waves; negative: against them
    Raises ValueError for waves that the current blocks.
    """

    def excess(k: Double, rows: slice | NDArray[np.int64] = slice(None)) -> Double:
        carried = k * along[rows] * current_share(k, depth, shear_exponent)
        return np.sqrt(gravity * k * np.tanh(k * depth)) + carried - frequency[rows]

    low, high = np.full_like(still, 1e-9) * still, still.copy()
    for row in np.flatnonzero(along < 0.0):
        k = still[row] * SEARCHED
        reached = np.flatnonzero(excess(k, np.full(k.size, row)) >= 0.0)
        if not reached.size:
            period = 2.0 * np.pi / frequency[row]
            raise ValueError(
                f"waves: a period of {period:.3g} s seen from the ground is blocked by an opposing current of {-along[row]:.3g} m/s, "
                "allowed: a longer period, or a weaker current"
            )
        low[row], high[row] = k[max(reached[0] - 1, 0)], k[reached[0]]
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        above = excess(middle) >= 0.0
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return 0.5 * (low + high)


def steepest_height(wave_number: float, depth: float) -> float:
    """Return the height crest to trough [m] at which a regular wave breaks: 0.142 L tanh(kh) (Miche 1944)."""
    return float(MICHE * 2.0 * np.pi / wave_number * np.tanh(wave_number * depth))


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
