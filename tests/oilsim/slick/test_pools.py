"""Booms hold oil: pools have the profile of the closure, slide, go round free ends, and let go when the water turns."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim.oil.fates import LossCause
from oilsim.slick.barriers import Boom
from oilsim.slick.parcels import ParcelState
from oilsim.slick.pools import boom_thickness, head_thickness, reduced_gravity, thickening
from tests.oilsim.slick.flows import Swell, Tide, UniformFlow


@pytest.mark.parametrize(
    ("density", "speed", "volume", "head", "thickness", "length"),
    [
        (900, 0.30, 0.2, 0.037, 0.056, 4.2), (900, 0.30, 1.0, 0.037, 0.088, 15.1), (900, 0.36, 0.2, 0.053, 0.069, 3.2),
        (900, 0.36, 1.0, 0.053, 0.102, 12.4), (900, 0.50, 0.2, 0.103, 0.113, 1.8), (900, 0.50, 1.0, 0.103, 0.142, 8.1),
        (840, 0.36, 0.2, 0.036, 0.057, 4.2), (840, 0.36, 1.0, 0.036, 0.089, 15.0), (950, 0.36, 0.2, 0.088, 0.099, 2.1),
        (950, 0.36, 1.0, 0.088, 0.128, 9.1),
    ],
)  # fmt: skip
def test_profile_by_hand(density, speed, volume, head, thickness, length):
    """h_f = U^2 / (2 g'), h_b = (h_f^3 + 1.5 K V')^(1/3), L = (h_b^2 - h_f^2) / K for C_f = 0.005, by hand in two to three digits."""
    weaker = reduced_gravity(np.array([float(density)]), 1027.0)
    front = head_thickness(np.array([speed]), weaker)
    growth = thickening(np.array([speed]), weaker, np.array([density / 1027.0]), 0.005)
    deep = boom_thickness(front, growth, np.array([volume]))
    assert front[0] == pytest.approx(head, abs=1.5e-3)
    assert deep[0] == pytest.approx(thickness, abs=1.5e-3)
    assert (deep[0] ** 2 - front[0] ** 2) / growth[0] == pytest.approx(length, rel=0.04)


def walled_boom() -> list[Boom]:
    """A boom of ten segments across the flow at x = 15, between two walls along the flow that reach far ahead of it."""
    line = [(15.0, y) for y in np.linspace(-10.0, 10.0, 11)]
    return [Boom(name="boom", nodes=[(-100.0, -10.0), *line, (-100.0, 10.0)], draft=0.6)]


def run(slick, flow, seconds, step=0.5, begin=0.0, loss_rate=None):
    extra = () if loss_rate is None else (loss_rate,)
    for k in range(round(seconds / step)):
        slick.step(flow, begin + k * step, step, *extra)
        assert abs(slick.oil.residual) < 1e-12
    return slick


def test_boom_across_the_flow_holds_all_oil_in_the_profile(make_slick):
    """The pool's thickness integrates to its volume: parcels within x of the boom hold (h_b^3 - h(x)^3) / (1.5 K) per metre of front."""
    slick = run(make_slick(walled_boom(), radius=8.0), UniformFlow((0.3, 0.0)), 300.0)
    oil, pools, parcels = slick.oil, slick.pools, slick.parcels
    assert oil.contained > 1.8
    assert oil.contained + oil.afloat == pytest.approx(
        2.0, abs=1e-12
    )  # some floats beside the walls, which press nothing
    assert (parcels.position[:, 0] < 15.0).all()
    middle = slice(2 * 3, 2 * 9)
    oil = pools.volume[middle] > 0.0
    thickness, reach = pools.thickness[middle][oil], pools.reach[middle][oil]
    growth = 0.005 * 1027.0 / 875.0 * 0.3**2 / reduced_gravity(875.0, 1027.0)
    assert len(thickness) == 6
    assert np.allclose(
        thickness,
        (pools.front_thickness[middle][oil] ** 3 + 1.5 * growth * pools.volume_per_front[middle][oil]) ** (1 / 3),
    )
    front = np.isin(parcels.place, range(3, 9))
    away = 15.0 - parcels.position[front, 0]
    assert (away > 0.0).all()
    for share in (0.25, 0.5, 0.75):
        x = share * reach.mean()
        expected = (thickness.mean() ** 3 - (thickness.mean() ** 2 - growth * x) ** 1.5) / (1.5 * growth) * 12.0
        assert parcels.volume[front][away < x].sum() == pytest.approx(expected, rel=0.1)


def test_pools_level_along_a_straight_boom(make_slick):
    """Oil that arrives off the middle spreads along the boom until the thickness is even within 10 %."""
    slick = run(make_slick(walled_boom(), radius=3.0, center=(0.0, -5.0)), UniformFlow((0.3, 0.0)), 600.0)
    thickness = slick.pools.thickness[2:22].reshape(-1, 2).max(axis=1)
    assert thickness.min() > 0.9 * thickness.max()


def test_boom_lets_go_when_the_water_turns(make_slick):
    slick = run(make_slick(walled_boom(), radius=8.0), Tide(0.3, 200.0), 300.0)
    parcels = slick.parcels
    assert slick.oil.contained == 0.0
    assert slick.oil.afloat == pytest.approx(2.0, abs=1e-12)
    assert slick.losses.passed["around_ends"] == 0.0
    assert (parcels.position[:, 0] < 15.0).all()


def test_oil_that_a_boom_takes_back_has_not_passed_it_and_oil_that_another_takes_has(make_slick):
    """Turbulence brings oil back that has gone round the end: into its own boom, or into that of a neighbour behind."""
    line = np.linspace(0.0, 40.0, 11)[:, None] * (np.cos(np.pi / 6), np.sin(np.pi / 6)) + (5.0, -8.0)
    behind = line[-1] + (3.0, -6.0), line[-1] + (3.0, 6.0)
    first, second = (Boom(name=name, nodes=nodes, draft=0.5) for name, nodes in (("first", line), ("second", behind)))
    caught = []
    for booms in ([first], [first, second]):
        slick = run(make_slick(booms, radius=3.0, center=(0.0, 0.0), diffusivity=0.2), UniformFlow((0.4, 0.0)), 200.0)
        losses, parcels, rows = slick.losses, slick.parcels, slick.barriers.rows("first")
        assert losses.recontained[rows].sum() > 0.05
        caught.append(losses.gone[:, rows].sum() - parcels.volume[parcels.loser == 0].sum())
    alone, behind_it = caught
    assert alone == pytest.approx(0.0, abs=1e-9)
    assert 0.1 < behind_it <= losses.gone[:, slick.barriers.rows("second")].sum() + slick.oil.contained


def test_a_boom_holds_its_oil_while_waves_carry_it_to_and_fro(make_slick):
    """Water of 0.2 m/s that swings by 0.3 m/s runs back for a quarter of each wave; the oil is let go when its mean turns."""
    flow = Swell(0.2, 0.3, 240.0)
    slick = run(make_slick(walled_boom(), radius=8.0), flow, 225.0, step=0.25)
    held, backwards = [], 0
    for k in range(60):
        run(slick, flow, 0.25, step=0.25, begin=225.0 + 0.25 * k)
        held.append(slick.oil.contained)
        middle = {
            name: getattr(slick.pools, name)[2:22:2]
            for name in ("normal_speed", "volume", "length", "volume_per_front")
        }
        backwards += (middle["normal_speed"] < 0.0).all()
        assert np.allclose(
            middle["volume_per_front"], middle["volume"] / middle["length"]
        )  # closures see no other pool
    assert 12 <= backwards <= 20
    assert min(held) > 1.95
    assert max(held) - min(held) < 0.03  # a parcel or two that slide on to a wall, which nothing presses
    run(slick, flow, 12.0, step=0.25, begin=240.0)
    assert slick.oil.contained < 0.02  # what touches the boom within a wave


def test_slack_water_is_restored(make_slick):
    """3.5 s after the turn the water has run back 1.05 m of three drafts of 0.6 m; a restored slick lets go at the same step."""
    flow = Tide(0.3, 200.0)
    slick, other = run(make_slick(walled_boom(), radius=8.0), flow, 203.5), make_slick(walled_boom(), seed=3)
    other.restore_state(slick.save_state())
    assert slick.oil.contained > 1.5
    steps = []
    for one in (slick, other):
        steps.append(0)
        while one.oil.contained > 0.0:
            run(one, flow, 0.5, begin=203.5 + 0.5 * steps[-1])
            steps[-1] += 1
    assert steps == [5, 5]
    assert np.array_equal(slick.parcels.position, other.parcels.position)


def test_oil_slides_along_a_boom_at_an_angle_and_leaves_at_its_free_end(make_slick):
    """At 30 degrees to 0.4 m/s the oil slides along and is lost around the downstream end, with that cause alone."""
    line = np.linspace(0.0, 40.0, 11)[:, None] * (np.cos(np.pi / 6), np.sin(np.pi / 6)) + (5.0, -8.0)
    slick = run(
        make_slick([Boom(name="boom", nodes=line, draft=0.5)], radius=3.0, center=(0.0, 0.0)),
        UniformFlow((0.4, 0.0)),
        120.0,
    )
    oil, parcels = slick.oil, slick.parcels
    assert oil.all_lost > 1.0
    assert oil.lost["around_ends"] == pytest.approx(oil.all_lost, rel=1e-12)
    assert slick.losses.passed["around_ends"] == pytest.approx(
        oil.all_lost, rel=1e-12
    )  # some spreads back, and is caught again
    lost = parcels.position[parcels.state == ParcelState.LOST]
    assert (lost[:, 0] > line[-1, 0]).mean() > 0.9
    ahead = parcels.position[(parcels.state == ParcelState.AFLOAT) & (np.abs(parcels.position[:, 0] - 20.0) < 10.0)]
    across = (ahead[:, 0] - 5.0) * np.tan(np.pi / 6) - 8.0
    assert not ((ahead[:, 1] < across) & (ahead[:, 1] > across - 1.0)).any()


def test_pools_of_legs_askew_to_the_flow_lie_beside_their_segments(make_slick):
    """Legs at 15 degrees to 0.3 m/s: no pool reaches past its own segment's ends, as it would against the flow, nor out of the mouth."""
    leg = np.linspace(0.0, 20.0, 6)[:, None] * (np.cos(np.pi / 12), np.sin(np.pi / 12))
    upper, lower = leg * (-1.0, 1.0), leg * (-1.0, -1.0)
    line = np.vstack([upper[::-1], lower[1:]])
    slick = make_slick([Boom(name="boom", nodes=line, draft=0.5)], radius=2.0, center=(-12.0, 0.0))
    for k in range(300):
        slick.step(UniformFlow((0.3, 0.0)), 0.5 * k, 0.5)
        held = slick.parcels.state == ParcelState.HELD
        place, position = slick.parcels.place[held], slick.parcels.position[held]
        start, way = line[place], (line[1:] - line[:-1])[place]
        along = ((position - start) * way).sum(1) / (way**2).sum(1)
        assert (np.abs(along - 0.5) < 0.5 + 1e-9).all()
    assert slick.oil.contained > 1.5


@pytest.mark.parametrize("seed", [1, 2])
def test_nothing_leaks_out_of_a_ring_that_is_towed_turned_and_bent(make_slick, seed):
    """300 steps with dispersion far above what is real: all oil stays inside a closed ring of 12 segments."""
    turn = np.linspace(0.0, 2.0 * np.pi, 13)[:-1]

    def nodes(time):
        ring = np.stack([np.cos(turn + 0.02 * time), np.sin(turn + 0.02 * time)], axis=1)
        return 20.0 * ring * (1.0 + 0.2 * np.sin(3.0 * turn + 0.1 * time)[:, None]) + (0.4 * time, 0.1 * time)

    slick = make_slick(
        [Boom(name="ring", nodes=nodes(0.0), draft=0.5, is_closed=True)], count=300, seed=seed, diffusivity=2.0
    )
    for step in range(300):
        slick.move("ring", nodes(0.5 * (step + 1)))
        slick.step(UniformFlow((0.1, -0.1)), 0.5 * step, 0.5)
    start, end = slick.barriers.start, slick.barriers.end
    winding = np.zeros(len(slick.parcels))
    for a, b in zip(start, end, strict=True):
        one, other = a - slick.parcels.position, b - slick.parcels.position
        cross = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
        winding += np.arctan2(cross, (one * other).sum(axis=1))
    assert np.allclose(winding, 2.0 * np.pi, atol=1e-6)
    assert slick.oil.all_lost == 0.0
    assert slick.oil.contained > 0.1


def test_losses_keep_their_cause_and_appear_behind(make_slick):
    """Two causes at constant rates: after a while each has taken its rate times the time, less at most one parcel a pool."""

    def loss_rate(pools):
        oil = (pools.volume > 0.0) & np.isin(pools.segment, range(1, 11))
        return {LossCause.ENTRAINMENT: np.where(oil, 2e-4, 0.0), LossCause.DRAINAGE: np.where(oil, 1e-4, 0.0)}

    slick = run(make_slick(walled_boom(), radius=8.0, volume=4.0), UniformFlow((0.3, 0.0)), 200.0)
    pools = 10
    run(slick, UniformFlow((0.3, 0.0)), 100.0, begin=200.0, loss_rate=loss_rate)
    assert (slick.pools.volume[2:22].reshape(-1, 2).max(axis=1) > 0.1).all()
    passed = slick.losses.passed
    for cause, rate in (("entrainment", 2e-4), ("drainage", 1e-4)):
        assert rate * 100.0 * pools - 0.003 * pools <= passed[cause] <= rate * 100.0 * pools + 0.001 * pools
        assert slick.oil.lost[cause] == pytest.approx(passed[cause], rel=1e-12)
    parcels = slick.parcels
    lost = parcels.state == ParcelState.LOST
    assert ((parcels.position[lost, 0] >= 15.0) | (np.abs(parcels.position[lost, 1]) >= 10.0)).all()
    assert parcels.position[lost, 0].max() > 40.0


def test_a_pool_never_loses_more_than_it_holds(make_slick):
    slick = make_slick(walled_boom(), radius=8.0)
    run(
        slick,
        UniformFlow((0.3, 0.0)),
        300.0,
        loss_rate=lambda pools: {LossCause.SUBMERGENCE: np.full(len(pools.volume), 50.0)},
    )
    assert slick.oil.contained == 0.0
    assert slick.oil.lost["submergence"] > 1.8
    assert slick.oil.all_lost + slick.oil.afloat == pytest.approx(2.0, abs=1e-12)


@pytest.mark.parametrize("share", [1.0, 0.7, 0.99])
def test_the_last_oil_of_a_pool_goes_whatever_the_number_of_causes(make_slick, share):
    """Half a loss volume, in one parcel, owed to two causes: it goes by the larger one, and the account of the other is kept."""

    def loss_rate(pools):
        rate = np.where(pools.volume > 0.0, 1e-4, 0.0)
        return {LossCause.DRAINAGE: share * rate, LossCause.ENTRAINMENT: (1.0 - share) * rate}

    slick = make_slick(walled_boom(), volume=0.001, count=1, center=(12.0, 1.0), radius=0.1)
    run(slick, UniformFlow((0.3, 0.0)), 60.0, loss_rate=loss_rate)
    assert slick.oil.contained == 0.0
    assert slick.oil.lost["drainage"] == pytest.approx(0.001, rel=1e-12)


def test_debts_of_many_pools_go_to_the_nearest_that_holds_enough(make_slick):
    """400 pools owe more than they hold. One at the end of another boom holds enough: nobody's heir. Then the one at this boom's end is."""
    line = [(0.0, 3.0 * k) for k in range(401)]
    slick = make_slick(
        [Boom(name="long", nodes=line, draft=0.5), Boom(name="far", nodes=[(90, 0), (90, 9)], draft=0.5)]
    )
    volume = np.tile([1e-3, 0.0], 401)
    volume[800] = 1e3
    rates = {LossCause.DRAINAGE: np.where(np.arange(802) < 800, volume, 0.0)}
    slick.losses.add(rates, slick.pools._replace(volume=volume), slick.barriers, 2.0)
    owed = slick.losses.owed[LossCause.DRAINAGE]
    assert np.allclose(owed[:800], volume[:800], rtol=1e-12)
    assert not owed[800:].any()
    volume[798] = 10.0
    slick.losses.add(rates, slick.pools._replace(volume=volume), slick.barriers, 1.0)
    assert slick.losses.owed.sum() == pytest.approx(2.0 * 0.399 + 0.002, rel=1e-9)


@pytest.mark.parametrize(("rate", "message"), [(np.full(3, 1.0), r"shape \(3,\)"), (np.full(24, -1.0), "is -1 m3/s")])
def test_rates_that_cannot_be_are_refused(make_slick, rate, message):
    slick = run(make_slick(walled_boom(), radius=8.0), UniformFlow((0.3, 0.0)), 60.0)
    with pytest.raises(ValueError, match=message):
        slick.step(UniformFlow((0.3, 0.0)), 60.0, 0.5, lambda pools: {LossCause.PLANING: rate})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"nodes": [(0, 0)]}, r"nodes have shape \(1, 2\)"),
        ({"nodes": [(0, 0), (0, 0.01)]}, "a segment is 0.01 m long"),
        ({"draft": -1.0}, "draft is -1 m somewhere"),
        ({"draft": [0.5, 0.5]}, r"draft has shape \(2,\), allowed: \(\) or \(1,\)"),
    ],
)
def test_booms_that_cannot_be_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        Boom(**({"name": "boom", "nodes": [(0, 0), (3, 0)], "draft": 0.5} | changes))


def test_a_little_oil_stays_in_the_apex(make_slick):
    """A U of 100 m holds 0.2 m3 in 0.6 m/s, most of it before the middle two of 40 segments. A whole head there would push it out."""
    arc, sag = np.linspace(-50.0, 50.0, 41), 7.0
    across = sag * np.arcsinh(arc / sag)
    line = np.stack([sag - sag * np.cosh(across / sag), -across], axis=1)
    boom = [Boom(name="boom", nodes=line, draft=0.5)]
    slick = run(make_slick(boom, volume=0.2, center=(-18.0, 0.0), radius=8.0), UniformFlow((0.6, 0.0)), 240.0, step=0.2)
    volume = slick.pools.volume.reshape(-1, 2).max(axis=1)
    assert volume.sum() == pytest.approx(0.2)
    assert volume[19:21].sum() > 0.5 * volume.sum()
