"""Numbers drawn from what a solver reports: the same code for every solver, and nothing here knows one.

A run is a list of `Sample`s, one a communication step; a measure turns it into one error, 0 for a perfect solver.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Double = NDArray[np.float64]

GRAVITY = 9.81
SHIFTS = np.linspace(-1.5, 1.5, 601)  # candidate shifts of the dimensionless time, 0.005 apart
REFERENCE = Path(__file__).parents[1] / "reference"


@dataclass(frozen=True, kw_only=True)
class Sample:
    """The liquid at one time [s]: position (N, 3) [m], velocity (N, 3) [m/s], z up.

    pressure     (K,) [Pa]  at the scene's probes
    body_height  [m]        of the floating body's centre of mass; NaN without one
    """

    time: float
    position: Double
    velocity: Double
    pressure: Double = field(default_factory=lambda: np.zeros(0))
    body_height: float = math.nan


def last(samples: Sequence[Sample], duration: float) -> list[Sample]:
    """The samples of the last `duration` [s]."""
    return [sample for sample in samples if sample.time > samples[-1].time - duration]


def pareto_front(points: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
    """The (cost, error) pairs that no other pair beats in both, by rising cost; pairs that are not finite are left out."""
    front: list[tuple[float, float]] = []
    for cost, error in sorted(point for point in points if all(math.isfinite(value) for value in point)):
        if not front or error < front[-1][1]:
            front.append((cost, error))
    return front


def pressure_error(samples: Sequence[Sample], expected: float) -> float:
    """|p / p_expected - 1| of the pressure [Pa], the mean over the last second and the probes."""
    return abs(float(np.mean([sample.pressure for sample in last(samples, 1.0)])) / expected - 1.0)


def rms_speed(samples: Sequence[Sample]) -> float:
    """Root mean square speed over particles and the last second [m/s]."""
    return math.sqrt(float(np.mean([(sample.velocity**2).sum(axis=1).mean() for sample in last(samples, 1.0)])))


def front_position(position: Double, spacing: float) -> float:
    """Largest x [m] of the liquid that runs along the bed: the first gap of two spacings ends it, so spray is not counted."""
    places = np.sort(position[:, 0])
    gaps = np.flatnonzero(np.diff(places) > 2.0 * spacing)
    return float(places[gaps[0]] if gaps.size else places[-1]) + 0.5 * spacing


def shifted_rms(time: Double, front: Double, reference_time: Double, reference_front: Double) -> tuple[float, float]:
    """Relative RMS difference of two front histories after the one time shift that makes it smallest, and that shift.

    sqrt(mean((z(T + s) / z_ref(T) - 1)^2)) over the reference's times T; all dimensionless. A shift that looks beyond the
    run is not tried; infinite where none is left.
    """
    best = (math.inf, math.nan)
    for shift in SHIFTS:
        wanted = reference_time + shift
        if wanted[-1] > time[-1]:
            break
        simulated = np.interp(wanted, time, front)  # before the release the front is where it starts
        error = math.sqrt(float(np.mean((simulated / reference_front - 1.0) ** 2)))
        best = min(best, (error, float(shift)))
    return best


def read_front(limit: float) -> tuple[Double, Double]:
    """Martin and Moyce (1952), a = 2.25 in, n^2 = 2: t sqrt(2 g / a) and front z / a, up to z / a = `limit`."""
    time, front = np.loadtxt(REFERENCE / "dam_break_martin_moyce_a2250.csv", delimiter=",").T
    return time[front <= limit], front[front <= limit]


def dam_front_error(samples: Sequence[Sample], width: float, spacing: float, limit: float) -> float:
    """RMS of the front of a column `width` [m] wide against Martin and Moyce, relative, after one time shift."""
    time = np.array([0.0] + [sample.time for sample in samples]) * math.sqrt(2.0 * GRAVITY / width)
    front = np.array([width] + [front_position(sample.position, spacing) for sample in samples]) / width
    return shifted_rms(time, front, *read_front(limit))[0]


def decay_rate(time: Double, amplitude: Double) -> float:
    """r [1/s] of amplitude = a exp(-r t), by least squares of its logarithm; NaN where an amplitude is not positive."""
    if not (amplitude > 0.0).all():
        return math.nan
    return -float(np.polyfit(time, np.log(amplitude), 1)[0])


def mode_viscosity(samples: Sequence[Sample], mode: Sequence[Double], wave_number_squared: float) -> float:
    """Kinematic viscosity [m2/s] from the decay exp(-nu k^2 t) of the velocity's share of a mode, one (N, 3) array a sample."""
    amplitude = np.array(
        [(sample.velocity * shape).sum() / (shape**2).sum() for sample, shape in zip(samples, mode, strict=True)]
    )
    return decay_rate(np.array([sample.time for sample in samples]), amplitude) / wave_number_squared


def surface_level(position: Double, spacing: float) -> float:
    """Height of a free surface [m]: half a spacing above the mean of the highest particles, one column of d x d each."""
    column = np.floor(position[:, :2] / spacing).astype(np.int64)
    _, inverse = np.unique(column, axis=0, return_inverse=True)
    highest = np.full(inverse.max() + 1, -np.inf)
    np.maximum.at(highest, inverse.ravel(), position[:, 2])
    # particles sit unevenly in the columns: those whose highest one lies a spacing low have none in the top layer
    return float(highest[highest > np.median(highest) - 0.75 * spacing].mean()) + 0.5 * spacing


def fit_pressure(position: Double, pressure: Double, points: Double, radius: float) -> Double:
    """Pressure (K,) [Pa] at points (K, 3): p_0 + b . (x_j - x) fitted to the particles within `radius` [m], nearer ones more."""
    result = np.zeros(len(points))
    for n, point in enumerate(points):
        offset = (position - point) / radius
        squared = (offset**2).sum(axis=1)
        near = squared < 1.0
        if near.sum() < 4:
            continue
        weight = 1.0 - squared[near]
        basis = np.column_stack([np.ones(near.sum()), offset[near]])
        result[n] = np.linalg.lstsq(basis * weight[:, None], pressure[near] * weight, rcond=None)[0][0]
    return result
