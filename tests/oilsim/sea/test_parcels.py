"""Dispersion, Langmuir cells and Lehr's ellipse, with parcels that drift on the sea."""

from __future__ import annotations

import math

import numpy as np
import pytest

from oilsim.sea import (
    CurrentProfile,
    JonswapWaves,
    LangmuirCells,
    RegularWaves,
    Sea,
    SeaDescription,
    SteadyFlow,
    Turbulence,
    WindField,
)  # fmt: skip
from oilsim.sea.turbulence import lehr_axes, lehr_diffusivity

WAVES = JonswapWaves(significant_height=0.5, peak_period=3.0, direction=0.5)


def sea_with(speed=8.0, direction=0.5, **parts):
    wind = WindField(flow=SteadyFlow(speed=speed, direction=direction))
    return Sea(SeaDescription(depth=20.0, wind=wind, waves=WAVES, **parts))


def test_a_random_walk_has_the_mean_0_and_the_variance_2_k_t():
    sea, count, step = sea_with(turbulence=Turbulence(diffusivity=0.7)), 40000, 0.5
    place = np.zeros((count, 2))
    for i in range(40):
        place += sea.random_walk(count, i, step)
    variance = 2 * 0.7 * 40 * step
    assert place.mean(0) == pytest.approx((0.0, 0.0), abs=0.02 * math.sqrt(variance))
    assert np.cov(place.T) == pytest.approx(variance * np.eye(2), abs=0.02 * variance)


def test_steps_follow_from_seed_and_number():
    sea = sea_with(turbulence=Turbulence(seed=5))
    first, again = sea.random_walk(10, 3, 0.1), sea.random_walk(10, 3, 0.1)
    assert (first == again).all()
    assert (first != sea.random_walk(10, 4, 0.1)).all()
    assert (first != sea_with(turbulence=Turbulence(seed=6)).random_walk(10, 3, 0.1)).all()
    # parcels that come later do not change the steps of those before
    assert (sea.random_walk(15, 3, 0.1)[:10] == first).all()
    with pytest.raises(ValueError, match="step is -1"):
        sea.random_walk(10, -1, 0.1)
    assert (sea_with().random_walk(4, 0, 0.1) == 0.0).all()


@pytest.mark.parametrize("current", [None, CurrentProfile(flow=SteadyFlow(speed=0.5, direction=2.5))])
def test_cells_draw_a_slick_into_rows_along_the_wind(current):
    spacing, direction = 8.0, 0.5
    sea = sea_with(langmuir=LangmuirCells(spacing=spacing), current=current)
    assert sea.langmuir_number(0.0) < 0.5
    across = np.array([-math.sin(direction), math.cos(direction)])
    along = np.array([math.cos(direction), math.sin(direction)])
    place = np.random.default_rng(1).uniform(-40.0, 40.0, (4000, 2))
    start = place.copy()

    def spread(at):
        """Concentration of the parcels in rows: 0 for an even cover, 1 for lines. It does not depend on where the rows are."""
        return abs(np.exp(2j * math.pi * (at @ across) / spacing).mean())

    assert spread(place) < 0.05
    for i in range(200):  # 100 s, Heun's rule
        flow = 0.0 if current is None else current.flow.velocity(0.0)
        first = sea.surface_drift(place, 0.5 * i) + flow
        second = sea.surface_drift(place + 0.5 * first, 0.5 * (i + 1)) + flow
        place = place + 0.25 * (first + second)
    assert spread(place) > 0.95
    # not along the wind, where the slick stays as long as it was
    assert np.ptp(place @ along) == pytest.approx(np.ptp(start @ along), rel=0.1)
    # rows drift faster than the mean of the surface, by the jet
    rows = sea.surface_drift(place, 100.0) @ along
    mean = (sea.wind_drift(0.0, 0.0) + sea.stokes_drift(0.0)) @ along
    assert np.median(rows) - mean == pytest.approx(0.01 * 8.0, rel=0.05)


def test_convergence_of_cells_is_their_formula():
    # the divergence at a row is -2 pi V / spacing, and its mean is 0
    sea = sea_with(direction=0.0, langmuir=LangmuirCells(spacing=8.0, convergence=0.01, jet=0.0))
    y, step = np.linspace(0.0, 8.0, 801), 1e-4
    points = np.stack([0 * y, y], -1)
    slope = (
        sea.surface_drift(points + np.array([0, step]), 0.0) - sea.surface_drift(points - np.array([0, step]), 0.0)
    )[:, 1] / (2 * step)
    assert slope.min() == pytest.approx(-2 * math.pi * 0.08 / 8.0, rel=1e-3)
    assert slope[:-1].mean() == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(("speed", "height"), [(2.5, 0.1), (14.0, 0.02)])
def test_a_weak_wind_or_weak_waves_make_no_cells(speed, height):
    wind = WindField(flow=SteadyFlow(speed=speed))
    waves = RegularWaves(height=height, period=3.0)
    parts = {"depth": 20.0, "wind": wind, "waves": waves}
    plain, with_cells = Sea(SeaDescription(**parts)), Sea(SeaDescription(**parts, langmuir=LangmuirCells()))
    points = np.random.default_rng(0).uniform(-20.0, 20.0, (50, 2))
    assert (with_cells.surface_drift(points, 0.0) == plain.surface_drift(points, 0.0)).all()


def test_the_axes_of_lehrs_ellipse():
    # 10 barrels of 1/1.2 of water's density, 10 knots, 16 minutes
    barrel, knot = 0.158987294928, 1852 / 3600
    minor, major = lehr_axes(volume=10 * barrel, density_ratio=1.2, wind_speed=10 * knot, time=16 * 60.0)
    assert minor == pytest.approx(53.76 * 2.0 ** (1 / 3) * 2.0, rel=1e-9)
    assert major - minor == pytest.approx(0.95 * 10 ** (4 / 3) * 8.0, rel=1e-9)
    # the area of the same paper in m2: 2270 (D V)^(2/3) t^(1/2) + 40 (D V)^(1/3) W^(4/3) t
    area = 2270 * 2.0 ** (2 / 3) * 4.0 + 40 * 2.0 ** (1 / 3) * 10 ** (4 / 3) * 16.0
    assert math.pi / 4 * minor * major == pytest.approx(area, rel=0.005)


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [("volume", -1.0, "volume is -1.0"), ("density_ratio", 1.0, "allowed: above 1"), ("time", math.nan, "time is nan")],
)
def test_an_ellipse_that_cannot_be_is_refused(name, value, text):
    given = {"volume": 1.0, "density_ratio": 1.1, "wind_speed": 5.0, "time": 60.0} | {name: value}
    with pytest.raises(ValueError, match=text):
        lehr_axes(**given)


def test_a_slick_becomes_an_ellipse_along_the_wind():
    # parcels that start at one point; the axis of an evenly covered ellipse is 4 deviations
    direction, speed, count, step = 0.5, 8.0, 20000, 20.0
    sea = sea_with(turbulence=Turbulence(diffusivity=0.05, stretch=True), langmuir=LangmuirCells())
    place = np.zeros((count, 2))
    for i in range(180):  # an hour
        time = (i + 0.5) * step
        place += step * sea.surface_drift(place, time) + sea.random_walk(count, i, step, time=time, age=time)
    axes, directions = np.linalg.eigh(np.cov(place.T))
    long_axis = math.atan2(directions[1, 1], directions[0, 1])
    assert math.remainder(long_axis - direction, math.pi) == pytest.approx(0.0, abs=math.radians(2.0))
    assert 4 * math.sqrt(axes[1]) == pytest.approx(0.95 * (speed * 3600 / 1852) ** (4 / 3) * 60.0**0.75, rel=0.03)
    assert axes[1] > 9 * axes[0]
    # the whole drifts with the wind
    assert math.atan2(*place.mean(0)[::-1]) == pytest.approx(direction, abs=math.radians(2.0))


def test_the_diffusivity_of_lehrs_ellipse_is_half_the_growth_of_its_variance():
    def variance(time):
        minor, major = lehr_axes(volume=1.0, density_ratio=1.1, wind_speed=6.0, time=time)
        return ((major - minor) / 4) ** 2

    growth = (variance(1801.0) - variance(1799.0)) / 2.0
    assert lehr_diffusivity(6.0, 1800.0) == pytest.approx(0.5 * growth, rel=1e-6)
