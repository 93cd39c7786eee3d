"""Gusts, stress and drift of the wind against formulas and check values."""

from __future__ import annotations

import math

import numpy as np
import pytest

from oilsim.sea import FlowTable, JonswapWaves, KaimalGusts, Sea, SeaDescription, SteadyFlow, WindDrift, WindField
from oilsim.sea.wind_stress import LENGTH, friction_speed, wind_stress

GRAVITY, WATER = 9.81, 1027.0


def kaimal_spectrum(frequency, speed, deviation):
    """S(f) of Kaimal (N,) [m2/s] at frequencies (N,) [Hz] for a mean speed [m/s] and a standard deviation [m/s]."""
    time = LENGTH / speed
    return deviation**2 * 4.0 * time / (1.0 + 6.0 * frequency * time) ** (5.0 / 3.0)


def windy(speed=8.0, direction=0.0, gusts=None, **rest):
    flow = SteadyFlow(speed=speed, direction=direction)
    return Sea(SeaDescription(depth=20.0, wind=WindField(flow=flow, gusts=gusts, **rest)))


@pytest.mark.parametrize(
    ("speed", "stress", "air", "water"),
    [(5.0, 0.034, 0.168, 0.0058), (10.0, 0.177, 0.381, 0.0131), (15.0, 0.487, 0.632, 0.0218)],
)
def test_stress_of_the_wind(speed, stress, air, water):
    assert wind_stress(speed) == pytest.approx(1.225 * (0.8 + 0.065 * speed) * 1e-3 * speed**2, rel=1e-12)
    assert wind_stress(speed) == pytest.approx(stress, rel=0.015)  # the values have three digits
    assert friction_speed(speed) == pytest.approx(air, rel=0.01)
    assert friction_speed(speed, WATER) == pytest.approx(water, rel=0.01)


def test_the_spectrum_of_gusts_holds_their_variance():
    # integral of S over all frequencies = sigma^2; the tail beyond the last frequency is (1 + 6 f L / U)^(-2/3)
    f = np.append(0.0, np.geomspace(1e-6, 1e4, 400001))
    total = np.trapezoid(kaimal_spectrum(f, 8.0, 0.96), f)
    assert total == pytest.approx(0.96**2, rel=1e-3)
    # inertial range: f^(-5/3)
    high = kaimal_spectrum(np.array([10.0, 20.0]), 8.0, 0.96)
    assert high[1] / high[0] == pytest.approx(2 ** (-5 / 3), rel=5e-3)


def test_gusts_have_their_intensity_and_their_spectrum():
    gusts = KaimalGusts(intensity=0.12, count=200)
    sines = gusts.components(8.0)
    variance = 0.5 * sines.amplitude**2
    assert variance.sum() == pytest.approx(0.12**2, rel=1e-9)
    # the variance of each band over its width is the spectrum, up to the share of the whole that lies between the two frequencies
    edges = np.geomspace(gusts.lowest_frequency, gusts.highest_frequency, 201)
    middle = np.sqrt(edges[1:] * edges[:-1])
    found = variance / np.diff(edges) * 64.0
    fine = np.geomspace(edges[0], edges[-1], 20001)
    share = np.trapezoid(kaimal_spectrum(fine, 8.0, 1.0), fine)
    assert found == pytest.approx(kaimal_spectrum(middle, 8.0, 0.96) / share, rel=0.01)
    assert ((sines.frequency / (2 * math.pi) >= edges[:-1]) & (sines.frequency / (2 * math.pi) <= edges[1:])).all()


def test_a_windy_day_has_the_mean_and_the_intensity():
    sea = windy(gusts=KaimalGusts(intensity=0.12))
    # places along the wind stand for times, since the wind carries its gusts
    line = np.stack([np.arange(0.0, 2e6, 10.0), np.zeros(200000)], -1)
    speed = sea.wind(line, 0.0)[:, 0]
    assert speed.mean() == pytest.approx(8.0, rel=0.005)
    assert speed.std() / speed.mean() == pytest.approx(0.12, rel=0.02)


def test_the_wind_carries_its_gusts():
    direction = 0.6
    sea = windy(direction=direction, gusts=KaimalGusts())
    to = np.array([math.cos(direction), math.sin(direction)])
    places = np.random.default_rng(0).uniform(-200.0, 200.0, (50, 2))
    assert sea.wind(places + 8.0 * 12.5 * to, 20.0 + 12.5) == pytest.approx(sea.wind(places, 20.0), abs=1e-9)
    across = np.array([-to[1], to[0]])
    assert sea.wind(places + 30.0 * across, 20.0) == pytest.approx(sea.wind(places, 20.0), abs=1e-9)
    wind = sea.wind(places, 20.0)
    assert np.arctan2(wind[:, 1], wind[:, 0]) == pytest.approx(direction)
    assert np.ptp(np.hypot(*wind.T)) > 0.5


def test_gusts_follow_from_the_seed():
    first, again, other = (windy(gusts=KaimalGusts(seed=seed)).wind((3.0, 4.0), 50.0) for seed in (1, 1, 2))
    assert (first == again).all()
    assert (first != other).any()


def test_a_wind_that_turns():
    table = FlowTable([0.0, 600.0], [(10.0, 0.0), (0.0, 10.0)])
    sea = Sea(SeaDescription(depth=20.0, wind=WindField(flow=table)))
    assert sea.wind((0.0, 0.0), 300.0) == pytest.approx((5.0, 5.0))


def test_the_drift_of_the_surface_layer():
    sea = windy(speed=10.0)
    surface = 0.53 * friction_speed(10.0)
    assert sea.wind_drift(0.0, 0.0) == pytest.approx((surface, 0.0))
    assert 0.018 < surface / 10.0 < 0.022
    depths = np.linspace(0.01, 0.4, 30)
    step = 1e-6
    shear = (sea.wind_drift(depths + step, 0.0) - sea.wind_drift(depths - step, 0.0))[:, 0] / (2 * step)
    # law of the wall: du/dd = -u*_water / (0.4 (d + z0)), z0 about a millimetre
    z0 = WindDrift().roughness(WATER)
    assert 5e-4 < z0 < 2e-3
    assert shear == pytest.approx(-friction_speed(10.0, WATER) / (0.4 * (depths + z0)), rel=1e-6)
    assert sea.wind_drift([0.5, 2.0], 0.0) == pytest.approx(np.zeros((2, 2)), abs=1e-12)
    # a slick feels all of it, a skirt of a metre less than a tenth
    mean = np.trapezoid(sea.wind_drift(np.linspace(0, 1, 10001), 0.0)[:, 0], dx=1e-4)
    assert mean < 0.1 * surface
    # the water of the sea has it, below its surface
    assert sea.velocity([(0.0, 0.0, 0.0), (0.0, 0.0, -0.1)], 0.0)[:, :2] == pytest.approx(
        sea.wind_drift([0.0, 0.1], 0.0)
    )


@pytest.mark.parametrize("speed", [5.0, 8.0, 12.0, 15.0])
@pytest.mark.parametrize("fetch", [10e3, 50e3])
def test_slicks_drift_with_3_percent_of_the_wind(speed, fetch):
    # a sea of limited fetch (Hasselmann et al. 1973): g Hs / U^2 = 1.6e-3 F^0.5, g Tp / U = 0.2857 F^(1/3), F = g fetch / U^2
    reach = GRAVITY * fetch / speed**2
    height, period = 1.6e-3 * math.sqrt(reach) * speed**2 / GRAVITY, 0.2857 * reach ** (1 / 3) * speed / GRAVITY
    waves = JonswapWaves(significant_height=height, peak_period=period, spread=10.0)
    wind = WindField(flow=SteadyFlow(speed=speed))
    sea = Sea(SeaDescription(depth=50.0, waves=waves, wind=wind))
    drift = sea.surface_drift((0.0, 0.0), 0.0)
    assert drift[0] / speed == pytest.approx(0.03, abs=0.005)


def test_a_wind_without_a_drift():
    sea = windy(drift=None)
    assert (sea.surface_drift((0.0, 0.0), 0.0) == 0.0).all()
    assert (sea.velocity((0.0, 0.0, 0.0), 0.0) == 0.0).all()
