"""The measuring tools find what synthetic data were made of."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.validation import measure
from tests.validation.liquids.drop import ellipse_axes


def test_mode_amplitude_ignores_what_is_orthogonal():
    x = (np.arange(64) + 0.5) / 64
    mode = np.zeros((3, 64))
    mode[0] = np.sin(2 * np.pi * x)
    field = 0.3 * mode
    field[0] += 0.7 * np.cos(2 * np.pi * x) + 0.1
    field[2] += 5.0
    assert measure.mode_amplitude(field, mode) == pytest.approx(0.3, rel=1e-12)


def test_rates_of_decay_and_growth():
    t = np.linspace(0.0, 1.3, 130)
    assert measure.decay_rate(t, 0.2 * np.exp(-0.7 * t)) == pytest.approx(0.7, rel=1e-9)
    assert measure.growth_rate(t, 0.01 * np.cosh(2.4455 * t), 2.0) == pytest.approx(2.4455, rel=1e-6)
    assert measure.growth_rate(t, 0.01 * np.sinh(2.4455 * t), 3.0) == pytest.approx(2.4455, rel=1e-6)


def test_front_does_not_follow_a_drop_that_has_left():
    column = (np.arange(100) + 0.5) * 0.01
    assert measure.front_position(column, 0.01) == pytest.approx(1.0)
    assert measure.front_position(np.append(column, [1.2, 1.3]), 0.01) == pytest.approx(1.0)


def test_steady_value_forgets_a_swing():
    t = np.arange(0.0, 6.0, 0.01)
    # the window's side lobes let less than 1 % of a swing of 3.3 periods through; a plain mean 5 %
    assert measure.steady_value(0.18 + 0.04 * np.cos(2.0 * math.pi * t / 1.8 + 0.7)) == pytest.approx(0.18, abs=4e-4)


def test_profile_value_is_exact_on_a_parabola():
    z = np.random.default_rng(1).uniform(0.0, 1.0, 200)
    assert measure.profile_value(z, z * (1 - z), 0.5, 0.1) == pytest.approx(0.25, rel=1e-9)
    assert measure.profile_value(z[z > 0.5], 3 * z[z > 0.5], 0.5, 0.2, 1) == pytest.approx(1.5, rel=1e-9)


def test_time_shift_is_found_and_leaves_the_difference():
    t = np.linspace(0.0, 6.0, 300)
    front = 1.0 + 0.5 * t**1.5
    points = np.linspace(1.0, 4.0, 12)
    exact = measure.best_time_shift(t, front, points + 0.31, 1.0 + 0.5 * points**1.5, 1.0)
    assert exact.shift == pytest.approx(0.31, abs=1e-3)
    assert exact.rms < 1e-4
    high = measure.best_time_shift(
        t, front, points, 1.0 + 0.5 * points**1.5 * (1 + 0.05 * (-1.0) ** np.arange(12)), 1.0
    )
    assert 0.02 < high.rms < 0.05


def test_power_law():
    t = np.linspace(0.5, 5.0, 100)
    assert measure.power_law(t, 1.3 * t**0.2) == pytest.approx((0.2, 1.3), rel=1e-9)


def test_arrival_is_interpolated_and_absence_is_nan():
    t = np.linspace(0.0, 4.0, 41)
    assert measure.crossing_time(t, np.maximum(0.0, t - 2.43), 0.2) == pytest.approx(2.63, abs=1e-9)
    assert math.isnan(measure.crossing_time(t, np.zeros(41), 0.2))


def test_ellipse_obeys_the_equations_of_motion():
    # da/dt = -A a, db/dt = A b, dA/dt = A^2 (a^2 - b^2) / (a^2 + b^2), from p = 0 at the edge of u = (-A x, A z)
    t = np.linspace(0.0, 0.0076, 400)
    a, b = ellipse_axes(t)
    rate = -np.gradient(a, t) / a
    assert rate[0] == pytest.approx(100.0, rel=1e-3)
    assert np.allclose(np.gradient(b, t)[2:-2], (rate * b)[2:-2], rtol=1e-4)
    assert np.allclose(np.gradient(rate, t)[3:-3], (rate**2 * (a**2 - b**2) / (a**2 + b**2))[3:-3], rtol=2e-3, atol=2.0)
