"""The stage of a step that sums over neighbours, and relaxes positions and noise by the kernels of `particle_shifting`."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from oilsim.backend.arrays import Real
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
from oilsim.gradients.free_surface import FreeSurface, mark_exposed
from oilsim.gradients.gradient_correction import CorrectionShares
from oilsim.gradients.particle_sums import sum_over_neighbors
from oilsim.gradients.relaxation_time import LIQUID, passing_unit, shear_rate_sums
from oilsim.neighborhood.neighbor_search import fill_rows, indices
from oilsim.neighborhood.smoothing_kernels import lattice_diagonal
from oilsim.pressure.rest_pressure import rest_impulse
from oilsim.stages.contact import plate_guard
from oilsim.stages.pairs import place_points, with_neighbors
from oilsim.step.arrays import Neighbors, NeighborSums
from oilsim.step.context import StepContext

# [1] share of the particles that may be near a surface while the liquid still counts as filling its box; measured; see docs/numerics.md
VOIDS = 0.005


class Relaxed(NamedTuple):
    """The sums over neighbours, the number of relaxing passes, and the mean compression that they leave [1]."""

    sums: NeighborSums
    passes: int
    left: float


def relax_positions(
    context: StepContext, neighbors: Neighbors, state: FluidState, time_step: float, last_unit: float
) -> Relaxed:
    """Relax positions once, and again while the mean compression is above the tolerance.

    time_step [s]; last_unit: unit of time of the step before [s]. Positions and velocities of the state change in place.
    """
    sums = NeighborSums.of(state.listed, last_unit)
    if state.awake == 0:
        state.confinement = Confinement.OPEN if state.asleep else Confinement.FILLED
        sums.compression[:] = 0.0  # of sleeping particles beside none that moves: nobody sums over their neighbours
        return Relaxed(sums, 0, 0.0)
    guard = plate_guard(context, neighbors)
    before = state.position[:, : state.awake].copy() if guard.present else None
    state.position[:, : state.awake] += state.shift[:, : state.awake]
    sum_neighbors(context, neighbors, state, sums, time_step)
    moved, passes, left = _relax(context, neighbors, state, sums, time_step)
    if before is not None:
        guard.keep_sides(before, neighbors.points, state.position)
        place_points(context.team, neighbors, state.position)
    carry_along(context, sums.flow, moved, state.velocity)
    return Relaxed(sums, passes, left)


def _relax(
    context: StepContext, neighbors: Neighbors, state: FluidState, sums: NeighborSums, time_step: float
) -> tuple[Real, int, float]:
    """Make the passes; return by how much they moved particles (3, N) [m], their number, and the mean compression they leave [1]."""
    config, constants, run, count = context.config, context.constants, context.team.run, state.awake
    neighborhood, walls, moving = neighbors.neighborhood, neighbors.neighborhood.walls, slice(0, state.awake)
    multiplier = np.zeros(state.listed, np.float32)
    push, change, moved = np.zeros((3, 3, count), np.float32)
    relaxation, square = Relaxation(push, state.shift, change, moved), np.float32(config.particle_spacing**2)
    rate, limit = np.float32(OMEGA / lattice_diagonal(config.dimension)) * square, LARGEST_MULTIPLIER * square
    theta, scales = (
        np.float32(-math.expm1(-time_step / (SETTLING * sums.time_unit))),
        ShiftScales(np.float32(time_step), square),
    )
    passes = RelaxationConstants(constants.shift_balance, theta, INERTIA, constants.touching_wall)
    run(shift_strength, state.listed, sums.surface, walls, scales, sums.flow)
    for iteration in range(1, config.density_iterations + 1):
        found = mean_compression(sums, state)
        if iteration > 1 and found <= config.density_tolerance:
            return moved, iteration - 1, found
        left, first = LEFT * found, iteration == 1
        enough = left <= config.density_tolerance
        hurried = rate if enough else HURRY * rate
        run(relaxation_multiplier, count, sums.compression, sums.surface, hurried, limit, multiplier)
        run(relax, count, passes, neighborhood, sums.flow, multiplier, first, relaxation)
        if first:
            run(
                end_first_pass, count, sums.surface, walls, sums.gradient_sum, sums.flow, scales, relaxation, state.position,
                state.velocity,
            )  # fmt: skip
        else:
            state.position[:, moving] += push
            moved += push
        if enough:
            break
        if iteration < config.density_iterations:
            place_points(context.team, neighbors, state.position)
            run(density_constraint, count, neighborhood, sums.compression)
    return moved, iteration, left


def carry_along(context: StepContext, flow: Real, moved: Real, velocity: Real) -> None:
    """Give particles that were `moved` (3, N) [m] the velocity that the flow has where they are put; their sum of momenta stays.

    flow (N, 16): columns as in `flow`; velocity (3, N) [m/s], changed in place.
    """
    count = moved.shape[1]
    change, sums = np.empty((4, count), np.float32), np.zeros((block_count(count), 4))
    context.team.run(flow_along, count, flow, moved, change, sums)
    *momentum, length = (total(column) for column in sums.T)
    if length > 0.0:
        context.team.run(follow_flow, count, change, (np.array(momentum) / length).astype(np.float32), velocity)


def sum_neighbors(
    context: StepContext, neighbors: Neighbors, state: FluidState, sums: NeighborSums, time_step: float
) -> None:
    """Fill `sums` (see `particle_sums`), which particles are near a free surface, and a weightless liquid's unit of time.

    time_step [s]; the state's confinement follows.
    """
    run, count, constants = context.team.run, state.awake, context.constants
    neighborhood, exposed = neighbors.neighborhood, np.empty(state.listed, np.uint8)
    place_points(context.team, neighbors, state.position)
    run(fill_rows, state.listed, state.velocity, neighbors.weight, sums.flow)
    sums.flow[:, LIQUID] = smoothed_liquid(context, neighbors, state)
    shares = CorrectionShares(constants.moment, constants.exact.take(state.phase), constants.plane)
    run(
        sum_over_neighbors, state.listed, neighborhood, shares, sums.compression, sums.gradient_sum, sums.flow, sums.matrix
    )  # fmt: skip
    spacing = np.float32(context.config.particle_spacing)
    run(mark_exposed, state.listed, sums.gradient_sum, sums.compression, spacing, exposed)
    near = with_neighbors(context, neighbors, indices(exposed > 0))
    np.maximum(exposed[:count], near, out=sums.surface[:count])
    state.confinement = confinement(state, int(np.count_nonzero(sums.surface)))
    choose_pressure(context, state)
    if constants.weightless or state.is_reduced:
        shear = np.zeros((block_count(count), 2))
        run(shear_rate_sums, count, sums.flow, np.float32(context.config.cfl / time_step), shear)
        unit = passing_unit(total(shear[:, 0]), total(shear[:, 1]))
        sums.time_unit = min(unit, context.config.capillary_time)


def smoothed_liquid(context: StepContext, neighbors: Neighbors, state: FluidState) -> NDArray[np.number]:
    """Return the number (listed,) [1] of the liquid within which each particle's velocity is smoothed.

    Without tension all liquids count as one, so that slicks follow the water. A liquid of at most half of the particles counts by itself
    where it is so thick that some of it is out of the others' reach.
    """
    phase = state.phase[: state.listed]
    if context.constants.tensions is not None:
        return phase
    number, awake = np.zeros(state.listed, np.float32), slice(0, state.awake)
    for liquid in range(len(context.config.phases)):
        own = phase[awake] == liquid
        if not 0 < 2 * np.count_nonzero(own) <= state.awake:
            continue
        beside = with_neighbors(context, neighbors, indices(own)) & ~own
        inner = own & ~with_neighbors(context, neighbors, indices(beside))
        number[awake][own & with_neighbors(context, neighbors, indices(inner))] = 1 + liquid
    return number


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


def choose_pressure(context: StepContext, state: FluidState) -> None:
    """Keep the reduced pressure of one liquid that fills its box, and the whole pressure of any other (see `rest_pressure`)."""
    gravity, spacing = context.constants.gravity, context.config.particle_spacing
    reduced = context.constants.reducible and state.confinement == Confinement.FILLED
    if reduced:  # a body that stands out of the box is not lifted by all that it displaces
        low, high = state.position.min(axis=1) - spacing, state.position.max(axis=1) + spacing
        reduced = context.walls.lie_within(low, high)
    if reduced == state.is_reduced:
        return
    potential = float((np.array(gravity) @ state.position).min()) if reduced else state.rest_potential
    rest = rest_impulse(state.position, gravity, potential, state.time_step)
    state.pressure_impulse += -rest if reduced else rest
    state.rest_potential = potential if reduced else -math.inf


def mean_compression(sums: NeighborSums, state: FluidState) -> float:
    """Return the mean of (C_i)+ [1] over the particles that move.

    Liquid that fills a box has a given mean density. There the mean of C_i inside, the crowding, is first subtracted from the compression,
    in place.
    """
    compression, sums.crowding = sums.compression, 0.0
    if state.confinement != Confinement.OPEN:
        filled = state.confinement == Confinement.FILLED
        inside = compression if filled else compression[sums.surface == FreeSurface.INSIDE]
        sums.crowding = float(inside.mean(dtype=np.float64))
        compression -= np.float32(sums.crowding)
    return float(np.maximum(compression[: state.awake], 0.0).mean(dtype=np.float64))
