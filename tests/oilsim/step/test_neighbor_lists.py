"""Lists hold exactly the pairs within the support, whatever moves, comes or goes between steps."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import BoundaryParticles, tank_walls
from oilsim.stages.explicit import wrap_periodic
from tests.oilsim.conftest import search

STILL = np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])


def listed(pairs, count):
    return [np.sort(pairs.neighbor[s : s + n]) for s, n in zip(pairs.start[:count], pairs.number[:count], strict=True)]


def reachable(position, other, support, period, same):
    delta = position.T[:, :, None].astype(np.float64) - other[None].astype(np.float64)
    for axis, length in enumerate(period or ()):
        if length:
            delta[:, axis] -= length * np.round(delta[:, axis] / length)
    near = (delta**2).sum(axis=1) < np.float64(support) ** 2
    if same:
        np.fill_diagonal(near, False)
    return [np.flatnonzero(row) for row in near]


def assert_lists_are_whole(fluid):
    context, arrays, state = fluid.context, fluid.arrays, fluid.state
    for pairs, other in (
        (arrays.neighbors.neighborhood.fluid, state.position),
        (arrays.neighbors.neighborhood.walls, context.walls.position),
    ):
        expected = reachable(
            state.position, other, context.constants.support, context.constants.period, other is state.position
        )
        for mine, theirs in zip(listed(pairs, state.count), expected, strict=True):
            assert np.array_equal(mine, theirs)


def crowd(make_fluid, threads=1, **options):
    """700 particles at random places in a box with a plate that moves."""
    fluid = make_fluid(threads=threads, **options)
    rng = np.random.default_rng(7)
    fluid.add_particles(rng.uniform(0.05, 1.95, (700, 3)), phase="water")
    plate = rng.uniform(-0.4, 0.4, (200, 3)) * (1, 1, 0)
    fluid.add_boundary(tank_walls((0.3, 0.3, 0.0), (1.7, 1.7, 1.5), 0.1, sides=("-z",)))
    handle = fluid.add_boundary(
        BoundaryParticles(name="plate", position=plate, volume=np.full(200, 1e-3), area=np.zeros(200))
    )
    fluid.set_boundary_motion(handle, (1.0, 1.0, 1.0), STILL[1], STILL[0], STILL[0])
    return fluid, handle


def stir(fluid, handle, step, amount, rng):
    """Move every particle by up to `amount` along each axis, some by nothing, and the plate with them."""
    shift = rng.uniform(-amount, amount, fluid.state.position.shape) * (rng.random(fluid.state.count) < 0.5)
    fluid.state.position += shift.astype(np.float32)
    wrap_periodic(fluid.state.position, fluid.config.lower, fluid.context.constants.period)
    fluid.set_boundary_motion(handle, (1.0, 1.0, 1.0 + 0.5 * amount * step), STILL[1], STILL[0], STILL[0])
    search(fluid)


@pytest.mark.parametrize("periodic", [(False, False, False), (True, True, False)])
@pytest.mark.parametrize("amount", [0.0, 3e-2, 1.0])
def test_lists_hold_the_pairs_within_the_support(make_fluid, periodic, amount):
    fluid, handle = crowd(make_fluid, periodic=periodic)
    rng = np.random.default_rng(1)
    for step in range(4):
        stir(fluid, handle, step, amount, rng)
        assert_lists_are_whole(fluid)


def test_lists_do_not_depend_on_threads(make_fluid):
    found = []
    for threads in (1, 2):
        fluid = make_fluid(threads=threads)
        rng = np.random.default_rng(3)
        fluid.add_particles(rng.uniform(0.05, 1.95, (6000, 3)), phase="water")
        for _ in range(8):
            fluid.state.position += rng.normal(0.0, 2e-5, fluid.state.position.shape).astype(np.float32)
            search(fluid)
        found.append((fluid.state.id, fluid.state.position, listed(fluid.arrays.neighbors.neighborhood.fluid, 6000)))
    assert np.array_equal(found[0][0], found[1][0])
    assert np.array_equal(found[0][1], found[1][1])
    assert all(np.array_equal(a, b) for a, b in zip(found[0][2], found[1][2], strict=True))


def test_lists_are_renewed_when_a_wall_jumps_comes_or_goes(make_fluid):
    fluid, handle = crowd(make_fluid)
    search(fluid)
    fluid.set_boundary_motion(handle, (1.0, 1.0, 0.5), STILL[1], STILL[0], STILL[0])
    search(fluid)
    assert_lists_are_whole(fluid)
    search(fluid)
    other = fluid.add_boundary(tank_walls((0.5, 0.5, 0.5), (1.5, 1.5, 1.5), 0.1))
    search(fluid)
    assert_lists_are_whole(fluid)
    search(fluid)
    fluid.remove_boundary(other)
    search(fluid)
    assert_lists_are_whole(fluid)


def test_lists_are_renewed_when_particles_come_or_go(make_fluid):
    fluid, _ = crowd(make_fluid)
    for change in ("come", "go"):
        search(fluid)
        if change == "come":
            fluid.add_particles([(1.0, 1.0, 1.05)], phase="water")
        else:
            fluid.state.take(np.arange(1, fluid.state.count), fluid.context.team)
        search(fluid)
        assert_lists_are_whole(fluid)


def test_lists_are_renewed_when_another_wall_takes_the_place_of_one(make_fluid):
    fluid, plate = crowd(make_fluid)
    floor = min(fluid.boundaries)
    for handle, points in ((floor, (0.5, 0.2)), (plate, (0.9, 0.1))):
        search(fluid)
        places = fluid.boundaries[handle].position[:, [1, 0, 2]] * points[0] + points[1]
        other = BoundaryParticles(name="other", position=places, volume=np.ones(len(places)), area=np.ones(len(places)))
        fluid.remove_boundary(handle)
        assert fluid.add_boundary(other, handle) == handle
        if handle == plate:
            fluid.set_boundary_motion(handle, (1.0, 1.0, 1.0), STILL[1], STILL[0], STILL[0])
        search(fluid)
        assert_lists_are_whole(fluid)
