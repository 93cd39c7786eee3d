"""A slick with everything in it: accounts at every step, repetition bit for bit, merging and recovery."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from matplotlib.path import Path

from oilsim.oil.fates import LossCause
from oilsim.slick.barriers import Boom, Immersion, Outline
from oilsim.slick.merging import merge_parcels
from oilsim.slick.oil import Oil
from oilsim.slick.parcels import COLUMNS, ParcelState
from oilsim.slick.slick import Slick, SlickSettings
from tests.oilsim.slick.flows import UniformFlow

FLOW = UniformFlow((0.15, 0.02))
HEAVY = Oil(density=940.0, dynamic_viscosity=2.0, interfacial_tension=0.03)


def nodes(time: float) -> np.ndarray:
    """A U of 16 segments that opens to +x and is towed there at 0.3 m/s."""
    turn = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 17)
    return np.stack([-5.0 - 25.0 * np.cos(turn) + 0.3 * time, 18.0 * np.sin(turn)], axis=1)


def loss_rate(pools):
    """A closure for these tests: a share of the pool a second where the water is fast, and oil thicker than a part of the draft."""
    fast = np.maximum(pools.normal_speed - 0.1, 0.0) * (pools.volume > 0.0)
    thick = np.maximum(pools.thickness - 0.02 * pools.draft, 0.0) * pools.front
    return {LossCause.ENTRAINMENT: 0.1 * fast * pools.volume, LossCause.DRAINAGE: 0.05 * thick}


def scene(seed: int = 5, **settings) -> Slick:
    boom = Boom(name="boom", nodes=nodes(0.0), draft=0.6)
    shore = Outline(name="shore", nodes=[(40.0, -60.0), (70.0, -60.0), (70.0, 60.0), (40.0, 60.0)], capacity=0.01)
    slick = Slick(SlickSettings(loss_volume=0.002, diffusivity=0.05, seed=seed, **settings), [boom, shore])
    slick.release(
        Oil(density=875.0, dynamic_viscosity=0.02, interfacial_tension=0.02),
        2.0,
        count=400,
        center=(4, 0),
        radius=8.0,
        age=300.0,
    )
    return slick


def advance(slick: Slick, first: int, last: int) -> None:
    for step in range(first, last):
        slick.move("boom", nodes(0.5 * (step + 1)), Immersion(0.6))
        if step == 100:
            slick.release(HEAVY, 0.3, count=50, center=(10.0, 2.0), radius=3.0)
        if step % 40 == 39:
            slick.recover((-24.0 + 0.15 * step, 0.0), 6.0, 0.01)
        slick.step(FLOW, 0.5 * step, 0.5, loss_rate)


def equal(one: Slick, other: Slick) -> bool:
    """Whether all columns of two slicks, and their accounts, are equal bit for bit."""
    same = all(np.array_equal(getattr(one.parcels, name), getattr(other.parcels, name)) for name in COLUMNS)
    return same and one.oil == other.oil and np.array_equal(one.losses.owed, other.losses.owed)


def test_accounts_close_at_every_step():
    """Released = afloat + held + lost + stranded + recovered to round-off, and every fate and cause that is asked for occurs."""
    slick = scene()
    for step in range(320):
        advance(slick, step, step + 1)
        oil = slick.oil
        assert abs(oil.residual) < 4e-13 * oil.spilled
        assert (slick.parcels.volume > 0.0).all()
    assert oil.spilled == pytest.approx(2.3, abs=1e-12)
    assert min(oil.afloat, oil.contained, oil.all_lost, oil.stranded, oil.recovered) > 0.01
    assert min(slick.losses.passed["entrainment"], slick.losses.passed["drainage"]) > 0.01


def test_restored_state_repeats_bit_for_bit():
    slick, other = scene(), scene(seed=99)
    advance(slick, 0, 150)
    saved = slick.save_state()
    advance(slick, 150, 200)
    other.restore_state(saved)
    advance(other, 150, 200)
    assert equal(slick, other)
    other.restore_state(saved)  # the state itself was not changed by the steps
    advance(other, 150, 200)
    assert equal(slick, other)


def test_seed_decides_and_threads_do_not():
    """Two slicks of one seed that step at the same time in two threads equal one that stepped alone; another seed differs."""
    alone, pair = scene(), [scene(), scene()]
    advance(alone, 0, 60)
    threads = [threading.Thread(target=advance, args=(slick, 0, 60)) for slick in pair]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(equal(alone, slick) for slick in pair)
    other = scene(seed=6)
    advance(other, 0, 60)
    assert not equal(alone, other)


def test_merging_keeps_volume_and_sides():
    """Merged down to a quarter: volume by fate and mass to round-off, and no oil has changed sides of the boom.

    Oil drifts close to the apex on either side; the U is closed far ahead of its mouth, where no oil crosses its sides.
    """
    slick = scene()
    advance(slick, 0, 250)
    line = nodes(125.0)
    for way in (-1.0, 1.0):
        slick.release(HEAVY, 0.2, count=60, center=line[8] + (way, 0.0), radius=0.9)
    bay = Path([line[0] + (200.0, 0.0), *line, line[-1] + (200.0, 0.0)])
    parcels = slick.parcels
    within = parcels.volume[bay.contains_points(parcels.position)].sum()
    assert 0.2 < within < parcels.volume.sum() - 0.2
    before = {state: parcels.volume[parcels.state == state].sum() for state in ParcelState}
    mass, age = ((parcels.volume * column).sum() for column in (parcels.density, parcels.age))
    most = len(parcels) // 4
    ids = set(parcels.id)
    merge_parcels(parcels, slick.barriers, most, 1.0)
    assert len(parcels) == most
    assert set(parcels.id) < ids
    assert parcels.volume[bay.contains_points(parcels.position)].sum() == pytest.approx(within, rel=1e-13)
    for state, volume in before.items():
        assert parcels.volume[parcels.state == state].sum() == pytest.approx(volume, rel=1e-13)
    assert (parcels.volume * parcels.density).sum() == pytest.approx(mass, rel=1e-13)
    assert (parcels.volume * parcels.age).sum() == pytest.approx(age, rel=1e-13)


def test_no_pair_merges_across_a_boom():
    """Two clouds 1 mm from either side of a boom, in one cell: each side keeps its volume."""
    slick = Slick(SlickSettings(loss_volume=1.0), [Boom(name="boom", nodes=[(0, -50), (0, 50)], draft=0.5)])
    oil = Oil(density=900.0, dynamic_viscosity=0.1, interfacial_tension=0.02)
    for x, volume in ((-0.002, 1.0), (0.002, 3.0)):
        slick.release(oil, volume, count=50, center=(x, 0.3), radius=0.001)
    merge_parcels(slick.parcels, slick.barriers, 2, 0.5)
    left = slick.parcels.position[:, 0] < 0.0
    assert slick.parcels.volume[left].sum() == pytest.approx(1.0, rel=1e-13)
    assert slick.parcels.volume[~left].sum() == pytest.approx(3.0, rel=1e-13)
    assert len(slick.parcels) < 20


def test_no_pair_of_different_oils_merges():
    """Two oils of the same density in one place: each keeps its volume and its viscosity."""
    slick = Slick(SlickSettings(loss_volume=1.0))
    for number, viscosity in enumerate((0.1, 0.5)):
        oil = Oil(density=900.0, dynamic_viscosity=viscosity, interfacial_tension=0.02, number=number)
        slick.release(oil, 1.0 + number, count=50, center=(0.25, 0.25), radius=0.01)
    merge_parcels(slick.parcels, slick.barriers, 2, 0.5)
    assert slick.parcels.volume[np.argsort(slick.parcels.oil)] == pytest.approx([1.0, 2.0], rel=1e-13)
    assert slick.parcels.viscosity[np.argsort(slick.parcels.oil)] == pytest.approx([0.1, 0.5], rel=1e-13)


def test_parcels_stay_few():
    slick = scene(most_parcels=300)
    advance(slick, 0, 120)
    assert len(slick.parcels) <= 300
    assert abs(slick.oil.residual) < 1e-12


def test_recovery_takes_what_is_asked_for_and_no_more(make_slick):
    slick = make_slick()
    assert slick.recover((0.0, 0.0), 4.0, 0.0015) == pytest.approx(0.0015, rel=1e-12)
    rest = slick.recover((0.0, 0.0), 4.0, 100.0)
    assert slick.oil.recovered == pytest.approx(0.0015 + rest, rel=1e-12)
    assert slick.recover((0.0, 0.0), 4.0, 100.0) == 0.0
    assert abs(slick.oil.residual) < 1e-12
    with pytest.raises(ValueError, match="radius is -1, allowed: 0 or more"):
        slick.recover((0.0, 0.0), -1, 1.0)


def test_oil_that_is_recovered_does_not_make_others_merge(make_slick):
    """A skimmer takes a little in each of 300 steps: the 500 parcels on the water stay, of 600 allowed."""
    slick = make_slick(most_parcels=600)
    for step in range(300):
        assert slick.recover((0.0, 0.0), 30.0, 1e-5) > 0.0
        slick.step(UniformFlow(), float(step), 1.0)
    assert slick.parcels.there().sum() == 500
    assert slick.oil.recovered == pytest.approx(0.003, rel=1e-12)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"volume": 0.0}, "volume is 0.0, allowed: above 0"),
        ({"radius": -1.0}, "radius is -1.0, allowed: above 0"),
        ({"count": 0}, "count is 0, allowed: 1 or more"),
        ({"age": -1.0}, "age is -1.0 s, allowed: 0 or more"),
        ({"loss_volume": 0.0}, "slick: loss_volume is 0.0, allowed: above 0 m3"),
        ({"friction": -0.1}, "slick: friction is -0.1"),
    ],
)
def test_bad_input_is_refused(make_slick, changes, message):
    with pytest.raises(ValueError, match=message):
        make_slick(**changes)


def test_barriers_have_names_of_their_own():
    boom = Boom(name="boom", nodes=[(0, 0), (3, 0)], draft=0.5)
    with pytest.raises(ValueError, match="barriers are named boom, boom, allowed: each name once"):
        Slick(SlickSettings(loss_volume=1.0), [boom, boom])
