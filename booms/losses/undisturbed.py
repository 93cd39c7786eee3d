"""The flow that a boom would meet if it were not there, and the water's surface before it: what drives the closures.

Nearer to the boom than two drafts the water is slowed and sped up by the boom itself, so it tells nothing of the tow's speed.
"""

from __future__ import annotations

import numpy as np

from booms.boom_state import BoomState, nearest_image
from oilsim import Fluid
from oilsim.backend.arrays import Array
from oilsim.sea import SeaForcing

NEAREST, FARTHEST = 2.0, 4.0  # [drafts] ahead of the segment between which the water is taken


def forced_flow(fluid: Fluid, boom: BoomState, height: float, period: tuple[float, float]) -> Array | None:
    """Return the horizontal flow (S, 2) [m/s] at the segments that the sea's current and waves prescribe; None without either.

    height [m]: at which the waves' orbital velocity is taken. period [m] of the sea along x and y: a segment that has sailed on beyond the
    fluid's box meets the waves that run in the box.
    """
    driving = next((one for one in fluid.forcings if isinstance(one, SeaForcing)), None)
    if driving is None or not driving.drives_water:
        return None
    middle = 0.5 * (np.array(fluid.config.lower) + np.array(fluid.config.upper))
    places = nearest_image(boom.position[:, :2], middle, period)
    return driving.stream(np.column_stack([places, np.full(len(places), height)]), fluid.time)[:, :2]


def flow_ahead(
    position: Array,
    velocity: Array,
    boom: BoomState,
    *,
    draft: float,
    level: float,
    below: Array,
    period: tuple[float, float],
) -> Array:
    """Return the mean horizontal velocity (S, 2) [m/s] of water 2 to 4 drafts ahead of each segment; NaN where there is none.

    position, velocity (N, 3) [m, m/s] of the water's particles. Those count that lie between `below` (S,) [m] under the still `level` [m],
    so that the oil lies above them, and one draft [m] deeper, and no farther aside than the segment's half length or a draft. They are seen
    across the sides of a sea with a period [m] along x and y.
    """
    normal, line = boom.normal(), boom.line()
    result = np.full((len(normal), 2), np.nan)
    for k, outward in enumerate(normal):
        middle = 0.5 * (line[k] + line[k + 1])
        reach = max(0.5 * float(np.linalg.norm(line[k + 1] - line[k])), draft)
        offset = nearest_image(position[:, :2], middle, period) - middle
        ahead = -(offset @ outward)
        aside = np.abs(offset @ np.array([-outward[1], outward[0]]))
        deep = level - below[k] - position[:, 2]
        chosen = (
            (ahead >= NEAREST * draft)
            & (ahead <= FARTHEST * draft)
            & (aside <= reach)
            & (deep >= 0.0)
            & (deep <= draft)
        )
        if chosen.any():
            result[k] = velocity[chosen, :2].mean(axis=0)
    return result


def surface_ahead(fluid: Fluid, boom: BoomState, distance: float, level: float, depth: float) -> Array:
    """Measure the height of the surface (S,) [m] at `distance` [m] before each segment's middle.

    Where there is no liquid within `depth` [m] below the still `level` [m], as beside a wall, it is that level.
    """
    points = boom.position[:, :2] - distance * boom.normal()
    height = fluid.surface_height_at(points)
    return np.where(np.abs(height - level) < depth, height, level)
