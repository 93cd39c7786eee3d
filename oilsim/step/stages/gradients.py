"""The stage of a step that caches pair vectors, and what the pressure operator needs of them."""

from __future__ import annotations

import numpy as np

from oilsim.boundaries.contacts import gather_contacts
from oilsim.gradients.shear_correction import mend_moments
from oilsim.pressure.pressure_gradient import cache_gradients
from oilsim.state import FluidState
from oilsim.step.stages.search import place_points
from oilsim.step.step_arrays import StepArrays
from oilsim.step.step_tools import StepTools


def cache_pair_gradients(tools: StepTools, arrays: StepArrays, state: FluidState) -> None:
    """Fill the arrays of the gradients' stage (see `StepArrays`) at the present positions."""
    walls, constants, hood = tools.walls, tools.constants, arrays.neighborhood
    with tools.stage("gradients"):
        place_points(tools, arrays, state)
        if arrays.mended is not None:
            tools.team.run(
                mend_moments, state.listed, arrays.points, arrays.matrix, arrays.flow, arrays.near, np.float32(tools.time_unit),
                constants.plane, *hood, arrays.mended,
            )  # fmt: skip
        tools.team.run(
            cache_gradients, state.awake, arrays.points, walls.points, arrays.mended, constants.moment, *hood, constants.wall_weight,
            arrays.by_body, constants.plane, constants.gravity, arrays.gradient, arrays.wall_gradient, arrays.own,
            arrays.extrapolation, arrays.waterline, arrays.lever, arrays.diagonal, arrays.coverage, arrays.wall_slope, arrays.openness,
        )  # fmt: skip
        arrays.contacts = gather_contacts(arrays.body_pairs, arrays.wall_gradient)
