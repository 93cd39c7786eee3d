"""The pull of a moored boom in waves: by orbital velocities it grows by half, and by no more than a boom that stood still would feel."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.scenarios.setup.test_lean_of_neighbours import history_of

CURRENT, DRAFT, HEIGHT = 0.5 * 1852.0 / 3600.0, 0.75, 0.28


def of_a_fixed_boom(period: float) -> float:
    """Return the mean of |U + u| (U + u) over phase and draft, over U^2: u = pi H / T e^(kz) cos, the waves' own velocity in deep water."""
    number = (2.0 * np.pi / period) ** 2 / 9.81
    depth = np.linspace(0.0, DRAFT, 51)[:, None]
    phase = np.linspace(0.0, 2.0 * np.pi, 361)[None, :-1]
    flow = CURRENT + np.pi * HEIGHT / period * np.exp(-number * depth) * np.cos(phase)
    return float((np.abs(flow) * flow).mean() / CURRENT**2)


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_regular_waves_raise_the_mean_pull_by_their_orbital_velocities(tmp_path: Path) -> None:
    def pull(more: str) -> float:
        history, late = history_of(more, tmp_path)
        return float(np.mean([tension[late].mean() for tension in history.tow_tension.values()]))

    calm = pull("")
    for period in (2.5, 3.5):
        more = f"sea.waves = {{kind = 'regular', height = {HEIGHT}, period = {period}, direction_deg = 180.0}}\n"
        assert 1.02 < pull(more) / calm < of_a_fixed_boom(period)
