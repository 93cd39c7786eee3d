"""Booms as laid for tests."""

from __future__ import annotations

import math

import numpy as np

from booms.boom import Boom
from booms.deployment import BoomLayout, lay_between


def lay_u(
    boom: Boom,
    middle: tuple[float, float],
    heading: float,
    gap_ratio: float,
    *,
    water_level: float,
    name: str = "boom",
) -> BoomLayout:
    """Lay a boom in a U that opens towards `heading` [rad]; its ends are gap_ratio x length apart about `middle` (x, y) [m].

    The first end is the one to port of the tow, the second the one to starboard.
    """
    port = 0.5 * gap_ratio * boom.length * np.array([-math.sin(heading), math.cos(heading)])
    start, end = np.array(middle) + port, np.array(middle) - port
    return lay_between(
        boom, (float(start[0]), float(start[1])), (float(end[0]), float(end[1])), water_level=water_level, name=name
    )
