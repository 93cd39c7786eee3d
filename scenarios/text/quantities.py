"""Quantities as people read them."""

from __future__ import annotations


def volume_in_words(volume: float) -> str:
    """Write a volume [m3] with three figures: in m3, or in litres below 1 m3."""
    return f"{volume:.3g} m3" if volume >= 1.0 or volume == 0.0 else f"{1e3 * volume:.3g} litres"


def force_in_words(force: float) -> str:
    """Write a force [N] with three figures: in kN, or in N below 1 kN."""
    return f"{1e-3 * force:.3g} kN" if abs(force) >= 1000.0 else f"{force:.3g} N"
