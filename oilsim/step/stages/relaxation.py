"""The stage of a step that sums over neighbours, and relaxes positions and noise by the kernels of `particle_shifting`."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from oilsim.backend.thread_team import block_count, total
from oilsim.core.state import Confinement, FluidState
from oilsim.density.density_constraint import LARGEST_MULTIPLIER, density_constraint
from oilsim.density.particle_shifting import (
    HURRY,
    INERTIA,
    LEFT,
    OMEGA,
    SETTLING,
    Relaxation,
    RelaxationConstants,
    ShiftScales,
    end_first_pass,
    flow_along,
    follow_flow,
    relax,
    relaxation_multiplier,
    shift_strength,
)
from oilsim.gradients.flow import LIQUID
from oilsim.gradients.free_surface import FreeSurface, mark_exposed, mark_free_surface
from oilsim.gradients.gradient_correction import CorrectionShares
from oilsim.gradients.particle_sums import sum_over_neighbors
from oilsim.gradients.relaxation_time import passing_unit, shear_rate_sums
from oilsim.neighborhood.neighbor_search import fill_rows
from oilsim.neighborhood.smoothing_kernels import lattice_diagonal
from oilsim.step.stages.contact import plate_guard
from oilsim.step.stages.search import place_points
from oilsim.step.step_arrays import StepArrays
from oilsim.step.step_tools import StepTools

# [1] share of the particles that may be near a surface while the liquid still counts as filling its box; measured; see docs/numerics.md
VOIDS = 0.005


def relax_positions(tools: StepTools, arrays: StepArrays, state: FluidState, time_step: float) -> tuple[int, float]:
    """Relax positions once, and again while the mean compression is above the tolerance; returns passes and that mean [1]."""
    config, run, count, position = tools.config, tools.team.run, state.awake, state.position
    if count == 0:
        state.confinement = Confinement.OPEN if state.asleep else Confinement.FILLED
        arrays.compression[:] = 0.0  # of sleeping particles beside none that moves: nobody sums over their neighbours
        return 0, 0.0
    constants, neighborhood, guard = tools.constants, arrays.neighborhood, plate_guard(tools, arrays)
    moving = slice(0, count)
    before = position[:, moving].copy() if guard.present else None
    multiplier = np.zeros(state.listed, np.float32)
    push, change, moved = np.zeros((3, 3, count), np.float32)
    relaxation = Relaxation(push, state.shift, change, moved)
    square = np.float32(config.particle_spacing**2)
    rate, limit = np.float32(OMEGA / lattice_diagonal(config.dimension)) * square, LARGEST_MULTIPLIER * square
    with tools.stage("density"):
        position[:, moving] += state.shift[:, moving]
        sum_neighbors(tools, arrays, state, time_step)
        theta = np.float32(-math.expm1(-time_step / (SETTLING * tools.time_unit)))
        scales = ShiftScales(np.float32(time_step), square)
        passes = RelaxationConstants(constants.shift_balance, theta, INERTIA, constants.touching_wall)
        run(shift_strength, state.listed, arrays.surface, neighborhood.walls, scales, arrays.flow)
        for iteration in range(1, config.density_iterations + 1):
            found = mean_compression(arrays, state)
            if iteration > 1 and found <= config.density_tolerance:
                iteration, left = iteration - 1, found
                break
            left, first = LEFT * found, iteration == 1
            enough = left <= config.density_tolerance
            hurried = rate if enough else HURRY * rate
            run(relaxation_multiplier, count, arrays.compression, arrays.surface, hurried, limit, multiplier)
            run(relax, count, passes, neighborhood, arrays.flow, multiplier, first, relaxation)
            if first:
                run(
                    end_first_pass, count, arrays.surface, neighborhood.walls, arrays.gradient_sum, arrays.flow, scales, relaxation,
                    position, state.velocity,
                )  # fmt: skip
            else:
                position[:, moving] += push
                moved += push
            if enough or iteration == config.density_iterations:
                break
            place_points(tools, arrays, state)
            run(density_constraint, count, neighborhood, arrays.compression)
        if before is not None:
            guard.keep_sides(before, arrays.points, position)
            place_points(tools, arrays, state)
        carry_along(tools, arrays, state, moved)
    return iteration, left


def carry_along(tools: StepTools, arrays: StepArrays, state: FluidState, moved: NDArray[np.float32]) -> None:
    """Give particles that were `moved` (3, N) [m] the velocity that the flow has where they are put; their sum of momenta stays."""
    count = state.awake
    change, sums = np.empty((4, count), np.float32), np.zeros((block_count(count), 4))
    tools.team.run(flow_along, count, arrays.flow, moved, change, sums)
    *momentum, length = (total(column) for column in sums.T)
    if length > 0.0:
        tools.team.run(follow_flow, count, change, (np.array(momentum) / length).astype(np.float32), state.velocity)


def sum_neighbors(tools: StepTools, arrays: StepArrays, state: FluidState, time_step: float) -> None:
    """Compute the neighbour sums (see `particle_sums`), which particles are near a free surface, and a weightless liquid's unit of time."""
    run, count, constants, neighborhood = tools.team.run, state.awake, tools.constants, arrays.neighborhood
    arrays.flow, exposed = np.empty((state.listed, 16), np.float32), np.empty(state.listed, np.float32)
    place_points(tools, arrays, state)
    run(fill_rows, state.listed, state.velocity, arrays.weight, arrays.flow)
    arrays.flow[:, LIQUID] = 0.0 if constants.tensions is None else state.phase[: state.listed]
    shares = CorrectionShares(constants.moment, constants.exact.take(state.phase), constants.plane)
    run(
        sum_over_neighbors, state.listed, neighborhood, shares, arrays.compression, arrays.gradient_sum, arrays.flow, arrays.matrix
    )  # fmt: skip
    if tools.budget is not None:
        tools.budget.add_strain(arrays.flow, time_step)
    spacing = np.float32(tools.config.particle_spacing)
    run(mark_exposed, state.listed, arrays.gradient_sum, arrays.compression, spacing, exposed)
    run(mark_free_surface, count, neighborhood.fluid, exposed, arrays.surface)
    state.confinement = confinement(state, int(np.count_nonzero(arrays.surface)))
    if constants.weightless:
        sums = np.zeros((block_count(count), 2))
        run(shear_rate_sums, count, arrays.flow, np.float32(tools.config.cfl / time_step), sums)
        unit = passing_unit(total(sums[:, 0]), total(sums[:, 1]))
        tools.time_unit = min(unit, tools.config.capillary_time)


def confinement(state: FluidState, near: int) -> Confinement:
    """Tell whether the liquid fills its box, of which `near` particles are within reach of a free surface.

    Liquid that filled it in the step before still does: neither changes its volume, and a little that has parted is disorder.
    """
    if state.asleep:
        return Confinement.OPEN
    if near == 0:
        return Confinement.FILLED
    did_fill = state.confinement != Confinement.OPEN
    return Confinement.PARTED if did_fill and near <= VOIDS * state.awake else Confinement.OPEN


def mean_compression(arrays: StepArrays, state: FluidState) -> float:
    """Return the mean of (C_i)+ [1] over the particles that move.

    Liquid that fills a box has a given mean density. There the mean of C_i inside, the crowding, is first subtracted from the compression,
    in place.
    """
    compression, arrays.crowding = arrays.compression, 0.0
    if state.confinement != Confinement.OPEN:
        inside = (
            compression
            if state.confinement == Confinement.FILLED
            else compression[arrays.surface == FreeSurface.INSIDE]
        )
        arrays.crowding = float(inside.mean(dtype=np.float64))
        compression -= np.float32(arrays.crowding)
    return float(np.maximum(compression[: state.awake], 0.0).mean(dtype=np.float64))
