"""Figures that swing with the waves are told as their means over a few seconds."""

from __future__ import annotations

import math

import numpy as np
import pytest

from scenarios.conduct.history import SPAN, Means


@pytest.mark.parametrize("step", [0.05, 0.5])
def test_a_wave_is_averaged_away_and_a_steady_speed_stays(step: float) -> None:
    means, period = Means(), SPAN / 2.0
    for index in range(round(20.0 / step)):
        time = index * step
        swing = math.cos(2.0 * math.pi * time / period)
        found = means.mean("port", time, [0.5 + 0.3 * swing, 0.3 * swing])
    assert found == pytest.approx([0.5, 0.0], abs=1e-9)  # two whole periods


def test_a_ramp_lags_by_half_the_span() -> None:
    means = Means()
    for index in range(200):
        found = means.mean("pull", 0.1 * index, 0.1 * index)
    assert float(found) == pytest.approx(19.9 - SPAN / 2.0, abs=0.1)


def test_a_moment_that_is_shown_twice_counts_once_and_what_is_not_known_is_not_averaged() -> None:
    means = Means()
    assert float(means.mean("pull", 1.0, 3.0)) == 3.0
    assert float(means.mean("pull", 1.0, 5.0)) == 5.0  # an order came, and the same moment is told again
    assert float(means.mean("pull", 3.0, 7.0)) == 7.0
    assert np.isnan(means.mean("pull", 4.0, math.nan))
    assert float(means.mean("pull", 5.0, 1.0)) == 1.0
