"""Two windows and one slick: each has the oil in it as particles, none twice, and what leaves one comes into the other."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from coupling.participants.slick import CarryingSea, SlickParticipant
from oilsim import Phase
from oilsim.sea import CurrentProfile, Sea, SeaDescription, SteadyFlow
from oilsim.slick.oil import Oil
from oilsim.slick.parcels import ParcelState
from oilsim.slick.slick import Slick, SlickSettings
from oilsim.window.oil_exchange import JointExchange, OilExchange
from oilsim.window.settings import WindowSettings
from oilsim.window.window import Window
from tests.oilsim.slick.flows import UniformFlow

WATER = Phase(name="water", rest_density=1027.0, dynamic_viscosity=1e-3)
CRUDE = Phase(name="crude", rest_density=870.0, dynamic_viscosity=0.05)
OIL = Oil(density=870.0, dynamic_viscosity=0.05, interfacial_tension=0.02)
SPACINGS, PLACES, STEP, CURRENT = (0.25, 0.3), (0.0, 5.0), 0.1, 0.9


@pytest.fixture
def windows() -> Iterator[list[Window]]:
    sea = Sea(SeaDescription(depth=10.0, current=CurrentProfile(flow=SteadyFlow(speed=CURRENT))))
    made = []
    for number, spacing in enumerate(SPACINGS):
        settings = WindowSettings(size=(4.0, 4.0), depth=1.2, spacing=spacing, rim=0.8, sleep_speed=0.02)
        made.append(Window(settings, sea, (WATER, CRUDE), threads=1, number=number))
    yield made
    for one in made:
        one.fluid.close()


def test_oil_goes_from_one_window_to_the_other_and_keeps_its_volume(windows: list[Window]) -> None:
    """The slick drifts 5.4 m from the middle of the first window to that of the second, whose particles are larger."""
    slick = Slick(SlickSettings(loss_volume=0.02, water_density=1027.0), ())
    participant, exchange = SlickParticipant("slick", slick, CarryingSea(UniformFlow((CURRENT, 0.0)))), None
    exchange = JointExchange([OilExchange(one) for one in windows])
    participant.meet(exchange, UniformFlow((CURRENT, 0.0)))
    slick.release(OIL, 0.6, count=200, center=(-0.4, 0.0), radius=0.4)
    counts = []
    for index in range(58):
        time = index * STEP
        for window, place in zip(windows, PLACES, strict=True):
            window.follow(np.array([place, 0.0]), time)
            window.fluid.time = time
            window.fluid.advance(STEP)
        participant.do_step(time, STEP)
        counts.append([len(window.fluid.phase_ids("crude")) for window in windows])
        assert abs(slick.oil.residual) < 1e-12
        volume = sum(n * spacing**3 for n, spacing in zip(counts[-1], SPACINGS, strict=True))
        assert slick.oil.resolved == pytest.approx(volume, rel=1e-9)
        rows, _ = exchange.places(slick.parcels, time)
        assert sorted(rows) == list(np.flatnonzero(slick.parcels.state == ParcelState.RESOLVED))
    first, second = np.array(counts).T
    assert first[:10].max() > 10
    assert first[-1] == 0
    assert second[:10].max() == 0
    ids = [window.fluid.particles.id for window in windows]
    assert not np.intersect1d(*ids).size
    taken = sum(one.taken - one.given for one in exchange.exchanges)
    assert taken == pytest.approx(slick.oil.resolved, abs=1e-9)
