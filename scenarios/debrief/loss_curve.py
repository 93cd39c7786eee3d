"""The loss of a boom over its speed through the water: the curve of a tow-speed ramp, resolved and modelled parts apart."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from oilsim.core.physical_constants import KNOT
from scenarios.debrief.boom_history import BoomHistory
from scenarios.debrief.diagrams import empty_figure
from scenarios.debrief.key_moments import KeyMoment

Array = NDArray[np.float64]
STEP = 0.1 * KNOT  # [m/s] width of a bar, as the steps of ASTM F2084
PRACTICE = (0.6, 1.0)  # [kn] in which booms lose their first oil in practice: 0.31 to 0.51 m/s
RESOLVED_COLOR, MODELLED_COLOR, _BAND = "#1f5fa8", "#e07b20", "#dfe8d8"


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
