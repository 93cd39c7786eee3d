"""The stage of a step in which single particles meet walls inelastically."""

from __future__ import annotations

import numpy as np

from oilsim.boundaries.plate_guard import PlateGuard
from oilsim.boundaries.wall_contact import ContactRule, WallSums, wall_approach, wall_contact, wall_push
from oilsim.core.state import FluidState
from oilsim.pressure.rigid_response import RigidResponse
from oilsim.step.step_arrays import StepArrays
from oilsim.step.step_tools import StepTools


def apply_wall_contact(tools: StepTools, arrays: StepArrays, state: FluidState, time_step: float) -> None:
    """Stop particles that would cross a wall, and move drops out of it (see `wall_contact`); bodies receive the opposite impulse."""
    walls, constants, run = tools.walls, tools.constants, tools.team.run
    if not walls.count:
        return
    count, spacing = state.awake, np.float32(tools.config.particle_spacing)
    sums = WallSums(arrays.coverage, arrays.wall_slope, arrays.compression)
    rule = ContactRule(constants.drop, constants.wall_coverages, constants.nearest_wall, spacing)
    rate, strength = np.empty((2, count), np.float32)
    with tools.stage("contact"):
        run(wall_approach, count, sums.slope, state.velocity, rate)
        response = RigidResponse(walls, arrays.contacts, None, float(constants.volume))
        if response.present:
            response.add_motion(rate)
        reach = np.float32(tools.config.particle_spacing / time_step)
        run(wall_contact, count, sums, rule, rate, reach, state.velocity, strength)
        run(wall_push, count, sums, rule, state.position)
        if response.present:
            response.accept(strength * arrays.rest_density[:count])
        guard = plate_guard(tools, arrays)
        if guard.present:
            arrays.points[:count, :3] = state.position[:, :count].T
            guard.stop(arrays.points, state.velocity, arrays.rest_density[:count], time_step)


def plate_guard(tools: StepTools, arrays: StepArrays) -> PlateGuard:
    """Make what keeps the particles of this step on their side of thin plates."""
    config = tools.config
    return PlateGuard(tools.walls, arrays.body_pairs, tools.constants.period, config.particle_spacing, config.dimension)
