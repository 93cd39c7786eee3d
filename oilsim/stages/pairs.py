"""The stages of a step that list all neighbours, and that store pair vectors with the sums of them that the pressure operator needs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from oilsim.backend.arrays import Flags, Index
from oilsim.backend.thread_team import Team
from oilsim.boundaries.contacts import gather_contacts, list_body_pairs
from oilsim.core.state import FluidState
from oilsim.gradients.gradient_correction import correct_for_shear
from oilsim.neighborhood.neighbor_search import fill_rows, mark_around
from oilsim.pressure.pressure_gradient import PressureSums, cache_gradients
from oilsim.pressure.wall_extrapolation import WallPressure
from oilsim.step.arrays import Neighbors, NeighborSums, PairArrays, reserved
from oilsim.step.context import StepContext


def search_neighbors(context: StepContext, state: FluidState) -> Neighbors:
    """List all neighbours at the present positions; the state is sorted by cell."""
    constants, walls = context.constants, context.walls
    fluid, solid = context.lists.update(state, walls)
    neighborhood = context.neighborhood(state.listed, fluid, solid)
    weight = constants.weights.take(state.phase)
    rest_density = constants.densities.astype(np.float32).take(state.phase)
    pairs, touching = list_body_pairs(walls.particles, solid, state.awake)
    by_body = np.zeros(state.listed, bool)
    by_body[touching] = True
    neighbors = Neighbors(neighborhood, weight, rest_density, pairs, touching, by_body, state.awake)
    place_points(context.team, neighbors, state.position)
    return neighbors


def place_points(team: Team, neighbors: Neighbors, position: NDArray[np.float32]) -> None:
    """Put the particles, now at `position` (3, N) [m], and their weights side by side for kernels that gather them."""
    team.run(fill_rows, len(neighbors.points), position, neighbors.weight, neighbors.points)


def with_neighbors(context: StepContext, neighbors: Neighbors, group: Index) -> Flags:
    """Return a mask (awake,) of the awake particles that belong to a group (K,) of indices or have a neighbour in it."""
    near = np.zeros(len(neighbors.points), np.uint8)
    context.team.run(mark_around, group.size, group, neighbors.neighborhood.fluid, near)
    return near[: neighbors.awake].view(np.bool_)


def cache_pair_gradients(
    context: StepContext, neighbors: Neighbors, sums: NeighborSums, position: NDArray[np.float32], last: PairArrays
) -> PairArrays:
    """Return the pair vectors of particles at `position` (3, N) [m], in the storage of the `last` step's where it is large enough."""
    constants, walls, run = context.constants, context.walls, context.team.run
    neighborhood, count, corrected = neighbors.neighborhood, len(neighbors.points), constants.corrected
    place_points(context.team, neighbors, position)
    repaired = np.empty_like(sums.matrix) if corrected else None
    if repaired is not None:
        run(
            correct_for_shear, count, neighborhood, sums.matrix, sums.flow, sums.surface, np.float32(sums.time_unit),
            constants.plane, repaired,
        )  # fmt: skip
    coverage, diagonal, openness = np.empty((3, count), np.float32)
    own, wall_slope, waterline = np.empty((3, 3, count), np.float32)
    pairs = PairArrays(
        repaired,
        last.gradient._replace(whole=reserved(last.gradient.whole, neighborhood.fluid)),
        reserved(last.wall_gradient, neighborhood.walls),
        own,
        PressureSums(diagonal, openness, coverage, wall_slope),
        WallPressure(np.empty((count, 9), np.float32), waterline) if corrected and walls.count else None,
        np.empty((count, 9), np.float32) if corrected and walls.moving else None,
    )
    run(
        cache_gradients, neighbors.awake, neighborhood, repaired, constants.pressure, neighbors.by_body, pairs.vectors, pairs.sums,
        pairs.wall_pressure, pairs.lever,
    )  # fmt: skip
    return replace(pairs, contacts=gather_contacts(neighbors.body_pairs, pairs.wall_gradient))
