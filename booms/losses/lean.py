"""Lean: the draft that a leaning skirt still has, from its pose, and the lean that a current gives a free skirt (closure, for checks).

Moments about the waterline, of the drag 0.5 rho C_d (U cos(t))^2 d at half the skirt's length and of the submerged ballast w_b at its foot:
rho C_d U^2 d / (4 w_b) = sin(t) / cos(t)^2. Range: no help from the boom's tension. In a run the pose itself is resolved; the skirt's
foot and the local surface give the draft.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def effective_draft(surface: ArrayLike, foot: ArrayLike) -> Array:
    """Compute the draft from the local surface down to the foot (S,) [m], 0 for a foot out of the water; both heights (S,) [m]."""
    return np.asarray(np.maximum(0.0, np.asarray(surface) - np.asarray(foot)))


def balanced_lean(speed: ArrayLike, draft: float, ballast: float, *, drag_coefficient: float, density: float) -> Array:
    """Solve sin(t) / cos(t)^2 = rho C_d U^2 d / (4 w_b) for the lean t (S,) [rad].

    speed U (S,) [m/s]; draft d [m] upright; ballast w_b [N/m], submerged; density rho [kg/m3]. With s = sin(t), s = a (1 - s^2).
    """
    a = density * drag_coefficient * np.square(np.asarray(speed, np.float64)) * draft / (4.0 * ballast)
    sine = 2.0 * a / (1.0 + np.sqrt(1.0 + 4.0 * a * a))
    return np.asarray(np.arcsin(sine))
