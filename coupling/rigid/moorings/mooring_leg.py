"""A mooring leg: a catenary from a body down to an anchor that holds up to its power and drags beyond.

The leg answers at once, as if it hung at rest (`coupling.rigid.moorings.catenary`). Its damping is that of the horizontal pull,
tau dH/dx dx/dt, with tau the relaxation time. An anchor of holding power R drags through the ground like a slider of dry friction: where
the leg would pull harder, it follows until H = R. R falls with the pull upwards V_a at the anchor:

    R = max(0, holding (1 - angle_loss atan(V_a / H)) - friction V_a).

The first term is for anchors that dig in, the second for weights. A leg parts where the tension in one of its parts passes its breaking
load.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from coupling.rigid.moorings.catenary import Pull, distance_under, pull_of, tensions
from coupling.rigid.moorings.ground_tackle import Anchor, LegPart
from coupling.rigid.rotations import applied, cross, rotation_matrices

Array = npt.NDArray[np.float64]

# [N] error of the pull at which an anchor drags; numerical
EVEN = 1e-3
# [m] by which a leg may grow before its stiffness is looked at again; numerical; 1 m/s in a step of bodies at sea
AHEAD = 0.04


@dataclass(eq=False)
class MooringLeg:
    """A leg between a body and an anchor; it stands among the lines of a world, see `coupling.rigid.lines`.

    row: of the body; point: (3,) [m] of the upper end, along the body's axes from its centre of mass; parts: from the upper end down;
    length, ordered_length, laid_length [m]: unstretched, now, at the end of the next advance and at the start; a windlass changes the
    uppermost part; tension [N]: at the upper end, mean over the last advance; dragged [m]: how far the anchor is from where it was laid.
    Raises ValueError without parts, and for lengths, weights or stiffnesses that cannot be.
    """

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

    def pull(self, pose: Array, twist: Array, payout_rate: float, *, settle: bool) -> tuple[float, Array]:
        """Return the tension [N] at the upper end and the wrenches (2, 6) [N, N m] on body and world.

        pose (B, 7), twist (B, 6), payout_rate [m/s]. With `settle` the anchor drags, and the leg parts, if it must; else it is only asked.
        """
        wrenches = np.zeros((2, 6))
        if self.parted:
            return 0.0, wrenches
        end, arm = self._upper_end(pose)
        span = self._place[:2] - end[:2]
        distance, height = float(np.hypot(*span)), max(0.0, float(end[2] - self._place[2]))
        outward = np.array([*(span / distance), 0.0]) if distance > 0.0 else np.zeros(3)
        pull, reach = self._held(distance, height)
        if settle:
            self._pull = pull
            self._place[:2] -= outward[:2] * (distance - reach)
            self.parted = self._breaks(pull)
        speed = twist[self.row, :3] + cross(twist[None, self.row, 3:], arm[None])[0]
        stretching = -float(outward @ speed) - payout_rate
        damped = self.relaxation_time * pull.stiffness * stretching if reach == distance else 0.0
        horizontal = max(0.0, pull.horizontal + damped)
        force = np.array([*(horizontal * outward[:2]), -pull.vertical])
        wrenches[0] = np.concatenate([force, cross(arm[None], force[None])[0]])
        return math.hypot(horizontal, pull.vertical), wrenches

    def stretching(self, pose: Array) -> Array:
        """Return the row (1, B, 6) [-] with which twists of the bodies lengthen the leg, dl/dt = sum of row times twist."""
        end, arm = self._upper_end(pose)
        chord = end - self._place
        along = chord / max(float(np.linalg.norm(chord)), 1e-12)
        total = np.zeros((1, len(pose), 6))
        if not self.parted:
            total[0, self.row] = np.concatenate([along, cross(arm[None], along[None])[0]])
        return total

    def spring(self, pose: Array) -> float:
        """Return a stiffness [N/m] that the leg does not pass soon: that of a leg `AHEAD` longer; pose (B, 7)."""
        if self.parted:
            return 0.0
        end, _ = self._upper_end(pose)
        distance = float(np.hypot(*(self._place[:2] - end[:2])))
        return pull_of(self._table, distance + AHEAD, max(0.0, float(end[2] - self._place[2])), (1.0, 1.0)).stiffest

    def pay_out(self, length: float) -> None:
        """Take the unstretched length [m]; what changes is the uppermost part. ValueError for a length that the other parts exceed."""
        others = self.length - float(self._table[0, 0])
        if not length > others:
            raise ValueError(
                f"the length of a mooring leg is {length:g} m, allowed: above {others:g} m, its lower parts"
            )
        self._table[0, 0] = length - others
        self.length = length

    def save_state(self) -> dict[str, Any]:
        """Return lengths, tension, the anchor's place, the pull and whether the leg parted, as plain data."""
        numbers = {name: getattr(self, name) for name in ("length", "ordered_length", "tension", "parted")}
        return numbers | {"place": self._place.tolist(), "pull": tuple(self._pull)}

    def restore_state(self, state: Mapping[str, Any]) -> None:
        """Go back to a state that `save_state` returned."""
        self.pay_out(float(state["length"]))
        self.ordered_length, self.tension = float(state["ordered_length"]), float(state["tension"])
        self.parted, self._pull = bool(state["parted"]), Pull(*state["pull"])
        self._place = np.array(state["place"], dtype=np.float64)

    def _upper_end(self, pose: Array) -> tuple[Array, Array]:
        """Return the place (3,) [m] of the upper end, and its arm (3,) [m] from the centre of mass."""
        arm = applied(rotation_matrices(pose[[self.row], 3:]), self.point[None])[0]
        return pose[self.row, :3] + arm, arm

    def _held(self, distance: float, height: float) -> tuple[Pull, float]:
        """Return the pull, and the distance [m] from the anchor at which it holds it: the present one, or a shorter one if it drags."""
        pull = pull_of(self._table, distance, height, (1.0, 1.0))
        if pull.horizontal <= self.anchor.power(pull.horizontal, pull.at_anchor):
            return pull, distance
        low, high = 0.0, pull.horizontal
        while high - low > max(EVEN, 1e-12 * high):
            middle = 0.5 * (low + high)
            _, _, upward = distance_under(self._table, height, middle, 1.0)
            low, high = (middle, high) if middle <= self.anchor.power(middle, upward) else (low, middle)
        reach, vertical, upward = distance_under(self._table, height, low, 1.0)
        return Pull(low, vertical, upward, 0.0, 0.0), min(reach, distance)

    def _breaks(self, pull: Pull) -> bool:
        """Return whether a part is pulled beyond its breaking load."""
        limits = [part.breaking_load for part in self.parts]
        return bool((tensions(self._table, pull.horizontal, pull.vertical) > limits).any())
