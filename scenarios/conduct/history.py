"""The past of a run for a page that is opened late: a sample of gauges and of the vessels' tracks, of bounded size."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

MOST_ROWS = 1500  # [1] of a sample; then every second row is dropped, and rows come half as often
CLOSEST = 0.5  # [s] of simulated time between rows at first


class History:
    """Rows of a run's past, thinned out evenly."""

    def __init__(self) -> None:
        self.rows: list[dict[str, Any]] = []
        self._between = CLOSEST

    def take(self, state: Mapping[str, Any]) -> dict[str, Any] | None:
        """Keep a state's row if it is due, and return it; None if it is not."""
        time = state["time"]
        while self.rows and self.rows[-1]["time"] > time:
            self.rows.pop()  # the run went back
        if self.rows and time - self.rows[-1]["time"] < self._between - 1e-9:
            return None
        row = {
            "time": time,
            "vessels": {name: [round(one["x"], 2), round(one["y"], 2)] for name, one in state["vessels"].items()},
            "booms": {
                name: {key: boom[key] for key in ("oil_retained", "oil_lost", "normal_speed_held", "tow_speed", "pull")}
                for name, boom in state["booms"].items()
            },
        }
        self.rows.append(row)
        if len(self.rows) > MOST_ROWS:
            self.rows = self.rows[::2]
            self._between *= 2.0
        return row
