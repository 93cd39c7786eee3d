"""A bridle: two elastic legs from one body meet in a junction, from which one line goes on to another body or to the world.

The junction has no mass and no drag, so it stands where the pulls of the three parts balance (*modelled*). This is the least of the convex

    E(J) = sum over parts of EA / (2 l_i) max(0, |x_i - J| - l_i)^2,

with x_i the outer end of part i and l_i its unstretched length. The least lies in the plane of the three ends. A part pulls with
T_i = EA / l_i max(0, |x_i - J| - l_i) towards J. A leg that its neighbour takes the load from is slack.

T is the pull of the line. The bridle as a whole lengthens at the rate e' = -(power of its pulls) / T, and is as stiff as
k = 1 / sum over taut parts of (T_i / T)^2 l_i / EA. Its damping adds tau k (e' - dl/dt) to T, with l the length of the line and tau the
relaxation time, and scales the pulls of the legs alike, so that the junction stays in balance and damping never makes energy.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import njit

from coupling.rigid.rotations import places_of
from oilsim.backend.wrenches import add_force_at

Array = npt.NDArray[np.float64]

NEWTON_STEPS = 60  # [1] most steps to the junction's place; numerical; from the places it begins at, five suffice
BALANCED = 1e-12  # [1] unbalanced force at the junction over EA at which the search ends; numerical
HALVINGS = 40  # [1] most halvings of a step that does not lower the energy; numerical


@dataclass(eq=False)
class Bridle:
    """A line that ends in two legs; it stands among the lines of a world, see `coupling.rigid.lines`.

    row: of the line's body, -1 for the world; leg_row: of the body of both legs. points (3, 3) [m]: the line's end and those of the legs,
    along each body's axes from its centre of mass (for the world, the point itself). leg_lengths (2,) [m]; stiffness: EA [N] of all parts;
    relaxation_time: tau [s]; length: of the line alone [m]; ordered_length [m]: at the end of the next advance; laid_length [m]: at the
    start; tension [N]: of the line, mean over the last advance; breaking_load [N]: tension beyond which a part parts. parted: the line
    has parted, or both legs; legs_parted: each leg. Raises ValueError for values that are not above 0, and for legs that cannot meet.
    """

    row: int
    leg_row: int
    points: Array
    leg_lengths: tuple[float, float]
    stiffness: float
    relaxation_time: float
    length: float
    breaking_load: float = math.inf
    ordered_length: float = field(init=False)
    laid_length: float = field(init=False)
    tension: float = 0.0
    parted: bool = False
    legs_parted: list[bool] = field(default_factory=lambda: [False, False])
    _asked: Array = field(default_factory=lambda: np.zeros(3))  # pulls [N] that `pull` gave last

    def __post_init__(self) -> None:
        for name, value in (("stiffness", self.stiffness), ("length", self.length), ("leg", min(self.leg_lengths))):
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"{name} is {value}, allowed: above 0")
        if not self.breaking_load > 0.0:
            raise ValueError(f"breaking_load is {self.breaking_load}, allowed: above 0")
        require_meeting(self.leg_lengths, float(np.linalg.norm(self.points[2] - self.points[1])))
        self.ordered_length = self.laid_length = self.length

    @property
    def rows(self) -> tuple[int, int, int]:
        """Rows of the bodies at the line's end and at those of the legs."""
        return self.row, self.leg_row, self.leg_row

    def pulls(self, pose: Array) -> Array:
        """Return the pulls (3,) [N] of the line and the legs at rest, without damping; pose (B, 7)."""
        places, _ = places_of(self.rows, self.points, pose)
        return _balance(places, *self._parts())[1]

    def pull(self, pose: Array, twist: Array, payout_rate: float) -> tuple[float, Array]:
        """Return the line's tension [N] and the wrenches (3, 6) [N, N m]; pose (B, 7), twist (B, 6), payout_rate dl/dt [m/s]."""
        if self.parted:
            return 0.0, np.zeros((3, 6))
        lengths, springs = self._parts()
        self._asked, wrenches = _pull(
            self.rows, self.points, lengths, springs, (float(self.relaxation_time), float(payout_rate)), pose, twist
        )
        return float(self._asked[0]), wrenches

    def settle(self) -> None:
        """Let parts break that pulled beyond their breaking load when they were asked last."""
        broken = self._asked > self.breaking_load
        if broken.any() and not self.parted:
            self.legs_parted = [bool(was or now) for was, now in zip(self.legs_parted, broken[1:], strict=True)]
            self.parted = bool(broken[0]) or all(self.legs_parted)

    def stretching(self, pose: Array) -> Array:
        """Return rows (2, B, 6) [-] with which twists of the bodies lengthen the line by way of each leg alone."""
        total = np.zeros((2, len(pose), 6))
        if self.parted:
            return total
        places, arms = places_of(self.rows, self.points, pose)
        for leg in (1, 2):
            if not self.legs_parted[leg - 1]:
                span = places[leg] - places[0]
                along = span / max(float(np.linalg.norm(span)), 1e-12)
                add_force_at(total[leg - 1, self.leg_row], arms[leg], along)
                if self.row >= 0:
                    add_force_at(total[leg - 1, self.row], arms[0], -along)
        return total

    def spring(self, pose: Array) -> float:
        """Return a stiffness [N/m] that the bridle does not pass along either row of `stretching`: both legs nearly in line."""
        return self.stiffness / (min(self.length, self.ordered_length) + 0.5 * min(self.leg_lengths))

    def pay_out(self, length: float) -> None:
        """Take the unstretched length [m] of the line."""
        self.length = length

    def save_state(self) -> dict[str, Any]:
        """Return lengths, tension, and which parts parted, as plain data."""
        numbers = {name: getattr(self, name) for name in ("length", "ordered_length", "tension", "parted")}
        return numbers | {"legs_parted": list(self.legs_parted)}

    def restore_state(self, state: Mapping[str, Any]) -> None:
        """Go back to a state that `save_state` returned."""
        self.length, self.ordered_length = float(state["length"]), float(state["ordered_length"])
        self.tension, self.parted = float(state["tension"]), bool(state["parted"])
        self.legs_parted = [bool(parted) for parted in state["legs_parted"]]

    def _parts(self) -> tuple[Array, Array]:
        """Return lengths (3,) [m] and springs (3,) [N/m] of the line and the legs; the spring of a leg that has parted is 0."""
        lengths = np.array([self.length, *self.leg_lengths])
        return lengths, self.stiffness / lengths * [True, *(not parted for parted in self.legs_parted)]


def require_meeting(leg_lengths: tuple[float, float], spread: float) -> None:
    """Raise ValueError for legs of these lengths [m] that cannot both be taut from points `spread` [m] apart."""
    one, two = leg_lengths
    if not abs(one - two) < spread < one + two:
        raise ValueError(
            f"legs of {one:g} and {two:g} m from points {spread:g} m apart cannot be taut together, allowed: points farther apart than"
            f" {abs(one - two):g} m and nearer than {one + two:g} m"
        )


def meeting_point(ends: Array, leg_lengths: tuple[float, float]) -> Array:
    """Return the place (3,) [m] where both legs are just taut, in the plane of all `ends` (3, 3) [m], on the side of the first one."""
    across, ahead, spread, _ = _plane(ends)
    along = (spread**2 + leg_lengths[0] ** 2 - leg_lengths[1] ** 2) / (2.0 * spread)
    return np.asarray(ends[1] + along * across + math.sqrt(leg_lengths[0] ** 2 - along**2) * ahead)


@njit(nogil=True, cache=True, error_model="numpy")
def _plane(places: Array) -> tuple[Array, Array, float, Array]:
    """Return unit vectors (3,) across from leg to leg and ahead to the line's end, the legs' distance [m], that end (2,) [m] in them."""
    across = places[2] - places[1]
    spread = np.sqrt((across**2).sum())
    across /= spread
    way = places[0] - places[1]
    along = (way * across).sum()
    ahead = way - along * across
    distance = np.sqrt((ahead**2).sum())
    if distance < 1e-9 * spread:  # the line's end lies on the line through both legs' ends: any direction across it
        ahead = np.zeros(3)
        ahead[np.argmin(np.abs(across))] = 1.0
        ahead -= (ahead * across).sum() * across
        ahead /= np.sqrt((ahead**2).sum())
        distance = 0.0
    else:
        ahead /= distance
    return across, ahead, spread, np.array([along, distance])


@njit(nogil=True, cache=True, error_model="numpy")
def _state(ends: Array, lengths: Array, springs: Array, junction: Array) -> tuple[float, Array, Array, Array]:
    """Return energy [N m], its slope (2,) [N], curvature (2, 2) [N/m], and pulls (3,) [N]; ends (3, 2), junction (2,) [m] in the plane."""
    energy, slope, curvature, pulls = 0.0, np.zeros(2), np.zeros((2, 2)), np.zeros(3)
    for part in range(3):
        x, y = ends[part] - junction
        distance = np.sqrt(x * x + y * y)
        stretch = distance - lengths[part]
        if stretch <= 0.0 or springs[part] == 0.0:
            continue
        pulls[part] = springs[part] * stretch
        energy += 0.5 * pulls[part] * stretch
        x, y, aside = x / distance, y / distance, pulls[part] / distance
        slope[0] -= pulls[part] * x
        slope[1] -= pulls[part] * y
        curvature[0, 0] += springs[part] * x * x + aside * y * y
        curvature[1, 1] += springs[part] * y * y + aside * x * x
        curvature[0, 1] += (springs[part] - aside) * x * y
    curvature[1, 0] = curvature[0, 1]
    return energy, slope, curvature, pulls


@njit(nogil=True, cache=True, error_model="numpy")
def _first_places(ends: Array, lengths: Array, springs: Array) -> Array:
    """Return places (3, 2) [m] to begin at: where both legs are just taut, and where the load hangs on one leg alone."""
    found = np.zeros((3, 2))
    spread = ends[2, 0]
    along = (spread**2 + lengths[1] ** 2 - lengths[2] ** 2) / (2.0 * spread)
    found[0] = along, np.sqrt(max(0.0, lengths[1] ** 2 - along**2))
    for leg in range(1, 3):
        span = ends[0] - ends[leg]
        distance = np.sqrt((span**2).sum())
        reach = lengths[0] + lengths[leg]
        share = lengths[leg] / reach if springs[leg] > 0.0 else 1.0
        found[leg] = ends[leg] + span * share if distance > reach else found[0]
    return found


@njit(nogil=True, cache=True, error_model="numpy")
def _balance(places: Array, lengths: Array, springs: Array) -> tuple[Array, Array]:
    """Return the junction (3,) [m] and the pulls (3,) [N] of the parts from outer ends `places` (3, 3) [m]; Newton steps in their plane."""
    across, ahead, spread, far = _plane(places)
    ends = np.zeros((3, 2))
    ends[0], ends[2, 0] = far, spread
    first = _first_places(ends, lengths, springs)
    junction = first[0]
    energy, slope, curvature, pulls = _state(ends, lengths, springs, junction)
    for leg in range(1, 3):
        other = _state(ends, lengths, springs, first[leg])
        if other[0] < energy:
            junction = first[leg]
            energy, slope, curvature, pulls = other
    enough = BALANCED * springs[0] * lengths[0]
    for _ in range(NEWTON_STEPS):
        if np.sqrt((slope**2).sum()) <= enough:
            break
        firm = 1e-12 * (curvature[0, 0] + curvature[1, 1])
        a, b, c = curvature[0, 0] + firm, curvature[0, 1], curvature[1, 1] + firm
        step = np.array([b * slope[1] - c * slope[0], b * slope[0] - a * slope[1]]) / (a * c - b * b)
        for _ in range(HALVINGS):
            tried = _state(ends, lengths, springs, junction + step)
            if tried[0] < energy or (tried[1] ** 2).sum() < (slope**2).sum():
                break
            step = 0.5 * step
        junction = junction + step
        energy, slope, curvature, pulls = tried
    return places[1] + junction[0] * across + junction[1] * ahead, pulls


@njit(nogil=True, cache=True, error_model="numpy")
def _pull(
    rows: tuple[int, int, int],
    points: Array,
    lengths: Array,
    springs: Array,
    rates: tuple[float, float],
    pose: Array,
    twist: Array,
) -> tuple[Array, Array]:
    """Return the damped pulls (3,) [N] of the parts, and the wrenches (3, 6) [N, N m] on their bodies; see the module.

    rows, points (3, 3) [m] of the ends; lengths (3,) [m], springs (3,) [N/m]; rates: relaxation time [s], payout rate [m/s].
    """
    places, arms = places_of(rows, points, pose)
    junction, pulls = _balance(places, lengths, springs)
    forces, wrenches = np.zeros((3, 3)), np.zeros((3, 6))
    if pulls[0] <= 0.0:
        return np.zeros(3), wrenches
    rate, softness = 0.0, 0.0
    for end in range(3):
        if pulls[end] == 0.0:
            continue
        way = junction - places[end]
        forces[end] = pulls[end] * way / np.sqrt((way**2).sum())
        softness += (pulls[end] / pulls[0]) ** 2 / springs[end]
        add_force_at(wrenches[end], arms[end], forces[end])
        if rows[end] >= 0:
            rate -= (wrenches[end] * twist[rows[end]]).sum() / pulls[0]
    damped = max(0.0, 1.0 + rates[0] * (rate - rates[1]) / (softness * pulls[0]))
    return pulls * damped, wrenches * damped
