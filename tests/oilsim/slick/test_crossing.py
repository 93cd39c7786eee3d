"""The test of ways against moving segments is exact, also at joints."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim.slick.barriers import Barriers, Boom, Outline
from oilsim.slick.crossing import beside, first_crossings, moving_sweep, resting_sweep


def moved(old, new, is_closed=False) -> Barriers:
    """One boom on its way from old to new nodes (N, 2) [m]."""
    barriers = Barriers([Boom(name="boom", nodes=old, draft=0.5, is_closed=is_closed)])
    barriers.move("boom", new)
    return barriers


def one_way(barriers: Barriers, origin, target):
    return first_crossings(np.array([origin], float), np.array([target], float), moving_sweep(barriers))


def test_segment_runs_over_a_resting_parcel():
    """A wall that moves 2 m in +x meets a parcel 0.5 m ahead after a quarter of the step, on its right."""
    found = one_way(moved([(0, -1), (0, 3)], [(2, -1), (2, 3)]), (0.5, 0), (0.5, 0))
    assert (found.segment[0], found.side[0]) == (0, -1)
    assert (found.time[0], found.along[0]) == pytest.approx((0.25, 0.25), abs=1e-15)


def test_turning_segment():
    """Ends go straight from (1, 0) to (0, 1): at time t the end is (1 - t, t), so the parcel at (0.3, 0.2) is met at t = 0.4."""
    found = one_way(moved([(0, 0), (1, 0)], [(0, 0), (0, 1)]), (0.3, 0.2), (0.3, 0.2))
    assert found.time[0] == pytest.approx(0.4, abs=1e-14)
    assert found.along[0] == pytest.approx(0.5, abs=1e-14)
    assert found.side[0] == 1


def test_parcel_that_outruns_the_segment_is_not_met():
    found = one_way(moved([(0, -1), (0, 1)], [(1, -1), (1, 1)]), (0.1, 0), (1.2, 0))
    assert found.segment[0] == -1


def test_parcel_that_passes_beside_a_free_end_is_not_met():
    barriers = moved([(0, -1), (0, 1)], [(0, -1), (0, 1)])
    assert one_way(barriers, (-1, 1.000001), (1, 1.000001)).segment[0] == -1
    assert one_way(barriers, (-1, 0.999999), (1, 0.999999)).segment[0] == 0


def test_first_of_two_walls_counts():
    barriers = Barriers([Boom(name=name, nodes=[(x, -1), (x, 1)], draft=1.0) for name, x in (("far", 2), ("near", 1))])
    found = first_crossings(np.array([[0.0, 0.0]]), np.array([[3.0, 0.0]]), moving_sweep(barriers))
    assert found.segment[0] == barriers.rows("near").start


@pytest.mark.parametrize("seed", range(4))
def test_against_many_small_steps(seed):
    """Segments and ways at random: the crossing is where 4000 small steps first see the sides change between the ends."""
    random = np.random.default_rng(seed)
    met = 0
    for _ in range(40):
        old, new = random.uniform(-2, 2, (2, 2, 2))
        if np.hypot(*(old[1] - old[0])) < 0.2 or np.hypot(*(new[1] - new[0])) < 0.2:
            continue
        origin, target = random.uniform(-2, 2, (2, 2))
        found = one_way(moved(old, new), origin, target)
        time = np.linspace(0.0, 1.0, 4001)[:, None]
        start, end = old[0] + time * (new[0] - old[0]), old[1] + time * (new[1] - old[1])
        along, away = end - start, origin + time * (target - origin) - start
        side = along[:, 0] * away[:, 1] - along[:, 1] * away[:, 0]
        share = (along * away).sum(axis=1) / (along**2).sum(axis=1)
        seen = np.flatnonzero((side[1:] * side[:-1] < 0.0) & (share[1:] > 1e-3) & (share[1:] < 1 - 1e-3))
        grazes = np.any(
            np.abs(share[1:][side[1:] * side[:-1] < 0.0] * (1 - share[1:][side[1:] * side[:-1] < 0.0])) < 2e-3
        )
        if grazes:
            continue
        assert (found.segment[0] >= 0) == bool(len(seen))
        if len(seen):
            assert abs(found.time[0] - time[seen[0], 0]) < 1e-3
            met += 1
    assert met > 3


@pytest.mark.parametrize("seed", range(3))
def test_nothing_leaves_a_ring_that_moves_and_bends(seed):
    """2000 parcels aimed exactly at the joints of a moving ring, or across it, all meet it."""
    random = np.random.default_rng(seed)
    turn = np.linspace(0.0, 2.0 * np.pi, 13)[:-1]
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    old = 10.0 * ring + (4000.0, -7000.0)
    new = 10.0 * ring * random.uniform(0.8, 1.2, (12, 1)) + (4001.5, -6999.0)
    origin = old.mean(axis=0) + random.uniform(-3, 3, (2000, 2))
    joint = random.integers(0, 12, 2000)
    time = random.random((2000, 1))
    passed = (1 - time) * old[joint] + time * new[joint]  # where the joint is at that time: on the way there
    target = origin + (passed - origin) / np.maximum(time, 1e-3)
    inside = Barriers([Outline(name="ring", nodes=new, capacity=0.0)]).encloses(target)
    found = first_crossings(origin, target, moving_sweep(moved(old, new, is_closed=True)))
    assert (found.segment[~inside] >= 0).all()
    assert (~inside).sum() > 500


def test_what_lies_in_two_outlines_lies_inside():
    """Two islands that overlap: by one count of all their sides the part in both would be water."""
    first, second = (np.array([(x, 0), (x + 4, 0), (x + 4, 4), (x, 4)]) for x in (0.0, 2.0))
    both = Barriers([Outline(name=name, nodes=one, capacity=0.0) for name, one in (("a", first), ("b", second))])
    points = np.array([[1.0, 1.0], [3.0, 1.0], [5.0, 1.0], [7.0, 1.0], [-1.0, 1.0]])
    assert both.encloses(points).tolist() == [True, True, True, False, False]


@pytest.mark.parametrize("angle", [10.0, 2.0, 0.6])
def test_stopped_parcels_stay_on_their_side_of_sharp_corners(angle):
    """Beside a segment that folds back at a sharp corner, a parcel never lies beyond the other leg."""
    leg = 3.0 * np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
    barriers = moved([(3, 0), (0, 0), leg], [(3, 0), (0, 0), leg])
    along = np.linspace(0.0, 1.0, 2001)
    segment = np.zeros(2001, int)
    points = beside(barriers, segment, along, np.full(2001, -1), resting_sweep(barriers))
    height = points[:, 0] * np.tan(np.radians(angle))
    assert ((points[:, 1] > 0.0) & (points[:, 1] < height)).all()
