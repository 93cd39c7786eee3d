"""The drift of an established wind: its profile, that it is kept without adding momentum, and how far it carries oil."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import Fluid, FluidConfig, Phase, tank_walls
from oilsim.forcing import AiryWaves, ForcingView, Wind, Zone
from oilsim.wind_drift import WindDrift, friction_velocity, wind_drift

BREEZE = 10.0  # m/s
FRICTION = friction_velocity(BREEZE, 1025.0, 1.3e-3)


def test_the_surface_drifts_at_three_per_cent_and_the_shear_is_that_of_a_constant_stress() -> None:
    depth = np.array([0.0, 0.1, 0.1 * np.e, 1.0, 50.0])
    speed = wind_drift(depth, BREEZE, FRICTION)
    assert pytest.approx(0.0125, rel=0.01) == FRICTION
    assert speed[0] == pytest.approx(0.3)
    assert speed[1] - speed[2] == pytest.approx(FRICTION / 0.4, rel=0.01)  # u* / kappa for a factor e
    assert 0.1 < speed[1] / speed[0] < 0.65 and 0.0 < speed[3] < 0.3 * speed[0] and speed[4] == 0.0
    assert wind_drift(depth, BREEZE, FRICTION, waves=0.1)[0] == pytest.approx(0.2)
    assert not wind_drift(depth, 0.0, 0.0).any()


def test_stokes_drift_of_deep_and_shallow_waves() -> None:
    zone = Zone((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), 1.0)
    for depth in (20.0, 0.2):
        waves = AiryWaves(height=0.1, period=1.5, direction=0.0, bottom=0.0, level=depth, zone=zone)
        k, omega = waves.wave_number, 2.0 * np.pi / 1.5
        expected = 0.05**2 * omega * k * np.cosh(2.0 * k * depth) / (2.0 * np.sinh(k * depth) ** 2)
        assert waves.surface_drift == pytest.approx(expected, rel=1e-9)


def view(velocity: np.ndarray, height: np.ndarray, step: float) -> ForcingView:
    position = np.zeros((3, len(height)), np.float32)
    position[2] = height
    return ForcingView(
        0.0, step, position, velocity, np.zeros(len(height), np.uint8), position, np.array([1025.0]), 1e-3
    )


def test_lost_shear_comes_back_and_no_momentum_with_it() -> None:
    wind = Wind(speed=BREEZE, direction=0.5 * np.pi, spacing=0.1, seed=1)
    drift = WindDrift(wind, level=0.8, spacing=0.1, water_density=1025.0)
    height = np.linspace(0.05, 0.75, 8)
    velocity = np.zeros((3, 8), np.float32)
    velocity[:2] = drift.velocities(height)
    assert velocity[1, -1] == pytest.approx(0.3) and not velocity[0].any()
    even = velocity.copy()
    even[1] = velocity[1].mean()
    kept = velocity.copy()
    drift.apply(view(kept, height, 0.01))
    np.testing.assert_allclose(kept, velocity, atol=1e-6)  # the drift as it is needs nothing
    for _ in range(500):
        drift.apply(view(even, height, 0.01))
    np.testing.assert_allclose(even, velocity, atol=0.01 * 0.3)
    assert even[1].mean() == pytest.approx(velocity[1].mean(), abs=1e-6)


def test_the_drift_follows_a_wind_that_changes_within_minutes() -> None:
    wind = Wind(speed=BREEZE, direction=0.0, spacing=0.1, seed=1)
    drift = WindDrift(wind, level=0.8, spacing=0.1, water_density=1025.0)
    wind.speed = 0.0
    drift.apply(view(np.zeros((3, 1), np.float32), np.array([0.75]), 60.0))
    assert drift.established[0] == pytest.approx(BREEZE * np.exp(-0.1))
    other = WindDrift(wind, level=0.8, spacing=0.1, water_density=1025.0)
    assert not other.established.any()
    other.restore(drift.save())
    np.testing.assert_array_equal(other.established, drift.established)


def test_oil_drifts_at_three_per_cent_of_the_wind() -> None:
    """10 m/s carry oil by 0.3 m/s; in a periodic sea of five layers, over 4 s: 1.2 m, within a sixth (3 % +- 0.5 % of the wind)."""
    d, level = 0.1, 0.5
    size = (0.9, 0.9, 1.0)
    phases = (
        Phase(name="sea", rest_density=1025.0, dynamic_viscosity=1e-3),
        Phase(name="oil", rest_density=840.0, dynamic_viscosity=1e-2),
    )
    config = FluidConfig(
        particle_spacing=d,
        phases=phases,
        lower=(0.0, 0.0, -d),
        upper=size,
        periodic=(True, True, False),
        maximum_time_step=0.02,
    )
    fluid = Fluid(config, threads=1)
    fluid.add_boundary(tank_walls((0.0, 0.0, 0.0), size, d, sides=("-z",), periodic=(True, True, False)))
    wind = Wind(speed=BREEZE, direction=0.0, spacing=d, seed=1)
    drift = WindDrift(wind, level=level, spacing=d, water_density=1025.0)
    axis = (np.arange(9) + 0.5) * d
    grid = np.stack(np.meshgrid(axis, axis, axis[:6], indexing="ij"), axis=-1).reshape(-1, 3)
    slick = (grid[:, 2] > level) & (np.abs(grid[:, :2] - 0.45) < 0.2).all(axis=1)
    for phase, points in (("sea", grid[grid[:, 2] < level]), ("oil", grid[slick])):
        speeds = np.zeros_like(points)
        speeds[:, :2] = drift.velocities(points[:, 2]).T
        fluid.add_particles(points, phase=phase, velocity=speeds)
    fluid.add_forcing(wind)
    fluid.add_forcing(drift)
    way = 0.0
    for _ in range(200):
        fluid.advance(0.02)
        way += 0.02 * float(fluid.phase_velocities("oil")[:, 0].mean())
    assert way == pytest.approx(0.03 * BREEZE * 4.0, rel=1.0 / 6.0)
