"""Running extremes: what a series reached between recorded frames, from a second series of its extreme values since the start."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Values = npt.NDArray[np.float64]
WORST = "worst_"
"""Prefix of a series of extreme values, as in ``worst_tow_tension/port``; with several booms, ``main/worst_skirt_angle``."""


def reached(sampled: Values, worst: Values | None) -> Values:
    """Compute the extreme value (N,) [-] of a series, in its own unit, from the frame before to each frame.

    sampled (N,) are the recorded values, worst (M,) the extremes since the run began. If the extreme has changed since
    the frame before, the result is the new extreme; elsewhere, and in the first frame, only the sample is known. None means that no
    extremes were recorded. In a recording that was cut off, M may be less than N.
    """
    values = sampled.copy()
    if worst is not None:
        known = worst[: len(values)]
        changed = np.flatnonzero(np.diff(known, prepend=known[:1]))
        values[changed] = known[changed]
    return values
