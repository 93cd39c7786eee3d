"""Encounter, recovery and loss of oil over time: volumes, rates, and the efficiencies of the skimmers, after ASTM F631 and F2709.

Encounter rate: oil that the boom meets in an hour. Recovery rate: oil that skimmers take in an hour. Throughput efficiency: oil recovered,
of all oil met so far. Recovery efficiency: oil in all fluid that skimmers have taken so far. A rate is the mean over `WINDOW`.

The loss over the speed through the water is the curve of a tow-speed ramp, resolved and modelled parts apart.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from oilsim.backend.arrays import Array
from oilsim.core.physical_constants import HOUR, KNOT
from recordings.model.words import three_figures
from scenarios.debrief.boom_history import BoomHistory
from scenarios.debrief.diagrams import HELD_COLOR, empty_figure, finish, line_color, volume_unit
from scenarios.debrief.key_moments import KeyMoment

STEP = 0.1 * KNOT  # [m/s] width of a bar, as the steps of ASTM F2084
PRACTICE = (0.6, 1.0)  # [kn] in which booms lose their first oil in practice: 0.31 to 0.51 m/s
RESOLVED_COLOR, MODELLED_COLOR, _BAND = "#1f5fa8", "#e07b20", "#dfe8d8"
ROUND_OFF = 1e-12  # [1] of a volume, by which a rate of 0 may miss it
WINDOW = 60.0  # [s] before an instant over which its rates are means; a pool of oil fills and empties within minutes


def rate(time: Array, volume: Array, window: float = WINDOW) -> Array:
    """Return the mean rate (N,) [m3/s] of a volume (N,) [m3] over the `window` [s] before each instant (N,) [s], 0 at the first.

    Before the window has passed since the first instant, it is the mean since then.
    """
    begin = np.maximum(time - window, time[0])
    duration = time - begin
    grown = volume - np.interp(begin, time, volume)
    grown[np.abs(grown) < ROUND_OFF * np.abs(volume).max(initial=0.0)] = 0.0
    return np.divide(grown, duration, out=np.zeros_like(grown), where=duration > 0.0)


def rates_diagram(history: BoomHistory, moments: Sequence[KeyMoment]) -> Figure | None:
    """Draw oil met, held, recovered and lost; their rates; and with skimmers their efficiencies. None if the boom met no oil."""
    met, recovered = history.oil["met"], history.recovered
    if not met.any():
        return None
    count = 2 if recovered is None else 3
    figure = empty_figure(2.2 * count)
    rows: list[Axes] = list(figure.subplots(count, 1, sharex=True))
    _draw_volumes(rows[0], history, met, recovered)
    _draw_rates(rows[1], history, met, recovered)
    if recovered is not None:
        _draw_efficiencies(rows[2], history, met, recovered)
    for axes in rows:
        axes.set_ylim(bottom=0.0)
        axes.legend(frameon=False, ncols=1, loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=9)
    finish(rows, moments)
    return figure


def rate_figures(history: BoomHistory) -> list[tuple[str, str]]:
    """List the largest rates and the final efficiencies in words, for the table of figures; empty if the boom met no oil."""
    met, recovered = history.oil["met"], history.recovered
    if not met.any():
        return []
    rows = [("Largest encounter rate, mean over a minute", _per_hour(history, met))]
    if recovered is not None:
        rows.append(("Largest recovery rate, mean over a minute", _per_hour(history, recovered)))
        rows.append(("Throughput efficiency: oil recovered, of all oil met", _percent(recovered, met)))
        rows.append(
            ("Recovery efficiency: oil in the fluid that skimmers took", _percent(recovered, _skimmed_fluid(history)))
        )
    return rows


def _skimmed_fluid(history: BoomHistory) -> Array:
    """Return the oil and water (N,) [m3] that skimmers at the boom had taken."""
    fluids = [np.zeros_like(history.time), *history.skimmed("oil"), *history.skimmed("water")]
    return np.asarray(np.sum(fluids, axis=0))


def _draw_volumes(axes: Axes, history: BoomHistory, met: Array, recovered: Array | None) -> None:
    factor, unit = volume_unit(history)
    shown = {"met": (met, line_color(0)), "held": (history.oil["contained"], HELD_COLOR)}
    shown |= {} if recovered is None else {"recovered": (recovered, line_color(2))}
    for name, (volume, color) in shown.items():
        axes.plot(history.time, factor * volume, color=color, linewidth=1.5, label=name)
    _stack_losses(axes, history.time, factor * history.oil["passed"], factor * history.oil["passed_modelled"])
    axes.set_title("Oil met, held, recovered and lost", loc="left")
    axes.set_ylabel(unit)


def _draw_rates(axes: Axes, history: BoomHistory, met: Array, recovered: Array | None) -> None:
    shown = {"encounter rate": (0, met)} | ({} if recovered is None else {"recovery rate": (2, recovered)})
    for name, (place, volume) in shown.items():
        axes.plot(history.time, HOUR * rate(history.time, volume), color=line_color(place), linewidth=1.5, label=name)
    lost, modelled = (
        HOUR * rate(history.time, volume) for volume in (history.oil["passed"], history.oil["passed_modelled"])
    )
    _stack_losses(axes, history.time, lost, modelled)
    axes.set_title(f"Rates, means over {WINDOW:.0f} s", loc="left")
    axes.set_ylabel("m³/h")


def _stack_losses(axes: Axes, time: Array, lost: Array, modelled: Array) -> None:
    """Fill what was lost, the resolved part below the modelled one; parts that are 0 throughout are left out."""
    resolved = np.maximum(lost - modelled, 0.0)
    parts = {
        "lost, resolved": (resolved, RESOLVED_COLOR),
        "lost, modelled": (np.maximum(modelled, 0.0), MODELLED_COLOR),
    }
    shown = {name: part for name, part in parts.items() if (part[0] > _LEAST * max(float(lost.max()), 0.0)).any()}
    if shown:
        values, colors = zip(*shown.values(), strict=True)
        axes.stackplot(time, values, labels=list(shown), colors=colors, alpha=0.75, linewidth=0.0)


def _draw_efficiencies(axes: Axes, history: BoomHistory, met: Array, recovered: Array) -> None:
    shown = {"throughput": (0, met), "recovery": (2, _skimmed_fluid(history))}
    for name, (place, whole) in shown.items():
        share = np.divide(100.0 * recovered, whole, out=np.full_like(whole, np.nan), where=whole > _LEAST * whole.max())
        axes.plot(history.time, share, color=line_color(place), linewidth=1.5, label=name)
    axes.set_ylim(top=105.0)
    axes.set_title("Efficiencies of the skimmers, so far", loc="left")
    axes.set_ylabel("%")


_LEAST = 0.01  # [1] of the largest value, below which a share of it says nothing


def _per_hour(history: BoomHistory, volume: Array) -> str:
    return f"{three_figures(HOUR * float(rate(history.time, volume).max()))} m³/h"


def _percent(part: Array, whole: Array) -> str:
    return f"{100.0 * float(part[-1] / whole[-1]):.0f} %" if whole[-1] > 0.0 else "no oil taken"


def loss_by_speed(history: BoomHistory) -> tuple[Array, Array, Array]:
    """Return speeds (K,) [m/s], the middles of steps of 0.1 kn, and the loss there (K,) [of the pool a minute], resolved and modelled.

    The loss of a recorded interval counts at its mean tow speed, over the oil held at its beginning. A step that took no time is left out.
    Oil that was re-contained counts against the loss, but not below 0.
    """
    duration = np.diff(history.time)
    step = np.floor(0.5 * (history.tow_speed[1:] + history.tow_speed[:-1]) / STEP).astype(np.int64)
    passed, modelled = history.oil["passed"], history.oil["passed_modelled"]
    pool = np.maximum(history.oil["contained"][:-1], 0.0)
    held = np.bincount(step, weights=pool * duration)
    steps = np.flatnonzero(held > 0.0)
    rates: list[Array] = []
    for volume in (passed - modelled, modelled):
        sums = np.bincount(step, weights=np.diff(volume), minlength=len(held))[steps]
        rates.append(np.asarray(np.maximum(0.0, 60.0 * sums / held[steps]), np.float64))
    return np.asarray((steps + 0.5) * STEP, np.float64), rates[0], rates[1]


def loss_curve(history: BoomHistory, moments: Sequence[KeyMoment]) -> Figure | None:
    """Draw the loss over the tow speed beside the band of practice; None if no oil was lost."""
    if len(history.time) < 2 or not history.oil["passed"].any():
        return None
    figure = empty_figure(3.0)
    axes = figure.subplots()
    speed, resolved, modelled = loss_by_speed(history)
    place, width = speed / KNOT, 0.85 * STEP / KNOT
    axes.axvspan(*PRACTICE, color=_BAND, label="first loss in practice, 0.6 to 1.0 kn")
    axes.bar(place, 100.0 * resolved, width, color=RESOLVED_COLOR, label="resolved by particles")
    axes.bar(
        place, 100.0 * modelled, width, bottom=100.0 * resolved, color=MODELLED_COLOR, label="modelled by closures"
    )
    for found, name, style in ((history.losses.first, "first loss", "--"), (history.losses.gross, "gross loss", ":")):
        if found is not None:
            axes.axvline(found / KNOT, color="#c23030", linestyle=style, label=f"{name}, {found / KNOT:.2f} kn")
    axes.set_xlabel("tow speed through the water [kn]")
    axes.set_ylabel("% of the pool a minute")
    axes.set_title("Loss over speed", loc="left")
    axes.legend(frameon=False, fontsize=9, loc="upper left")
    return figure
