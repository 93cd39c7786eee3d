"""Tell what part of each boom the particles of windows bear at the start."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from booms.deployment import BoomLayout
from coupling.participants.window import FADE
from oilsim.window.window import Window
from scenarios.schema.window import WindowTable, window_place


def segments_borne(
    windows: Mapping[str, Window], booms: Mapping[str, BoomLayout], tables: Mapping[str, WindowTable]
) -> Iterator[str]:
    """Say of each boom in a window how many of its segments particles bear at the start."""
    for place, boom, shares in _boom_shares(windows, booms, tables):
        if shares.any():
            borne = f"{np.count_nonzero(shares)} of the {len(shares)} segments of boom {boom!r}"
            yield f"{place}: particles bear {borne} at the start; formulas bear those that are in no window"


def booms_in_rims(
    windows: Mapping[str, Window], booms: Mapping[str, BoomLayout], tables: Mapping[str, WindowTable]
) -> Iterator[str]:
    """Say of each boom in a window if none of its segments is in the middle, where particles would bear it."""
    for place, boom, shares in _boom_shares(windows, booms, tables):
        if not shares.any():
            yield (
                f"{place}: boom {boom!r} lies in its rim at the start, and no segment in its middle, so formulas alone load the boom; a"
                f" larger window has it in the middle, or {place}.target = {boom!r}"
            )


def _boom_shares(
    windows: Mapping[str, Window], booms: Mapping[str, BoomLayout], tables: Mapping[str, WindowTable]
) -> Iterator[tuple[str, str, NDArray[np.float64]]]:
    """Yield each window's place in the file, each boom in it, and the shares (n,) of the particles in the loads of its segments."""
    for name, window in windows.items():
        rim, fade = window.rim, FADE * window.settings.spacing
        for boom, layout in booms.items():
            places = np.array([segment.position for segment in layout.segments])
            within = (np.abs(places[:, :2] - rim.center) < 0.5 * np.array(rim.size)).all(1)
            shares = np.where(within, np.clip((rim.inward(places) - rim.width) / fade, 0.0, 1.0), 0.0)
            if within.any():
                yield window_place(name, tables), boom, shares
