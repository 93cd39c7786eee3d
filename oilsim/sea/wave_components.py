"""Sums of regular waves: the components that every wave field here is made of, and the still water that they run on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Double = NDArray[np.float64]


class StillWater(NamedTuple):
    """The water without waves: depth [m], height of its level [m], density [kg/m3], gravity [m/s2]."""

    depth: float
    level: float
    density: float
    gravity: float


class WaveComponents(NamedTuple):
    """Regular waves that add up to a sea, each (M,).

    amplitude a [m]; wave_number k [1/m]; frequency sigma [rad/s], as seen from the water; phase [rad] at the origin at time 0;
    toward_x, toward_y  unit vector along which a component runs
    share  of the surface current by which it is carried [-]
    """

    amplitude: Double
    wave_number: Double
    frequency: Double
    phase: Double
    toward_x: Double
    toward_y: Double
    share: Double

    def phase_at(self, time: float, travel: Double) -> Double:
        """Compute sigma t + k . share travel - phase (M,) [rad], reduced to one turn.

        The angle of a component at x is k . x less this. travel (2,) [m] is the way of the surface current since time 0.
        """
        carried = self.share * (self.toward_x * travel[0] + self.toward_y * travel[1])
        return np.remainder(self.frequency * time + self.wave_number * carried - self.phase, 2.0 * np.pi)

    def stokes_drift(self, depth: float, z: Double) -> Double:
        """Compute the Stokes drift (N, 2) [m/s] at the heights z (N,) [m] above the still level, 0 or below.

        It is the sum of a^2 sigma k cosh 2k(h + z) / (2 sinh^2 kh) along each component (Stokes 1847; Dean and Dalrymple 1991,
        sec. 10.2), in water of `depth` h [m]. It holds no more of a spectrum's tail than the components do.
        """
        z = np.asarray(z, np.float64)[..., None]
        k, once = self.wave_number, -np.expm1(-2.0 * self.wave_number * depth)
        profile = (np.exp(2.0 * k * z) + np.exp(-2.0 * k * (z + 2.0 * depth))) / once**2
        drift = self.amplitude**2 * self.frequency * k * profile
        return np.stack([(drift * self.toward_x).sum(-1), (drift * self.toward_y).sum(-1)], -1)


NO_WAVES = WaveComponents(*(np.zeros(0) for _ in WaveComponents._fields))
