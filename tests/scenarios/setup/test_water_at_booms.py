"""The water that runs against booms in a sea without particles: current, drift of the wind, and the waves' own motion."""

from __future__ import annotations

import math

import numpy as np
import pytest

from oilsim.sea import Sea
from oilsim.sea.description import SeaDescription
from oilsim.sea.regular_waves import RegularWaves
from oilsim.slick.barriers import Boom
from oilsim.slick.slick import Slick, SlickSettings
from scenarios.setup.at_sea.parcels import WaterFlow

HEIGHT, PERIOD, DEPTH = 0.4, 4.0, 30.0
OMEGA = 2.0 * math.pi / PERIOD
NUMBER = OMEGA**2 / 9.80665  # deep water


@pytest.fixture
def sea() -> Sea:
    return Sea(SeaDescription(depth=DEPTH, waves=RegularWaves(height=HEIGHT, period=PERIOD, direction=0.0)))


def test_water_moves_with_the_waves(sea: Sea) -> None:
    """Airy: at most a omega exp(-k d) at the depth d below a deep sea's surface; its mean over a wave is 0."""
    flow = WaterFlow(sea, 0.25)
    speeds = np.array([flow.surface_velocity(np.zeros((1, 2)), t)[0] for t in np.arange(0.0, PERIOD, PERIOD / 64)])
    assert np.abs(speeds[:, 0]).max() == pytest.approx(0.5 * HEIGHT * OMEGA * math.exp(-0.25 * NUMBER), rel=0.01)
    assert speeds.mean(axis=0) == pytest.approx([0.0, 0.0], abs=2e-3)


def test_a_boom_that_the_waves_carry_meets_no_water(sea: Sea) -> None:
    """A boom that goes to and fro with the water feels none of its speed; one that is held feels all of it."""
    flow, step = WaterFlow(sea, 0.25), 0.05
    line = np.array([[0.0, -5.0], [0.0, 5.0]])
    largest = {}
    for carried in (True, False):
        slick = Slick(SlickSettings(loss_volume=0.01), [Boom(name="main", nodes=line, draft=0.5)])
        x, met = 0.0, []
        for k in range(160):
            time = k * step
            if carried:
                x += step * float(flow.surface_velocity(np.array([[x, 0.0]]), time + 0.5 * step)[0, 0])
            slick.move("main", line + np.array([x, 0.0]))
            met.append(float(np.abs(slick.relative_velocity(flow, time, step)).max()))
            slick.step(flow, time, step)
        largest[carried] = max(met)
    assert largest[False] == pytest.approx(0.5 * HEIGHT * OMEGA * math.exp(-0.25 * NUMBER), rel=0.02)
    assert largest[True] < 0.02 * largest[False]
