"""The undisturbed motion of the sea, followed by its particles: where the water that was at q at rest is now.

    x = q + X(t) + D(q, t),     X = int U dt the way of the current at the surface,

    D = sum of (-a C sin theta along the wave, a S cos theta upwards),     C = cosh k(h + q_z) / sinh kh,  S = sinh k(h + q_z) / sinh kh

with theta = k . q - sigma t: the linear wave in Lagrange's variables. A regular wave in deep water is then Gerstner's (Lamb 1932, section
251), which fulfils the equations of motion whole, at any steepness: its pressure depends on q_z alone, as that of water at rest does. So
water at rest in q is the sea with its waves, and particles of a fluid that lives in q need to carry only what differs from it.

Three things are left out: in water of finite depth, the pressure beyond that of q_z, 2 rho g a sinh(-k q_z) / sinh 2kh cos theta; products
of the slope with what differs from the sea; and the Stokes drift, since every place has its mean at q + X.

The displacement of water by linear waves, as compiled sums over components (`oilsim.window.sea_motion` has the formula).

With theta = k . q - sigma t each component adds to D at the place at rest q, z being its height over the still level, at most 0,

    -a cosh k(h + z) / sinh kh sin theta     along the component
     a sinh k(h + z) / sinh kh cos theta     upwards.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numba import njit

from oilsim.backend.arrays import Array
from oilsim.backend.jit import ALLOCATING, inlined
from oilsim.backend.thread_team import Team
from oilsim.sea import Sea
from oilsim.sea.linear_waves import BLOCK, DEEP, exponential, linear_field, sine_cosine

# [1] numbers of a block for a point; layout; three of its place, three of its displacement
ROWS = 6
# the first number of each row: place, height over the still level, displacement
X, Y, Z, DX, DY, DZ = (BLOCK * row for row in range(ROWS))
# [1] repetitions that find q from x; numerical; each takes the error times the slope, 0.44 at most
REPETITIONS = 12


@njit(**ALLOCATING)
def sum_displacement(begin, end, rest, waves, phase, water, moved):
    """Sum D of the water at those from begin to end of the places `rest` (N, 3) [m] into `moved` (N, 3) [m].

    waves: WaveComponents; phase (M,) [rad] from `WaveComponents.phase_at`; water: StillWater.
    """
    block = np.empty(ROWS * BLOCK)
    for start in range(begin, end, BLOCK):
        size = min(BLOCK, end - start)
        for i in range(size):
            block[X + i], block[Y + i] = rest[start + i, 0], rest[start + i, 1]
            block[Z + i] = rest[start + i, 2] - water.level
        _displace(block, size, waves, phase, water.depth)
        for i in range(size):
            n = start + i
            moved[n, 0], moved[n, 1], moved[n, 2] = block[DX + i], block[DY + i], block[DZ + i]


@njit(**ALLOCATING)
def find_rest(begin, end, points, waves, phase, water, rest):
    """Find the places `rest` (N, 3) [m] of the water that is at those from begin to end of `points` (N, 3) [m]: q = x - D(q).

    waves: WaveComponents; phase (M,) [rad] from `WaveComponents.phase_at`; water: StillWater.
    """
    block = np.empty(ROWS * BLOCK)
    for start in range(begin, end, BLOCK):
        size = min(BLOCK, end - start)
        block[DX : DX + 3 * BLOCK] = 0.0
        for _ in range(REPETITIONS):
            _place(block, size, points, start, water.level)
            _displace(block, size, waves, phase, water.depth)
        _place(block, size, points, start, water.level)
        for i in range(size):
            n = start + i
            rest[n, 0], rest[n, 1], rest[n, 2] = block[X + i], block[Y + i], block[Z + i] + water.level


@inlined
def _place(block, size, points, start, level):
    """Set the places of a block (ROWS * BLOCK,) [m] to points (N, 3) [m] from `start` on less their displacement."""
    for i in range(size):
        block[X + i], block[Y + i] = points[start + i, 0] - block[DX + i], points[start + i, 1] - block[DY + i]
        block[Z + i] = points[start + i, 2] - level - block[DZ + i]


@inlined
def _displace(block, size, waves, phase, h):
    """Set the displacement rows of a block (ROWS * BLOCK,) [m]; h [m] depth, phase (M,) [rad]."""
    block[DX : DX + 3 * BLOCK] = 0.0
    for j in range(phase.shape[0]):
        k, to_x, to_y, shift = waves.wave_number[j], waves.toward_x[j], waves.toward_y[j], phase[j]
        k_x, k_y, twice = k * to_x, k * to_y, np.exp(-2.0 * k * h)
        scale, is_deep = waves.amplitude[j] / (1.0 - twice), k * h > DEEP
        for i in range(size):
            s, c = sine_cosine(k_x * block[X + i] + k_y * block[Y + i] - shift)
            fall = exponential(k * min(max(block[Z + i], -h), 0.0))
            down, up = scale * fall, 0.0 if is_deep else scale * twice / fall
            along = (down + up) * s
            block[DX + i] -= to_x * along
            block[DY + i] -= to_y * along
            block[DZ + i] += (down - up) * c


class SeaMotion:
    """Places at rest and in the moving sea. Points are (N, 3) [m], z up, time in s since the start of the run."""

    def __init__(self, sea: Sea, team: Team | None = None) -> None:
        """Follow a sea; the threads of a `team` share the work of many points."""
        self.sea, self._team = sea, team
        waves = sea.components
        depth = sea.description.depth
        self.farthest = float(
            (waves.amplitude / np.tanh(waves.wave_number * depth)).sum()
        )  # [m] that D may be along x or y, at most

    @property
    def is_still(self) -> bool:
        """True if the sea has no waves."""
        return self.sea.components.amplitude.size == 0

    def travel(self, time: float) -> Array:
        """Return the way X (3,) [m] of the surface current since time 0."""
        return np.append(self.sea.travel(time), 0.0)

    def displacement(self, rest: Array, time: float) -> Array:
        """Return D (N, 3) [m] of the water whose place at rest is `rest`."""
        return np.zeros(rest.shape) if self.is_still else self._swept(sum_displacement, rest, time)

    def velocity(self, rest: Array, time: float) -> Array:
        """Return the velocity (N, 3) [m/s] of the water whose place at rest is `rest`, the current included."""
        flow, waves = self.sea.description.surface_current, self.sea.components
        current = np.zeros(2) if flow is None else flow.velocity(time)
        carried = waves.wave_number * (waves.toward_x * current[0] + waves.toward_y * current[1])
        seen = (
            1.0 + (waves.share - 1.0) * carried / waves.frequency
        )  # a sheared current changes the frequency seen from the surface's
        orbital = linear_field(
            _rows(rest), waves._replace(amplitude=seen * waves.amplitude), self._phase(time), self.sea.description.water,
            wheeler=False, team=self._team,
        ).velocity  # fmt: skip
        return np.asarray(orbital + np.append(current, 0.0))

    def at_rest(self, points: Array, time: float) -> Array:
        """Return the places at rest (N, 3) [m] of the water that is at `points` now."""
        start = points - self.travel(time)
        return start if self.is_still else self._swept(find_rest, start, time)

    def in_sea(self, rest: Array, time: float) -> Array:
        """Return where the water of the places `rest` is now (N, 3) [m]."""
        return np.asarray(rest + self.travel(time) + self.displacement(rest, time))

    def _swept(self, kernel: Callable[..., None], points: Array, time: float) -> Array:
        """Return what a kernel of `wave_displacement` finds for points (N, 3) [m], on the threads of the team if there is one."""
        found, rows = np.empty((len(points), 3)), _rows(points)
        arguments = rows, self.sea.components, self._phase(time), self.sea.description.water, found
        if self._team is None:
            kernel(0, len(points), *arguments)
        else:
            self._team.run(kernel, len(points), *arguments)
        return found

    def _phase(self, time: float) -> Array:
        """Return the phases (M,) [rad] of the waves at places at rest, which the current carries."""
        own = self.sea.components
        # a sheared current carries waves by a share of what carries the places at rest
        return own._replace(share=own.share - 1.0).phase_at(time, self.travel(time)[:2])


def _rows(points: Array) -> Array:
    """Return points (N, 3) [m] as kernels take them."""
    return np.require(points.reshape(-1, 3), np.float64, requirements=["C", "W"])
