"""The stage of a step that lists all neighbours."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from oilsim.backend.thread_team import Team
from oilsim.boundaries.contacts import list_body_pairs
from oilsim.core.state import FluidState
from oilsim.neighborhood.neighbor_search import fill_rows
from oilsim.step.arrays import Neighbors
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
