"""A series of any length keeps within its room, evenly, and goes on where it was saved."""

from __future__ import annotations

import numpy as np
import pytest

from recordings.files.checkpoint import state_from_bytes, state_to_bytes
from scenarios.running.instructor import MOST, EvenSample


def sampled(values) -> EvenSample:
    sample = EvenSample()
    for value in values:
        sample.append(value)
    return sample


@pytest.mark.parametrize(
    ("count", "stride"), [(0, 1), (1, 1), (MOST, 1), (MOST + 1, 2), (2 * MOST, 2), (2 * MOST + 1, 4), (9 * MOST, 16)]
)
def test_values_are_even_and_begin_with_the_first(count, stride):
    assert sampled(map(float, range(count))).values == [float(n) for n in range(0, count, stride)]


@pytest.mark.parametrize("cut", [0, MOST - 1, MOST, MOST + 1, 3 * MOST + 5])
def test_a_saved_series_goes_on(cut):
    whole = [0.1 * n for n in range(4 * MOST + 3)]
    saved = state_from_bytes(state_to_bytes(sampled(whole[:cut]).save_state()))
    again = EvenSample.restored(saved)
    for value in whole[cut:]:
        again.append(value)
    assert again.values == sampled(whole).values


@pytest.mark.parametrize("change", [{"stride": 0}, {"seen": 4}, {"stride": 2}, {"values": np.zeros(0)}])
def test_a_sample_that_no_series_has_is_refused(change):
    saved = sampled([1.0, 2.0, 3.0]).save_state()
    with pytest.raises(ValueError, match=r"has a sample of shape"):
        EvenSample.restored(saved | change)
