"""When a slice's first loss is: a particle that is put back at once was not lost."""

from __future__ import annotations

import math

import numpy as np

from tests.validation.bodies.boom_slice import LASTING, first_lasting


def test_first_loss_is_where_it_began_to_last() -> None:
    speeds = np.arange(4.0 * LASTING)
    lost = np.zeros_like(speeds)
    lost[10] = lost[20 : 20 + LASTING - 1] = 0.02  # put back
    assert math.isnan(first_lasting(speeds, lost, 0.01))
    lost[2 * LASTING :] = 0.02
    assert first_lasting(speeds, lost, 0.01) == 2.0 * LASTING
    assert math.isnan(first_lasting(speeds[: 3 * LASTING - 1], lost[: 3 * LASTING - 1], 0.01))  # not known yet
