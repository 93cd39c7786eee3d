"""Spectra, spreading and Stokes drift against integrals and check values."""

from __future__ import annotations

import math

import numpy as np
import pytest

from oilsim.sea import JonswapWaves, RegularWaves, Sea, SeaDescription
from oilsim.sea.jonswap import direction_quantiles, spectrum, spreading

GRAVITY = 9.81
SEA = {"significant_height": 0.5, "peak_period": 3.0}


def moments(order, frequency, energy):
    return np.trapezoid(frequency**order * energy, frequency)


def test_moments_of_the_spectrum():
    # Hs 0.5 m, Tp 3 s, gamma 3.3, up to 3 Hz: m0 = Hs^2 / 16, Tm01 = m0 / m1, Tz = (m0 / m2)^0.5
    f = np.geomspace(0.1, 3.0, 200001)
    s = spectrum(f, 0.5, 3.0, 3.3)
    m0, m1, m2 = (moments(order, f, s) for order in range(3))
    assert m0 == pytest.approx(0.015625, rel=2e-4)
    assert m0 / m1 == pytest.approx(2.506, rel=5e-4)
    assert math.sqrt(m0 / m2) == pytest.approx(2.346, rel=5e-4)
    assert f[s.argmax()] == pytest.approx(1 / 3, rel=1e-3)


def test_peakedness_1_is_the_pierson_moskowitz_spectrum():
    # 5/16 Hs^2 fp^4 f^-5 exp(-5/4 (fp / f)^4)
    f = np.linspace(0.2, 2.0, 50)
    expected = 5 / 16 * 0.25 / 3.0**4 * f**-5 * np.exp(-1.25 / (3.0 * f) ** 4)
    assert spectrum(f, 0.5, 3.0, 1.0) == pytest.approx(expected, rel=2e-4)


def test_components_hold_the_energy_of_the_spectrum():
    waves = Sea(SeaDescription(depth=500.0, waves=JonswapWaves(**SEA, highest_frequency=3.0))).components
    f, energy = waves.frequency / (2 * math.pi), 0.5 * waves.amplitude**2
    assert energy.sum() == pytest.approx(0.015625, rel=1e-3)
    assert energy.sum() / (energy * f).sum() == pytest.approx(2.506, rel=5e-3)
    assert math.sqrt(energy.sum() / (energy * f * f).sum()) == pytest.approx(2.346, rel=1e-2)
    fine = np.geomspace(0.1, 30.0, 100001)
    s = spectrum(fine, 0.5, 3.0, 3.3)
    for limit in (0.3, 0.4, 0.6, 1.0):  # the energy below a frequency, to that of a band
        below = moments(0, fine[fine < limit], s[fine < limit])
        assert energy[f < limit].sum() == pytest.approx(below, abs=energy.max())


def test_the_surface_has_the_significant_height():
    sea = Sea(SeaDescription(depth=50.0, waves=JonswapWaves(**SEA, spread=8.0)))
    places = np.random.default_rng(0).uniform(-2000.0, 2000.0, (20000, 2))
    heights = np.concatenate([sea.elevation(places, t) for t in (0.0, 400.0, 900.0)])
    assert 4 * heights.std() == pytest.approx(0.5, rel=0.02)
    assert abs(heights.mean()) < 0.005
    # a Gaussian surface: kurtosis 3
    assert (heights**4).mean() / heights.var() ** 2 == pytest.approx(3.0, abs=0.15)


@pytest.mark.parametrize("spread", [1.0, 4.0, 15.0])
def test_directions_spread_as_cos_2s(spread):
    theta = np.linspace(-math.pi, math.pi, 40001)
    density = spreading(theta, spread)
    assert np.trapezoid(density, theta) == pytest.approx(1.0, rel=1e-6)
    assert np.trapezoid(density * np.cos(theta), theta) == pytest.approx(spread / (spread + 1), rel=1e-6)
    fractions = (np.arange(2000) + 0.5) / 2000
    assert np.cos(direction_quantiles(fractions, spread)).mean() == pytest.approx(spread / (spread + 1), rel=1e-3)
    waves = Sea(SeaDescription(depth=50.0, waves=JonswapWaves(**SEA, spread=spread, direction=1.0))).components
    energy = waves.amplitude**2
    ahead = energy * (waves.toward_x * math.cos(1.0) + waves.toward_y * math.sin(1.0))
    side = energy * (waves.toward_y * math.cos(1.0) - waves.toward_x * math.sin(1.0))
    assert ahead.sum() / energy.sum() == pytest.approx(spread / (spread + 1), rel=0.03)
    assert abs(side.sum() / energy.sum()) < 0.05


@pytest.mark.parametrize(
    ("period", "depth", "drift"),
    [
        (2.0, 2.0, 0.2105), (2.0, 5.0, 0.1976), (2.0, 500.0, 0.1975), (3.0, 2.0, 0.0926), (3.0, 5.0, 0.0610), (3.0, 500.0, 0.0585),
        (4.0, 2.0, 0.0641), (4.0, 5.0, 0.0315), (4.0, 500.0, 0.0247), (6.0, 2.0, 0.0468), (6.0, 5.0, 0.0172), (6.0, 500.0, 0.0073),
    ],
)  # fmt: skip
def test_stokes_drift_of_regular_waves(period, depth, drift):
    sea = Sea(SeaDescription(depth=depth, level=1.0, waves=RegularWaves(height=0.5, period=period)))
    assert sea.stokes_drift(1.0) == pytest.approx((drift, 0.0), rel=0.007)  # the table has four digits
    k = sea.components.wave_number[0]
    if depth == 500.0:  # a^2 w k exp(2kz)
        assert sea.stokes_drift(0.4)[0] / sea.stokes_drift(1.0)[0] == pytest.approx(math.exp(-1.2 * k), rel=1e-9)


def test_water_drifts_as_stokes_found():
    # paths in the velocity field of a wave, over 20 periods, by the midpoint rule; k a is 1.4 %
    sea = Sea(SeaDescription(depth=5.0, waves=RegularWaves(height=0.1, period=4.0, stretching="none")))
    start = np.array([(0.0, 0.0, -1.0), (5.0, 0.0, -2.0)])
    place, height, step = start.copy(), np.zeros(2), 4.0 / 200
    for i in range(20 * 200):
        half = place + 0.5 * step * sea.velocity(place, i * step)
        place += step * sea.velocity(half, (i + 0.5) * step)
        height += place[:, 2] / 4000
    assert (place - start)[:, 0] / 80.0 == pytest.approx(sea.stokes_drift(height)[:, 0], rel=0.02)


@pytest.mark.parametrize(("cut", "drift"), [(1.0, 0.061), (1.5, 0.072), (3.0, 0.082)])
def test_stokes_drift_of_a_spectrum_grows_with_its_cut(cut, drift):
    # 2 / g integral S (2 pi f)^3 df up to the cut
    f = np.linspace(0.1, cut, 100001)
    integral = 2 / GRAVITY * np.trapezoid(spectrum(f, 0.5, 3.0, 3.3) * (2 * math.pi * f) ** 3, f)
    assert integral == pytest.approx(drift, rel=0.01)
    waves = JonswapWaves(**SEA, highest_frequency=cut, count=200)
    sea = Sea(SeaDescription(depth=500.0, waves=waves))
    assert sea.stokes_drift(0.0)[0] == pytest.approx(integral, rel=0.005)


@pytest.mark.parametrize(
    ("given", "depth", "text"),
    [
        (
            {"significant_height": 1.0, "peak_period": 3.0},
            50.0,
            r"up to 0.9368 m, the limit of seas of this peak period \(DNV-RP-C205\)",
        ),
        ({"significant_height": 1.3, "peak_period": 6.0}, 2.0, r"up to 1.2 m, the limit of seas of this depth"),
    ],
)
def test_seas_too_steep_are_refused(given, depth, text):
    with pytest.raises(ValueError, match=text):
        Sea(SeaDescription(depth=depth, waves=JonswapWaves(**given)))
