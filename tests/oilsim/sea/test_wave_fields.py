"""Velocity, acceleration and pressure of waves against the equations of motion, by finite differences."""

from __future__ import annotations

import math

import numpy as np
import pytest

from oilsim.sea import CurrentProfile, JonswapWaves, RegularWaves, Sea, SeaDescription, SteadyFlow
from oilsim.sea.linear_waves import exponential, sine_cosine

GRAVITY, DENSITY = 9.81, 1027.0
STEP = 1e-4  # [m], [s] of the finite differences
FLOW = SteadyFlow(speed=0.5, direction=2.0)
WAVES = {
    "linear": RegularWaves(height=0.3, period=4.0, direction=0.7, phase=0.4, stretching="none"),
    "jonswap": JonswapWaves(
        significant_height=0.3, peak_period=4.0, direction=0.7, spread=6.0, count=30, stretching="none"
    ),
}
POINTS = np.random.default_rng(3).uniform((-20.0, -20.0, -4.5), (20.0, 20.0, -0.5), (40, 3))


def make_sea(name, depth=5.0, current=True):
    profile = CurrentProfile(flow=FLOW) if current else None
    return Sea(SeaDescription(depth=depth, waves=WAVES[name], current=profile))


def gradient(function, time):
    """Differentiate by x, y, z: (3, N, ...)."""
    return np.stack([(function(POINTS + d, time) - function(POINTS - d, time)) / (2 * STEP) for d in STEP * np.eye(3)])


@pytest.mark.parametrize("name", WAVES)
def test_velocity_has_no_divergence_and_no_rotation(name):
    slope = gradient(make_sea(name).velocity, 3.3)  # slope[i, n, j] = d u_j / d x_i
    size = np.abs(slope).max()
    assert np.abs(np.trace(slope, axis1=0, axis2=2)).max() < 1e-6 * size
    assert np.abs(slope - slope.transpose(2, 1, 0)).max() < 1e-6 * size


@pytest.mark.parametrize("name", WAVES)
def test_acceleration_is_the_rate_seen_by_a_point_that_the_current_carries(name):
    sea, way = make_sea(name), np.append(FLOW.velocity(0.0), 0.0) * STEP
    rate = (sea.velocity(POINTS + way, 3.3 + STEP) - sea.velocity(POINTS - way, 3.3 - STEP)) / (2 * STEP)
    found = sea.acceleration(POINTS, 3.3)
    assert np.abs(found - rate).max() < 1e-6 * np.abs(found).max()


@pytest.mark.parametrize("name", WAVES)
def test_pressure_fulfils_the_equation_of_motion(name):
    # rho Du/Dt = -grad p - rho g z, to first order
    sea, still = make_sea(name), make_sea(name, current=False)
    push = -gradient(lambda points, time: sea.pressure(points, time)[:, None], 3.3)[:, :, 0].T / DENSITY
    push[:, 2] -= GRAVITY
    answer = sea.acceleration(POINTS, 3.3)
    assert np.abs(push - answer).max() < 2e-6 * GRAVITY
    # the current only carries the waves, so that a still sea has the same pressure where the waves are the same
    carried = POINTS + np.append(FLOW.travel(3.3), 0.0)
    assert sea.pressure(carried, 3.3) == pytest.approx(still.pressure(POINTS, 3.3), abs=1e-6)


@pytest.mark.parametrize("name", WAVES)
def test_no_water_passes_the_bottom(name):
    bottom = POINTS * (1.0, 1.0, 0.0) - (0.0, 0.0, 5.0)
    assert np.abs(make_sea(name).velocity(bottom, 3.3)[:, 2]).max() < 1e-12


@pytest.mark.parametrize("waves", [WAVES["linear"], JonswapWaves(significant_height=0.3, peak_period=4.0)])
@pytest.mark.parametrize("stretching", ["wheeler", "none"])
def test_linear_pressure_vanishes_at_the_surface(waves, stretching):
    waves = type(waves)(**{**vars(waves), "stretching": stretching})
    sea = Sea(SeaDescription(depth=5.0, waves=waves, level=2.0))
    top = POINTS.copy()
    top[:, 2] = sea.elevation(POINTS, 3.3)
    if stretching == "none":
        top = top[top[:, 2] >= 2.0]  # below the still level the linear pressure is 0 to first order only
    assert np.abs(sea.pressure(top, 3.3)).max() < 1e-9 * DENSITY * GRAVITY
    # above the surface it goes on linearly, as without waves
    assert sea.pressure(top + np.array([0.0, 0.0, 0.1]), 3.3) == pytest.approx(-0.1 * DENSITY * GRAVITY, rel=1e-9)


def test_wheeler_stretching_is_its_formula():
    # u(z) = u_linear(h (h + z) / (h + eta) - h)
    wave = {"height": 0.5, "period": 4.0}
    stretched = Sea(SeaDescription(depth=5.0, waves=RegularWaves(**wave)))
    plain = Sea(SeaDescription(depth=5.0, waves=RegularWaves(**wave, stretching="none")))
    eta = stretched.elevation(POINTS, 1.0)
    mapped = POINTS.copy()
    mapped[:, 2] = 5.0 * (5.0 + POINTS[:, 2]) / (5.0 + eta) - 5.0
    assert stretched.velocity(POINTS, 1.0) == pytest.approx(plain.velocity(mapped, 1.0), abs=1e-12)


def test_the_linear_wave_is_its_formula():
    a, h, omega = 0.15, 5.0, 2 * math.pi / 4.0
    sea = make_sea("linear", current=False)
    k = sea.components.wave_number[0]
    along = POINTS[:, 0] * math.cos(0.7) + POINTS[:, 1] * math.sin(0.7)
    theta = k * along - omega * 3.3 + 0.4
    assert sea.elevation(POINTS[:, :2], 3.3) == pytest.approx(a * np.cos(theta), abs=1e-12)
    u = a * omega * np.cosh(k * (h + POINTS[:, 2])) / np.sinh(k * h) * np.cos(theta)
    w = a * omega * np.sinh(k * (h + POINTS[:, 2])) / np.sinh(k * h) * np.sin(theta)
    expected = np.stack([u * math.cos(0.7), u * math.sin(0.7), w], -1)
    assert sea.velocity(POINTS, 3.3) == pytest.approx(expected, abs=1e-12)
    dynamic = DENSITY * GRAVITY * a * np.cosh(k * (h + POINTS[:, 2])) / np.cosh(k * h) * np.cos(theta)
    assert sea.pressure(POINTS, 3.3) == pytest.approx(dynamic - DENSITY * GRAVITY * POINTS[:, 2], abs=1e-7)


def test_deep_water_does_not_overflow():
    sea = Sea(SeaDescription(depth=4000.0, waves=RegularWaves(height=0.1, period=1.0)))
    motion = sea.kinematics([(0.0, 0.0, -4000.0), (0.0, 0.0, 0.0)], 0.1)
    assert np.isfinite(motion.velocity).all()
    assert motion.velocity[0] == pytest.approx(0.0, abs=1e-200)


def test_sine_cosine_and_exponential():
    angles = np.concatenate([np.linspace(-10.0, 10.0, 5001), np.linspace(-1e5, 1e5, 5001)])
    sines, cosines = sine_cosine(angles)
    assert np.abs(sines - np.sin(angles)).max() < 3e-11
    assert np.abs(cosines - np.cos(angles)).max() < 3e-11
    for y in np.linspace(-690.0, 5.0, 2001):
        assert exponential(float(y)) == pytest.approx(math.exp(y), rel=2e-12)
