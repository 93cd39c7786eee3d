"""Drops of few particles rise and sink as drops of their volume do, others as before; volumes, momentum and repeats are exact."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from numpy.typing import NDArray

from oilsim import Fluid, FluidConfig, Phase, block, tank_walls
from oilsim.backend.thread_team import Team
from oilsim.core.state import FluidState
from oilsim.drops.drift import RESTS, choose_partners, draw, fill_drop_shares, fill_shares, pairs_of, terminal_speed
from oilsim.stages.pairs import search_neighbors
from oilsim.step.context import StepContext

Double = NDArray[np.float64]
D = 0.006
WATER = Phase(name="water", rest_density=1000.0, dynamic_viscosity=1e-3)
OIL = Phase(name="oil", rest_density=900.0, dynamic_viscosity=0.05)


def speed_of(count: int, dimension: int, drop: Phase = OIL, around: Phase = WATER) -> float:
    """Terminal speed [m/s] of a drop with the volume of `count` particles."""
    size = (6.0 * count / math.pi) ** (1.0 / 3.0) if dimension == 3 else math.sqrt(4.0 * count / math.pi)
    difference = abs(drop.rest_density - around.rest_density)
    return terminal_speed(size * D, around.rest_density, around.dynamic_viscosity, difference, 0.02, 9.81)


def nearest_cells(count: int, dimension: int) -> list[tuple[int, ...]]:
    """The cells of a compact cluster, the first about (0, 0, 0)."""
    cells = itertools.product(range(-4, 5), repeat=dimension)
    return sorted(cells, key=lambda cell: sum((x + 0.1 * n) ** 2 for n, x in enumerate(cell, start=1)))[:count]


def with_clusters(
    count: int, dimension: int, wide: int, high: int, phases: tuple[Phase, Phase], threads: int = 1, gap: int = 0
) -> Fluid:
    """A column of the first phase, `wide` by `high` [d], with clusters of the second, `gap` [d] apart: 12 in a plane and 8 in space."""
    side, gap = wide * D, gap or (12 if dimension == 2 else 8)
    thin = 0.5 * D
    lower, upper = (
        ((0.0, -thin, 0.0), (side, thin, (high + 4) * D))
        if dimension == 2
        else ((0.0,) * 3, (side, side, (high + 4) * D))
    )
    periodic = (True, dimension == 3, False)
    config = FluidConfig(
        particle_spacing=D, phases=phases, lower=lower, upper=upper, dimension=dimension, periodic=periodic
    )
    fluid = Fluid(config, threads=threads)
    fluid.add_boundary(tank_walls(lower, upper, D, sides=("-z",), periodic=periodic, dimension=dimension))
    places = block(lower, (upper[0], upper[1], high * D), D, dimension)
    middles = range(gap // 2, wide, gap)
    level = high // 3 if phases[1].rest_density < phases[0].rest_density else high - high // 3
    cells = {
        (x + cell[0], 0, level + cell[1]) if dimension == 2 else (x + cell[0], y + cell[1], level + cell[2])
        for cell in nearest_cells(count, dimension)
        for x in middles
        for y in (middles if dimension == 3 else [0])
    }
    found = np.floor((places - np.array(lower)) / D + 1e-6).astype(int)
    if dimension == 2:
        found[:, 1] = 0
    in_drop = np.array([tuple(cell) in cells for cell in found.tolist()])
    assert in_drop.sum() == len(cells)
    fluid.add_particles(places[~in_drop], phase=phases[0].name)
    fluid.add_particles(places[in_drop], phase=phases[1].name)
    return fluid


def height(fluid: Fluid, phase: str) -> float:
    return float(fluid.phase_positions(phase)[:, 2].astype(np.float64).mean())


def risen(fluid: Fluid, phase: str, speed: float, way: float) -> float:
    """Mean speed [m/s] of a phase's particles over the last 0.7 of the time in which `speed` takes them `way` [m]."""
    fluid.advance(0.3 * way / speed)
    first = height(fluid, phase)
    fluid.advance(0.7 * way / speed)
    return (height(fluid, phase) - first) / (0.7 * way / speed)


@pytest.mark.parametrize(
    ("dimension", "count"),
    [(2, 1), (2, 4), (2, 9), (3, 1), *(pytest.param(3, count, marks=pytest.mark.slow) for count in (8, 32))],
)
def test_clusters_rise_as_drops_of_their_volume(dimension: int, count: int) -> None:
    """20 clusters in the plane, and 9 in space, of some 7 places each: the draws scatter the mean of single ones by 9 and 13 %."""
    fluid = with_clusters(count, dimension, wide=240 if dimension == 2 else 24, high=24, phases=(WATER, OIL))
    speed = speed_of(count, dimension)
    assert risen(fluid, "oil", speed, 8.0 * D) == pytest.approx(speed, rel=0.25)


@pytest.mark.slow
@pytest.mark.parametrize("count", [16, 64])
def test_larger_clusters_in_a_plane_rise_by_their_own_flow(count: int) -> None:
    """Once they have got under way, and where there is room for the water beside them: 40 places from one to the next."""
    fluid = with_clusters(count, 2, wide=160, high=48, phases=(WATER, OIL), gap=40)
    speed = speed_of(count, 2)
    fluid.advance(6.0 * D / speed)
    first = height(fluid, "oil")
    fluid.advance(8.0 * D / speed)
    assert (height(fluid, "oil") - first) / (8.0 * D / speed) == pytest.approx(1.15 * speed, rel=0.2)


@pytest.mark.parametrize("share", [0.05, 0.2])
def test_drops_of_a_cloud_hinder_each_other(share: float) -> None:
    """Richardson and Zaki's w (1 - c)^n, n = 4.45 Re^-0.1; particles drawn at random on their lattice, over some four places."""
    wide, high, speed = 12, 48, speed_of(1, 3)
    fluid = with_clusters(0, 3, wide, high, phases=(WATER, OIL))
    z = fluid.phase_positions("water")[:, 2]
    drawn = np.random.default_rng(1).random(len(z)) < share
    oil = fluid.phase_ids("water")[drawn & (z > 0.15 * high * D) & (z < 0.75 * high * D)]
    fluid.change_phase(oil, "oil")

    def heights() -> Double:
        found = np.full(2 * fluid.particle_count, math.nan)  # a change of phase gives new ids
        found[fluid.phase_ids("oil").astype(int)] = fluid.phase_positions("oil")[:, 2]
        return found

    fluid.advance(2.0 * D / speed)
    first, begin = heights(), fluid.time
    inside = (first > 0.3 * high * D) & (first < 0.6 * high * D)
    fluid.advance(4.0 * D / speed)
    measured = np.nanmean((heights() - first)[inside]) / (fluid.time - begin)
    exponent = 4.45 * (speed * D * 1000.0 / 1e-3) ** -0.1
    assert measured == pytest.approx(speed * (1.0 - share) ** exponent, rel=0.15)


def test_water_sinks_in_oil() -> None:
    thick = Phase(name="thick", rest_density=900.0, dynamic_viscosity=0.1)
    speed = speed_of(1, 2, drop=WATER, around=thick)
    fluid = with_clusters(1, 2, wide=240, high=24, phases=(thick, WATER))
    assert -risen(fluid, "water", speed, 6.0 * D) == pytest.approx(speed, rel=0.25)


def test_layers_at_rest_stay_at_rest() -> None:
    config = FluidConfig(
        particle_spacing=D, phases=(WATER, OIL), lower=(-D, -D, -D), upper=(41 * D, D, 30 * D), dimension=2
    )
    fluid = Fluid(config, threads=1)
    fluid.add_boundary(tank_walls((0, 0, 0), (40 * D, 0, 30 * D), D, sides=("-x", "+x", "-z"), dimension=2))
    fluid.add_particles(block((0, 0, 0), (40 * D, 0, 12 * D), D, 2), phase="water")
    fluid.add_particles(block((0, 0, 12 * D), (40 * D, 0, 20 * D), D, 2), phase="oil")
    assert fluid.advance(1.0).drops == 0
    assert fluid.phase_positions("oil")[:, 2].min() > 11.9 * D
    assert fluid.phase_positions("water")[:, 2].max() < 12.1 * D


def test_momentum_is_kept_and_the_energy_becomes_heat() -> None:
    """A drop that rises by one place frees drho g d V; nothing but places changes, and what the pair had is its own."""
    fluid = with_clusters(1, 2, wide=48, high=24, phases=(WATER, OIL))
    fluid.watch()
    first = height(fluid, "oil")
    report = fluid.advance(0.5)
    budget = report.budget
    assert budget is not None
    assert report.drops > 10
    swaps = budget.parts["swaps"]
    mass = fluid.config.rest_volume * fluid.particle_count * 1000.0
    assert np.abs(swaps.momentum[:3]).max() < 1e-6 * mass
    freed = 4 * 100.0 * 9.81 * fluid.config.rest_volume * (height(fluid, "oil") - first)
    assert 0.8 * freed < -swaps.potential < freed  # the rest is what the particles' own flow lifts
    assert abs(swaps.kinetic) < 0.02 * freed


def test_any_number_of_threads_and_a_restart_give_the_same_bits() -> None:
    one, two = (with_clusters(2, 2, wide=48, high=20, phases=(WATER, OIL), threads=threads) for threads in (1, 2))
    for fluid in (one, two):
        fluid.advance(0.2)
    saved = one.save_state()
    for fluid in (one, two):
        fluid.advance(0.2)
    again = with_clusters(2, 2, wide=48, high=20, phases=(WATER, OIL))
    again.restore_state(saved)
    again.advance(0.2)
    for other in (two, again):
        for name in ("position", "velocity", "phase", "id"):
            assert np.array_equal(getattr(one.state, name), getattr(other.state, name)), name


def test_one_liquid_has_no_drops() -> None:
    config = FluidConfig(particle_spacing=D, phases=(WATER,), lower=(0,) * 3, upper=(1,) * 3)
    assert StepContext.of(config, Team(1)).constants.drop_speeds is None


@pytest.mark.parametrize("tilt", [0.0, 0.6])
def test_a_drop_moves_against_the_gradient_of_pressure_at_its_speed(tilt: float) -> None:
    """Without a fluid: one particle of oil in a block of water whose pressure falls along a tilted axis; 4,000 steps are drawn."""
    config = FluidConfig(particle_spacing=D, phases=(WATER, OIL), lower=(0,) * 3, upper=(11 * D,) * 3)
    context, state = StepContext.of(config, Team(1)), FluidState(viscous_time=np.zeros(2))
    places = block((D, D, D), (10 * D, 10 * D, 10 * D), D)
    state.append(places, np.zeros_like(places), 0)
    neighbors = search_neighbors(context, state)
    middle = int(np.argmin(((state.position - 5.5 * D) ** 2).sum(axis=0)))
    state.phase[middle] = 1
    ahead, time_step = np.array([math.sin(tilt), 0.0, math.cos(tilt)]), 0.004
    state.pressure_impulse = (-9.81 * time_step * ahead @ state.position).astype(np.float32)
    chosen, partner, moved = np.array([middle], np.uint32), np.empty(1, np.int64), np.zeros(3)
    points = neighbors.neighborhood.points
    points[:, :3], points[:, 3] = state.position.T, context.constants.weights[state.phase]
    share, drop = np.ones(len(places), np.float32), np.empty(1, np.float32)
    fill_shares(0, 1, chosen, neighbors.neighborhood, share)
    fill_drop_shares(0, 1, chosen, neighbors.neighborhood, share, drop)
    assert share[middle] == drop[0] == 0.0
    for number in range(4000):
        scales = D, time_step, 9.81 * time_step, 3, number
        choose_partners(
            0, 1, chosen, (share, drop), neighbors.neighborhood, (state.phase, state.id, context.constants.densities), state.velocity,
            state.pressure_impulse, context.constants.drop_speeds, scales, partner,
        )  # fmt: skip
        if partner[0] >= 0:
            moved += state.position[:, partner[0]] - state.position[:, middle]
    assert moved @ ahead / (4000 * time_step) == pytest.approx(speed_of(1, 3), rel=0.1)
    assert np.linalg.norm(np.cross(moved, ahead)) < 0.45 * np.linalg.norm(
        moved
    )  # places of the lattice are along its axes


def test_of_pairs_that_share_a_particle_the_lowest_id_goes_first() -> None:
    chosen, identity = np.array([4, 2, 7], np.uint32), np.arange(10, dtype=np.uint32)[::-1].copy()
    assert pairs_of(chosen, np.array([5, 5, RESTS]), identity).tolist() == [[4], [5]]
    assert pairs_of(chosen, np.array([RESTS, RESTS, RESTS]), identity).shape == (2, 0)


def test_draws_are_even_and_hang_on_id_and_step_alone() -> None:
    with np.errstate(over="ignore"):  # it counts modulo 2^64
        drawn = np.array([[draw(number, step) for step in range(100)] for number in range(100)])
    assert abs(drawn.mean() - 0.5) < 0.01
    assert np.histogram(drawn, 10, (0.0, 1.0))[0] == pytest.approx(1000, abs=120)
    assert abs(np.corrcoef(drawn[:, :-1].ravel(), drawn[:, 1:].ravel())[0, 1]) < 0.03
