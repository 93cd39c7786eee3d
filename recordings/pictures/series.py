"""The numbers of a run's picture over time: the events with their numbers, and the lines of one or several booms."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import shorten
from typing import Literal

from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from recordings import palette
from recordings.frame import Event
from recordings.pictures.style import EVENT_COLORS, edge_of_light
from recordings.replay.recording import Replay
from recordings.sink.plots import labels

EVENT_ROW = 1.1  # height of the events, in heights of a diagram
_NAMED_EVENTS = 4
_EVENT_LETTERS = 88  # letters that fit above a diagram
_WIDTH = 1.6  # [points] of a line
_BESIDE = 0.035  # of the width: numbers of events closer than this share a mark
_Style = Literal["-"] | tuple[float, Sequence[float]]
_STYLES: tuple[_Style, ...] = ("-", (0, (5, 2)), (0, (1, 1.2)), (0, (5, 1.5, 1, 1.5)))  # of booms, in turn
_LEGEND_SIZES = (
    (56, 9.0),
    (78, 7.5),
    (1000, 6.5),
)  # letters of a legend that fit beside the title of a diagram, and their size


def draw_events(axes: Axes, events: Sequence[Event], span: tuple[float, float]) -> None:
    """Write the few most urgent events, of equals the last, and below them their numbers at their times; span [s] of the axis."""
    shown = sorted(
        sorted(events, key=lambda event: (event.urgency, event.time))[-_NAMED_EVENTS:], key=lambda event: event.time
    )
    axes.set_ylim(-1.8, _NAMED_EVENTS - 0.5)
    axes.set_axis_off()
    for place, event in enumerate(shown):
        row, color = len(shown) - 1 - place, EVENT_COLORS[event.level]
        said = f"{event.source}: {event.text}" if event.source else event.text
        text = shorten(f"{event.time:.1f} s  {said}", _EVENT_LETTERS, placeholder=" ...")
        across = axes.get_yaxis_transform()
        axes.text(0.0, row, str(place + 1), transform=across, va="center", fontsize=9, color=color, fontweight="bold")
        axes.text(0.025, row, text, transform=across, va="center", fontsize=9, color=color)
    for time, numbers, color in _marks(shown, _BESIDE * (span[1] - span[0])):
        axes.plot([time], [-1.7], marker="v", markersize=4.5, color=color, clip_on=False)
        axes.text(time, -1.35, numbers, ha="center", va="bottom", fontsize=8.5, color=color, fontweight="bold")


def _marks(events: Sequence[Event], apart: float) -> list[tuple[float, str, str]]:
    """List times, numbers and colours of the marks; events within `apart` [s] of the first of a mark share it."""
    found: list[tuple[float, list[int], str]] = []
    for number, event in enumerate(events, start=1):
        if found and event.time - found[-1][0] < apart:
            found[-1][1].append(number)
        else:
            found.append((event.time, [number], EVENT_COLORS[event.level]))
    return [(time, ", ".join(map(str, numbers)), color) for time, numbers, color in found]


def draw_lines(axes: Axes, replay: Replay, names: Sequence[str], booms: Sequence[str], factor: float) -> None:
    """Draw series times `factor` in one diagram; of several `booms`, a quantity has one colour, and a boom one style of line."""
    quantities = [_quantity(name, booms) for name in names]
    unlike = list(dict.fromkeys(quantities))
    colors = {one: _line_color(one) or f"C{place % 10}" for place, one in enumerate(unlike)}
    styles = {boom: _STYLES[place % len(_STYLES)] for place, boom in enumerate(booms)}
    for name, quantity in zip(names, quantities, strict=True):
        series, boom = replay.scalars[name], name.removesuffix(quantity).rstrip("/")
        color = colors[quantity]
        axes.plot(
            series.time, factor * series.value, linewidth=_WIDTH, color=color, linestyle=styles.get(boom, _STYLES[0]),
            path_effects=edge_of_light(color, _WIDTH),
        )  # fmt: skip
    shown = [_key(colors[one], "-", label) for one, label in zip(unlike, labels(unlike), strict=True)]
    drawn = [boom for boom in booms if any(name.startswith(f"{boom}/") for name in names)]
    shown += [_key("#5c6b76", styles[boom], boom) for boom in drawn if len(drawn) > 1]
    if len(shown) > 1 or "/" in names[0]:  # a single cause of loss needs its name, too
        letters = sum(len(str(line.get_label())) + 4 for line in shown)
        size = next(size for most, size in _LEGEND_SIZES if letters <= most)
        axes.legend(
            handles=shown, frameon=False, ncols=len(shown), loc="lower right", bbox_to_anchor=(1.0, 0.97), fontsize=size,
            columnspacing=1.2, handlelength=1.6, handletextpad=0.5, borderaxespad=0.2,
        )  # fmt: skip


def _key(color: str, style: _Style, label: str) -> Line2D:
    """Return the line that stands in a legend."""
    effects = edge_of_light(color, _WIDTH)
    return Line2D([], [], linewidth=_WIDTH, color=color, linestyle=style, label=label, path_effects=effects)


def _quantity(name: str, booms: Sequence[str]) -> str:
    """Return the name of a series without that of its boom."""
    boom, _, rest = name.partition("/")
    return rest if rest and boom in booms else name


def _line_color(name: str) -> str | None:
    """Return the colour that a series has in the viewer, too; None for the next colour in turn."""
    if "oil_lost/" in name:
        return palette.css(palette.cause_color(name.rpartition("/")[2]))
    return palette.css(palette.LIMIT) if name.endswith("_limit") else None
