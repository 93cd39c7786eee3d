"""Density and divergence constraints reduce their own error and conserve momentum pair by pair."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim.boundary import BoundaryParticles
from oilsim.divergence import pressure_velocity, velocity_divergence
from oilsim.initial_conditions import block
from oilsim.phases import Phase
from oilsim.rigid_response import RigidResponse

from .conftest import disturbed

TWO = (Phase(name="water", rest_density=1000.0), Phase(name="oil", rest_density=800.0))


def crowd(make_fluid, *, dimension=3, squeeze=0.95, seed=0, **options):
    """A disturbed, compressed blob in free space, half of it oil."""
    fluid = make_fluid(phases=TWO, dimension=dimension, gravity=(0.0, 0.0, 0.0), **options)
    points = block((0.5, 0.5, 0.5), (1.3, 1.3, 1.3), 0.1, dimension)
    middle = points.mean(axis=0)
    points = disturbed(middle + squeeze * (points - middle), 0.004, seed)
    if dimension == 2:
        points[:, 1] = 0.0
    half = points[:, 0] < middle[0]
    fluid.add_particles(points[half], phase="water")
    fluid.add_particles(points[~half], phase="oil")
    fluid.work.search(fluid.state)
    return fluid


@pytest.mark.parametrize("dimension", [2, 3])
def test_density_constraint_removes_compression(make_fluid, dimension):
    fluid = crowd(make_fluid, dimension=dimension)
    work = fluid.work
    work.linearise(fluid.state.position)
    before = np.maximum(work.density - 1.0, 0.0).mean()
    iterations, error = work.constrain_density(fluid.state.position)
    assert before > 0.02
    assert error <= fluid.config.density_tolerance
    assert 1 <= iterations < fluid.config.density_iterations
    work.search(fluid.state)
    work.linearise(fluid.state.position)
    # measured afresh, with lists of the new positions
    assert np.maximum(work.density - 1.0, 0.0).mean() < 2 * fluid.config.density_tolerance


@pytest.mark.parametrize("seed", range(3))
def test_density_pushes_conserve_momentum(make_fluid, seed):
    fluid = crowd(make_fluid, seed=seed, density_iterations=1)
    mass = fluid.work.rest_density.astype(np.float64)
    before = fluid.state.position.astype(np.float64)
    fluid.work.constrain_density(fluid.state.position)
    shift = fluid.state.position.astype(np.float64) - before
    moved = (mass * np.abs(shift)).sum()
    # float32 round-off of positions near 1 m: 6e-8 each
    assert np.abs(shift @ mass).max() < 1e-4 * moved


@pytest.mark.parametrize("seed", range(3))
def test_pressure_operator_is_symmetric_positive_and_conserves_momentum(make_fluid, seed):
    fluid = crowd(make_fluid, seed=seed)
    work, count = fluid.work, fluid.particle_count
    work.linearise(fluid.state.position)
    rng = np.random.default_rng(seed)
    kappa = rng.random((2, count)).astype(np.float32)
    images = np.empty((2, count), np.float32)
    for n in range(2):
        change = np.empty((3, count), np.float32)
        pressure_velocity(0, count, work.fluid_pairs, work.gradient, work.gradient_sum, work.weight, kappa[n], change)
        velocity_divergence(0, count, work.fluid_pairs, work.gradient, work.gradient_sum, change, images[n])
        momentum = change.astype(np.float64) @ work.rest_density.astype(np.float64)
        assert np.abs(momentum).max() < 1e-5 * (np.abs(change) @ work.rest_density).sum()
    left, right = kappa[0].astype(float) @ images[1], kappa[1].astype(float) @ images[0]
    assert left == pytest.approx(right, rel=1e-4)
    assert kappa[0].astype(float) @ images[0] > 0.0


@pytest.mark.parametrize("scheme", ["split", "paper"])
def test_divergence_constraint_stops_compression(make_fluid, scheme):
    fluid = make_fluid(scheme=scheme, gravity=(0.0, 0.0, 0.0), divergence_tolerance=1e-5, divergence_iterations=500)
    points = disturbed(block((0.5, 0.5, 0.5), (1.3, 1.3, 1.3), 0.1), 0.004, 0)
    fluid.add_particles(points, phase="water", velocity=-0.2 * (points - points.mean(axis=0)))
    work, state = fluid.work, fluid.state
    rate = np.empty(fluid.particle_count, np.float32)

    def compression():
        work.search(state)
        work.linearise(state.position)
        velocity_divergence(0, rate.size, work.fluid_pairs, work.gradient, work.gradient_sum, state.velocity, rate)
        return np.maximum(rate, 0.0).mean()

    before = compression()
    fluid.advance(1e-4)
    # what is left: the tolerance over the time step, and for the split scheme the gradient correction of its source
    assert compression() < 0.25 * before


def test_body_that_answers_keeps_the_operator_symmetric_and_momentum(make_fluid):
    fluid = crowd(make_fluid, squeeze=1.0)
    points = block((-0.1, -0.1, -0.1), (0.1, 0.1, 0.1), 0.1)
    handle = fluid.add_boundary(
        BoundaryParticles(name="ball", position=points, volume=np.full(len(points), 5e-4), area=np.zeros(len(points)))
    )
    inverse_mass = np.diag([1 / 2.0] * 3 + [1 / 0.1] * 3)
    fluid.set_boundary_motion(
        handle, (0.9, 0.9, 1.38), (0, 0, 0, 1), (0, 0, -1.0), (0.2, 0.1, 0), inverse_mass, np.zeros(6)
    )
    before = fluid.momentum() + 2.0 * np.array([0, 0, -1.0])
    fluid.advance(0.005)
    body = fluid.work.walls.moving[handle]
    after = fluid.momentum() + 2.0 * body.twist[:3]
    assert body.impulse[2] > 0.01
    assert np.abs(after - before).max() < 1e-5 * np.abs(before).max()
    response = RigidResponse(fluid.work.walls, fluid.work.contacts, float(fluid.work.volume) * 1000.0)
    assert response.present
    rng = np.random.default_rng(3)
    kappa = rng.random((2, fluid.particle_count)).astype(np.float32)
    images = np.zeros_like(kappa)
    for n in range(2):
        response.add_answer(kappa[n], images[n])
    assert kappa[0].astype(float) @ images[1] == pytest.approx(kappa[1].astype(float) @ images[0], rel=1e-5)
