"""Wave lengths, currents that carry waves, and breaking, against formulas and check values."""

from __future__ import annotations

import math

import numpy as np
import pytest

from oilsim.sea import CurrentProfile, FlowTable, RegularWaves, Sea, SeaDescription, SteadyFlow, TidalFlow
from oilsim.sea.regular_waves import current_share, steepest_height, wave_number

GRAVITY = 9.81
# period [s]: lengths [m] and celerities [m/s] in 2 m, 5 m and deep water, solved to all digits
LENGTHS = {
    2.0: ((6.052, 3.026), (6.245, 3.122), (6.245, 3.123)),
    3.0: ((11.306, 3.769), (13.762, 4.587), (14.052, 4.684)),
    4.0: ((16.226, 4.056), (22.198, 5.550), (24.981, 6.245)),
    6.0: ((25.583, 4.264), (38.090, 6.348), (56.207, 9.368)),
}


@pytest.mark.parametrize("period", LENGTHS)
@pytest.mark.parametrize(("place", "depth"), [(0, 2.0), (1, 5.0), (2, 500.0)])
def test_lengths_and_celerities_are_those_of_the_table(period, place, depth):
    k = wave_number(period, depth)
    assert math.sqrt(GRAVITY * k * math.tanh(k * depth)) == pytest.approx(2 * math.pi / period, rel=1e-12)
    length, celerity = LENGTHS[period][place]
    assert 2 * math.pi / k == pytest.approx(length, rel=2e-4)
    assert 2 * math.pi / k / period == pytest.approx(celerity, rel=2e-4)


@pytest.mark.parametrize("speed", [-0.5, -0.2, 0.3, 2.0])
@pytest.mark.parametrize("shear_exponent", [0.0, 1 / 7])
def test_a_period_seen_from_the_ground_fulfils_the_relation_on_a_current(speed, shear_exponent):
    # (omega - k U share)^2 = g k tanh kh
    direction = 0.0 if speed > 0.0 else math.pi
    flow = SteadyFlow(speed=abs(speed), direction=direction)
    sea = Sea(
        SeaDescription(
            depth=5.0,
            waves=RegularWaves(height=0.2, period=3.0, seen_from="ground"),
            current=CurrentProfile(flow=flow, shear_exponent=shear_exponent),
        )
    )
    k, share = sea.components.wave_number[0], sea.components.share[0]
    sigma = 2 * math.pi / 3.0 - k * speed * share
    assert sigma**2 == pytest.approx(GRAVITY * k * math.tanh(5.0 * k), rel=1e-9)
    # so that an observer at rest sees the period
    place = np.array([3.0, 1.0])
    now, later = sea.elevation(place, 7.0), sea.elevation(place, 10.0)
    assert later == pytest.approx(now, abs=1e-9)


def test_the_doppler_shift_of_a_period_seen_from_the_water():
    # at rest the frequency is sigma + k . U; with the current it is sigma
    u, direction, sigma = np.array([0.4, -0.3]), 0.5, 2 * math.pi / 3.0
    flow = SteadyFlow(speed=0.5, direction=math.atan2(-0.3, 0.4))
    waves = RegularWaves(height=0.2, period=3.0, direction=direction)
    still = Sea(SeaDescription(depth=5.0, waves=waves))
    sea = Sea(SeaDescription(depth=5.0, waves=waves, current=CurrentProfile(flow=flow)))
    k = sea.components.wave_number[0]
    seen = 2 * math.pi / (sigma + k * (u[0] * math.cos(direction) + u[1] * math.sin(direction)))
    times = np.arange(0.0, 20.0, 0.7)
    assert [float(sea.elevation((1.0, 2.0), t + seen)) for t in times] == pytest.approx(
        [float(sea.elevation((1.0, 2.0), t)) for t in times], abs=1e-12
    )
    for t in times:
        assert sea.elevation(np.array([1.0, 2.0]) + u * t, t) == pytest.approx(
            still.elevation((1.0, 2.0), t), abs=1e-12
        )


def test_a_tide_carries_the_waves_along():
    # waves seen from the water are at rest in it, whatever its way was
    tide = TidalFlow(speed=0.8, direction=0.4, turn=600.0)
    waves = RegularWaves(height=0.2, period=3.0, direction=0.4)
    still = Sea(SeaDescription(depth=5.0, waves=waves))
    sea = Sea(SeaDescription(depth=5.0, waves=waves, current=CurrentProfile(flow=tide)))
    for time in (0.0, 300.0, 20000.0):
        place = np.array([4.0, -2.0]) + tide.travel(time)
        assert sea.elevation(place, time) == pytest.approx(still.elevation((4.0, -2.0), time), abs=1e-9)


def test_the_share_of_a_sheared_current_in_its_limits():
    # long waves are carried by the mean over the depth, 1 / (1 + n); short ones by the surface
    share = current_share(np.array([1e-4, 100.0]), 5.0, 1 / 7)
    assert share == pytest.approx([7 / 8, 1.0], rel=1e-3)
    # a linear profile in deep water: U_s (1 - 1 / (2 k h)) (Stewart and Joy 1974)
    assert current_share(np.array([4.0]), 10.0, 1.0)[0] == pytest.approx(1 - 1 / 80, rel=1e-5)
    assert current_share(np.array([0.3, 3.0]), 5.0, 0.0) == pytest.approx([1.0, 1.0], abs=0)


def test_the_steepest_waves():
    # 0.142 L in deep water, 0.89 h in shallow water (0.142 2 pi)
    assert steepest_height(1.0, 100.0) == pytest.approx(0.142 * 2 * math.pi, rel=1e-9)
    assert steepest_height(0.001, 2.0) == pytest.approx(0.892 * 2.0, rel=1e-3)


def test_waves_that_a_current_blocks_are_refused():
    # deep water: blocked by g T / (8 pi) = 0.78 m/s
    waves = RegularWaves(height=0.02, period=2.0, seen_from="ground")
    for speed, blocked in ((0.77, False), (0.80, True)):
        current = CurrentProfile(flow=SteadyFlow(speed=speed, direction=math.pi))
        description = SeaDescription(depth=50.0, waves=waves, current=current)
        if blocked:
            with pytest.raises(
                ValueError, match=r"period of 2 s .* blocked by an opposing current of 0.8 m/s, allowed"
            ):
                Sea(description)
        else:
            Sea(description)


def test_a_period_seen_from_the_ground_needs_a_steady_current():
    waves = RegularWaves(height=0.02, period=2.0, seen_from="ground")
    for flow in (TidalFlow(speed=0.5), FlowTable([0.0, 60.0], [(0.0, 0.0), (0.1, 0.0)])):
        with pytest.raises(ValueError, match=r"seen_from is 'ground' .* allowed: 'water', or a steady current"):
            Sea(SeaDescription(depth=5.0, waves=waves, current=CurrentProfile(flow=flow)))
