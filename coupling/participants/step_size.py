"""Steps of a fixed length that a master asks for by the difference of two times."""

from __future__ import annotations

ROUNDING = 1e-6  # of a step: above what the difference of two times loses, below any other step that is meant


def same_step(asked: float, own: float) -> bool:
    """Tell whether the step `asked` for [s] equals a participant's `own` step [s], up to the rounding of times."""
    return abs(asked - own) <= ROUNDING * own
