"""Checks of waves at gauges: height, and the share that comes back."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from coupling.testkit.history import Track
from coupling.testkit.sources import readings_of
from coupling.testkit.verdict import require_near
from oilsim.forcing import wave_number

Double = NDArray[np.float64]

MOST_ALIKE = (
    0.3  # of |sin k l|; Goda and Suzuki advise distances from 0.05 to 0.45 of a wave, whose sines are 0.31 and more
)


def assert_wave_height(
    source: object, gauge: str, expected: float, *, period: float, within: float, since: float = 0.0
) -> None:
    """Require that the regular wave at a gauge is `expected` [m] high, crest to trough, to `within` [m]; CheckFailed if not.

    The height is twice the amplitude of the harmonic of `period` [s] after `since` [s]. gauge: name of a series `probes/GAUGE`.
    """
    readings = readings_of(source)
    found = 2.0 * abs(harmonic(readings.one_series(f"probes/{gauge}"), period, since))
    require_near(f"wave height at gauge {gauge!r}", found, expected, within, "m", readings.context())


def assert_reflection(
    source: object,
    gauges: tuple[str, str],
    expected: float,
    *,
    apart: float,
    depth: float,
    period: float,
    within: float,
    since: float = 0.0,
) -> None:
    """Require that a share `expected` [1] of the height of a regular wave comes back, to `within` [1]; CheckFailed if not.

    gauges: two series `probes/GAUGE`, the second `apart` [m] further along the incident wave, in water of `depth` [m]. With the harmonics
    a_1, a_2 at both (Goda and Suzuki 1976), the incident wave is (a_2 - a_1 e^{i k l}) / (-2 i sin k l), the
    reflected one (a_2 - a_1 e^{-i k l}) / (2 i sin k l).
    Raises ValueError for gauges that are nearly a multiple of half a wave apart, which cannot tell the two waves apart.
    """
    readings = readings_of(source)
    first, second = (harmonic(readings.one_series(f"probes/{gauge}"), period, since) for gauge in gauges)
    phase = wave_number(period, depth) * apart
    if abs(math.sin(phase)) < MOST_ALIKE:
        raise ValueError(
            f"gauges are {apart:g} m apart, {phase / math.pi:.3g} half waves, allowed: well off whole ones"
        )
    incident = abs(second - first * np.exp(1j * phase))
    reflected = abs(second - first * np.exp(-1j * phase))
    found = reflected / incident
    require_near(
        f"reflected share of the wave at {gauges[0]!r}", float(found), expected, within, "", readings.context()
    )


def harmonic(track: Track, period: float, since: float) -> complex:
    """Return the amplitude a of Re(a e^{i w t}), w = 2 pi / period, by least squares with a mean; ValueError for less than a period."""
    chosen = track.time >= since - 1e-9
    time, value = track.time[chosen], track.value[chosen]
    seen = float(time[-1] - time[0]) if len(time) else 0.0
    if seen < 0.99 * period:
        raise ValueError(f"wave: {seen:.3g} s were seen after {since:g} s, allowed: a period, {period:g} s, or more")
    angle = 2.0 * math.pi / period * time
    basis = np.stack([np.cos(angle), -np.sin(angle), np.ones_like(angle)], axis=1)
    real, imaginary, _ = np.linalg.lstsq(basis, value, rcond=None)[0]
    return complex(real, imaginary)
