"""The undisturbed motion of the sea: it is that of its particles, and in deep water Gerstner's wave."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim.sea import CurrentProfile, JonswapWaves, RegularWaves, Sea, SeaDescription, SteadyFlow, TidalFlow
from oilsim.window.sea_motion import SeaMotion

GRAVITY = 9.81
STEP = 1e-4


def regular(height: float = 0.5, period: float = 3.0, depth: float = 100.0) -> Sea:
    return Sea(SeaDescription(depth=depth, gravity=GRAVITY, waves=RegularWaves(height=height, period=period)))


def random_places(count: int, deepest: float = 4.0) -> np.ndarray:
    places = np.random.default_rng(1).uniform(-20.0, 20.0, (count, 3))
    places[:, 2] = -np.abs(places[:, 2]) * deepest / 20.0
    return places


SEAS = {
    "jonswap on a tide": SeaDescription(
        depth=12.0,
        waves=JonswapWaves(significant_height=0.5, peak_period=3.5, spread=10.0, seed=2),
        current=CurrentProfile(flow=TidalFlow(speed=0.5, turn=600.0)),
    ),
    "sheared current": SeaDescription(
        depth=8.0,
        waves=RegularWaves(height=0.3, period=3.0, direction=0.7),
        current=CurrentProfile(flow=SteadyFlow(speed=0.4, direction=2.0), shear_exponent=1.0 / 7.0),
    ),
    "no waves": SeaDescription(depth=8.0, current=CurrentProfile(flow=SteadyFlow(speed=0.4))),
}


@pytest.mark.parametrize("name", SEAS)
def test_places_at_rest_are_found_again(name: str) -> None:
    motion, places = SeaMotion(Sea(SEAS[name])), random_places(50)
    there = motion.in_sea(places, 31.0)
    np.testing.assert_allclose(motion.at_rest(there, 31.0), places, atol=1e-7)


@pytest.mark.parametrize("name", SEAS)
def test_velocity_is_the_rate_of_the_place(name: str) -> None:
    motion, places = SeaMotion(Sea(SEAS[name])), random_places(50)
    rate = (motion.in_sea(places, 31.0 + STEP) - motion.in_sea(places, 31.0 - STEP)) / (2.0 * STEP)
    found = np.broadcast_to(motion.velocity(places, 31.0), rate.shape)
    np.testing.assert_allclose(found, rate, atol=2e-6)


def test_crests_stand_where_the_sea_has_them_on_a_sheared_current() -> None:
    sea = Sea(SEAS["sheared current"])
    motion, places = SeaMotion(sea), random_places(400, 0.0)
    there = motion.in_sea(places, 40.0)
    steepness = 0.15 * float(sea.components.wave_number[0])
    np.testing.assert_allclose(there[:, 2], sea.elevation(there[:, :2], 40.0), atol=1.1 * 0.15 * steepness)


def test_a_regular_wave_in_deep_water_obeys_the_equation_of_motion_whole() -> None:
    """Gerstner's wave: the pressure is even on every sheet that is level at rest, and grows by rho g times the volume between sheets."""
    sea = regular(height=1.0)
    motion, places, k = SeaMotion(sea), random_places(60), float(sea.components.wave_number[0])
    times = (20.0 - 1e-3, 20.0, 20.0 + 1e-3)
    before, now, after = (motion.in_sea(places, time) for time in times)
    force = (after - 2.0 * now + before) / 1e-6 + np.array([0.0, 0.0, GRAVITY])  # -grad p / rho
    along = [motion.in_sea(places + 1e-4 * axis, 20.0) - now for axis in np.eye(3)]
    volume = 1.0 - (0.5 * k * np.exp(k * places[:, 2])) ** 2
    for axis, expected in enumerate((0.0, 0.0, GRAVITY * volume)):
        np.testing.assert_allclose((force * along[axis]).sum(1) / 1e-4, expected, atol=2e-3)
