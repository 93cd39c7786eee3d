"""Fay's three laws, and the speeds of the front made of them."""

from __future__ import annotations

import math

import pytest

from oilsim.slick import gradient_flow

VOLUME, DENSITY, TENSION = 20.0, 875.0, 0.01
WATER, VISCOSITY = 1027.0, 1.05e-6
BUOYANCY = 1.0 - DENSITY / WATER


@pytest.mark.parametrize(("time", "expected"), [(60.0, (20.5, 24.8, 3.4)), (600.0, (64.8, 44.1, 18.9))])
def test_radii_of_20_m3(time, expected):
    """20 m3 of 875 kg/m3, sigma 0.01 N/m, water of 1027 kg/m3 and 1.05e-6 m2/s: the formulas by hand, to three digits."""
    radii = (
        gradient_flow.gravity_inertia_radius(time, VOLUME, BUOYANCY),
        gradient_flow.gravity_viscous_radius(time, VOLUME, BUOYANCY, VISCOSITY),
        gradient_flow.surface_tension_radius(time, TENSION, WATER, VISCOSITY),
    )
    assert radii == pytest.approx(expected, abs=0.06)


def spread_from(start: float, end: float, radius: float, volume: float, buoyancy: float, tension: float) -> float:
    """Radius at `end` of the front's speed alone, by the midpoint rule in equal steps of log(time)."""
    steps, time = 4000, start
    factor = (end / start) ** (1.0 / steps)
    for _ in range(steps):
        step = time * (factor - 1.0)
        arguments = (volume, buoyancy, tension, WATER, VISCOSITY)
        half = radius + 0.5 * step * gradient_flow.spreading_rate(radius, time, *arguments) / radius
        radius += step * gradient_flow.spreading_rate(half, time + 0.5 * step, *arguments) / half
        time += step
    return radius


def test_speed_of_gravity_and_inertia():
    start = gradient_flow.gravity_inertia_radius(1.0, 1e4, BUOYANCY)
    end = spread_from(1.0, 60.0, start, 1e4, BUOYANCY, 0.0)
    assert end == pytest.approx(gradient_flow.gravity_inertia_radius(60.0, 1e4, BUOYANCY), rel=1e-6)


def test_speed_of_gravity_and_viscosity():
    start = gradient_flow.gravity_viscous_radius(600.0, 5.0, BUOYANCY, VISCOSITY)
    end = spread_from(600.0, 6000.0, start, 5.0, BUOYANCY, 0.0)
    assert end == pytest.approx(gradient_flow.gravity_viscous_radius(6000.0, 5.0, BUOYANCY, VISCOSITY), rel=1e-6)


def test_speed_of_surface_tension():
    start = gradient_flow.surface_tension_radius(1800.0, TENSION, WATER, VISCOSITY)
    end = spread_from(1800.0, 7200.0, start, 1.0, 1e-6, TENSION)
    assert end == pytest.approx(gradient_flow.surface_tension_radius(7200.0, TENSION, WATER, VISCOSITY), rel=1e-6)


def crossing_of(one, other) -> float:
    """Time at which two laws give one radius, by bisection of their ratio in log(time)."""
    low, high = 1.0, 1e6
    for _ in range(100):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if (one(middle) - other(middle)) * (one(low) - other(low)) > 0.0 else (low, middle)
    return low


def test_joins():
    """From a point, dR/dt joined is R^6 = R_v^6 (1 - 1/4 (t_1/t)^(3/2)) after the first crossing and 1.177 R at the second.

    Inertia lets go where the speeds are equal, at t_1 / 2^(2/3), with R^6 half of the viscous law's. At the second crossing, y = R^2 and
    T = t^(3/2) in its units obey dy/dT = max(1 / (3 y^2), 1), so y(1) = 1 + (1 - 1/3) 3^(-1/2).
    """
    laws = [
        lambda t: gradient_flow.gravity_inertia_radius(t, VOLUME, BUOYANCY),
        lambda t: gradient_flow.gravity_viscous_radius(t, VOLUME, BUOYANCY, VISCOSITY),
        lambda t: gradient_flow.surface_tension_radius(t, TENSION, WATER, VISCOSITY),
    ]
    first, second = crossing_of(laws[0], laws[1]), crossing_of(laws[1], laws[2])
    radius = spread_from(1.0, first, laws[0](1.0), VOLUME, BUOYANCY, TENSION)
    assert radius / laws[1](first) == pytest.approx(0.75 ** (1 / 6), rel=1e-3)
    radius = spread_from(first, second, radius, VOLUME, BUOYANCY, TENSION)
    assert radius / laws[1](second) == pytest.approx(math.sqrt(1.0 + (2.0 / 3.0) / math.sqrt(3.0)), rel=5e-3)
    for time in (first, second):
        joined = gradient_flow.joined_radius(time, VOLUME, BUOYANCY, TENSION, WATER, VISCOSITY)
        assert joined == pytest.approx(sorted(law(time) for law in laws)[1], rel=1e-6)


def test_film_ends_at_its_final_area():
    """1 m3 ends at 1e5 m2."""
    edge = math.sqrt(1e5 / math.pi)
    assert gradient_flow.spreading_rate(1.001 * edge, 1e5, 1.0, BUOYANCY, TENSION, WATER, VISCOSITY) == 0.0
    assert gradient_flow.spreading_rate(0.999 * edge, 1e5, 1.0, BUOYANCY, TENSION, WATER, VISCOSITY) > 0.0
