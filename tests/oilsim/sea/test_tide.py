"""A tide moves the whole surface, and the water under it goes along."""

from __future__ import annotations

import math

import numpy as np
import pytest

from oilsim.sea import CurrentProfile, RegularWaves, Sea, SeaDescription, SteadyFlow, Tide

FALLING = Tide(range=4.0, high_water=-250.0, period=1000.0)  # fastest at the start, 2 pi A / T = 12.6 mm/s


def test_rise_is_a_cosine_from_high_water_and_starts_at_zero() -> None:
    assert FALLING.rise(0.0) == 0.0
    assert FALLING.rise(250.0) == pytest.approx(-2.0)  # low water
    assert FALLING.rise(750.0) == pytest.approx(2.0)  # high water
    assert FALLING.rise(0.5) / 0.5 == pytest.approx(-2.0 * math.pi * 2.0 / 1000.0, rel=1e-5)


def test_the_sea_is_the_same_sea_at_another_height() -> None:
    parts = {
        "depth": 10.0,
        "level": 1.0,
        "waves": RegularWaves(height=0.4, period=4.0),
        "current": CurrentProfile(flow=SteadyFlow(speed=0.5), shear_exponent=1 / 7),
    }
    still, tidal = Sea(SeaDescription(**parts)), Sea(SeaDescription(**parts, tide=FALLING))
    rise = FALLING.rise(100.0)
    points = np.random.default_rng(0).uniform((-20.0, -20.0, -8.0), (20.0, 20.0, 1.0), (50, 3))
    lower = points + np.array((0.0, 0.0, rise))
    one, other = still.kinematics(points, 100.0), tidal.kinematics(lower, 100.0)
    assert other.elevation == pytest.approx(one.elevation + rise, abs=1e-12)
    assert other.pressure == pytest.approx(one.pressure, abs=1e-6)
    assert other.velocity == pytest.approx(one.velocity, abs=1e-12)
    assert tidal.elevation(points, 100.0) == pytest.approx(one.elevation + rise, abs=1e-12)
    lines = np.linspace(-5.0, 5.0, 21)
    assert tidal.grid_elevation(lines, lines, 100.0) == pytest.approx(still.grid_elevation(lines, lines, 100.0) + rise)
    assert tidal.current(lower[:, 2], 100.0) == pytest.approx(still.current(points[:, 2], 100.0))
    assert tidal.still_level(100.0) == pytest.approx(1.0 + rise)


def test_wrong_tides_are_refused_at_once() -> None:
    with pytest.raises(ValueError, match=r"(?s)range.*period"):
        Tide(range=-1.0, period=0.0)
