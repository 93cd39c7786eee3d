"""The stage of a step that lists all neighbours and makes room for the step's arrays."""

from __future__ import annotations

import numpy as np

from oilsim.boundaries.contacts import list_body_pairs
from oilsim.core.state import FluidState
from oilsim.neighborhood.neighbor_search import fill_rows
from oilsim.step.step_arrays import StepArrays
from oilsim.step.step_tools import StepTools


def search_neighbors(tools: StepTools, arrays: StepArrays, state: FluidState) -> None:
    """List all neighbours at the present positions, for which the state may be sorted by cell."""
    constants, walls = tools.constants, tools.walls
    with tools.stage("search"):
        fluid, solid = tools.lists.update(state, walls)
        arrays.reserve(tools.neighborhood(state.listed, fluid, solid), tools.needs())
        arrays.weight = constants.weights.take(state.phase)
        arrays.rest_density = constants.densities.astype(np.float32).take(state.phase)
        place_points(tools, arrays, state)
        arrays.body_pairs, arrays.touching = list_body_pairs(walls.particles, solid, state.awake)
        arrays.by_body[arrays.touching] = True


def place_points(tools: StepTools, arrays: StepArrays, state: FluidState) -> None:
    """Put places [m] and weights of the particles side by side (N, 4), for kernels that gather them."""
    tools.team.run(fill_rows, state.listed, state.position, arrays.weight, arrays.points)
