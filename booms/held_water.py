"""Water that a U of boom holds: its pressure on the boom's sides (*modelled*).

The rule for skirts loads each segment as if it stood alone, by the square of the speed normal to it. Where a boom bends round so far that
the water cannot slide off along it, the water stands in the U, and its stagnation pressure bears on all of the skirt:

    dF/ds = 1/2 rho U^2 d (1.88 sin^2 a + h cos^2 a) n,     h = min(1, 20 d / w)

U is the current relative to the boom, a the angle between a segment and the current, d the draft, n the normal out of the U, and w the
width of the U at the segment, across the current. The first part is the rule (`booms.loads`); this module adds the second one. A segment
holds water if another segment of its boom lies across the current, and a third one lies downstream of the water between both. A boom with
a pocket holds none, since the pocket lets the water out below.

Particles around booms of 12 m, with gaps of 0.25, 0.33 and 0.5 of the length and drafts of 0.30 and 0.45 m, in 0.5 m/s, have 0.72 to 1.30
of this pull. These runs cover widths of 7 to 20 drafts. More water passes under wider mouths; how h fades there is assumed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from booms.boom import Boom
from booms.reel import ReeledBodies, Track
from oilsim.backend.arrays import Array, Ints
from oilsim.backend.jit import njit
from oilsim.loads.load_model import LoadModel
from oilsim.loads.morison import BodyLoads
from oilsim.sea import Sea

# [drafts] width up to which a U holds water wholly; assumed; the widest of the runs with particles
WIDEST = 20.0
# [half lengths] that a segment reaches from its middle, when looked for across the water; numerical; joints are no gaps
OVERLAP = 1.1


@dataclass(frozen=True, kw_only=True, eq=False)
class Chain:
    """The segments of a boom among the loaded bodies: their rows (S,), length and draft [m], place of mid draft along their z [m]."""

    rows: Ints
    length: float
    draft: float
    middle: float


def chain_of(boom: Boom, waterline: float, first_row: int, count: int) -> Chain:
    """Return the chain of a boom of `count` segments, the first of them in `first_row`; waterline [m] along a segment's z."""
    rows = first_row + np.arange(count)
    return Chain(
        rows=rows, length=boom.segment_length, draft=boom.skirt_depth, middle=waterline - 0.5 * boom.skirt_depth
    )


class BodiesWithBooms(ReeledBodies):
    """Bodies afloat of which some are segments of booms: a U holds water, and a wound segment feels its reel."""

    def __init__(self, models: Sequence[LoadModel], sea: Sea, chains: Sequence[Chain], tracks: Sequence[Track]) -> None:
        super().__init__(models, sea, tracks)
        self._chains = tuple(chains)
        self._volumes = np.array([model.parts[0].design_volume if model.parts else 0.0 for model in models])

    def loads(self, time: float, pose: Array, twist: Array) -> BodyLoads:
        """Return the loads as of `ReeledBodies.loads`, with the water that booms hold.

        time [s]; pose (B, 7) [m, 1] with quaternions xyzw, twist (B, 6) [m/s, rad/s].
        """
        found = super().loads(time, pose, twist)
        level = self.sea.still_level(time)
        for chain in self._chains:
            middle = pose[chain.rows, :2].mean(axis=0)
            flow = self.sea.current(np.array([level - 0.5 * chain.draft]), time, middle)[0]
            flow = flow - twist[chain.rows, :2].mean(axis=0)
            force = held_pressure(pose[chain.rows], chain, flow, self.sea.description.density)
            force *= np.clip(found.wetted_volume[chain.rows] / self._volumes[chain.rows], 0.0, 1.0)[:, None]
            arm = chain.middle * up_of(pose[chain.rows, 3:])
            found.wrench[chain.rows, :3] += force
            found.wrench[chain.rows, 3:] += np.cross(arm, force)
        return found


def up_of(orientation: Array) -> Array:
    """Return the z axes (S, 3) of segments with quaternions (S, 4) xyzw."""
    x, y, z, w = orientation.T
    return np.column_stack([2.0 * (x * z + y * w), 2.0 * (y * z - x * w), 1.0 - 2.0 * (x * x + y * y)])


def held_pressure(pose: Array, chain: Chain, flow: Array, density: float) -> Array:
    """Return the force (S, 3) [N] of held water on each segment of a boom.

    pose (S, 7) [m, 1]; flow (2,) [m/s]: of the water, relative to the boom; density [kg/m3] of the water.
    """
    force, speed = np.zeros((len(pose), 3)), math.hypot(*flow)
    if speed == 0.0:
        return force
    x, y, z, w = pose[:, 3:].T
    along = np.column_stack([1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + z * w)])
    along /= np.maximum(np.hypot(*along.T), 1e-9)[:, None]
    half = 0.5 * chain.length * along
    width = held_widths(pose[:, :2].copy(), half, np.asarray(flow) / speed)
    share = np.minimum(1.0, WIDEST * chain.draft / np.maximum(np.abs(width), 1e-9)) * (width != 0.0)
    parallel = along @ (np.asarray(flow) / speed)
    outward = np.sign(width)[:, None] * np.column_stack([-along[:, 1], along[:, 0]])
    size = 0.5 * density * speed**2 * chain.draft * chain.length * share * parallel**2
    force[:, :2] = size[:, None] * outward
    return force


@njit(nogil=True, cache=True, error_model="numpy")
def held_widths(middle: Array, half: Array, ahead: Array) -> Array:
    """Return the width [m] across the current of the water that each segment (S,) holds; 0 for none.

    It is positive where the water lies right of the segment, so that it presses to the left. middle (S, 2) [m]; half (S, 2) [m]: from there
    to its end; ahead (2,): unit vector along the current.
    """
    width = np.zeros(len(middle))
    for s in range(len(middle)):
        left = half[s, 0] * ahead[0] + half[s, 1] * ahead[1]  # above 0: the left of the current is the segment's left
        for side in (-1.0, 1.0):
            x, y = -side * ahead[1], side * ahead[0]
            reach = first_hit(middle, half, middle[s, 0], middle[s, 1], x, y, s)
            if not math.isfinite(reach):
                continue
            inside_x, inside_y = middle[s, 0] + 0.5 * reach * x, middle[s, 1] + 0.5 * reach * y
            if math.isfinite(first_hit(middle, half, inside_x, inside_y, ahead[0], ahead[1], -2)):
                width[s] = -reach if side * left > 0.0 else reach
                break
    return width


@njit(nogil=True, cache=True, error_model="numpy")
def first_hit(middle: Array, half: Array, x: float, y: float, way_x: float, way_y: float, own: int) -> float:
    """Return the distance [m] from a place (x, y) [m] along a unit vector to the first segment; infinite without any.

    Segment `own` and its neighbours are passed over; -2 for none.
    """
    nearest = np.inf
    for k in range(len(middle)):
        turn = way_x * half[k, 1] - way_y * half[k, 0]
        if turn == 0.0 or abs(k - own) <= 1:
            continue
        off_x, off_y = middle[k, 0] - x, middle[k, 1] - y
        place = off_x * way_y - off_y * way_x  # of the half length, from the middle
        if abs(place) <= OVERLAP * abs(turn):
            distance = (off_x * half[k, 1] - off_y * half[k, 0]) / turn
            if 0.0 < distance < nearest:
                nearest = distance
    return nearest
