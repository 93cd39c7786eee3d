"""A time step of the paper (Qiu et al. 2021, Alg. 3).

    1. v* = v + dt gravity, x* = x + dt v*, neighbours
    2. density constraint on positions (Alg. 2), v* = (x_cd - x) / dt
    3. forcing and adhesion, divergence constraint (Alg. 1)
    4. viscosity

Its feedback of position corrections into velocity acts as a viscosity of the order of spacing times speed, and keeps calm water moving.
"""

from __future__ import annotations

import numpy as np

from oilsim.backend.arrays import Real
from oilsim.backend.thread_team import block_count, total
from oilsim.boundaries.wall_contact import WallSums, sum_walls, wall_approach, wall_contact
from oilsim.core.state import Confinement, FluidState
from oilsim.density.density_constraint import (
    LARGEST_MULTIPLIER,
    density_and_diagonal,
    density_constraint,
    density_multiplier,
    density_push,
    push_reaction,
)
from oilsim.fluid.schemes import attract, cache_gradients, fall, find_neighbors, let_viscosity_act, meet_walls, move
from oilsim.pressure.pressure_gradient import divergence_multiplier
from oilsim.stages.contact import contact_rule
from oilsim.stages.explicit import Drive
from oilsim.stages.pairs import place_points
from oilsim.stages.pressure import PressureOperator
from oilsim.stages.viscosity import begin_viscosity
from oilsim.step.arrays import Neighbors, NeighborSums, PairArrays, StepArrays, StepResult
from oilsim.step.context import StepClock, StepContext


def paper_step(
    context: StepContext, clock: StepClock, arrays: StepArrays, state: FluidState, time_step: float, drive: Drive
) -> StepResult:
    """Advance `state` in place by `time_step` [s]; `drive(dt)` adds currents, waves and wind to the velocities."""
    fall(context, clock, state, time_step)
    move(context, clock, state, time_step)
    find_neighbors(context, clock, arrays, state)
    arrays.sums = NeighborSums.of(state.listed, context.time_unit)
    predicted = state.position.copy()
    with clock.stage("density"):
        passes, density_error, pushed = constrain_density(
            context, arrays.neighbors, arrays.sums, state.position, time_step
        )
    with clock.stage("density"):
        state.velocity += (state.position - predicted) / np.float32(time_step)
    cache_gradients(context, clock, arrays, state)
    drive(time_step)
    attract(context, clock, arrays, state, time_step)
    with clock.stage("divergence"):
        pressure = correct_velocity(context, arrays.neighbors, arrays.pairs, state, time_step)
    state.pressure_impulse += pushed
    viscous = let_viscosity_act(context, clock, arrays, state, begin_viscosity(context, state, time_step))
    _meet_walls(context, clock, arrays, state, time_step)
    return StepResult(time_step, passes, pressure[0], viscous[0], density_error, pressure[1], viscous[1])


def _meet_walls(
    context: StepContext, clock: StepClock, arrays: StepArrays, state: FluidState, time_step: float
) -> None:
    """Stop what the coming advection would take across a wall: it has gravity's share before anything can resist it."""
    gravity = np.asarray(context.config.gravity, np.float32)[:, None] * np.float32(time_step)
    state.velocity += gravity
    meet_walls(context, clock, arrays, state, time_step)
    state.velocity -= gravity


def constrain_density(
    context: StepContext, neighbors: Neighbors, sums: NeighborSums, position: Real, reaction_time: float | None = None
) -> tuple[int, float, Real]:
    """Apply Alg. 2 to `position` (3, N) [m] in place; returns iterations, the mean compression left [1] and the sum of the pushes.

    With a `reaction_time` [s] pushes become velocities: moving bodies receive the opposite impulse, and the sum of the pushes (N,) is
    kappa / rho_ref [m2/s]; it is 0 without. Compression and gradient sums are filled.
    """
    config, run, count, neighborhood = context.config, context.team.run, position.shape[1], neighbors.neighborhood
    pushed = np.zeros(count, np.float32)
    if count == 0:
        return 0, 0.0, pushed
    (diagonal, multiplier), push, error = (
        np.zeros((2, count), np.float32),
        np.empty_like(position),
        np.zeros(block_count(count)),
    )
    relaxation, limit = np.float32(config.relaxation), LARGEST_MULTIPLIER * np.float32(config.particle_spacing**2)
    run(density_and_diagonal, count, neighborhood, sums.compression, diagonal, sums.gradient_sum)
    for iteration in range(config.density_iterations + 1):
        run(density_multiplier, count, sums.compression, diagonal, relaxation, limit, multiplier, error)
        mean = total(error) / count
        if mean <= config.density_tolerance or iteration == config.density_iterations:
            return iteration, mean, pushed
        run(density_push, count, neighborhood, multiplier, push)
        stopped = _stop_at_walls(context, neighbors, sums.compression, push)
        if reaction_time is not None:
            pushed -= multiplier / np.float32(reaction_time)
            _react(context, neighbors, multiplier - stopped / neighbors.weight, reaction_time)
        position += push
        place_points(context.team, neighbors, position)
        run(density_constraint, count, neighborhood, sums.compression)
    raise AssertionError("the loop returns")


def _stop_at_walls(context: StepContext, neighbors: Neighbors, compression: Real, push: Real) -> Real:
    """Shorten, in place, pushes that would take particles across walls, which Alg. 2 does not forbid.

    Liquid as stiff as the paper's (gamma = 1e4) presses single particles down a whole spacing. Returns beta (N,) [m2] of
    `boundaries.wall_contact`: the walls took beta_i s_i of each push.
    """
    count, run = push.shape[1], context.team.run
    beta = np.zeros(count, np.float32)
    if not context.walls.count:
        return beta
    sums = WallSums(np.empty(count, np.float32), np.empty_like(push), compression)
    rule, rate = contact_rule(context), np.empty(count, np.float32)
    run(sum_walls, count, neighbors.neighborhood, sums.coverage, sums.slope)
    run(wall_approach, count, sums.slope, push, rate)
    run(wall_contact, count, sums, rule, rate, np.float32(context.config.particle_spacing), push, beta)
    return beta


def _react(context: StepContext, neighbors: Neighbors, multiplier: Real, reaction_time: float) -> None:
    """Give moving bodies the opposite of the pushes."""
    walls = context.walls
    if neighbors.touching.size:
        impulse, density = walls.zero_forces(), np.float32(context.constants.reference_density)
        push_reaction(neighbors.body_pairs, neighbors.neighborhood, multiplier, density, impulse)
        walls.receive(impulse / reaction_time)


def correct_velocity(
    context: StepContext, neighbors: Neighbors, pairs: PairArrays, state: FluidState, time_step: float
) -> tuple[int, float]:
    """Apply Alg. 1 to the velocities in place, bodies responding; returns the iterations and the mean residual [1]."""
    config, run, count = context.config, context.team.run, state.count
    correction, error = np.empty(count, np.float32), np.zeros(block_count(count))
    state.pressure_impulse[:] = 0.0
    state.time_step = time_step
    operator = PressureOperator(context, neighbors, pairs, state.velocity, state.confinement == Confinement.FILLED)
    for iteration in range(config.divergence_iterations + 1):
        rate = operator.compression_rate()
        run(
            divergence_multiplier, count, rate, pairs.sums.diagonal, neighbors.neighborhood.fluid, np.float32(time_step),
            state.pressure_impulse, correction, error,
        )  # fmt: skip
        residual = total(error) / max(count, 1)
        settled = residual <= config.divergence_tolerance and iteration > 0
        if settled or iteration == config.divergence_iterations:
            return iteration, residual
        operator.accelerate(correction)
    raise AssertionError("the loop returns")
