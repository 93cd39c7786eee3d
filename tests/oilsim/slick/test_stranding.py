"""Oil sticks to shores and hulls until they are full."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim.slick.barriers import Boom, Immersion, Outline
from oilsim.slick.parcels import ParcelState
from tests.oilsim.slick.flows import UniformFlow

SHORE = [(20.0, -200.0), (60.0, -200.0), (60.0, 200.0), (20.0, 200.0)]


def drift(slick, seconds, move=None, velocity=(0.5, 0.0)):
    for step in range(round(seconds)):
        if move is not None:
            move(step + 1.0)
        slick.step(UniformFlow(velocity), float(step), 1.0)
        assert abs(slick.oil.residual) < 1e-12
        assert not slick.barriers.encloses(slick.parcels.position[slick.parcels.state != ParcelState.STRANDED]).any()


def test_all_oil_strands_where_there_is_room(make_slick):
    slick = make_slick([Outline(name="shore", nodes=SHORE, capacity=1.0)])
    drift(slick, 120.0)
    assert slick.oil.stranded == pytest.approx(2.0, abs=1e-12)
    assert np.allclose(slick.parcels.position[:, 0], 20.0)


def test_full_shore_lets_the_rest_float(make_slick):
    """1 litre a metre on 400 m is 0.4 m3, to round-off, and the rest lies beside the shore."""
    slick = make_slick([Outline(name="shore", nodes=SHORE, capacity=0.001)])
    drift(slick, 200.0)
    assert slick.oil.stranded == pytest.approx(0.4, rel=1e-12)
    assert slick.oil.afloat == pytest.approx(1.6, rel=1e-12)
    afloat = slick.parcels.position[slick.parcels.state == ParcelState.AFLOAT]
    assert (afloat[:, 0] < 20.0).all()
    assert np.median(afloat[:, 0]) > 19.9


def test_hull_carries_what_sticks_to_it(make_slick):
    """A hull of 30 m by 6 m that runs through the slick at 3 m/s takes oil along; oil that stuck keeps its place on the hull."""
    hull = np.array([(-60.0, -3.0), (-30.0, -3.0), (-25.0, 0.0), (-30.0, 3.0), (-60.0, 3.0)])
    slick = make_slick([Outline(name="hull", nodes=hull, capacity=0.004)])
    drift(slick, 60.0, lambda time: slick.move("hull", hull + np.array([3.0 * time, 0.0])), (0.0, 0.0))
    stuck = slick.parcels.state == ParcelState.STRANDED
    assert 0.03 < slick.oil.stranded <= 0.004 * 72.0
    place = slick.parcels.position[stuck] - (180.0, 0.0)
    before = place.copy()
    slick.move("hull", hull + np.array([183.0, 1.0]))
    slick.step(UniformFlow(), 60.0, 1.0)
    assert np.allclose(slick.parcels.position[stuck] - (183.0, 1.0), before)
    assert (np.abs(place[:, 1]) <= 3.0 + 1e-9).all()


@pytest.mark.parametrize(("turned", "falls"), [(False, 0.0), (True, 0.0), (False, 0.02)])
def test_oil_that_slides_along_a_boom_to_a_waterline_strands_there_and_the_rest_stays_held(make_slick, turned, falls):
    """A boom that lies askew to the flow and ends 5 m inland loses nothing there: the shore's side of 40 m takes 20 l a metre.

    So it does where the waterline falls back past the oil.
    """
    shore = np.array([(-60.0, 20.0), (-60.0, 60.0), (60.0, 60.0), (60.0, 20.0), (22.0, 20.0), (-18.0, 20.0)])
    line = [(10.0 + 0.5 * y, y) for y in (-25.0, -12.0, 0.0, 10.0, 17.0, 25.0)]
    boom = Boom(name="boom", nodes=line[::-1] if turned else line, draft=0.5)
    slick = make_slick([Outline(name="shore", nodes=shore, capacity=0.02), boom], radius=5.0)
    drift(slick, 240.0, lambda time: slick.move("shore", shore - (0.0, falls * time)), (0.3, 0.0))
    oil = slick.oil
    assert slick.losses.passed["around_ends"] == 0.0
    assert oil.stranded == pytest.approx(0.8, rel=1e-9)
    assert oil.contained > 1.1
    held = slick.parcels.position[slick.parcels.state == ParcelState.HELD]
    assert 19.0 < held[:, 1].max() + 240.0 * falls < 20.0


def test_release_inside_an_outline_is_refused(make_slick):
    with pytest.raises(ValueError, match="reaches into an outline, allowed: water"):
        make_slick([Outline(name="shore", nodes=SHORE, capacity=1.0)], center=(18.0, 0.0))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda slick: slick.move("rock", SHORE), "no barrier 'rock', allowed: shore, boom"),
        (lambda slick: slick.move("shore", SHORE[:3]), r"nodes have shape \(3, 2\), allowed: \(4, 2\)"),
        (lambda slick: slick.move("shore", SHORE, Immersion(0.5)), "an immersion was given, allowed: none"),
    ],
)
def test_moves_that_cannot_be_are_refused(make_slick, call, message):
    boom = Boom(name="boom", nodes=[(-20, 30), (-20, 40)], draft=0.5)
    slick = make_slick([Outline(name="shore", nodes=SHORE, capacity=1.0), boom])
    with pytest.raises(ValueError, match=message):
        call(slick)


def test_negative_capacity_is_refused():
    with pytest.raises(ValueError, match="capacity is -1 m3/m, allowed: 0 or more"):
        Outline(name="shore", nodes=SHORE, capacity=-1)
