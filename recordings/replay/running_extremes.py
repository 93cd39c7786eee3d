"""What a series reached between recorded frames, told by a second one: its worst value since the run began."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Values = npt.NDArray[np.float64]
WORST = "worst_"
"""Before the name of a series: that of its worst values, as in ``worst_tow_tension/port``, or ``main/worst_skirt_angle`` of one boom
of several."""


def reached(sampled: Values, worst: Values | None) -> Values:
    """Worst value from the frame before to each frame (N,), of a series as sampled (N,) and its worst since the run began.

    Where that has changed since the frame before, it is the answer; elsewhere only the sample is known, as in the first frame, whose
    worst may be from before the recording. None: no worst was recorded; a recording that was cut off may hold less of it.
    """
    values = sampled.copy()
    if worst is not None:
        known = worst[: len(values)]
        changed = np.flatnonzero(np.diff(known, prepend=known[:1]))
        values[changed] = known[changed]
    return values
