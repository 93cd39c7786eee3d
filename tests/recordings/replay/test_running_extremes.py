"""What a series reached between recorded frames, by its worst value since the run began."""

from __future__ import annotations

import numpy as np
import pytest

from recordings.replay.series import reached


@pytest.mark.parametrize(
    ("worst", "expected"),
    [
        ([9.0, 9.0, 12.0, 12.0], [1.0, 3.0, 12.0, 2.0]),  # the first frame's is from before the recording
        ([9.0, 9.0, 12.0], [1.0, 3.0, 12.0, 2.0]),  # cut off
        ([0.0, 0.0, -1.0, -2.0], [1.0, 3.0, -1.0, -2.0]),  # the smallest
        ([], [1.0, 3.0, 2.0, 2.0]),
        (None, [1.0, 3.0, 2.0, 2.0]),
    ],
)
def test_the_worst_counts_where_it_has_changed(worst: list[float] | None, expected: list[float]) -> None:
    sampled = np.array([1.0, 3.0, 2.0, 2.0])
    assert reached(sampled, None if worst is None else np.array(worst)).tolist() == expected
    assert sampled.tolist() == [1.0, 3.0, 2.0, 2.0]
