"""Noise is told from flow; the filter takes noise and leaves flow and momentum alone; shifts even out positions, not velocities."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim.initial_conditions import block
from oilsim.local_fields import NOISE, STRAIN, THETA
from oilsim.phases import Phase
from oilsim.relaxation import relax
from oilsim.resolved_strain import SETTLING, time_unit
from oilsim.smoothing_kernels import lattice_moment

from .conftest import disturbed
from .test_local_fields import EPSILON, SPACING, fields, linear_field

TWO = (Phase(name="water", rest_density=1000.0), Phase(name="oil", rest_density=800.0))


def judged(fluid, time_step=0.005):
    """field with theta and |S|, matrix Y, and M^-1 before it was judged."""
    _, _, field, matrix = fields(fluid)
    inverse = matrix.copy()
    fluid.work._resolved.judge(fluid.state.position, field.T, matrix.T, time_step)
    return field, matrix, inverse


def weight_of_exact(matrix, inverse, dimension):
    """z (N,) of Y = (1 - z) / m_0 + z M^-1, by least squares over the entries; nan where both are the same."""
    plain = np.zeros(6)
    plain[[0, 3, 5]] = 1.0 / lattice_moment(dimension)
    towards = inverse[:, :6].astype(np.float64) - plain
    gone = matrix[:, :6].astype(np.float64) - plain
    if dimension == 2:
        towards[:, 3] = gone[:, 3] = 0.0
    square = (towards**2).sum(axis=1)
    return np.where(square > 1e-4, (towards * gone).sum(axis=1) / np.maximum(square, 1e-30), np.nan)


def blob(make_fluid, dimension, velocity, *, phases=None, seed=0, amount=0.01, **options):
    """A disturbed block of 10 or 20 particles a side with velocity(points) in free space."""
    settings = {"gravity": (0.0, 0.0, -9.81), "dimension": dimension, **options}
    fluid = make_fluid(**settings, **({} if phases is None else {"phases": phases}))
    low, high = ((0.5,) * 3, (1.5,) * 3) if dimension == 3 else ((0.1,) * 3, (1.9,) * 3)
    points = disturbed(block(low, high, SPACING, dimension), amount, seed)
    if dimension == 2:
        points[:, 1] = 0.0
    speeds = velocity(points)
    half = np.arange(len(points)) % 2 == 0
    fluid.add_particles(points[half], phase="water", velocity=speeds[half])
    fluid.add_particles(points[~half], phase="water" if phases is None else "oil", velocity=speeds[~half])
    return fluid


def inside(fluid, margin):
    """Particles further than `margin` [m] from the bounds of all."""
    position = fluid.state.position[[0, 2]] if fluid.config.dimension == 2 else fluid.state.position
    low, high = position.min(axis=1, keepdims=True), position.max(axis=1, keepdims=True)
    return ((position > low + margin) & (position < high - margin)).all(axis=0)


def test_smooth_shear_is_flow(make_fluid):
    # 2 / s: 0.2 m/s a spacing, ten times or more FLOOR sqrt(g d) = 0.01 to 0.02 m/s, so that s / m >= 100 > 0.5
    fluid = blob(make_fluid, 2, lambda p: np.stack([2.0 * (p[:, 2] - 1.0), 0 * p[:, 0], 0 * p[:, 0]], axis=1))
    field, matrix, inverse = judged(fluid)
    core = inside(fluid, 3 * SPACING)
    assert field[core, STRAIN] == pytest.approx(np.full(core.sum(), 2.0), rel=1e-4)
    # n is round-off: C n / (C n + s) < 10 (1e-6)^2 / 0.2^2
    assert field[core, THETA].max() < 1e-6
    z = weight_of_exact(matrix, inverse, 2)[core]
    assert np.isfinite(z).mean() > 0.5
    # beta = 1, and the smallest eigenvalue inside is above 0.8
    assert np.nanmin(z) > 0.999


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("speed", [1e-3, 0.02, 0.5])
def test_random_velocities_are_noise(make_fluid, dimension, speed):
    rng = np.random.default_rng(8)

    def velocity(points):
        noise = rng.normal(0.0, speed, points.shape)
        return noise * (1, 0, 1) if dimension == 2 else noise

    fluid = blob(make_fluid, dimension, velocity)
    time_step = 0.005
    field, matrix, inverse = judged(fluid, time_step)
    core = inside(fluid, 3 * SPACING)
    z = weight_of_exact(matrix, inverse, dimension)[core]
    # the mean of the gradients over 40 particles or more keeps a fortieth of their square, below the tenth where z begins
    assert np.nanmax(z) < 0.05
    # C n >> s: nearly all of dt / tau
    full = 1.0 - np.exp(-time_step / (SETTLING * time_unit(fluid.config)))
    assert field[core, THETA].mean() > 0.9 * full
    assert field[:, THETA].max() <= full * (1.0 + 1e-6)


def test_rest_is_neither(make_fluid):
    fluid = blob(make_fluid, 2, np.zeros_like)
    field, matrix, inverse = judged(fluid)
    assert (field[:, THETA] == 0.0).all() and (field[:, STRAIN] == 0.0).all() and (field[:, NOISE] == 0.0).all()
    z = weight_of_exact(matrix, inverse, 2)
    assert np.abs(z[np.isfinite(z)]).max() < 1e-4


def filtered(fluid, theta):
    """What the filter alone (no multipliers, so no shift) adds to velocities (3, N), for given theta (N,)."""
    work, state = fluid.work, fluid.state
    _, _, field, _ = fields(fluid)
    field[:, THETA] = theta
    push, change = np.empty((2, 3, state.count), np.float32)
    relax(
        0, state.count, state.position, work.walls.position, work.walls.volume, field.T, np.zeros(state.count, np.float32), True,
        work.period, work.fluid_pairs, work.wall_pairs, work.sigma, work.support, work.volume, push, change,
    )  # fmt: skip
    assert not push.any()
    return change.astype(np.float64)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("phases", [None, TWO])
def test_filter_conserves_momentum(make_fluid, dimension, phases):
    rng = np.random.default_rng(2)
    fluid = blob(
        make_fluid,
        dimension,
        lambda p: rng.normal(0.0, 0.3, p.shape) * ((1, 0, 1) if dimension == 2 else 1),
        phases=phases,
    )
    change = filtered(fluid, rng.uniform(0.0, 1.0, fluid.particle_count))
    mass = fluid.work.rest_density.astype(np.float64)
    moved = (np.abs(change) * mass).sum()
    assert moved > 0.01 * (np.abs(fluid.state.velocity) * mass).sum()
    # each pair's share is the same to a few roundings
    assert np.abs(change @ mass).max() < 8 * EPSILON * moved


@pytest.mark.parametrize("dimension", [2, 3])
def test_filter_takes_noise_and_leaves_linear_flow(make_fluid, dimension):
    slope = linear_field(dimension, 5)
    rng = np.random.default_rng(3)
    noise = []

    def velocity(points):
        noise.append(rng.normal(0.0, 0.1, points.shape) * ((1, 0, 1) if dimension == 2 else 1))
        return noise[0]

    calm = blob(make_fluid, dimension, lambda p: (p - 1.0) @ slope.T)
    # particles on edges of the block have no gradient; their neighbours' filter sees that
    core = inside(calm, 3 * SPACING)
    # velocities of 3 m/s, each known to EPSILON; a gradient's error over a spacing is of the same order
    change = filtered(calm, np.ones(calm.particle_count))[:, core]
    assert np.abs(change).max() < 100 * EPSILON * np.abs(calm.state.velocity).max()
    noisy = blob(make_fluid, dimension, velocity)
    change = filtered(noisy, np.ones(noisy.particle_count))
    before = noisy.state.velocity.astype(np.float64)
    after = before + change
    core = inside(noisy, 3 * SPACING)
    # v_i - sum V W (v_i - v_j + G x): white noise keeps about V W_0 of itself and the mean of the rest
    assert (after[:, core] ** 2).sum() < 0.5 * (before[:, core] ** 2).sum()


@pytest.mark.parametrize("dimension", [2, 3])
def test_relaxation_moves_particles_of_a_linear_flow_and_leaves_their_velocities(make_fluid, dimension):
    slope = linear_field(dimension, 6)
    fluid = blob(make_fluid, dimension, lambda p: (p - 1.0) @ slope.T, amount=0.02)
    work, state = fluid.work, fluid.state
    work.search(state)
    core = inside(fluid, 3 * SPACING)
    before, velocity = state.position.copy(), state.velocity.copy()
    work.relax(state, 0.005)
    # positions do change, and never become velocity; a linear flow has no noise to filter but round-off
    assert np.linalg.norm(state.position - before, axis=0)[core].max() > 1e-3 * SPACING
    assert np.abs(state.velocity - velocity)[:, core].max() < 100 * EPSILON * np.abs(velocity).max()


def test_shifts_even_out_neighbours(make_fluid):
    # in a closed periodic box: the spread of densities and |g|, 0 on a lattice, fall; the mean density is given
    fluid = make_fluid(dimension=2, periodic=(True, False, True), gravity=(0.0, 0.0, 0.0))
    points = disturbed(block((0, 0, 0), (2, 0, 2), SPACING, 2), 0.02, 1) % 2.0
    points[:, 1] = 0.0
    fluid.add_particles(points, phase="water")
    spread = []
    for _ in range(100):
        compression, gradient, _, _ = fields(fluid)
        spread.append((compression.std(), np.sqrt((gradient**2).sum(axis=0).mean()) * SPACING))
        fluid.work.relax(fluid.state, 0.005)
        fluid.work.wrap(fluid.state)
    assert not fluid.work.near.any()
    assert spread[-1][0] < 0.1 * spread[0][0]
    assert spread[-1][1] < 0.5 * spread[0][1]


def test_relaxation_conserves_momentum_of_a_flow(make_fluid):
    # a vortex of a wavelength of 2 m on disordered particles: theta and G differ from particle to particle
    def vortex(points):
        x, z = np.pi * points[:, 0], np.pi * points[:, 2]
        return np.stack([np.sin(x) * np.cos(z), 0.0 * x, -np.cos(x) * np.sin(z)], axis=1)

    fluid = make_fluid(dimension=2, periodic=(True, False, True), gravity=(0.0, 0.0, 0.0))
    points = disturbed(block((0, 0, 0), (2, 0, 2), SPACING, 2), 0.02, 1) % 2.0
    points[:, 1] = 0.0
    fluid.add_particles(points, phase="water", velocity=vortex(points))
    fluid.work.search(fluid.state)
    before, velocity = fluid.momentum(), fluid.state.velocity.copy()
    fluid.work.relax(fluid.state, 0.005)
    mass = 1000.0 * SPACING**2
    changed = mass * np.abs(fluid.state.velocity.astype(np.float64) - velocity).sum()
    assert changed > 0.0
    # velocities of 1 m/s are stored to half an EPSILON each
    roundoff = mass * EPSILON * np.abs(velocity).sum()
    assert np.abs(fluid.momentum() - before).max() < 1e-5 * changed + roundoff
