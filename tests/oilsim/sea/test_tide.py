"""A tide moves the whole surface, and the water under it goes along."""

from __future__ import annotations

import math

import numpy as np
import pytest

from oilsim.sea import CurrentProfile, RegularWaves, Sea, SeaDescription, SteadyFlow, Tide

FALLING = Tide(
    turns=((-250.0, 5.0), (250.0, 1.0), (750.0, 5.0))
)  # fastest at the start, pi / 2 times 4 m in 500 s: 12.6 mm/s


def test_height_follows_half_a_cosine_from_turn_to_turn_and_starts_at_zero() -> None:
    assert FALLING.rise(0.0) == 0.0
    assert FALLING.rise(250.0) == pytest.approx(-2.0)  # low water
    assert FALLING.rise(750.0) == pytest.approx(2.0)  # high water
    assert FALLING.rise(0.5) / 0.5 == pytest.approx(-0.5 * math.pi * 4.0 / 500.0, rel=1e-5)
    times = np.linspace(-250.0, 750.0, 101)
    assert [FALLING.rise(time) for time in times] == pytest.approx(-2.0 * np.sin(math.pi * times / 500.0), abs=1e-12)


def test_tides_of_unequal_range_meet_at_their_turns_without_speed() -> None:
    table = ((0.0, 6.5), (7.4, 0.8), (12.2, 6.6), (19.6, 0.9))  # h, m
    tide = Tide(turns=tuple((3600.0 * hours, height) for hours, height in table))
    for hours, height in table:
        assert tide.rise(3600.0 * hours) == pytest.approx(height - 6.5)
        for side in (-60.0, 60.0):
            if 0.0 < hours < 19.6:
                assert abs(tide.rise(3600.0 * hours + side) - (height - 6.5)) < 1e-3  # a minute from a turn
    assert tide.lowest(6.0 * 3600.0) == tide.rise(6.0 * 3600.0)
    assert tide.lowest(12.0 * 3600.0) == pytest.approx(-5.7)


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


@pytest.mark.parametrize(
    ("turns", "reason"),
    [
        ((), "turns is a table of 0, allowed: 2 high and low waters, or more"),
        (
            ((0.0, 1.0), (-5.0, 30.0)),
            "turns has -5 s after 0 s, allowed: times that rise; turns has 30 m after 1 m, allowed: at most 20 m",
        ),
        (((10.0, 1.0), (500.0, 2.0)), "turns has 10 s as its first time, allowed: 0"),
        (((0.0, math.nan), (500.0, 2.0)), "turns is nan, allowed: finite"),
    ],
)
def test_wrong_tides_are_refused_at_once(turns: tuple[tuple[float, float], ...], reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        Tide(turns=turns)


def test_nothing_is_known_beyond_the_table() -> None:
    with pytest.raises(ValueError, match=r"time is 751 s, allowed: -250 to 750 s"):
        FALLING.rise(751.0)
