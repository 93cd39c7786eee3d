"""A time step of the paper (Qiu et al. 2021, Alg. 3).

    1. v* = v + dt gravity, x* = x + dt v*, neighbours
    2. density constraint on positions (Alg. 2), v* = (x_cd - x) / dt
    3. forcing and adhesion, divergence constraint (Alg. 1)
    4. viscosity

Its feedback of position corrections into velocity acts as a viscosity of the order of spacing times speed, and keeps calm water moving.
"""

from __future__ import annotations

import numpy as np

from oilsim.core.state import FluidState
from oilsim.step.paper.density_stage import constrain_density
from oilsim.step.paper.velocity_stage import correct_velocity
from oilsim.step.stages.adhesion import apply_adhesion
from oilsim.step.stages.advection import advect
from oilsim.step.stages.contact import apply_wall_contact
from oilsim.step.stages.forcing import Drive
from oilsim.step.stages.gradients import cache_pair_gradients
from oilsim.step.stages.gravity import apply_gravity
from oilsim.step.stages.search import search_neighbors
from oilsim.step.stages.viscosity import apply_viscosity, begin_viscosity
from oilsim.step.step_arrays import StepArrays, StepResult
from oilsim.step.step_tools import StepTools


def paper_step(tools: StepTools, arrays: StepArrays, state: FluidState, time_step: float, drive: Drive) -> StepResult:
    """Advance `state` in place by `time_step` [s]; `drive(dt)` adds currents, waves and wind to the velocities."""
    apply_gravity(tools, state, time_step)
    advect(tools, state, time_step)
    search_neighbors(tools, arrays, state)
    predicted = state.position.copy()
    density_iterations, density_error, pushed = constrain_density(tools, arrays, state, time_step)
    with tools.stage("density"):
        state.velocity += (state.position - predicted) / np.float32(time_step)
    cache_pair_gradients(tools, arrays, state)
    drive(time_step)
    apply_adhesion(tools, arrays, state, time_step)
    divergence_iterations, divergence_error = correct_velocity(tools, arrays, state, time_step)
    state.pressure_impulse += pushed
    viscous_step = begin_viscosity(tools, state, time_step)
    viscosity_iterations, viscosity_error = apply_viscosity(tools, arrays, state, viscous_step)
    _meet_walls(tools, arrays, state, time_step)
    return StepResult(
        time_step, density_iterations, divergence_iterations, viscosity_iterations, density_error, divergence_error,
        viscosity_error,
    )  # fmt: skip


def _meet_walls(tools: StepTools, arrays: StepArrays, state: FluidState, time_step: float) -> None:
    """Stop what the coming flight would take across a wall: the flight has gravity's share before anything can resist it."""
    gravity = np.asarray(tools.config.gravity, np.float32)[:, None] * np.float32(time_step)
    state.velocity += gravity
    apply_wall_contact(tools, arrays, state, time_step)
    state.velocity -= gravity
