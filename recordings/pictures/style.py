"""The style of drawn diagrams."""

from __future__ import annotations

from typing import Any

INK = "#26323b"
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
