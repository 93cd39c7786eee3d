"""Seas that follow another one: waves and gusts go on from where they are."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from oilsim.sea import (
    CurrentProfile,
    JonswapWaves,
    KaimalGusts,
    LangmuirCells,
    Sea,
    SeaDescription,
    SteadyFlow,
    TidalFlow,
    WindField,
)
from oilsim.sea.flows import Flow

PLACES = np.random.default_rng(3).uniform(-300.0, 300.0, (50, 2))
WAVES = JonswapWaves(significant_height=0.8, peak_period=4.0, direction=2.0)
CURRENT, STRONGER = SteadyFlow(speed=0.3, direction=1.0), SteadyFlow(speed=0.4, direction=0.2)


def sea_on(flow: Flow | None, seen_from: str = "water", shear_exponent: float = 0.0) -> Sea:
    current = None if flow is None else CurrentProfile(flow=flow, shear_exponent=shear_exponent)
    return Sea(SeaDescription(depth=8.0, waves=replace(WAVES, seen_from=seen_from), current=current))


@pytest.mark.parametrize("flow", [CURRENT, None, TidalFlow(speed=0.8, direction=2.0, turn=100.0)])
@pytest.mark.parametrize("shear_exponent", [0.0, 1 / 7])
def test_waves_go_on_from_where_they_are_when_the_current_changes(flow: Flow | None, shear_exponent: float) -> None:
    """Twice; without it the current of 0.3 m/s and 0.1 m/s more would shift them by 60 m at 600 s."""
    before = sea_on(flow, shear_exponent=shear_exponent)
    description = sea_on(STRONGER, shear_exponent=shear_exponent).description
    after = before.followed_by(description, 600.0, PLACES[0])
    assert after.elevation(PLACES, 600.0) == pytest.approx(before.elevation(PLACES, 600.0), abs=1e-9)
    last = after.followed_by(sea_on(CURRENT, shear_exponent=shear_exponent).description, 900.0, PLACES[0])
    assert last.elevation(PLACES, 900.0) == pytest.approx(after.elevation(PLACES, 900.0), abs=1e-9)
    # and the new current carries them: waves at rest in the water have moved with it
    apart = after.elevation(PLACES, 900.0) - Sea(description).elevation(PLACES, 900.0)
    assert np.abs(apart).max() > 0.1


def test_a_current_changes_the_period_of_waves_seen_from_the_ground_and_not_their_length() -> None:
    before = sea_on(CURRENT, "ground")
    after = before.followed_by(sea_on(STRONGER, "ground").description, 600.0, PLACES[0])
    last = after.followed_by(sea_on(CURRENT, "ground").description, 700.0, PLACES[0])
    assert np.array_equal(last.components.wave_number, before.components.wave_number)
    assert after.elevation(PLACES, 600.0) == pytest.approx(before.elevation(PLACES, 600.0), abs=1e-9)
    made = sea_on(None, "ground")
    after = made.followed_by(sea_on(STRONGER, "ground").description, 600.0, PLACES[0])
    assert after.elevation(PLACES, 600.0) == pytest.approx(made.elevation(PLACES, 600.0), abs=1e-9)


def test_gusts_go_on_at_a_place_when_the_wind_grows_and_turns() -> None:
    """At the place they go on whole, and over the length of a boom about it nearly so; the few that leave the band differ in height."""
    gusts = KaimalGusts(intensity=0.15, seed=4)
    winds = (SteadyFlow(speed=10.0, direction=0.3), SteadyFlow(speed=10.5, direction=0.4))
    before, plain = (Sea(SeaDescription(depth=8.0, wind=WindField(flow=flow, gusts=gusts))) for flow in winds)
    place = np.array([400.0, -250.0])
    after = before.followed_by(plain.description, 600.0, place)

    def gust(sea: Sea, speed: float, where: np.ndarray) -> float:
        return math.hypot(*sea.wind(where, 600.0)) / speed - 1.0

    near = place + np.array([60.0, 40.0])
    assert gust(after, 10.5, place) == pytest.approx(gust(before, 10.0, place), abs=2e-3)
    assert gust(after, 10.5, near) == pytest.approx(gust(before, 10.0, near), abs=0.05)


def test_a_sea_that_stays_as_it_is_stays_so_to_the_last_bit() -> None:
    wind = WindField(flow=SteadyFlow(speed=8.0, direction=2.0), gusts=KaimalGusts())
    first = Sea(replace(sea_on(CURRENT).description, wind=wind, langmuir=LangmuirCells()))
    changed = Sea(replace(first.description, current=CurrentProfile(flow=STRONGER)))
    second = first.followed_by(changed.description, 123.4, PLACES[0])
    third = second.followed_by(changed.description, 567.8, PLACES[7])
    assert third.description == second.description
    assert np.array_equal(third.surface_drift(PLACES, 600.0), second.surface_drift(PLACES, 600.0))
    assert second.surface_drift(PLACES, 123.4) == pytest.approx(first.surface_drift(PLACES, 123.4), abs=1e-9)
    assert first.followed_by(first.description, 50.0, PLACES[3]).description == first.description


def test_waves_of_another_period_are_in_step_where_the_run_is() -> None:
    """Twice, and at another place in between; elsewhere they part, since their lengths are others."""
    first, second = (replace(WAVES, peak_period=period) for period in (4.2, 4.4))
    before, here, there = sea_on(CURRENT), PLACES[0], PLACES[1]
    after = before.followed_by(replace(before.description, waves=first), 600.0, here)
    last = after.followed_by(replace(before.description, waves=second), 700.0, there)
    assert after.elevation(here, 600.0) == pytest.approx(before.elevation(here, 600.0), rel=0.1, abs=0.02)
    assert after.kinematics((*here, -1.0), 600.0).velocity == pytest.approx(
        before.kinematics((*here, -1.0), 600.0).velocity, abs=0.05
    )
    assert last.elevation(there, 700.0) == pytest.approx(after.elevation(there, 700.0), rel=0.1, abs=0.02)
    apart = after.elevation(PLACES, 600.0) - before.elevation(PLACES, 600.0)
    assert np.abs(apart).max() > 0.1
    same = last.followed_by(sea_on(STRONGER).description, 800.0, here)
    assert same.description.carried.turn != ()
    again = last.followed_by(last.description, 800.0, here)
    assert again.elevation(PLACES, 800.0) == pytest.approx(last.elevation(PLACES, 800.0), abs=1e-9)
