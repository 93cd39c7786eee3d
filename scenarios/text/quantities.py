"""Figures in words, as they are told."""

from __future__ import annotations


def volume_in_words(volume: float) -> str:
    """A volume [m3] to three figures: in m3, or in litres below one."""
    return f"{volume:.3g} m3" if volume >= 1.0 or volume == 0.0 else f"{1e3 * volume:.3g} l"
