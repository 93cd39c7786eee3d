"""Skimmers against their formulas: the share of passing oil, pump, storage, decanting and offload."""

from __future__ import annotations

import math

import pytest
from scipy.constants import foot, gallon, inch, knot

from booms.recovery.skimmer import Skimmer, SkimmerDesign, daily_capacity

HOUR = 3600.0
DESIGN = {
    "nameplate": 40.0 / HOUR,
    "swath": 4.0,
    "throughput_efficiency": 0.6,
    "recovery_efficiency": 0.5,
    "storage": 5.0,
}


def skimmer(**changes: float) -> Skimmer:
    return Skimmer(SkimmerDesign(**(DESIGN | changes)))


def test_encounter_is_that_of_the_calculator_in_its_own_units() -> None:
    """63.13 w[ft] t[in] V[kn] gallons a minute."""
    volume = foot * inch * knot  # [m3/s] that a foot meets of an inch at a knot
    assert volume / gallon * 60.0 == pytest.approx(63.13, rel=1e-3)


def test_daily_capacity_is_a_fifth_of_the_nameplate() -> None:
    assert daily_capacity(40.0 / HOUR) == pytest.approx(192.0)  # [m3] of 40 m3/h over 24 h


def test_oil_that_passes_the_mouth_is_taken_by_its_share() -> None:
    """Over the mean time of a passage, pi w / (4 U), a skimmer that its pump does not limit takes TE of the oil at its mouth."""
    one, volume, speed = skimmer(nameplate=10.0, storage=1e3), 1.0, 0.5
    steps = 400
    step = 0.25 * math.pi * 4.0 / speed / steps
    for number in range(steps):
        taken = one.wanted(volume, 1026.999, speed, step)
        one.take(taken, number * step, step)
        volume -= taken
    assert one.account.oil == pytest.approx(0.6, rel=1e-3)
    assert one.figures()["recovery_efficiency"] == pytest.approx(0.5)


def test_a_mouth_that_stands_still_draws_oil_by_gravity() -> None:
    still, thickness, density = skimmer(nameplate=10.0), 0.05, 900.0
    volume = thickness * 0.25 * math.pi * 4.0**2
    speed = math.sqrt(9.81 * (1.0 - density / 1025.0) * thickness)
    assert still.wanted(volume, density, 0.0, 0.1) == pytest.approx(
        skimmer(nameplate=10.0).wanted(volume, density, speed, 0.1), rel=1e-2
    )


def test_the_rate_falls_in_a_thin_slick_as_measured() -> None:
    """BSEE 1072: at best in 50 to 75 mm, below 26 % of that in half an inch; a pump that much oil passes is the limit here."""
    one = skimmer(nameplate=1e-4, storage=1e6)
    area = 0.25 * math.pi * 4.0**2
    best, thin, thinner = (one.wanted(h * area, 900.0, 1.0, 1.0) for h in (0.1, 0.0127, 0.0127 / 4.0))
    assert best == pytest.approx(1e-4 * one.design.recovery_efficiency)
    assert thin / best == pytest.approx(0.26, abs=0.005)
    assert thinner / thin == pytest.approx(0.25**0.76)


def test_the_pump_and_then_the_storage_stop_it() -> None:
    one = skimmer()
    assert one.wanted(10.0, 900.0, 0.5, 1.0) == pytest.approx(40.0 / HOUR * 0.5)
    for second in range(1000):
        one.begin(float(second), 1.0)
        one.take(one.wanted(10.0, 900.0, 0.5, 1.0), second + 1.0, 1.0)
    assert one.is_full
    assert one.account.oil == pytest.approx(2.5, rel=1e-3)
    assert one.account.oil + one.account.water == pytest.approx(one.oil_aboard + one.water_aboard)
    figures = one.figures()
    assert figures["share_of_nameplate"] == pytest.approx(1.0, abs=0.01)
    assert figures["oil_recovery_rate_m3_h"] == pytest.approx(20.0, rel=0.01)


def test_decanting_keeps_room_for_oil_and_offloading_brings_the_skimmer_back() -> None:
    decanting, offloading = skimmer(decanting=20.0 / HOUR), skimmer(offload_time=100.0)
    for second in range(2000):
        for one in (decanting, offloading):
            one.begin(float(second), 1.0)
            one.take(one.wanted(10.0, 900.0, 0.5, 1.0), second + 1.0, 1.0)
    assert decanting.water_aboard < 0.05
    assert decanting.account.oil == pytest.approx(5.0, rel=0.02)
    account = offloading.account
    assert account.offloaded >= 5.0
    aboard = offloading.oil_aboard + offloading.water_aboard
    assert account.oil + account.water == pytest.approx(aboard + account.offloaded + account.decanted)
    assert account.oil > 2.5 * 2


@pytest.mark.parametrize("duration", [0.5, 4.0])
def test_water_is_let_out_at_the_rate_of_decanting_and_no_more_than_there_is(duration: float) -> None:
    one = skimmer(decanting=20.0 / HOUR)
    one.water_aboard = 0.05
    one.begin(0.0, duration)
    assert one.account.decanted == pytest.approx(duration * 20.0 / HOUR)
    assert one.water_aboard == pytest.approx(0.05 - duration * 20.0 / HOUR)
    one.begin(duration, 60.0)
    assert (one.account.decanted, one.water_aboard) == pytest.approx((0.05, 0.0))


def test_state_is_restored_and_a_stopped_skimmer_takes_nothing() -> None:
    one, other = skimmer(offload_time=50.0), skimmer(offload_time=50.0)
    one.take(one.wanted(10.0, 900.0, 0.5, 1.0), 1.0, 1.0)
    one.is_running = False
    other.restore_state(one.save_state())
    assert other.account == one.account
    assert other.wanted(10.0, 900.0, 0.5, 1.0) == 0.0


def test_impossible_values_are_named_at_once() -> None:
    with pytest.raises(ValueError) as found:
        skimmer(nameplate=0.0, recovery_efficiency=1.2, throughput_efficiency=1.0)
    assert all(name in str(found.value) for name in ("nameplate", "recovery_efficiency", "throughput_efficiency"))
