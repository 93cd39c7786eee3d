"""Drives: one or two screws with rudders, or azimuth thrusters, and the loss of one of them.

A screw gives up to T_0 (1 - J / J_0), T_0 its share of the bollard pull, J = u_a / (n D), u_a = (1 - w) u the inflow: an open-water
characteristic as a straight line, K_T = K_T0 (1 - J / J_0) with K_T0 = 0.44 P/D and J_0 = 1.1 P/D, near the Wageningen B-4.55 screws
for P/D of 0.6 to 1.2 (*modelled*). Its revolutions follow its thrust. Astern it gives half. A screw that stands still is not dragged.

A rudder stands in the slipstream, whose speed by momentum theory is u_j = sqrt(u_a^2 + 2 T / (rho A)):

    u_R^2 = eta (u_a + k (u_j - u_a))^2 + (1 - eta) u_a^2,   eta = D / height,  k = 0.6
    F_N = rho / 2 A_R (u_R^2 + v_R^2) 6.13 Lambda / (Lambda + 2.25) sin(alpha),   alpha = delta - atan(v_R / u_R)
    X = -(1 - t_R) F_N sin(delta),  Y = -(1 + a_H) F_N cos(delta),  N = -(x_R + a_H x_H) F_N cos(delta)

v_R = -gamma (v + 2 x_R r) is the cross flow, straightened by the hull. Source: Yasukawa and Yoshimura 2015, Introduction of MMG standard
method for ship maneuvering predictions, with their t_R, a_H and x_H of the KVLCC2, and Fujii's lift slope. An angle to port, which turns
the bow to port, is positive. The rudder turns at 5 degrees a second. Azimuth thrusters point anywhere at once.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass
from typing import NamedTuple

from oilsim.core.quantity import quantity, require

# [1] wake fraction, thrust at rest over pitch ratio, advance without thrust over pitch ratio; paper (van Lammeren et al. 1969, B-4.55)
WAKE, THRUST_AT_REST, FREE_ADVANCE = 0.2, 0.44, 1.1
# [1] slipstream at the rudder, loss of thrust, hull's share of the rudder's force and its place in lengths; paper (Yasukawa and
# Yoshimura 2015); KVLCC2
SLIPSTREAM, RUDDER_LOSS, HULL_SHARE, HULL_PLACE = 0.6, 0.387, 0.312, -0.464
# [1] flow straightening; paper (Yasukawa and Yoshimura 2015: 0.395 and 0.64 for the two sides); mean
STRAIGHTENING = 0.5
# [rad], [rad/s] largest rudder angle and its rate; paper (SOLAS II-1/29: 35 degrees, 65 degrees in 28 s; small vessels are faster)
HARD_OVER, RUDDER_RATE = math.radians(35.0), math.radians(5.0)
# [L] of screws and rudders from midships; layout
SCREWS, RUDDERS = -0.42, -0.48
# [m/s] speed from which a helmsman steers by rudder alone and leaves two screws even; numerical; walking pace
SLOW = 1.0
# [1] thrust astern over that ahead; the same as for machinery without a drive; numerical
ASTERN = 0.5


@dataclass(frozen=True, kw_only=True)
class Drive:
    """Screws with rudders, or azimuth thrusters; the bollard pull is that of all together, and falls with the speed (page "Vessels").

    count        1 or 2 screws
    diameter     [m] of a screw
    spacing      [m] between two screws
    pitch_ratio  P/D of the screws
    rudder_area  [m2] of all rudders; 0: azimuth thrusters, which swivel
    Raises ValueError for values that are not allowed, and for two screws that do not stand apart.
    """

    count: int = quantity("", default=2, at_least=1, at_most=2, whole=True)
    diameter: float = quantity("m", above=0.0, at_most=12.0)
    spacing: float = quantity("m", default=0.0, at_least=0.0)
    pitch_ratio: float = quantity("", default=0.8, at_least=0.6, at_most=1.2)
    rudder_area: float = quantity("m2", default=0.0, at_least=0.0)

    def __post_init__(self) -> None:
        require("drive", Drive, vars(self), self._problems())

    def _problems(self) -> Iterator[str]:
        if self.count == 2 and self.spacing < self.diameter:
            yield f"spacing is {self.spacing:g} m, allowed: diameter = {self.diameter:g} m or more with 2 screws"
        if self.count == 1 and self.spacing > 0.0:
            yield f"spacing is {self.spacing:g} m, allowed: only with count = 2"

    @property
    def swivels(self) -> bool:
        """True for azimuth thrusters."""
        return self.rudder_area == 0.0


class Through(NamedTuple):
    """Motion through the water: speed ahead and to port [m/s], rate of turn [rad/s]."""

    ahead: float
    to_port: float
    turn_rate: float


class Wanted(NamedTuple):
    """Thrust ahead [N] and yaw moment [N m] that a helmsman asks for."""

    thrust: float
    moment: float


class Push(NamedTuple):
    """Force ahead and to port [N] and yaw moment [N m]."""

    ahead: float
    to_port: float
    moment: float


class DriveModel:
    """A drive in its hull of `length` [m], with the bollard pull [N] of all screws together, in water of `density` [kg/m3]."""

    def __init__(self, drive: Drive, length: float, bollard_pull: float, density: float) -> None:
        self.drive, self._length, self._density = drive, length, density
        self._pull, self._hard_over = bollard_pull / drive.count, HARD_OVER
        at_rest = THRUST_AT_REST * drive.pitch_ratio * density * drive.diameter**4
        revolutions = math.sqrt(self._pull / at_rest)
        self.free_speed = FREE_ADVANCE * drive.pitch_ratio * revolutions * drive.diameter / (1.0 - WAKE)
        self._sides = (0.5 * drive.spacing, -0.5 * drive.spacing) if drive.count == 2 else (0.0,)

    def limited(self, angle: float) -> DriveModel:
        """Return the same drive with rudders that turn no farther than an angle [rad], as in a zig-zag trial."""
        other = copy(self)
        other._hard_over = angle
        return other

    def limits(self, ahead: float) -> tuple[float, float]:
        """Return the largest thrust astern and ahead [N] of one screw at a speed [m/s] ahead."""
        left = min(1.0, max(0.0, 1.0 - ahead / self.free_speed)) if self.free_speed > 0.0 else 0.0
        return -ASTERN * self._pull, self._pull * left

    def push(
        self,
        order: tuple[float, float],
        motion: tuple[float, float, float],
        rudder: float,
        step_size: float,
        running: tuple[bool, bool],
    ) -> tuple[Push, float]:
        """Return what the drive gives of what is wanted, and the rudder's angle [rad] at the end of the step [s].

        order: as `Wanted`; motion: as `Through`; rudder: its angle now; running: whether the port and the starboard screw run; a single
        screw is the first.
        """
        wanted, through, runs = Wanted(*order), Through(*motion), running[: self.drive.count]
        if self.drive.swivels:
            return self._swivelled(wanted, through, runs), 0.0
        thrusts = self._shared(wanted.thrust, through, runs)
        asked = self._rudder_for(wanted.moment, thrusts, through)
        change = RUDDER_RATE * step_size
        angle = rudder + min(max(asked - rudder, -change), change)
        steered = self._rudder_push(angle, thrusts, through)
        if self.drive.count == 2 and all(runs):
            thrusts = self._twisted(wanted.moment - steered.moment, thrusts, through)
            steered = self._rudder_push(angle, thrusts, through)
        return self._sum(thrusts, steered), angle

    def _shared(self, thrust: float, through: Through, runs: tuple[bool, ...]) -> tuple[float, ...]:
        """Share a thrust [N] between the screws that run."""
        low, high = self.limits(through.ahead)
        each = thrust / max(1, sum(runs))
        return tuple(min(max(each, low), high) if run else 0.0 for run in runs)

    def _twisted(self, moment: float, thrusts: tuple[float, ...], through: Through) -> tuple[float, ...]:
        """Let two screws differ in thrust to give a moment [N m] that the rudders cannot, the less the faster the vessel goes."""
        share = 1.0 - abs(through.ahead) / SLOW
        if share <= 0.0:
            return thrusts
        low, high = self.limits(through.ahead)
        half = share * moment / self.drive.spacing
        room = min(high - thrusts[1], thrusts[0] - low) if half > 0.0 else min(high - thrusts[0], thrusts[1] - low)
        part = math.copysign(min(abs(half), max(0.0, room)), half)
        return thrusts[0] - part, thrusts[1] + part

    def _sum(self, thrusts: tuple[float, ...], steered: Push) -> Push:
        turning = -sum(side * thrust for side, thrust in zip(self._sides, thrusts, strict=True))
        return Push(sum(thrusts) + steered.ahead, steered.to_port, turning + steered.moment)

    def _rudder_flow(self, thrusts: tuple[float, ...], through: Through) -> tuple[float, float]:
        """Return speed along and across the rudders [m/s], the latter to port, mean over them."""
        inflow, disc = max(0.0, (1.0 - WAKE) * through.ahead), 0.25 * math.pi * self.drive.diameter**2
        height = math.sqrt(1.5 * self.drive.rudder_area / self.drive.count)  # an aspect ratio of 1.5
        wash = min(1.0, self.drive.diameter / height)
        squares = []
        for thrust in thrusts:
            jet = math.sqrt(inflow**2 + 2.0 * max(0.0, thrust) / (self._density * disc))
            squares.append(wash * (inflow + SLIPSTREAM * (jet - inflow)) ** 2 + (1.0 - wash) * inflow**2)
        across = -STRAIGHTENING * (through.to_port + 2.0 * RUDDERS * self._length * through.turn_rate)
        return math.sqrt(sum(squares) / len(squares)), across

    def _rudder_push(self, angle: float, thrusts: tuple[float, ...], through: Through) -> Push:
        """Return the rudders' force at an angle [rad], positive to port: it pushes the stern to starboard and the bow to port."""
        along, across = self._rudder_flow(thrusts, through)
        if along == 0.0 and across == 0.0:
            return Push(0.0, 0.0, 0.0)
        slope = 6.13 * 1.5 / (1.5 + 2.25)
        lift = 0.5 * self._density * self.drive.rudder_area * (along**2 + across**2) * slope
        normal = lift * math.sin(angle - math.atan2(across, along))
        side = -(1.0 + HULL_SHARE) * normal * math.cos(angle)
        arm = (RUDDERS + HULL_SHARE * HULL_PLACE) * self._length
        return Push(-(1.0 - RUDDER_LOSS) * abs(normal * math.sin(angle)), side, -arm * normal * math.cos(angle))

    def _rudder_for(self, moment: float, thrusts: tuple[float, ...], through: Through) -> float:
        """Return the rudder angle [rad] for a moment [N m], by the slope at midships; hard over where there is no flow."""
        at_rest = self._rudder_push(0.0, thrusts, through).moment
        slope = (self._rudder_push(0.1, thrusts, through).moment - at_rest) / 0.1
        if slope <= 0.0:
            return 0.0
        return min(max((moment - at_rest) / slope, -self._hard_over), self._hard_over)

    def _swivelled(self, wanted: Wanted, through: Through, runs: tuple[bool, ...]) -> Push:
        """Point azimuth thrusters so that they give the moment first, and the thrust with what is left."""
        high, count = self.limits(max(0.0, through.ahead))[1], sum(runs)
        if count == 0:
            return Push(0.0, 0.0, 0.0)
        lost = -sum(side for side, run in zip(self._sides, runs, strict=True) if run) / count * wanted.thrust
        side = min(max((wanted.moment - lost) / (SCREWS * self._length), -count * high), count * high)
        room = math.sqrt(max(0.0, (count * high) ** 2 - side**2))
        ahead = min(max(wanted.thrust, -room), room)
        turning = -sum(at for at, run in zip(self._sides, runs, strict=True) if run) / count * ahead
        return Push(ahead, side, SCREWS * self._length * side + turning)
