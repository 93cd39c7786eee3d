"""Spots of oil seen from above: their volume, their final area, and booms that they do not reach across."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim.oil.fates import Fate, LossCause
from oilsim.slick.barriers import Boom
from oilsim.slick.crossing import nearest_on_barriers
from oilsim.slick.oil import Oil
from oilsim.slick.parcels import ParcelState
from oilsim.slick.slick import Slick, SlickSettings
from scenarios.watch.slick_oil import BANKED_UP, spots_of_slick

CRUDE = Oil(density=875.0, dynamic_viscosity=0.02, interfacial_tension=0.02)


def film(thickness: float) -> Slick:
    """A hundred litres in 50 parcels of that thickness [m], between 0 and 8 m before a boom along y."""
    slick = Slick(SlickSettings(loss_volume=0.01), [Boom(name="main", nodes=[[0.0, -50.0], [0.0, 50.0]], draft=0.5)])
    slick.release(CRUDE, 0.1, count=50, center=(4.0, 0.0), radius=3.9)
    slick.parcels.thickness[:] = thickness
    return slick


@pytest.mark.parametrize("thickness", [1e-3, 1e-5, 1e-9])
def test_spots_keep_their_volume_and_do_not_reach_across_a_boom(thickness: float) -> None:
    slick = film(thickness)
    x, _, radius, height, _ = spots_of_slick(slick).T
    np.testing.assert_allclose(np.pi * radius**2 * height, slick.parcels.volume, rtol=1e-5)
    least = np.sqrt(slick.parcels.volume / (np.pi * BANKED_UP))
    assert (radius <= x * 1.000001).all()  # none reaches across, wherever its parcel lies
    moved = radius > slick.parcels.position[:, 0] * 1.000001
    np.testing.assert_allclose(radius[moved], least[moved], rtol=1e-5)
    assert (radius <= np.sqrt(1e5 * slick.parcels.volume**0.75 / np.pi) * 1.000001).all()


def test_a_pool_thicker_than_a_film_is_drawn_as_thick_as_it_is() -> None:
    slick = film(0.05)
    np.testing.assert_allclose(spots_of_slick(slick)[:, 3], 0.05, rtol=1e-6)


def test_what_is_taken_is_not_drawn_and_what_is_lost_has_its_fate() -> None:
    slick = film(1e-3)
    slick.parcels.state[:10], slick.parcels.state[10:15] = ParcelState.RECOVERED, ParcelState.LOST
    slick.parcels.cause[10:15] = LossCause.DRAINAGE
    spots = spots_of_slick(slick)
    assert len(spots) == 40
    assert (spots[:, 4] == Fate.LOST + LossCause.DRAINAGE).sum() == 5


def test_nearest_points_are_those_of_the_nearest_segment() -> None:
    corner = Boom(name="corner", nodes=[[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]], draft=0.5)
    barriers = Slick(SlickSettings(loss_volume=0.01), [corner]).barriers
    places = np.array([[2.0, 1.0], [-3.0, -4.0], [5.5, 2.0], [4.0, 7.0], [3.5, 2.9]])
    nearest = [[2.0, 0.0], [0.0, 0.0], [4.0, 2.0], [4.0, 3.0], [4.0, 2.9]]
    np.testing.assert_allclose(nearest_on_barriers(places, barriers), nearest, atol=1e-12)
    assert np.isinf(nearest_on_barriers(places, Slick(SlickSettings(loss_volume=0.01)).barriers)).all()
