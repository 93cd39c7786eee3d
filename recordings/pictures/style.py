"""The style of drawn diagrams, and how light colours are seen on their white ground."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.colors import to_rgb
from matplotlib.patheffects import AbstractPathEffect, withStroke

INK = "#26323b"
EDGE = "#6b7a86"  # round what is nearly white
_LIGHT = 0.9  # luminance from which a colour does not show on white
EVENT_COLORS = {"info": "#6b7a86", "warning": "#d9822b", "error": "#c23030"}
STYLE: dict[Any, Any] = {
    "font.size": 10.5,
    "axes.edgecolor": "#9aa7b1",
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titleweight": "bold",
}


def is_light(color: Any) -> bool:
    """Return whether a colour does not show on white, by its luminance (ITU-R BT.709)."""
    red, green, blue = to_rgb(color)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue > _LIGHT


def edge_of_light(color: Any, width: float) -> Sequence[AbstractPathEffect]:
    """Return the effects by which a line of a width [points] shows on white: an edge round a light colour, none for others."""
    return [withStroke(linewidth=width + 1.6, foreground=EDGE)] if is_light(color) else []
