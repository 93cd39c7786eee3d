"""Langmuir cells, with parcels that drift on the sea."""

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
    WindField,
)  # fmt: skip

WAVES = JonswapWaves(significant_height=0.5, peak_period=3.0, direction=0.5)


def sea_with(speed=8.0, direction=0.5, **parts):
    wind = WindField(flow=SteadyFlow(speed=speed, direction=direction))
    return Sea(SeaDescription(depth=20.0, wind=wind, waves=WAVES, **parts))


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
