"""A current that grows before a skirt until its oil drains beneath it: the ramp of case 23, also from slower flow and with tension.

    python -m tests.validation.bodies.flumes.skirt_ramp --oil 900 --resolution 64 [--tension] [--minutes 60] [--keep]

runs the ramp of one oil from U = 0.15 V on, V = sqrt(g Delta d); case 23 begins at 0.4 V. The state is saved every five minutes and at the
end of a piece (`--minutes`): the same command goes on from there, bit for bit. `--keep` puts the curve, a row each 0.01 V, into
`skirt_ramp.csv` beside this file.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.seas import shallow_sea
from tests.validation.bodies.flumes.flume import Flume, fill_flume
from tests.validation.bodies.flumes.flume import unit_of_speed as unit_at_draft
from tests.validation.bodies.flumes.pieces import Piece, add_options, piece_of, read_options, rows_of, save, saved
from tests.validation.bodies.flumes.tables import keep
from tests.validation.case import Bench

Double = NDArray[np.float64]

DRAFT = 0.5  # m: d of the skirt
FLUME = Flume(draft=DRAFT, depth=3.0, length=9.0, skirt=6.0)
OILS = (840.0, 900.0, 950.0)  # kg/m3
FIRST, SLOW, LAST = 0.4, 0.15, 0.9  # U / V: where the ramp begins in case 23, and as a command, and where it ends
HELD, GROWTH = 15.0, 0.006  # d/V at the first, and how fast it grows after that [V/d]
LOST, ENOUGH = 0.03, 0.15  # of the oil: the first loss, and what ends a run
BEHIND = 0.5, 2.5  # d behind the skirt, where oil counts as lost
SAMPLE = 0.1  # s
STEP = 0.01  # V between two rows of the table
FOLDER = Path("validation-report/skirt-ramp")
MEASURED = Path(__file__).with_name("skirt_ramp.csv")
KEY = ("oil", "resolution", "tension", "balanced", "first", "number")  # of a row


@dataclass(frozen=True, kw_only=True)
class Setting:
    """A ramp: oil [kg/m3], spacings of draft, tension [N/m], U / V at the beginning, and lean of the skirt, back [rad].

    balanced: whether the water is well balanced, as in windows.
    """

    oil: float
    resolution: int
    tension: float = 0.0
    first: float = FIRST
    lean: float = 0.0
    balanced: bool = False

    @property
    def unit(self) -> float:
        """V = sqrt(g Delta d) [m/s]."""
        return unit_of_speed(self.oil)

    def number(self, time: float) -> float:
        """U / V at a time [s]."""
        return self.first + GROWTH * max(0.0, time * self.unit / DRAFT - HELD)

    @property
    def span(self) -> float:
        """Time [s] until `LAST`."""
        return (HELD + (LAST - self.first) / GROWTH) * DRAFT / self.unit


@dataclass(frozen=True, kw_only=True)
class Row:
    """A point of the curve: oil [kg/m3], spacings of draft, tension [N/m], U / V, U [m/s], and shares of the oil.

    balanced: 1 in well-balanced water, else 0; first: U / V at the beginning; lost: has passed under the skirt; ahead: lies in the zone
    that renews the current or has left it upstream.
    """

    oil: float
    resolution: int
    tension: float
    balanced: int
    first: float
    number: float
    speed: float
    lost: float
    ahead: float


class Ramp:
    """A ramp that is under way; with a path it is saved there, and goes on from there."""

    def __init__(self, bench: Bench, setting: Setting, state: Path | None = None) -> None:
        self.bench, self.setting, self._state = bench, setting, state
        self.fluid, self.driving = fill_flume(
            bench, FLUME, DRAFT / setting.resolution, setting.oil, setting.first * setting.unit, setting.lean,
            setting.tension, setting.balanced,
        )  # fmt: skip
        self.lost, self.strayed = set[int](), set[int]()
        self.rows: list[Row] = []
        if state and (found := saved(state)):
            self.rows = rows_of(found, Row, state)
            self.fluid.restore_state(found["fluid"])
            self.lost, self.strayed = set(found["lost"]), set(found["strayed"])

    @property
    def is_done(self) -> bool:
        """Whether the current or the loss has reached its end."""
        return bool(self.rows) and (self.rows[-1].number >= LAST or self.rows[-1].lost >= ENOUGH)

    def run(self, piece: Piece | None = None) -> bool:
        """Go on until the ramp is done or the piece is over; returns whether it is done."""
        piece, first = piece or Piece(), self.fluid.time
        while not (self.is_done or piece.is_over):
            self._look()
            if piece.asks_to_save():
                self._save()
                piece.say(self._progress(piece, first))
        self._save()
        piece.say(self._progress(piece, first))
        self.fluid.close()
        return self.is_done

    def _look(self) -> None:
        """Advance by one sample; count once the current grows."""
        number = self.setting.number(self.fluid.time)
        self.driving.sea = shallow_sea(self.driving.sea.description.depth, current=(number * self.setting.unit, 0.0))
        self.bench.advance(self.fluid, SAMPLE)
        ids, x = self.fluid.phase_ids("oil"), self.fluid.phase_positions("oil")[:, 0]
        behind = (x - FLUME.skirt_place) / DRAFT
        # oil that spreads through the zone against a slow current comes round from behind, and has not passed the skirt
        self.strayed |= set(ids[behind > BEHIND[1]].tolist()) - self.lost
        if number > self.setting.first:
            self.lost |= set(ids[(behind > BEHIND[0]) & (behind < BEHIND[1])].tolist()) - self.strayed
            ahead = np.mean(x < FLUME.zone * DRAFT) + len(self.strayed) / len(ids)
            self.rows.append(self._row(number, len(self.lost) / len(ids), float(ahead)))

    def _row(self, number: float, lost: float, ahead: float) -> Row:
        setting = self.setting
        return Row(
            oil=setting.oil, resolution=setting.resolution, tension=setting.tension, balanced=int(setting.balanced),
            first=setting.first, number=number, speed=number * setting.unit, lost=lost, ahead=ahead,
        )  # fmt: skip

    def _save(self) -> None:
        if self._state:
            rows = [asdict(row) for row in self.rows]
            state = {"fluid": self.fluid.save_state(), "lost": self.lost, "strayed": self.strayed, "rows": rows}
            save(self._state, state)

    def _progress(self, piece: Piece, first: float) -> str:
        left = 0.0 if self.is_done else self.setting.span - self.fluid.time
        lost = f", {self.rows[-1].lost:.2%} lost" if self.rows else ""
        number = self.setting.number(self.fluid.time)
        return f"U = {number:.3f} V{lost}: {piece.progress(self.fluid.time - first, left)}"


def unit_of_speed(oil_density: float) -> float:
    """V = sqrt(g Delta d) [m/s]."""
    return unit_at_draft(oil_density, DRAFT)


def curve(rows: list[Row]) -> Double:
    """U / V and the share that has passed (2, n)."""
    return np.array([(row.number, row.lost) for row in rows]).T


def first_loss(numbers: Double, shares: Double) -> float:
    """Froude number at which LOST of the oil has passed under; NaN if less has."""
    passed = np.flatnonzero(shares >= LOST)
    return float(numbers[passed[0]]) if len(passed) else math.nan


def thinned(rows: list[Row]) -> list[Row]:
    """The first row of each `STEP`, the first loss, and the last row."""
    places = [math.floor(row.number / STEP) for row in rows]
    lost = next((n for n, row in enumerate(rows) if row.lost >= LOST), None)
    return [row for n, row in enumerate(rows) if n in (0, lost, len(rows) - 1) or places[n] != places[n - 1]]


def main() -> None:
    """Run one ramp, or a piece of it."""
    parser = argparse.ArgumentParser(description="A current that grows before a skirt.")
    add_options(parser, OILS, FOLDER)
    parser.add_argument("--first", type=float, default=SLOW, metavar="U/V", help=f"beginning; default {SLOW:g}")
    options = read_options(parser, DRAFT)
    setting = Setting(
        oil=options.oil, resolution=options.resolution, tension=options.tension, first=options.first,
        balanced=options.balanced,
    )  # fmt: skip
    kind = "-balanced" if setting.balanced else ""
    name = f"{setting.oil:g}-{setting.resolution}-{setting.tension:g}-{setting.first:g}{kind}.pickle"
    ramp = Ramp(Bench(threads=options.threads), setting, options.folder / name)
    ramp.run(piece_of(options))
    if ramp.rows:
        print(f"first loss at {first_loss(*curve(ramp.rows)):.3f} V")
    if options.keep:
        keep(MEASURED, thinned(ramp.rows), KEY)


if __name__ == "__main__":
    main()
