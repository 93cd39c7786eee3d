"""The harbour flume goes on where it was ended, and reads what it wrote."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from booms.losses.rates import Closures
from tests.validation.bodies import harbour_flume as flume
from tests.validation.bodies.boom_losses import drivers
from tests.validation.case import Bench

ROW = flume.Row(
    oil=900.0, resolution=33, speed=0.3, flow=0.29, pool=0.012, passed=0.0, thickness=0.05, length=0.3, front=0.04,
    friction=0.004, suction=1.4,
)  # fmt: skip


def test_a_run_that_was_ended_goes_on_as_if_it_had_not(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(flume, "FLUME", replace(flume.FLUME, depth=3.0, length=5.0, skirt=3.5))
    monkeypatch.setattr(flume, "SPEEDS", (0.8, 1.0))
    for folder, ends in (("whole", (2,)), ("ended", (1, 2))):
        for end in ends:
            series = flume.Series(Bench(threads=1), 900.0, 3, tmp_path / folder)
            monkeypatch.setattr(flume, "SPEEDS", (0.8, 1.0)[:end])
            series.run()
            monkeypatch.setattr(flume, "SPEEDS", (0.8, 1.0))
    whole, ended = ((tmp_path / folder / "rows.csv").read_text() for folder in ("whole", "ended"))
    assert whole == ended
    assert len(flume.read(tmp_path / "whole" / "rows.csv")) == 2


def test_rows_survive_the_table(tmp_path: Path) -> None:
    flume.append(tmp_path / "rows.csv", replace(ROW, speed=0.32))
    flume.append(tmp_path / "rows.csv", ROW)
    assert flume.read(tmp_path / "rows.csv") == [ROW, replace(ROW, speed=0.32)]
    assert flume.read(tmp_path / "none.csv") == []


def test_first_loss_is_a_share_of_the_pool_in_one_passage_of_the_water() -> None:
    """The flume is 1.6 m long: at 0.3 m/s, 2 % of 0.012 m2 in 5.3 s are 4.5e-5 m2/s."""
    assert flume.first_loss([replace(ROW, passed=4.4e-5), replace(ROW, speed=0.32, passed=5e-5)]) == 0.32
    assert flume.first_loss([replace(ROW, passed=4.6e-5)]) == 0.3
    assert np.isnan(flume.first_loss([ROW]))


def test_closures_are_driven_by_the_flow_and_the_pool_of_each_row() -> None:
    rows = [replace(ROW, flow=speed) for speed in (0.3, 0.45)]
    given = Closures(skirt_depth=0.2).rates(drivers(0.45, 0.2, np.array([0.012])), flume.liquids(900.0)).sum()
    assert flume.by_closures(rows) == pytest.approx([0.0, float(given)])
    assert given > 0.0
