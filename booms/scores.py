"""Scores that boom crews train to, each with its formula."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.constants import g as STANDARD_GRAVITY
from scipy.constants import knot

from oilsim.physical_constants import GRAVITY

Array = NDArray[np.float64]

RULE_DENSITY = 1025.0  # [kg/m3] of sea water in the rule of thumb for the drag of a skirt


def encounter_rate(boom_length: float, gap_ratio: float, speed: float, slick_thickness: float) -> float:
    """Oil met a second [m3/s] by a boom swept through a slick: Q = L (gap / L) V h.

    boom_length [m], speed through the water [m/s], slick_thickness [m]. 200 m of boom at a gap ratio of 0.3 and 0.7
    knots meet 77.8 m3/h a millimetre of slick.
    """
    return boom_length * gap_ratio * speed * slick_thickness


def skirt_drag_coefficient() -> float:
    """Cd [-] of the rule F = 26 A V^2 (kgf, m2, knots) for the skirt: 2 x 26 g0 / (1025 kn^2) = 1.88.

    The rule is the one responders are taught; g0 = 9.80665 m/s2, sea water of 1025 kg/m3.
    """
    return 2.0 * 26.0 * STANDARD_GRAVITY / (RULE_DENSITY * knot**2)


def catenary_parameter(boom_length: float, gap_ratio: float) -> float:
    """Parameter a [m] of the catenary of a towed boom: L = 2 a sinh(gap / (2 a)), gap = gap_ratio L.

    By bisection of sinh(u) / u = 1 / gap_ratio, u = gap / (2 a).
    """
    if not 0.0 < gap_ratio < 1.0:
        raise ValueError(f"gap ratio {gap_ratio:g} must lie between 0 and 1")
    low, high = 1e-9, 700.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        if math.sinh(middle) / middle < 1.0 / gap_ratio:
            low = middle
        else:
            high = middle
    return gap_ratio * boom_length / (low + high)


def tow_force(
    boom_length: float, gap_ratio: float, skirt_depth: float, speed: float, *, drag_coefficient: float, density: float
) -> tuple[float, float]:
    """Tension at each end and drag on both ends together [N] of a boom that is towed steadily.

    Drag normal to the skirt only, q = 0.5 rho Cd V^2: T = q d a everywhere, a the catenary's parameter, and the tow
    feels 2 T sin(psi) with tan(psi) = L / (2 a).
    """
    parameter = catenary_parameter(boom_length, gap_ratio)
    tension = 0.5 * density * drag_coefficient * speed**2 * skirt_depth * parameter
    slope = boom_length / (2.0 * parameter)
    return tension, 2.0 * tension * slope / math.hypot(1.0, slope)


def droplet_onset_speed(oil_density: float, water_density: float, interfacial_tension: float) -> float:
    """Speed of oil over water [m/s] from which waves on their interface grow (Kelvin-Helmholtz, inviscid, deep).

    U^2 = 2 (rho_w + rho_o) / (rho_w rho_o) sqrt(sigma g (rho_w - rho_o)); sigma [N/m]. Modelled, not resolved.
    Lamb, Hydrodynamics, chapter IX.
    """
    if not 0.0 < oil_density < water_density:
        raise ValueError(f"oil density {oil_density:g} kg/m3 must lie between 0 and that of water, {water_density:g}")
    stiffness = math.sqrt(interfacial_tension * GRAVITY * (water_density - oil_density))
    return math.sqrt(2.0 * (water_density + oil_density) / (water_density * oil_density) * stiffness)


def drainage_speed(oil_density: float, water_density: float, depth: float, critical_froude: float = 0.5) -> float:
    """Tow speed [m/s] at which a boom stops holding oil by gravity: U = Fr sqrt(g (1 - rho_o / rho_w) d), Fr about 0.5.

    depth [m]: of the skirt. Densimetric Froude number of containment in flumes.
    """
    return critical_froude * math.sqrt(GRAVITY * (1.0 - oil_density / water_density) * depth)


@dataclass
class TensionRecord:
    """Mean and peak of a tension [N] over the samples taken, each weighted with the time [s] it stood for."""

    peak: float = 0.0
    _impulse: float = 0.0
    _duration: float = 0.0

    def add(self, tension: float, duration: float) -> None:
        """Take a tension that acted for `duration`."""
        self.peak = max(self.peak, tension)
        self._impulse += tension * duration
        self._duration += duration

    @property
    def mean(self) -> float:
        """Impulse / time; 0 before the first sample."""
        return self._impulse / self._duration if self._duration > 0.0 else 0.0


@dataclass(kw_only=True)
class HeldSpeed:
    """Speed at which water keeps running against each segment of a boom: the mean over the last `window` [s].

    Oil is drawn under a skirt by a flow that lasts: to get from the surface past the foot, water must come on by at least about
    the skirt's depth d. A wobble of the boom that is over before that moves the same water to and fro and draws nothing under.
    So the speed U that matters is one held over d / U.
    """

    window: float
    _past: list[tuple[float, Array, Array]] = field(default_factory=list)

    @classmethod
    def at(cls, speed: float, skirt_depth: float) -> HeldSpeed:
        """With the window skirt_depth / speed: the time in which water at `speed` [m/s] passes a skirt of that depth [m]."""
        return cls(window=skirt_depth / speed)

    def add(self, time: float, flow: Array) -> Array:
        """Sample at `time` [s] of the flow (S,) [m/s] along each segment's normal; returns what is held (S,), at first 0."""
        way = np.zeros_like(flow)
        if self._past:
            before, flow_before, way_before = self._past[-1]
            way = way_before + 0.5 * (time - before) * (flow_before + flow)
        self._past.append((time, flow, way))
        begin = time - self.window * (1.0 - 1e-9)
        while self._past[1:] and self._past[1][0] <= begin:
            self._past.pop(0)
        since, _, way_since = self._past[0]
        return np.abs(way - way_since) / (time - since) if since <= begin else np.zeros_like(way)


@dataclass(kw_only=True)
class LossSpeeds:
    """First-loss and gross-loss tow speed [m/s] of a run in which the speed is raised; None until they happen.

    First loss: the lost share of all oil taken in first exceeds `first_share`. Gross loss: over `window` [s], or from one
    sample to the next if they are farther apart, more than `gross_rate` of it is lost a second; a single particle that
    passes within a short step must not count as a torrent. After ASTM F2084, whose observers judge by eye.
    """

    first_share: float = 0.005
    gross_rate: float = 0.02
    window: float = 1.0
    first_loss: float | None = None
    gross_loss: float | None = None
    _past: list[tuple[float, float]] = field(default_factory=list)

    def add(self, time: float, tow_speed: float, lost: float, taken_in: float) -> None:
        """Sample at `time` [s]: volume lost so far and volume taken in so far [m3], recovered oil not deducted."""
        if taken_in > 0.0 and self.first_loss is None and lost / taken_in > self.first_share:
            self.first_loss = tow_speed
        begin = time - self.window * (1.0 - 1e-9)
        while len(self._past) > 1 and self._past[1][0] <= begin:
            self._past.pop(0)
        if taken_in > 0.0 and self.gross_loss is None and self._past and self._past[0][0] <= begin:
            before, lost_before = self._past[0]
            if (lost - lost_before) / (taken_in * (time - before)) > self.gross_rate:
                self.gross_loss = tow_speed
        self._past.append((time, lost))
