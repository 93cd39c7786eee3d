"""Elastic lines between bodies: they pull when stretched and are slack otherwise; a winch may change their length.

With l the distance of the line's two end points, L its unstretched length, EA its axial stiffness [N] and tau the relaxation time of its
damping [s] (Kelvin-Voigt):

    T = max(0, EA / L (l - L + tau (dl/dt - dL/dt)))   while l > L, else 0.

A line has no mass. Where T passes its breaking load, it parts, and holds nothing from then on. A line that was loosened has one end
free and pulls on nothing, until it is made fast between its two points, wherever they are then. Two lines from one point are a bridle.
Mooring legs stand among the lines (`coupling.multibody`). The force of a line is computed anew in every sub-step of the rigid bodies,
whose length h is chosen for it. Symplectic Euler with damping is stable while (h^2 + 2 h tau) EA / L w < 4, with w the sum over both ends
of the speed along the line by unit impulse [1/kg].
Joints that resist a twist (`coupling.multibody.joint_twist`) are counted among the lines' pulls.
Lines that share bodies are stiffer together: there h^2 a + 2 h b < 4, with a the largest eigenvalue of sqrt(k_l k_m) w_lm, k = EA / L,
b the same with k tau for k, and w_lm the speed at which line l grows by unit impulse along m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from coupling.master.saved_fields import SavedFields
from coupling.multibody.joint_twist import Twists, longest_twist_step, twist_torques, twists_of
from coupling.multibody.mooring_leg import MooringLeg
from coupling.multibody.rotations import applied, places_of
from oilsim.backend.arrays import Array
from oilsim.backend.jit import njit
from oilsim.loads.load_model import add_force_at

STABLE = 2.0  # used instead of the limit 4, because joints and water around the bodies change w


@dataclass(eq=False)
class ElasticLine(SavedFields):
    """One elastic line.

    rows: of the two bodies; the second is -1 for the world. points: (2, 3) [m] of its ends, along each body's axes from its centre of mass
    (for the world, the point itself). stiffness: EA [N]; relaxation_time: tau [s]; length: L [m]; ordered_length [m]: at the end of the
    next advance; laid_length [m]: at the start; tension [N]: mean over the last advance; breaking_load [N]: tension beyond which it parts.
    Raises ValueError for values that are not above 0.
    """

    STATE = ("length", "ordered_length", "tension", "parted", "made_fast")

    rows: tuple[int, int]
    points: Array
    stiffness: float
    relaxation_time: float
    length: float
    ordered_length: float = field(init=False)
    laid_length: float = field(init=False)
    tension: float = 0.0
    breaking_load: float = math.inf
    parted: bool = False
    made_fast: bool = True
    loosened: bool = False  # at its laying
    _last_pull: float = 0.0  # tension [N] that `pull` gave last

    def __post_init__(self) -> None:
        for name in ("stiffness", "length", "breaking_load"):
            if not ((math.isfinite(getattr(self, name)) or name == "breaking_load") and getattr(self, name) > 0.0):
                raise ValueError(f"{name} is {getattr(self, name)}, allowed: above 0")
        self.ordered_length = self.laid_length = self.length

    def pull(self, pose: Array, twist: Array, payout_rate: float) -> tuple[float, Array]:
        """Return the tension [N] and the wrenches (2, 6) [N, N m] on the bodies; pose (B, 7), twist (B, 6), payout_rate dL/dt [m/s]."""
        if not self.holds:
            return 0.0, np.zeros((2, 6))
        terms = (float(self.length), float(self.stiffness), float(self.relaxation_time), float(payout_rate))
        self._last_pull, wrenches = _pull(self.rows, self.points, terms, pose, twist)
        return self._last_pull, wrenches

    def settle(self) -> None:
        """Let the line part if what it pulled last is beyond its breaking load."""
        self.parted = self.parted or self._last_pull > self.breaking_load

    def stretching(self, pose: Array) -> Array:
        """Return the row (1, B, 6) [-] with which twists of the bodies lengthen the line, dl/dt = sum of row times twist."""
        total = np.zeros((1, len(pose), 6))
        if self.holds:
            _add_stretching(self.rows, self.points, pose, total[0])
        return total

    @property
    def holds(self) -> bool:
        """True if both ends are fast, and the line has not parted."""
        return self.made_fast and not self.parted

    def distance(self, pose: Array) -> float:
        """Return the distance [m] of the two points that the line is, or is to be, made fast to; pose (B, 7)."""
        position, _ = places_of(self.rows, self.points, pose)
        return float(np.linalg.norm(position[1] - position[0]))

    def spring(self, pose: Array) -> float:
        """Return the stiffness [N/m] of the taut line, however its bodies are placed."""
        return self.stiffness / min(self.length, self.ordered_length)

    def pay_out(self, length: float) -> None:
        """Take the unstretched length [m]."""
        self.length = length


Line = ElasticLine | MooringLeg


def stiffest(line: Line, pose: Array, inverse_masses: Array, sub_step: float) -> float:
    """Return the largest EA [N] that is stable in sub-steps of that length [s]; pose (B, 7), inverse_masses (B, 6, 6)."""
    compliance = max(float((row * applied(inverse_masses, row)).sum()) for row in line.stretching(pose))
    if compliance == 0.0:
        return math.inf
    return STABLE * line.length / (compliance * (sub_step**2 + 2.0 * sub_step * line.relaxation_time))


class _Pulls(NamedTuple):
    """The pull of lines, tensions [N] and wrenches (B, 6) [N, N m], at poses (B, 7), twists (B, 6) and rates of paying out [m/s]."""

    pose: Array
    twist: Array
    rates: list[float]
    tensions: list[float]
    wrenches: Array

    def is_of(self, pose: Array, twist: Array, rates: list[float]) -> bool:
        """Tell whether it is the pull at these poses (B, 7), twists (B, 6) and rates [m/s]."""
        return rates == self.rates and np.array_equal(pose, self.pose) and np.array_equal(twist, self.twist)


class Lines(SavedFields):
    """The lines of one world by name, and their forces over an advance."""

    STATE = ("_lines", "_payout_rate")

    def __init__(self) -> None:
        self._lines: dict[str, Line] = {}
        self._payout_rate: dict[str, float] = {}
        self._impulse = np.zeros((0, 6))
        self._known: _Pulls | None = None
        self._twists = twists_of([])

    @property
    def twists(self) -> Twists:
        """The joints that resist a twist."""
        return self._twists

    @twists.setter
    def twists(self, twists: Twists) -> None:
        self._twists, self._known = twists, None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the lines, in the order in which they were added."""
        return tuple(self._lines)

    def add(self, name: str, line: Line) -> None:
        """Add a line; ValueError for a name that is in use."""
        if name in self._lines:
            raise ValueError(f"the line {name!r} is added twice, allowed: each name once")
        self._lines[name] = line
        self._known = None

    def __getitem__(self, name: str) -> Line:
        """Return the line of that name."""
        return self._lines[name]

    def length(self, name: str) -> float:
        """Return the present unstretched length [m]."""
        return self._lines[name].length

    def laid_length(self, name: str) -> float:
        """Return the unstretched length [m] when the line was added."""
        return self._lines[name].laid_length

    def longest_step(self, pose: Array, inverse_masses: Array) -> float:
        """Return the longest sub-step [s] that is stable if all lines are taut, and legs as stiff as they are soon.

        pose (B, 7), inverse_masses (B, 6, 6).
        """
        twisted = longest_twist_step(self._twists, pose, inverse_masses, STABLE)
        if not self._lines:
            return twisted
        rows = [line.stretching(pose) for line in self._lines.values()]
        counts = [len(row) for row in rows]
        stiffness = np.repeat([line.spring(pose) for line in self._lines.values()], counts)
        relaxation = np.repeat([line.relaxation_time for line in self._lines.values()], counts)
        compliance = _compliance(np.concatenate(rows), inverse_masses)
        elastic = _largest(compliance, stiffness)
        damping = _largest(compliance, stiffness * relaxation)
        longest = STABLE / (damping + math.sqrt(damping**2 + STABLE * elastic)) if elastic > 0.0 else math.inf
        return min(longest, twisted)

    def order_length(self, name: str, length: float) -> None:
        """Order the unstretched length [m] at the end of the next advance, reached evenly; ValueError if it is not above 0."""
        if not (math.isfinite(length) and length > 0.0):
            raise ValueError(f"the length of line {name!r} is {length} m, allowed: above 0 m")
        self._lines[name].ordered_length = length

    def part(self, name: str) -> None:
        """Let a line part: from now on it holds nothing."""
        self._lines[name].parted = True
        self._known = None

    def loosen(self, name: str) -> None:
        """Let one end of an elastic line be free, until it is made fast; the length as laid is that to which it is hauled in then."""
        line = self._elastic(name)
        line.made_fast, line.loosened = False, True
        self._known = None

    def make_fast(self, name: str, pose: Array) -> None:
        """Make a loosened line fast between its points, at poses (B, 7): as long as they are apart, and not shorter than it was laid."""
        line = self._elastic(name)
        line.length = line.ordered_length = max(line.laid_length, line.distance(pose))
        line.made_fast = True
        self._known = None

    def distance(self, name: str, pose: Array) -> float:
        """Return the distance [m] of the two points of an elastic line, at poses (B, 7)."""
        return self._elastic(name).distance(pose)

    def ends(self, name: str, pose: Array) -> Array:
        """Return the places (2, 3) [m] of both ends of a line, the anchor last, at poses (B, 7)."""
        line = self._lines[name]
        points = np.stack([line.point, line.place]) if isinstance(line, MooringLeg) else line.points
        return places_of(line.rows, points, pose)[0]

    def _elastic(self, name: str) -> ElasticLine:
        """Return the elastic line of that name; ValueError for a line of another kind, or an unknown name."""
        line = self._lines.get(name)
        if not isinstance(line, ElasticLine):
            known = [other for other, one in self._lines.items() if isinstance(one, ElasticLine)]
            raise ValueError(f"rigid bodies: {name!r} is no elastic line, allowed: {', '.join(known)}")
        return line

    def tension(self, name: str) -> float:
        """Return the mean tension [N] over the last advance."""
        return self._lines[name].tension

    def begin(self, duration: float, body_count: int) -> None:
        """Begin an advance of `duration` [s]."""
        self._impulse = np.zeros((body_count, 6))
        for name, line in self._lines.items():
            line.tension = 0.0
            self._payout_rate[name] = (line.ordered_length - line.length) / duration

    def pull_for(self, sub_step: float, pose: Array, twist: Array) -> Array:
        """Return wrenches (B, 6) [N, N m] on all bodies over a sub-step [s], record them, and change lengths; pose (B, 7), twist (B, 6)."""
        total = self.present_pull(pose, twist)
        assert self._known is not None
        for (name, line), tension in zip(self._lines.items(), self._known.tensions, strict=True):
            line.tension += tension * sub_step
            line.settle()
            if self._payout_rate[name] != 0.0:
                line.pay_out(line.length + self._payout_rate[name] * sub_step)
        self._known = None
        self._impulse += sub_step * total
        return total

    def present_pull(self, pose: Array, twist: Array) -> Array:
        """Return the present wrenches (B, 6) [N, N m] on all bodies, and change nothing; pose (B, 7), twist (B, 6)."""
        rates = [self._payout_rate.get(name, 0.0) for name in self._lines]
        if self._known is None or not self._known.is_of(pose, twist, rates):
            total, tensions = twist_torques(self._twists, pose, twist), []
            for line, rate in zip(self._lines.values(), rates, strict=True):
                tension, wrenches = line.pull(pose, twist, rate)
                tensions.append(tension)
                for row, wrench in zip(line.rows, wrenches, strict=True):
                    if row >= 0:
                        total[row] += wrench
            self._known = _Pulls(pose.copy(), twist.copy(), rates, tensions, total)
        return self._known.wrenches.copy()

    def end(self, duration: float) -> Array:
        """End the advance; return the mean wrenches (B, 6) [N, N m]."""
        for line in self._lines.values():
            line.pay_out(line.ordered_length)
            line.tension /= duration
        self._known = None
        return self._impulse / duration

    def restore_state(self, state: Any) -> None:
        """Go back to a state that `save_state` returned."""
        super().restore_state(state)
        self._known = None


def _largest(compliance: Array, stiffness: Array) -> float:
    """Return the largest eigenvalue of `compliance` (L, L) times diag(`stiffness`) (L,)."""
    root = np.sqrt(stiffness)
    return float(np.linalg.eigvalsh(root[:, None] * compliance * root)[-1])


@njit(nogil=True, cache=True, error_model="numpy")
def _compliance(rows: Array, inverse_masses: Array) -> Array:
    """Return the speed (L, L) [1/kg] at which each line grows by unit impulse along each; rows (L, B, 6), few of which hold numbers."""
    count = len(rows)
    result, answer = np.zeros((count, count)), np.empty(6)
    for line in range(count):
        for body in range(rows.shape[1]):
            row = rows[line, body]
            if not row.any():
                continue
            for axis in range(6):
                answer[axis] = (inverse_masses[body, axis] * row).sum()
            for other in range(count):
                result[other, line] += (rows[other, body] * answer).sum()
    return result


@njit(nogil=True, cache=True, error_model="numpy")
def _add_stretching(rows: tuple[int, int], points: Array, pose: Array, total: Array) -> None:
    """Add `ElasticLine.stretching` of a line to `total` (B, 6); points (2, 3) [m], pose (B, 7)."""
    position, arm = places_of(rows, points, pose)
    span = position[1] - position[0]
    along = span / max(np.sqrt((span**2).sum()), 1e-12)
    for end in range(2):
        if rows[end] >= 0:
            add_force_at(total[rows[end]], arm[end], (2.0 * end - 1.0) * along)


@njit(nogil=True, cache=True, error_model="numpy")
def _pull(
    rows: tuple[int, int], points: Array, terms: tuple[float, float, float, float], pose: Array, twist: Array
) -> tuple[float, Array]:
    """Return the tension [N] of a line and the wrenches (2, 6) [N, N m] on its bodies; see the module.

    points (2, 3) [m]; terms: length [m], stiffness [N], relaxation time [s], payout rate [m/s]; pose (B, 7), twist (B, 6).
    """
    length, stiffness, relaxation_time, payout_rate = terms
    wrenches = np.zeros((2, 6))
    position, arm = places_of(rows, points, pose)
    span = position[1] - position[0]
    distance = np.sqrt((span**2).sum())
    if distance <= length:
        return 0.0, wrenches
    along, rate = span / distance, 0.0
    for end in range(2):
        row = rows[end]
        if row >= 0:
            for axis in range(3):
                after, before = (axis + 1) % 3, (axis + 2) % 3
                speed = (
                    twist[row, axis]
                    + twist[row, 3 + after] * arm[end, before]
                    - twist[row, 3 + before] * arm[end, after]
                )
                rate += (2.0 * end - 1.0) * along[axis] * speed
    tension = max(0.0, stiffness / length * (distance - length + relaxation_time * (rate - payout_rate)))
    for end in range(2):
        add_force_at(wrenches[end], arm[end], (1.0 - 2.0 * end) * tension * along)
    return tension, wrenches
