"""The stage of a step that stores pair vectors, and the sums of them that the pressure operator needs."""

from __future__ import annotations

import numpy as np

from oilsim.boundaries.contacts import gather_contacts
from oilsim.core.state import FluidState
from oilsim.gradients.shear_correction import correct_for_shear
from oilsim.pressure.pressure_gradient import cache_gradients
from oilsim.step.stages.search import place_points
from oilsim.step.step_arrays import StepArrays
from oilsim.step.step_tools import StepTools


def cache_pair_gradients(tools: StepTools, arrays: StepArrays, state: FluidState) -> None:
    """Fill the arrays of the gradients' stage (see `StepArrays`) at the present positions."""
    constants, neighborhood = tools.constants, arrays.neighborhood
    with tools.stage("gradients"):
        place_points(tools, arrays, state)
        if arrays.repaired is not None:
            tools.team.run(
                correct_for_shear, state.listed, neighborhood, arrays.matrix, arrays.flow, arrays.surface, np.float32(tools.time_unit),
                constants.plane, arrays.repaired,
            )  # fmt: skip
        tools.team.run(
            cache_gradients, state.awake, neighborhood, arrays.repaired, constants.pressure, arrays.by_body, arrays.vectors, arrays.sums,
            arrays.wall_pressure, arrays.lever,
        )  # fmt: skip
        arrays.contacts = gather_contacts(arrays.body_pairs, arrays.wall_gradient)
