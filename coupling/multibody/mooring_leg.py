"""A mooring leg: a catenary from a body down to an anchor that holds up to its power and drags beyond.

The leg answers at once, as if it hung at rest (`coupling.multibody.catenary`). Its damping is that of the horizontal pull,
tau dH/dx dx/dt, with tau the relaxation time. An anchor of holding power R drags through the ground like a slider of dry friction: where
the leg would pull harder, it follows until H = R. R falls with the pull upwards V_a at the anchor:

    R = max(0, holding (1 - angle_loss atan(V_a / H)) - friction V_a).

The first term is for anchors that dig in, the second for weights. A leg parts where the tension in one of its parts passes its breaking
load.

Anchors and the parts of mooring legs, as numbers: whoever only describes a mooring needs no compiler.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from coupling.master.saved_fields import SavedFields
from coupling.multibody.catenary import Pull, distance_under, pull_of, tensions
from coupling.multibody.ground_tackle import Anchor, LegPart
from coupling.multibody.rotations import places_of
from oilsim.backend.arrays import Array
from oilsim.backend.jit import njit
from oilsim.loads.load_model import add_force_at

# [N] error of the pull at which an anchor drags; numerical
EVEN = 1e-3
# [m] by which a leg may grow before its stiffness is looked at again; numerical; 1 m/s in a step of bodies at sea
AHEAD = 0.04


@dataclass(eq=False)
class MooringLeg(SavedFields):
    """A leg between a body and an anchor; it stands among the lines of a world, see `coupling.multibody.lines`.

    row: of the body; point: (3,) [m] of the upper end, along the body's axes from its centre of mass; parts: from the upper end down;
    length, ordered_length, laid_length [m]: unstretched, now, at the end of the next advance and at the start; a windlass changes the
    uppermost part; tension [N]: at the upper end, mean over the last advance; dragged [m]: how far the anchor is from where it was laid.
    Raises ValueError without parts, and for lengths, weights or stiffnesses that cannot be.
    """

    STATE = ("length", "ordered_length", "tension", "parted", "_place", "_pull")

    row: int
    point: Array
    parts: tuple[LegPart, ...]
    anchor: Anchor
    relaxation_time: float
    length: float = field(init=False)
    ordered_length: float = field(init=False)
    laid_length: float = field(init=False)
    tension: float = 0.0
    parted: bool = False

    def __post_init__(self) -> None:
        if not self.parts:
            raise ValueError("a mooring leg has no parts, allowed: one part or more")
        for part in self.parts:
            for name, lowest in (("length", "above 0"), ("stiffness", "above 0"), ("weight", "0 or more")):
                value = getattr(part, name)
                if not (math.isfinite(value) and (value > 0.0 or (value == 0.0 and name == "weight"))):
                    raise ValueError(f"{name} of a mooring leg's part is {value}, allowed: {lowest}")
        self._table = np.array([(part.length, part.weight, part.stiffness) for part in self.parts])
        self.length = self.laid_length = self.ordered_length = float(self._table[:, 0].sum())
        self._place = np.array(self.anchor.place, dtype=np.float64)
        self._pull = Pull(1.0, 1.0, 0.0, 0.0, 0.0)
        self._last_pull: tuple[Pull, Array] = self._pull, np.zeros(2)

    @property
    def rows(self) -> tuple[int, int]:
        """Rows of its bodies; the anchor's is -1, the world's."""
        return self.row, -1

    @property
    def stiffness(self) -> float:
        """Axial stiffness EA [N] of a uniform line of its length that gives as much."""
        return self.length / float((self._table[:, 0] / self._table[:, 2]).sum())

    @property
    def place(self) -> Array:
        """The place of the anchor now, (3,) [m]."""
        return self._place.copy()

    @property
    def dragged(self) -> float:
        """Distance [m] of the anchor from where it was laid."""
        return float(np.linalg.norm(self._place - self.anchor.place))

    @property
    def pull_now(self) -> Pull:
        """The pull at the end of the last advance, without damping."""
        return self._pull

    @property
    def table(self) -> Array:
        """Length [m], weight [N/m] and stiffness [N] of each part (P, 3) now, from the upper end down."""
        return self._table.copy()

    def pull(self, pose: Array, twist: Array, payout_rate: float) -> tuple[float, Array]:
        """Return the tension [N] at the upper end and the wrenches (2, 6) [N, N m] on body and world.

        pose (B, 7), twist (B, 6), payout_rate [m/s].
        """
        if self.parted:
            return 0.0, np.zeros((2, 6))
        span, arm = self._span(pose)
        distance, height = math.hypot(span[0], span[1]), max(0.0, -span[2])
        pull, reach = self._held(distance, height)
        damping = self.relaxation_time * pull.stiffness if reach == distance else 0.0
        wrenches = np.zeros((2, 6))
        terms = (pull.horizontal, pull.vertical, damping, float(payout_rate))
        tension = _add_pull(terms, span, arm, twist[self.row], wrenches[0])
        self._last_pull = pull, span[:2] * ((distance - reach) / distance if reach < distance else 0.0)
        return tension, wrenches

    def settle(self) -> None:
        """Let the anchor drag, and the leg part, as what it pulled last demands."""
        if not self.parted:
            self._pull, dragged = self._last_pull
            self._place[:2] -= dragged
            self.parted = self._breaks(self._pull)

    def stretching(self, pose: Array) -> Array:
        """Return the row (1, B, 6) [-] with which twists of the bodies lengthen the leg, dl/dt = sum of row times twist."""
        total = np.zeros((1, len(pose), 6))
        if not self.parted:
            span, arm = self._span(pose)
            add_force_at(total[0, self.row], arm, -span / max(float(np.linalg.norm(span)), 1e-12))
        return total

    def spring(self, pose: Array) -> float:
        """Return a stiffness [N/m] that the leg does not pass soon: that of a leg `AHEAD` longer; pose (B, 7)."""
        if self.parted:
            return 0.0
        span, _ = self._span(pose)
        return self._pull_of(math.hypot(span[0], span[1]) + AHEAD, max(0.0, -span[2])).stiffest

    def pay_out(self, length: float) -> None:
        """Take the unstretched length [m]; what changes is the uppermost part. ValueError for a length that the other parts exceed."""
        others = self.length - float(self._table[0, 0])
        if not length > others:
            raise ValueError(
                f"the length of a mooring leg is {length:g} m, allowed: above {others:g} m, its lower parts"
            )
        self._table[0, 0] = length - others
        self.length = length

    def restore_state(self, state: Any) -> None:
        """Go back to a state that `save_state` returned."""
        if isinstance(state, Mapping):
            self.pay_out(float(state["length"]))
        super().restore_state(state)

    def _span(self, pose: Array) -> tuple[Array, Array]:
        """Return the way (3,) [m] from the upper end to the anchor, and the arm (3,) [m] of that end from the centre of mass."""
        places, arms = places_of(self.rows, np.stack([self.point, self._place]), pose)
        return places[1] - places[0], arms[0]

    def _pull_of(self, distance: float, height: float) -> Pull:
        """Return the pull at a distance and height [m] from the anchor, sought from where the last advance ended."""
        guess = (max(1.0, self._pull.horizontal), max(1.0, self._pull.vertical))
        return pull_of(self._table, distance, float(height), guess)

    def _held(self, distance: float, height: float) -> tuple[Pull, float]:
        """Return the pull, and the distance [m] from the anchor at which it holds it: the present one, or a shorter one if it drags."""
        pull = self._pull_of(distance, height)
        if pull.horizontal <= self.anchor.power(pull.horizontal, pull.at_anchor):
            return pull, distance
        low, high = 0.0, pull.horizontal
        while high - low > max(EVEN, 1e-12 * high):
            middle = 0.5 * (low + high)
            _, _, upward = distance_under(self._table, height, middle)
            low, high = (middle, high) if middle <= self.anchor.power(middle, upward) else (low, middle)
        reach, vertical, upward = distance_under(self._table, height, low)
        return Pull(low, vertical, upward, 0.0, 0.0), min(reach, distance)

    def _breaks(self, pull: Pull) -> bool:
        """Return whether a part is pulled beyond its breaking load."""
        limits = [part.breaking_load for part in self.parts]
        return bool((tensions(self._table, pull.horizontal, pull.vertical) > limits).any())


@njit(nogil=True, cache=True, error_model="numpy")
def _add_pull(terms: tuple[float, float, float, float], span: Array, arm: Array, twist: Array, wrench: Array) -> float:
    """Add the pull of a leg to the `wrench` (6,) [N, N m] on its body; return the tension [N] at the upper end.

    terms: horizontal and vertical pull [N], damping of the first [N s/m], payout rate [m/s]; span: way (3,) [m] to the anchor; arm (3,)
    [m] of the upper end; twist (6,) [m/s, rad/s].
    """
    horizontal, vertical, damping, payout_rate = terms
    distance = np.sqrt(span[0] * span[0] + span[1] * span[1])
    force = np.zeros(3)
    force[2] = -vertical
    if distance > 0.0:
        x, y = span[0] / distance, span[1] / distance
        ahead = x * (twist[0] + twist[4] * arm[2] - twist[5] * arm[1])
        ahead += y * (twist[1] + twist[5] * arm[0] - twist[3] * arm[2])
        horizontal = max(0.0, horizontal - damping * (ahead + payout_rate))
        force[0], force[1] = horizontal * x, horizontal * y
    add_force_at(wrench, arm, force)
    return np.sqrt(horizontal * horizontal + vertical * vertical)
