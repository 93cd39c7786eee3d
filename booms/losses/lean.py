"""Lean: the draft that a leaning skirt still has, from its pose.

In a run the pose is resolved; the skirt's foot and the local surface give the draft.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def effective_draft(surface: ArrayLike, foot: ArrayLike) -> Array:
    """Compute the draft from the local surface down to the foot (S,) [m], 0 for a foot out of the water; both heights (S,) [m]."""
    return np.asarray(np.maximum(0.0, np.asarray(surface) - np.asarray(foot)))
