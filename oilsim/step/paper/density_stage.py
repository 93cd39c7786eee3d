"""The paper's density constraint on positions (Qiu et al. 2021, Alg. 2): Jacobi steps until the liquid is no longer compressed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from oilsim.backend.thread_team import block_count, total
from oilsim.boundaries.wall_contact import WallSums, sum_walls, wall_approach, wall_contact
from oilsim.density.density_constraint import (
    LARGEST_MULTIPLIER,
    density_and_diagonal,
    density_constraint,
    density_multiplier,
    density_push,
    push_reaction,
)
from oilsim.step.arrays import Neighbors, NeighborSums
from oilsim.step.context import StepContext
from oilsim.step.stages.contact import contact_rule
from oilsim.step.stages.search import place_points

Real = NDArray[np.float32]


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
