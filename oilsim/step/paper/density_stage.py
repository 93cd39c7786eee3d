"""The paper's density constraint on positions (Qiu et al. 2021, Alg. 2): Jacobi steps until the liquid is no longer compressed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from oilsim.backend.thread_team import block_count, total
from oilsim.boundaries.wall_contact import ContactRule, WallSums, sum_walls, wall_approach, wall_contact
from oilsim.core.state import FluidState
from oilsim.density.density_constraint import (
    LARGEST_MULTIPLIER,
    density_and_diagonal,
    density_constraint,
    density_multiplier,
    density_push,
    push_reaction,
)
from oilsim.step.stages.search import place_points
from oilsim.step.step_arrays import StepArrays
from oilsim.step.step_tools import StepTools

Real = NDArray[np.float32]


def constrain_density(
    tools: StepTools, arrays: StepArrays, state: FluidState, reaction_time: float | None = None
) -> tuple[int, float, Real]:
    """Apply Alg. 2 to the positions of `state` in place; returns iterations, the mean compression left [1] and the sum of the pushes.

    With a `reaction_time` [s] pushes become velocities: moving bodies receive the opposite impulse, and the sum of the pushes (N,) is
    kappa / rho_ref [m2/s]; it is 0 without.
    """
    config, run, count, position = tools.config, tools.team.run, state.count, state.position
    pushed = np.zeros(count, np.float32)
    if count == 0:
        return 0, 0.0, pushed
    multiplier, push, error = np.zeros(count, np.float32), np.empty_like(position), np.zeros(block_count(count))
    limit, neighborhood = LARGEST_MULTIPLIER * np.float32(config.particle_spacing**2), arrays.neighborhood
    with tools.stage("density"):
        run(density_and_diagonal, count, neighborhood, arrays.compression, arrays.diagonal, arrays.gradient_sum)
        for iteration in range(config.density_iterations + 1):
            run(
                density_multiplier, count, arrays.compression, arrays.diagonal, np.float32(config.relaxation), limit, multiplier, error
            )  # fmt: skip
            mean = total(error) / count
            if mean <= config.density_tolerance or iteration == config.density_iterations:
                return iteration, mean, pushed
            run(density_push, count, neighborhood, multiplier, push)
            stopped = _stop_at_walls(tools, arrays, push)
            if reaction_time is not None:
                pushed -= multiplier / np.float32(reaction_time)
                _react(tools, arrays, multiplier - stopped / arrays.weight, reaction_time)
            position += push
            place_points(tools, arrays, state)
            run(density_constraint, count, neighborhood, arrays.compression)
    raise AssertionError("the loop returns")


def _stop_at_walls(tools: StepTools, arrays: StepArrays, push: Real) -> Real:
    """Shorten, in place, pushes that would take particles across walls, which Alg. 2 does not forbid.

    Liquid as stiff as the paper's (gamma = 1e4) presses single particles down a whole spacing. Returns beta (N,) [m2] of
    `boundaries.wall_contact`: the walls took beta_i s_i of each push.
    """
    count, run, constants = push.shape[1], tools.team.run, tools.constants
    beta = np.zeros(count, np.float32)
    if not tools.walls.count:
        return beta
    spacing = np.float32(tools.config.particle_spacing)
    sums = WallSums(np.empty(count, np.float32), np.empty_like(push), arrays.compression)
    rule = ContactRule(constants.drop, constants.wall_coverages, constants.nearest_wall, spacing)
    rate = np.empty(count, np.float32)
    run(sum_walls, count, arrays.neighborhood, sums.coverage, sums.slope)
    run(wall_approach, count, sums.slope, push, rate)
    run(wall_contact, count, sums, rule, rate, spacing, push, beta)
    return beta


def _react(tools: StepTools, arrays: StepArrays, multiplier: Real, reaction_time: float) -> None:
    """Give moving bodies the opposite of the pushes."""
    walls = tools.walls
    if arrays.touching.size:
        impulse = walls.zero_forces()
        push_reaction(
            arrays.body_pairs, arrays.neighborhood, multiplier, np.float32(tools.constants.reference_density), impulse,
        )  # fmt: skip
        walls.receive(impulse / reaction_time)
