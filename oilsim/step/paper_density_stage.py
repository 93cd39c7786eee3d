"""The paper's density constraint on positions (Qiu et al. 2021, Alg. 2): Jacobi steps until the liquid is no longer compressed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from oilsim.backend.thread_team import block_count, total
from oilsim.density.density_constraint import (
    LARGEST_MULTIPLIER,
    density_and_diagonal,
    density_constraint,
    density_multiplier,
    density_push,
    push_reaction,
)
from oilsim.state import FluidState
from oilsim.step.step_arrays import Workspace

Real = NDArray[np.float32]


def constrain_density(
    work: Workspace, state: FluidState, reaction_time: float | None = None
) -> tuple[int, float, Real]:
    """Alg. 2 on the positions of `state` in place; returns iterations, the mean compression left and what the pushes amount to.

    With a `reaction_time` [s] pushes become velocities: moving bodies receive the opposite impulse, and the pushes (N,) are told in
    kappa / rho_ref [m2/s], 0 without it.
    """
    config, run, count, position = work.config, work.team.run, state.count, state.position
    pushed = np.zeros(count, np.float32)
    if count == 0:
        return 0, 0.0, pushed
    multiplier, push, error = np.zeros(count, np.float32), np.empty_like(position), np.zeros(block_count(count))
    limit = LARGEST_MULTIPLIER * np.float32(config.particle_spacing**2)
    walls = work.walls
    with work.stage("density"):
        run(
            density_and_diagonal, count, work.points, walls.points, *work.geometry, work.compression, work.diagonal,
            work.gradient_sum,
        )  # fmt: skip
        for iteration in range(config.density_iterations + 1):
            run(
                density_multiplier, count, work.compression, work.diagonal, np.float32(config.relaxation), limit,
                multiplier, error,
            )  # fmt: skip
            mean = total(error) / count
            if mean <= config.density_tolerance or iteration == config.density_iterations:
                return iteration, mean, pushed
            run(density_push, count, work.points, walls.points, multiplier, *work.geometry, push)
            if reaction_time is not None:
                pushed -= multiplier / np.float32(reaction_time)
                _react(work, multiplier, reaction_time)
            position += push
            work.place_points(state)
            run(density_constraint, count, work.points, walls.points, *work.geometry, work.compression)
    raise AssertionError("the loop returns")


def _react(work: Workspace, multiplier: Real, reaction_time: float) -> None:
    """Hand moving bodies the opposite of what pushes them."""
    walls = work.walls
    if work.touching.size:
        impulse = walls.zero_forces()
        push_reaction(
            work.touching, work.points, walls.points, multiplier, *work.geometry,
            np.float32(work.reference_density), walls.resting, walls.owner, walls.arm, impulse,
        )  # fmt: skip
        walls.receive(impulse / reaction_time)
