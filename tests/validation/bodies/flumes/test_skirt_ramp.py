"""The ramp before a skirt goes on where it was ended, and counts what passes under the skirt."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.validation.bodies.flumes import skirt_ramp as ramp
from tests.validation.bodies.flumes.tables import read
from tests.validation.bodies.flumes.test_harbour_flume import Looks
from tests.validation.case import Bench

SETTING = ramp.Setting(oil=900.0, resolution=4, tension=0.02)


def test_a_ramp_in_pieces_is_that_of_a_whole_one(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(ramp, "HELD", 1.0)
    monkeypatch.setattr(ramp, "GROWTH", 0.2)
    whole = ramp.Ramp(Bench(threads=1), SETTING)
    assert whole.run()
    while not (pieces := ramp.Ramp(Bench(threads=1), SETTING, tmp_path / "state.pickle")).run(Looks()):
        assert pieces.rows == whole.rows[: len(pieces.rows)]
    assert pieces.rows == whole.rows
    assert whole.rows[-1].lost >= ramp.ENOUGH or whole.rows[-1].number >= ramp.LAST


def test_the_current_is_held_and_then_grows() -> None:
    unit = ramp.DRAFT / SETTING.unit
    assert SETTING.number(ramp.HELD * unit) == ramp.FIRST
    assert SETTING.number((ramp.HELD + 10.0) * unit) == pytest.approx(ramp.FIRST + 10.0 * ramp.GROWTH)
    assert SETTING.number(SETTING.span) == pytest.approx(ramp.LAST)


def test_the_table_keeps_the_first_loss() -> None:
    numbers, shares = np.linspace(0.4, 0.5, 101), np.linspace(0.0, 0.0999, 101)
    rows = [
        ramp.Row(
            oil=900.0,
            resolution=64,
            tension=0.0,
            balanced=0,
            first=0.4,
            number=number,
            speed=number,
            lost=share,
            ahead=0.0,
        )
        for number, share in zip(numbers.tolist(), shares.tolist(), strict=True)
    ]
    kept = ramp.thinned(rows)
    assert ramp.first_loss(*ramp.curve(kept)) == ramp.first_loss(*ramp.curve(rows)) == pytest.approx(0.431)
    assert (kept[0], kept[-1], len(kept)) == (rows[0], rows[-1], 12)


def test_the_committed_table_has_ramps_with_and_without_tension() -> None:
    rows = read(ramp.MEASURED, ramp.Row)
    assert {0.0} < {row.tension for row in rows}
    assert all(0.0 <= row.lost <= 1.0 for row in rows)
