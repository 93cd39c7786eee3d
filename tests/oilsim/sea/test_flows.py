"""Steady flows, tides and tables, and the profile of a current."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim.sea import CurrentProfile, FlowTable, RegularWaves, Sea, SeaDescription, SteadyFlow, TidalFlow

TIMES, SPEEDS = [0.0, 600.0, 1200.0, 1800.0], [(0.5, 0.0), (0.3, 0.1), (0.0, 0.0), (-0.4, 0.2)]
FLOWS = {
    "steady": SteadyFlow(speed=0.6, direction=2.1),
    "tide": TidalFlow(speed=0.7, direction=-0.4, turn=500.0),
    "table": FlowTable(TIMES, SPEEDS),
}


@pytest.mark.parametrize("flow", FLOWS.values(), ids=FLOWS)
@pytest.mark.parametrize("time", [100.0, 700.0, 1500.0])
def test_rate_and_travel_are_derivative_and_integral(flow, time):
    step = 1e-2
    rate = (flow.velocity(time + step) - flow.velocity(time - step)) / (2 * step)
    assert flow.rate(time) == pytest.approx(rate, abs=1e-9)
    velocity = (flow.travel(time + step) - flow.travel(time - step)) / (2 * step)
    assert flow.velocity(time) == pytest.approx(velocity, abs=1e-9)
    assert flow.travel(0.0) == pytest.approx((0.0, 0.0), abs=1e-12)


def test_a_tide_turns_every_6_21_hours():
    tide = TidalFlow(speed=0.5, turn=900.0)
    half = 6.21 * 3600
    assert tide.velocity(900.0) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert tide.velocity(900.0 + half) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert tide.velocity(900.0 + 0.5 * half) == pytest.approx((0.5, 0.0), abs=1e-12)
    assert tide.velocity(900.0 + 1.5 * half) == pytest.approx((-0.5, 0.0), abs=1e-12)
    assert tide.velocity(899.0)[0] < 0.0 < tide.velocity(901.0)[0]


def test_a_table_is_linear_between_its_rows_and_does_not_extrapolate():
    table = FLOWS["table"]
    assert table.velocity(600.0) == pytest.approx((0.3, 0.1))
    assert table.velocity(900.0) == pytest.approx((0.15, 0.05))
    assert table.velocity(1800.0) == pytest.approx((-0.4, 0.2))
    assert table.mean() == pytest.approx(table.travel(1800.0) / 1800.0)
    for time in (-1.0, 1800.5):
        with pytest.raises(ValueError, match=rf"time is {time:g} s, allowed: 0 to 1800 s, as in the table"):
            table.velocity(time)


@pytest.mark.parametrize(
    ("times", "values", "text"),
    [
        ([0.0, 2.0, 1.0], [(0, 0)] * 3, r"time goes from 2 s to 1 s at row 2, allowed: times that rise"),
        ([0.0, 60.0, 120.0, 600.0], [(0, 0)] * 4, r"a gap of 480 s follows 120 s, allowed: intervals up to 150 s"),
        ([0.0, 1.0], [(0, 0), (np.nan, 0)], r"velocity of row 1 is \(nan, 0\), allowed"),
        ([0.0, np.inf], [(0, 0)] * 2, r"time of row 1 is not finite"),
        ([0.0], [(0, 0)], r"allowed: \(N,\) and \(N, 2\), N of 2 or more"),
        ([0.0, 1.0], [(0, 0), (200, 0)], r"allowed: at most 100 m/s"),
    ],
)
def test_tables_that_cannot_be_used_are_refused(times, values, text):
    with pytest.raises(ValueError, match=text):
        FlowTable(times, values)


def test_all_faults_of_a_table_are_told_at_once():
    with pytest.raises(ValueError, match=r"velocity of row 1 .*; a gap of 480 s"):
        FlowTable([0.0, 60.0, 120.0, 600.0], [(0, 0), (np.nan, 0), (0, 0), (0, 0)])


def test_the_power_law_of_a_current():
    current = CurrentProfile(flow=SteadyFlow(speed=0.8, direction=0.5 * np.pi), shear_exponent=1 / 7)
    sea = Sea(SeaDescription(depth=10.0, level=1.0, current=current))
    z = np.array([1.0, -4.0, -9.0, 3.0])
    expected = 0.8 * np.array([1.0, 0.5 ** (1 / 7), 0.0, 1.0])
    assert sea.current(z, 5.0)[:, 1] == pytest.approx(expected, abs=1e-12)
    points = np.stack([0 * z, 0 * z, z], -1)
    assert sea.velocity(points, 5.0)[:, 1] == pytest.approx(expected, abs=1e-12)


def test_a_tide_accelerates_the_water():
    tide = FLOWS["tide"]
    sea = Sea(SeaDescription(depth=10.0, current=CurrentProfile(flow=tide, shear_exponent=1 / 7)))
    place = np.array([(0.0, 0.0, -5.0)])
    rate = (sea.velocity(place, 301.0) - sea.velocity(place, 299.0)) / 2.0
    assert sea.acceleration(place, 300.0) == pytest.approx(rate, rel=1e-6)


def test_a_current_follows_the_moving_surface():
    # with waves the profile is stretched between the bottom and the surface
    current = CurrentProfile(flow=SteadyFlow(speed=0.8), shear_exponent=1 / 7)
    waves = RegularWaves(height=0.4, period=5.0, direction=0.5 * np.pi)
    sea = Sea(SeaDescription(depth=5.0, current=current, waves=waves))
    eta = float(sea.elevation((0.0, 0.0), 0.0))
    assert eta == pytest.approx(0.2)
    assert sea.velocity([(0.0, 0.0, eta), (0.0, 0.0, 0.1)], 0.0)[:, 0] == pytest.approx(
        [0.8, 0.8 * (5.1 / 5.2) ** (1 / 7)]
    )
