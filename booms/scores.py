"""Scores by which boom crews are trained, each with its formula."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from oilsim.backend.arrays import Array
from oilsim.core.physical_constants import GRAVITY, KNOT, STANDARD_GRAVITY

TOW_BEGINS = 0.1 * KNOT  # [m/s] through the water; a slower boom only lies there, and oil moves in and out at its mouth
RULE_DENSITY = 1025.0  # [kg/m3] of sea water in the rule of thumb for the drag of a skirt
VISCOUS_LIMIT = 3000e-6  # [m2/s] above which oil forms no droplets and is lost as a whole, 3000 cSt (Delvigne 1989)
PLANING_ANGLE = math.radians(45.0)  # [rad] lean of a skirt from which it is said to plane; assumed


def skirt_drag_coefficient() -> float:
    """Compute Cd [-] of the skirt from the rule F = 26 A V^2 (kgf, m2, knots): 2 x 26 g0 / (1025 kn^2) = 1.88.

    Responders are taught this rule; g0 = 9.80665 m/s2, sea water of 1025 kg/m3.
    """
    return 2.0 * 26.0 * STANDARD_GRAVITY / (RULE_DENSITY * KNOT**2)


def catenary_parameter(boom_length: float, gap_ratio: float) -> float:
    """Solve for the parameter a [m] of a towed boom's catenary: L = 2 a sinh(gap / (2 a)), gap = gap_ratio L.

    It solves ln(sinh(u) / u) = -ln gap_ratio with u = gap / (2 a). Raises ValueError unless 0 < gap_ratio < 1.
    """
    if not 0.0 < gap_ratio < 1.0:
        raise ValueError(f"gap ratio {gap_ratio:g} is not allowed: it must lie between 0 and 1")
    from scipy.optimize import brentq  # a third of a second, for those who need it

    half = brentq(lambda u: math.log(math.sinh(u) / u) + math.log(gap_ratio), 1e-9, 700.0)
    return 0.5 * gap_ratio * boom_length / half


def tow_force(
    boom_length: float, gap_ratio: float, skirt_depth: float, speed: float, *, drag_coefficient: float, density: float
) -> tuple[float, float]:
    """Compute the tension at each end [N], and the drag [N] on both ends together, of a boom that is towed steadily.

    Drag acts normal to the skirt only, q = 0.5 rho Cd V^2. The tension is T = q d a everywhere, with a the catenary's parameter, and the
    tow feels 2 T sin(psi) with tan(psi) = L / (2 a). boom_length, skirt_depth [m], speed [m/s], density [kg/m3].
    """
    parameter = catenary_parameter(boom_length, gap_ratio)
    tension = 0.5 * density * drag_coefficient * speed**2 * skirt_depth * parameter
    slope = boom_length / (2.0 * parameter)
    return tension, 2.0 * tension * slope / math.hypot(1.0, slope)


def droplet_onset_speed(oil_density: float, water_density: float, interfacial_tension: float) -> float:
    """Compute the speed [m/s] of oil over water from which waves on their interface grow (Kelvin-Helmholtz, inviscid, deep).

    U^2 = 2 (rho_w + rho_o) / (rho_w rho_o) sqrt(sigma g (rho_w - rho_o)), sigma [N/m]; Lamb, Hydrodynamics, chapter IX. This loss is
    modelled, not resolved. Raises ValueError unless the oil is lighter than the water.
    """
    if not 0.0 < oil_density < water_density:
        raise ValueError(
            f"oil density {oil_density:g} kg/m3 is not allowed: it must be above 0 and below that of water, {water_density:g} kg/m3"
        )
    stiffness = math.sqrt(interfacial_tension * GRAVITY * (water_density - oil_density))
    return math.sqrt(2.0 * (water_density + oil_density) / (water_density * oil_density) * stiffness)


@dataclass
class TensionRecord:
    """Mean and peak of a tension [N]; each sample counts for the time [s] that it lasted."""

    peak: float = 0.0
    _impulse: float = 0.0
    _duration: float = 0.0

    def add(self, tension: float, duration: float) -> None:
        """Add a tension [N] that acted for `duration` [s]."""
        self.peak = max(self.peak, tension)
        self._impulse += tension * duration
        self._duration += duration

    @property
    def mean(self) -> float:
        """Mean tension [N], the impulse / the time; 0 before the first sample."""
        return self._impulse / self._duration if self._duration > 0.0 else 0.0


@dataclass(kw_only=True)
class HeldSpeed:
    """The speed at which water keeps running against each segment of a boom: the mean over the last `window` [s].

    A flow draws oil under a skirt only if it lasts. To carry oil from the surface past the foot, the water must advance by at least about
    the skirt's depth d. A shorter swing of the boom moves the same water to and fro and draws no oil under. The speed U that matters is
    therefore one that is held over d / U. In waves boom and water swing together: there it is held over a wave's period at least, so that
    the swing does not count as a speed through the water.
    """

    window: float
    _past: list[tuple[float, Array, Array]] = field(default_factory=list)

    @classmethod
    def at(cls, speed: float, skirt_depth: float, wave_period: float = 0.0) -> HeldSpeed:
        """Create the record with the window skirt_depth / speed: the time in which water at `speed` [m/s] passes that depth [m].

        wave_period [s]: the window is no shorter; 0 without waves.
        """
        return cls(window=max(skirt_depth / speed, wave_period))

    def add(self, time: float, flow: Array) -> Array:
        """Add a sample at `time` [s] of the flow (S,) [m/s] along each normal; return the speeds held (S,) [m/s], 0 at first."""
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
    """The tow speeds [m/s] of first loss and of gross loss in a run with rising speed; None until they happen, and then they stay.

    Both count from the tow's beginning, when the boom first goes through the water at `TOW_BEGINS`; oil that was lost before does not
    count. Losses are net: oil that is taken back is deducted.

    First loss: the net lost share of all oil taken in has stayed above `first_share` for `window` [s]; the speed is that at which it rose
    above. Gross loss comes after it: the mean net loss over `gross_window` [s] is more than the share `gross_rate` [1/s] of that oil,
    10 % a minute; the speed is the mean over that loss. Oil that comes back later withdraws neither. After ASTM F2084, in which
    observers judge by eye; trials call more than 10 % a minute catastrophic. The longer window sees it in pools of some 50 particles.
    """

    first_share: float = 0.005
    window: float = 5.0
    gross_rate: float = 0.1 / 60.0
    gross_window: float = 12.0
    first_loss: float | None = None
    gross_loss: float | None = None
    _lost_before: float | None = None  # [m3] when the tow began
    _above: tuple[float, float] | None = (
        None  # time [s] and tow speed [m/s] since which the lost share is above first_share
    )
    _past: list[tuple[float, float, float]] = field(default_factory=list)  # time, tow speed, net loss

    @property
    def begun(self) -> bool:
        """True once the tow has begun."""
        return self._lost_before is not None

    def add(self, time: float, tow_speed: float, lost: float, taken_in: float, parcel: float = 0.0) -> None:
        """Add a sample at `time` [s]: volume that has passed the boom and volume taken in so far [m3], at `tow_speed` [m/s].

        parcel [m3]: the most that passes at once. A gross loss is one without its last parcel too: one parcel alone is none.
        """
        if self._lost_before is None:
            if tow_speed < TOW_BEGINS:
                return
            self._lost_before = lost
        net = lost - self._lost_before
        self._add_first(time, tow_speed, net / taken_in if taken_in > 0.0 else 0.0)
        self._past.append((time, tow_speed, net))
        begin = time - self.gross_window * (1.0 - 1e-9)
        while self._past[1:] and self._past[1][0] <= begin:
            self._past.pop(0)
        if self._past[0][0] <= begin:
            self._add_gross(time, net, taken_in, parcel)

    def _add_first(self, time: float, tow_speed: float, share: float) -> None:
        if share <= self.first_share:
            self._above = None
        elif self.first_loss is None:
            self._above = self._above or (time, tow_speed)
            if time - self._above[0] >= self.window * (1.0 - 1e-9):
                self.first_loss = self._above[1]

    def _add_gross(self, time: float, net: float, taken_in: float, parcel: float) -> None:
        since, _, net_then = self._past[0]
        if self.first_loss is None or self.gross_loss is not None:
            return
        if net - parcel - net_then > self.gross_rate * taken_in * (time - since):
            self.gross_loss = self._speed_of_loss()

    def _speed_of_loss(self) -> float:
        """Return the mean tow speed [m/s] of the oil that was lost in the window."""
        _, speed, net = np.array(self._past).T
        return float(np.average(0.5 * (speed[1:] + speed[:-1]), weights=np.maximum(np.diff(net), 0.0)))
