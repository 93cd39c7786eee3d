"""The series of a boom's history stand at the frames of its clock."""

from __future__ import annotations

import numpy as np

from recordings.replay.recording import Series
from scenarios.debrief.boom_history import _on


def series(index: list[int], value: list[float]) -> Series:
    return Series(index=np.array(index), time=0.1 * np.array(index), value=np.array(value))


def test_a_cause_that_loses_oil_later_only_had_lost_none_before() -> None:
    clock = np.array([0, 2, 4, 6])
    assert _on(clock, series([4, 6], [1.0, 3.0]), "oil_lost/drainage").tolist() == [0.0, 0.0, 1.0, 3.0]
    late = _on(clock, series([2, 4, 6], [5.0, 6.0, 7.0]), "tow_tension/port")
    np.testing.assert_array_equal(late, [np.nan, 5.0, 6.0, 7.0])
    whole = series([0, 2, 4, 6, 8], [1.0, 2.0, 3.0, 4.0, 5.0])
    assert _on(clock, whole, "tow_speed").tolist() == [1.0, 2.0, 3.0, 4.0]
