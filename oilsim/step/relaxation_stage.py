"""The stage of a step that relaxes positions and noise, by the kernels of `relaxation`, and looks around for it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from oilsim.backend.thread_team import block_count, total
from oilsim.density.density_constraint import LARGEST_MULTIPLIER, density_constraint
from oilsim.density.particle_shifting import (
    HURRY,
    INERTIA,
    LEFT,
    OMEGA,
    SETTLING,
    end_first_pass,
    flow_along,
    follow_flow,
    mark_near_surface,
    mark_surface,
    relax,
    relaxation_multiplier,
    shift_strength,
)
from oilsim.gradients.particle_sums import local_fields
from oilsim.gradients.relaxation_time import passing_unit, shear_rate_sums
from oilsim.neighborhood.neighbor_search import fill_rows
from oilsim.neighborhood.smoothing_kernels import lattice_diagonal
from oilsim.state import FluidState

if TYPE_CHECKING:
    from oilsim.step.step_arrays import Workspace

VOIDS = 0.005  # of the particles of liquid that fills its box, that may be near a surface where it has parted


def relax_liquid(work: Workspace, state: FluidState, time_step: float) -> tuple[int, float]:
    """One pass of `relaxation`, more while the mean compression is above the tolerance; returns passes and that mean."""
    config, walls, run, count, position = work.config, work.walls, work.team.run, state.awake, state.position
    work.closed = state.asleep == 0
    if count == 0:
        state.filled = False
        return 0, 0.0
    moving = slice(0, count)
    multiplier = np.zeros(state.listed, np.float32)
    push = np.zeros((3, count), np.float32)
    change, moved = np.empty((2, 3, count), np.float32)
    square = np.float32(config.particle_spacing**2)
    rate, limit = np.float32(OMEGA / lattice_diagonal(config.dimension)) * square, LARGEST_MULTIPLIER * square
    with work.stage("density"):
        position[:, moving] += state.shift[:, moving]
        look_around(work, state, time_step)
        theta = np.float32(-math.expm1(-time_step / (SETTLING * work.time_unit)))
        run(shift_strength, state.listed, work.near, work.wall_pairs, work.field, np.float32(time_step), square)
        for iteration in range(1, config.density_iterations + 1):
            found = mean_compression(work, state)
            if iteration > 1 and found <= config.density_tolerance:
                iteration, left = iteration - 1, found
                break
            left, first = LEFT * found, iteration == 1
            enough = left <= config.density_tolerance
            hurried = rate if enough else HURRY * rate
            run(relaxation_multiplier, count, work.compression, work.near, hurried, limit, multiplier)
            run(
                relax, count, work.points, walls.points, work.field, multiplier, work.balance, first, theta, INERTIA, work.touching_wall,
                *work.geometry, push, state.shift, change,
            )  # fmt: skip
            if first:
                run(
                    end_first_pass, count, push, change, work.near, work.wall_pairs, work.gradient_sum, work.field, np.float32(time_step),
                    square, position, state.velocity, state.shift, moved,
                )  # fmt: skip
            else:
                position[:, moving] += push
                moved += push
            if enough or iteration == config.density_iterations:
                break
            work.place_points(state)
            run(density_constraint, count, work.points, walls.points, *work.geometry, work.compression)
        carry_along(work, state, moved)
    return iteration, left


def carry_along(work: Workspace, state: FluidState, moved: NDArray[np.float32]) -> None:
    """Give particles that were `moved` (3, N) [m] the velocity that the flow has where they are put; their sum of momenta stays."""
    count = state.awake
    change, sums = np.empty((4, count), np.float32), np.zeros((block_count(count), 4))
    work.team.run(flow_along, count, work.field, moved, change, sums)
    *momentum, length = (total(column) for column in sums.T)
    if length > 0.0:
        work.team.run(follow_flow, count, change, (np.array(momentum) / length).astype(np.float32), state.velocity)


def look_around(work: Workspace, state: FluidState, time_step: float) -> None:
    """What `particle_sums` tells of every particle, which are near a free surface, and the unit of time of weightless liquid."""
    run, count, spacing = work.team.run, state.awake, np.float32(work.config.particle_spacing)
    work.field, surface = np.empty((state.listed, 16), np.float32), np.empty(state.listed, np.float32)
    work.place_points(state)
    run(fill_rows, state.listed, state.velocity, work.weight, work.field)
    run(
        local_fields, state.listed, work.points, work.walls.points, *work.geometry, work.plane, work.moment, work.compression,
        work.gradient_sum, work.field, work.matrix,
    )  # fmt: skip
    if work.budget is not None:
        work.budget.add_strain(work.field, time_step)
    run(mark_surface, state.listed, work.gradient_sum, work.compression, spacing, surface)
    run(mark_near_surface, count, work.fluid_pairs, surface, work.near)
    beside = int(np.count_nonzero(work.near))
    work.closed = not (state.asleep or beside)
    # what filled its box in the step before still does: neither changes its volume, and what has parted a little is disorder
    state.filled = work.closed or (state.filled and not state.asleep and beside <= VOIDS * count)
    if work.weightless:
        sums = np.zeros((block_count(count), 2))
        run(shear_rate_sums, count, work.field, np.float32(work.config.cfl / time_step), sums)
        work.time_unit = passing_unit(total(sums[:, 0]), total(sums[:, 1]))


def mean_compression(work: Workspace, state: FluidState) -> float:
    """Mean of (C_i)+ of the particles that move; where they fill a box, whose mean density is given, about the mean of C_i inside."""
    if state.filled:
        inside = work.compression if work.closed else work.compression[work.near == 0]
        work.compression -= inside.mean(dtype=np.float64).astype(np.float32)
    return float(np.maximum(work.compression[: state.awake], 0.0).mean(dtype=np.float64))
