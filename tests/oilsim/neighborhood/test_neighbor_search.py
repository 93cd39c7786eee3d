"""Lists equal brute force, wrapped or not, whatever the number of threads."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit

from oilsim.backend.simd.compaction import (
    Ball,
    Box,
    Candidates,
    append_near,
    append_one_by_one,
    collect_near,
    collect_one_by_one,
)
from oilsim.backend.thread_team import Team
from oilsim.neighborhood.list_building import CANDIDATES
from oilsim.neighborhood.neighbor_search import CellOrder, NeighborSearch, Sorted, make_grid

SUPPORT = 0.2


@njit
def searched(box, ball, points, candidate, found, index):
    """`collect_near` and `append_near` as kernels call them."""
    count = collect_near(box, points, candidate, 3, 87, found, 2)
    return count, append_near(ball, found, count, index, 5)


def brute_force(points, others, period):
    delta = points[:, :, None] - others[:, None, :]
    for axis, length in enumerate(period):
        if length:
            delta[axis] -= length * np.round(delta[axis] / length)
    return (delta**2).sum(axis=0) < np.float32(SUPPORT) ** 2


@pytest.mark.parametrize("periodic", [(False,) * 3, (True, False, False), (True, True, True)])
@pytest.mark.parametrize("threads", [1, 2])
def test_lists_equal_brute_force(periodic, threads):
    lower, upper = (0.0, 0.0, 0.0), (1.0, 0.8, 1.3)
    rng = np.random.default_rng(4)
    points = (rng.random((3, 5000)) * np.array(upper)[:, None]).astype(np.float32)
    period = tuple(high if repeats else 0.0 for high, repeats in zip(upper, periodic, strict=True))
    grid = make_grid(lower, upper, periodic, SUPPORT, 3)
    search = NeighborSearch(grid, Team(threads), period if any(periodic) else None)
    order, start = search.order_by_cell(points)
    points = np.ascontiguousarray(points[:, order])
    pairs = search.list_neighbors("all", points, Sorted(position=points, cell_start=start))
    near = brute_force(points[:, :500], points, period)
    for i in range(500):
        expected = set(np.flatnonzero(near[i])) - {i}
        listed = pairs.neighbor[pairs.start[i] : pairs.start[i] + pairs.number[i]]
        assert len(listed) == len(set(listed))
        assert set(listed) == expected


def test_lists_in_a_plane_equal_brute_force():
    grid = make_grid((0, 0, 0), (3, 0.1, 2), (False,) * 3, SUPPORT, 2)
    search = NeighborSearch(grid, Team(1), None)
    points = (np.random.default_rng(5).random((3, 900)) * np.array([[3.4], [0.0], [2.3]]) - 0.2).astype(np.float32)
    order, start = search.order_by_cell(points)
    points = np.ascontiguousarray(points[:, order])  # some lie outside the domain
    pairs = search.list_neighbors("all", points, Sorted(position=points, cell_start=start))
    near = brute_force(points, points, (0, 0, 0))
    for i in range(900):
        listed = pairs.neighbor[pairs.start[i] : pairs.start[i] + pairs.number[i]]
        assert sorted(listed) == np.setdiff1d(np.flatnonzero(near[i]), i).tolist()


def test_moving_particles_are_found_beside_sorted_ones():
    grid = make_grid((0, 0, 0), (1, 1, 1), (False,) * 3, SUPPORT, 3)
    search = NeighborSearch(grid, Team(1), None)
    rng = np.random.default_rng(1)
    resting = rng.random((3, 200)).astype(np.float32)
    order, start = search.order_by_cell(resting)
    moving = rng.random((3, 60)).astype(np.float32)
    moving_order, moving_start = search.order_by_cell(moving)
    walls = np.concatenate([resting[:, order], moving], axis=1)
    points = rng.random((3, 50)).astype(np.float32)
    behind = CellOrder(order=moving_order + np.uint32(200), cell_start=moving_start)
    pairs = search.list_neighbors("walls", points, Sorted(position=walls, cell_start=start), moving=behind)
    near = brute_force(points, walls, (0, 0, 0))
    for i in range(50):
        assert set(pairs.neighbor[pairs.start[i] : pairs.start[i] + pairs.number[i]]) == set(np.flatnonzero(near[i]))


def listed_in(search, points, walls):
    """Order of the points, and neighbours of each in that order among them and among the walls, by their places in `walls`."""
    order, start = search.order_by_cell(points)
    wall_order, wall_start = search.order_by_cell(walls)
    points, walls = points[:, order].copy(), walls[:, wall_order].copy()
    fluid = search.list_neighbors("fluid", points, Sorted(position=points, cell_start=start))
    others = Sorted(position=walls, cell_start=wall_start)
    wall = search.list_neighbors("walls", points, others, near=search.surroundings(walls))
    rows = [[(pairs.start[i], pairs.number[i]) for i in range(len(order))] for pairs in (fluid, wall)]
    beside = [fluid.neighbor[first : first + number].tolist() for first, number in rows[0]]
    return (
        order.tolist(),
        beside,
        [wall_order[wall.neighbor[first : first + number]].tolist() for first, number in rows[1]],
    )


@pytest.mark.parametrize("periodic", [(False,) * 3, (False, True, False)])
def test_of_a_large_domain_the_liquids_part_is_counted_and_nothing_else_changes(periodic):
    grid = make_grid((0.0, -30.0, 0.0), (90.0, 31.3, 40.0), periodic, SUPPORT, 3)
    rng = np.random.default_rng(6)
    points = (rng.random((3, 2000)) + np.array([[60.2], [11.0], [39.3]])).astype(np.float32)  # at the top, and above it
    stray = (40.0 * rng.random((3, 500))).astype(np.float32)
    walls = np.concatenate([points[:, ::7] + np.float32(0.01), stray], axis=1)
    whole, part = (NeighborSearch(grid, Team(1), (0.0, 61.3, 0.0) if periodic[1] else None) for _ in range(2))
    assert part.cover(points, 2000) and not part.cover(points, 2000)
    assert part.grid.cell_count < 0.1 * grid.cell_count
    assert listed_in(part, points, walls) == listed_in(whole, points, walls)
    assert part.cover(stray, 500) and part.cover(points, 2000)  # it grows, and shrinks again


@pytest.mark.parametrize("count", [300, CANDIDATES + 300])
def test_crowded_block_grows_its_lists(count):
    grid = make_grid((0, 0, 0), (1, 1, 1), (False,) * 3, SUPPORT, 3)
    search = NeighborSearch(grid, Team(1), None)
    points = (0.5 + 0.01 * np.random.default_rng(0).random((3, count))).astype(np.float32)
    _, start = search.order_by_cell(points)
    pairs = search.list_neighbors("all", points, Sorted(position=points, cell_start=start))
    assert (pairs.number[:count] == count - 1).all()


@pytest.mark.parametrize("period", [None, (np.float32(1.0), np.float32(0.0), np.float32(0.7))])
@pytest.mark.parametrize("listed", [False, True])
def test_compiled_search_equals_plain_python(period, listed):
    rng = np.random.default_rng(2)
    points = rng.random((3, 90)).astype(np.float32)
    candidate = rng.permutation(90).astype(np.uint32) if listed else None
    middle, half = tuple(points[:, 40]), (np.float32(0.05), np.float32(0.0), np.float32(0.1))
    box = Box(middle=middle, half=half, reach_squared=np.float32(0.12), period=period)
    ball = Ball(place=middle, own=40, reach_squared=np.float32(0.09), period=period)
    rooms = [Candidates(np.full(128, 999, np.uint32), np.zeros((3, 128), np.float32)) for _ in range(2)]
    lists = [np.full(128, 999, np.uint32) for _ in range(2)]
    count, cursor = searched(box, ball, points, candidate, rooms[0], lists[0])
    collected = collect_one_by_one(box, points, candidate, 3, 87, rooms[1], 2)
    assert (count, cursor) == (collected, append_one_by_one(ball, rooms[1], collected, lists[1], 5))
    assert 5 < cursor < count
    assert np.array_equal(rooms[0].index[:count], rooms[1].index[:count])
    assert np.array_equal(rooms[0].position[:, :count], rooms[1].position[:, :count])
    assert np.array_equal(lists[0][:cursor], lists[1][:cursor])


def test_short_periodic_axis_is_refused():
    with pytest.raises(ValueError, match=r"periodic axis x is 0\.5 m long, allowed: 0\.6"):
        make_grid((0, 0, 0), (0.5, 1, 1), (True, False, False), SUPPORT, 3)
