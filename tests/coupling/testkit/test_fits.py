"""Fits of the test kit recover what made the signal."""

from __future__ import annotations

import math

import numpy as np
import pytest

from coupling.testkit import body_checks


def test_damped_cosine_is_recovered_under_noise():
    t = np.arange(0.0, 7.0, 0.01)
    made = 0.004 + 0.1 * np.exp(-0.05 * t) * np.cos(2.0 * math.pi / 1.134 * t + 0.3)
    noise = np.random.default_rng(0).normal(0.0, 0.002, t.size)
    fit = body_checks.fit_damped_cosine(t, made + noise, 1.05)
    # 700 samples of 2 % noise over 6 periods leave about 0.02 / sqrt(350) / 20 rad of phase a radian of time, 1e-4 of the period
    assert fit.period == pytest.approx(1.134, rel=3e-4)
    assert fit.loss == pytest.approx(1.0 - math.exp(-0.05 * 1.134), abs=2e-3)
    assert fit.amplitude == pytest.approx(0.1, rel=0.01)
    assert fit.phase == pytest.approx(0.3, abs=0.01)
    assert fit.offset == pytest.approx(0.004, abs=5e-4)


@pytest.mark.parametrize("order", [1.0, 2.0])
def test_order_of_convergence(order):
    spacing = np.array([0.1, 0.05, 0.025])
    assert body_checks.order_of_convergence(spacing, 3.0 * spacing**order) == pytest.approx(order)
    assert math.isnan(body_checks.order_of_convergence(spacing, [0.1, 0.0, 0.1]))
    assert math.isnan(body_checks.order_of_convergence(spacing[:1], [0.1]))
