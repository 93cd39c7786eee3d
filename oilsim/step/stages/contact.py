"""The stage of a step in which single particles meet walls inelastically."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from oilsim.boundaries.contacts import Contacts, sum_bodies
from oilsim.boundaries.plate_guard import PlateGuard
from oilsim.boundaries.wall_contact import (
    ContactRule,
    WallSums,
    find_walls_between,
    wall_approach,
    wall_contact,
    wall_push,
)
from oilsim.gradients.free_surface import FreeSurface
from oilsim.pressure.rigid_response import RigidResponse
from oilsim.state import FluidState
from oilsim.step.step_arrays import StepArrays
from oilsim.step.step_tools import StepTools


def apply_wall_contact(tools: StepTools, arrays: StepArrays, state: FluidState, time_step: float) -> None:
    """Stop particles that would cross a wall, and move drops out of it (see `wall_contact`); bodies receive the opposite impulse."""
    if not tools.walls.count:
        return
    count = state.awake
    with tools.stage("contact"):
        moving, contacts = sum_moving(tools, arrays, count)
        resting = moving._replace(
            coverage=arrays.coverage[:count] - moving.coverage, slope=arrays.wall_slope[:, :count] - moving.slope
        )
        meet(tools, resting, None, state, time_step)
        if contacts.particle.size:
            response = RigidResponse(tools.walls, contacts, None, float(tools.constants.volume))
            strength = meet(tools, moving, response, state, time_step)
            response.accept(strength * arrays.rest_density[:count])
        guard = plate_guard(tools, arrays)
        if guard.present:
            arrays.points[:count, :3] = state.position[:, :count].T
            guard.stop(arrays.points, state.velocity, arrays.rest_density[:count], time_step)


def sum_moving(tools: StepTools, arrays: StepArrays, count: int) -> tuple[WallSums, Contacts]:
    """Return the sums over moving bodies of `count` particles, and the contacts with these by the same vectors: not of wet walls alone."""
    coverage, slope, between = np.zeros(count, np.float32), np.zeros((3, count), np.float32), np.empty(count, bool)
    contacts = arrays.contacts
    if contacts.particle.size:
        contacts = contacts._replace(jacobian=np.empty_like(contacts.jacobian))
        sum_bodies(contacts, arrays.body_pairs, arrays.neighborhood, contacts.jacobian, coverage, slope)
    tools.team.run(find_walls_between, count, arrays.coverage, arrays.wall_slope, contact_rule(tools), between)
    loose = arrays.surface[:count] >= FreeSurface.AT_SURFACE
    return WallSums(coverage, arrays.wet, slope, arrays.compression, loose, between), contacts


def contact_rule(tools: StepTools) -> ContactRule:
    """Return the constants of contact with walls."""
    constants, spacing = tools.constants, np.float32(tools.config.particle_spacing)
    return ContactRule(constants.drop, constants.wall_coverages, constants.nearest_wall, spacing)


def meet(
    tools: StepTools, sums: WallSums, response: RigidResponse | None, state: FluidState, time_step: float
) -> NDArray[np.float32]:
    """Let particles meet the walls of these sums, moved as `response` has it or at rest; returns beta (N,) of `wall_contact` [m2/s]."""
    run, count, rule = tools.team.run, state.awake, contact_rule(tools)
    rate, strength = np.empty((2, count), np.float32)
    run(wall_approach, count, sums.slope, state.velocity, rate)
    if response is not None:
        response.add_motion(rate)
    run(wall_contact, count, sums, rule, rate, rule.spacing / np.float32(time_step), state.velocity, strength)
    run(wall_push, count, sums, rule, state.position)
    return strength


def plate_guard(tools: StepTools, arrays: StepArrays) -> PlateGuard:
    """Make what keeps the particles of this step on their side of thin plates."""
    config = tools.config
    return PlateGuard(tools.walls, arrays.body_pairs, tools.constants.period, config.particle_spacing, config.dimension)
