"""Steps of a fixed length that a master asks for by the difference of two times."""

from __future__ import annotations

ROUNDING = 1e-6  # of a step: above what the difference of two times loses, below any other step that is meant


def same_step(asked: float, own: float) -> bool:
    """Whether a step that is asked for [s] is a participant's own one, but for the rounding of times."""
    return abs(asked - own) <= ROUNDING * own
