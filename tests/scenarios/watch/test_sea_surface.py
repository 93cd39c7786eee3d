"""The surface of a sea by formulas, as it is recorded: where its grid lies, and the volume of the film on it."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim.sea import RegularWaves, Sea, SeaDescription
from oilsim.slick.barriers import Boom, Outline
from oilsim.slick.oil import Oil
from oilsim.slick.slick import Slick, SlickSettings
from scenarios.watch.sea_surface import (
    FILM_CELLS,
    INNER_LINES,
    OUTER_LINES,
    SeaSurface,
    box_around,
    film_of,
    grid_lines,
)

BOX = (-60.0, -20.0, 100.0, 60.0)
CRUDE = Oil(density=875.0, dynamic_viscosity=0.02, interfacial_tension=0.02)
BENT = ([-200.0, 10.0, 200.0], [0.0, 7.0, 3.0])  # m: y and x of a boom
HULL = np.array([47.5, 6.0])  # m: its middle


def test_the_grid_is_even_in_the_box_and_reaches_far_beyond():
    lines = grid_lines(-60.0, 100.0)
    inner, steps = lines[OUTER_LINES:-OUTER_LINES], np.diff(lines)
    assert len(inner) == INNER_LINES
    assert (inner[0], inner[-1]) == (-60.0, 100.0)
    assert np.ptp(np.diff(inner)) < 1e-12
    assert (steps > 0.0).all()
    assert lines[-1] > 100.0 + 10.0 * 160.0


def test_the_box_holds_the_exercise_and_seldom_moves():
    places = np.random.default_rng(0).uniform((-50.0, -30.0), (50.0, 30.0), (500, 2))
    boxes = {box_around(places + np.array([along, 0.0])) for along in np.arange(0.0, 32.0, 0.5)}
    assert len(boxes) <= 3
    low, high = np.percentile(places, [2.0, 98.0], axis=0)
    assert (np.array(box_around(places)[:2]) < low).all()
    assert (np.array(box_around(places)[2:]) > high).all()


@pytest.mark.parametrize("radius", [0.1, 0.9, 4.0])
def test_a_film_has_the_volume_of_its_spots(radius: float):
    random = np.random.default_rng(1)
    places = random.uniform((-40.0, -10.0), (80.0, 50.0), (400, 2))
    spots = np.column_stack([places, np.full(400, radius), random.uniform(1e-4, 1e-2, 400), np.zeros(400)])
    cell = (BOX[2] - BOX[0]) * (BOX[3] - BOX[1]) / FILM_CELLS**2
    volume = (np.pi * spots[:, 2] ** 2 * spots[:, 3]).sum()
    # a disc's cells are counted by their centres, to about a part in the square root of 400 discs of some cells each
    assert film_of(spots, BOX).sum() * cell == pytest.approx(volume, rel=0.05 if radius > 0.9 else 0.12)


def test_a_film_ends_at_a_boom_and_at_a_hull_and_keeps_its_volume():
    """Spots smaller and larger than a cell of 1.7 by 0.8 m before a slanting boom and around a hull: no oil behind it or inside."""
    boom = Boom(name="main", nodes=np.array(BENT)[::-1].T, draft=0.5)
    hull = Outline(name="hull", nodes=[[40.0, 0.0], [55.0, 0.0], [55.0, 12.0], [40.0, 12.0]], capacity=0.0)
    slick = Slick(SlickSettings(loss_volume=0.01), [boom, hull])
    slick.release(CRUDE, 8.0, count=400, center=(70.0, 40.0), radius=8.0)
    places = np.random.default_rng(3).uniform((1.0, -20.0), (70.0, 60.0), (4000, 2))
    ahead = places[:, 0] > np.interp(places[:, 1], *BENT)
    places = places[ahead & (np.abs(places - HULL) > (7.5, 6.0)).any(axis=1)][:400]
    places[:60, 0] = np.interp(places[:60, 1], *BENT) + 0.002  # at the boom, as those that it holds
    slick.parcels.position[:] = places
    surface = SeaSurface().frame(Sea(SeaDescription(depth=30.0)), 0.0, np.array([BOX[:2], BOX[2:]]))
    for thickness in (0.05, 1e-3):
        slick.parcels.thickness[:] = thickness
        film = SeaSurface().film(surface, slick)
        low, high = np.array(film.box[:2]), np.array(film.box[2:])
        cell = (high - low) / FILM_CELLS
        x, y = (low[axis] + (np.arange(FILM_CELLS) + 0.5) * cell[axis] for axis in (0, 1))
        behind = x[:, None] < np.interp(y, *BENT)[None, :]
        within = (np.abs(x - HULL[0]) < 7.5)[:, None] & (np.abs(y - HULL[1]) < 6.0)[None, :]
        assert not film.thickness[behind].any()
        assert not film.thickness[within].any()
        assert film.thickness.sum() * cell.prod() == pytest.approx(slick.parcels.volume.sum(), rel=0.05)


def test_the_surface_is_the_sea_at_its_crossings():
    sea = Sea(SeaDescription(depth=30.0, waves=RegularWaves(height=0.6, period=8.0)))
    surface = SeaSurface().frame(sea, 3.0, np.array([[0.0, 0.0], [40.0, 20.0]]))
    middle = surface.vertices[np.abs(surface.vertices[:, :2] - (20.0, 10.0)).max(axis=1) < 20.0]
    assert np.abs(middle[:, 2] - sea.elevation(middle[:, :2], 3.0)).max() <= 0.5 / 256 + 1e-6


def test_sheen_wider_than_the_box():
    """A disc of a kilometre covers every cell that the viewer does not continue with its thickness, and a far one leaves no round-off."""
    spots = np.array([[0.0, 0.0, 1000.0, 1e-6, 0.0], [1e5, 0.0, 1000.0, 1e-3, 0.0]])
    film = film_of(spots, BOX)
    assert film[4:-4, 4:-4] == pytest.approx(1e-6)
    assert not film_of(spots[1:], BOX).any()
