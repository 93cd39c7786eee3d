"""Booms as designed and laid for tests."""

from __future__ import annotations

import math

import numpy as np

from booms.boom import Boom, BoomDesign, catalogue
from booms.deployment import BoomLayout, lay_between
from oilsim.core.quantity import quantities


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


def of_the_catalogue(name: str, length: float, segment_count: int) -> Boom:
    """Design a boom of a kind of the catalogue."""
    entry = vars(catalogue()[name])
    same = {key: entry[key] for key in quantities(BoomDesign) if key in entry}
    sizes = {"length": length, "segment_count": segment_count, "skirt_thickness": 0.005, "pocket": entry["pocket"]}
    return BoomDesign(**same, **sizes).boom()
