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
from oilsim.step.arrays import NeighborSums, StepArrays, StepResult
from oilsim.step.context import StepClock, StepContext
from oilsim.step.paper.density_stage import constrain_density
from oilsim.step.paper.velocity_stage import correct_velocity
from oilsim.step.schemes import attract, cache_gradients, fall, find_neighbors, let_viscosity_act, meet_walls, move
from oilsim.step.stages.forces import Drive
from oilsim.step.stages.viscosity import begin_viscosity


def paper_step(
    context: StepContext, clock: StepClock, arrays: StepArrays, state: FluidState, time_step: float, drive: Drive
) -> StepResult:
    """Advance `state` in place by `time_step` [s]; `drive(dt)` adds currents, waves and wind to the velocities."""
    fall(context, clock, state, time_step)
    move(context, clock, state, time_step)
    find_neighbors(context, clock, arrays, state)
    arrays.sums = NeighborSums.of(state.listed, context.time_unit)
    predicted = state.position.copy()
    with clock.stage("density"):
        passes, density_error, pushed = constrain_density(
            context, arrays.neighbors, arrays.sums, state.position, time_step
        )
    with clock.stage("density"):
        state.velocity += (state.position - predicted) / np.float32(time_step)
    cache_gradients(context, clock, arrays, state)
    drive(time_step)
    attract(context, clock, arrays, state, time_step)
    with clock.stage("divergence"):
        pressure = correct_velocity(context, arrays.neighbors, arrays.pairs, state, time_step)
    state.pressure_impulse += pushed
    viscous = let_viscosity_act(context, clock, arrays, state, begin_viscosity(context, state, time_step))
    _meet_walls(context, clock, arrays, state, time_step)
    return StepResult(time_step, passes, pressure[0], viscous[0], density_error, pressure[1], viscous[1])


def _meet_walls(
    context: StepContext, clock: StepClock, arrays: StepArrays, state: FluidState, time_step: float
) -> None:
    """Stop what the coming advection would take across a wall: it has gravity's share before anything can resist it."""
    gravity = np.asarray(context.config.gravity, np.float32)[:, None] * np.float32(time_step)
    state.velocity += gravity
    meet_walls(context, clock, arrays, state, time_step)
    state.velocity -= gravity
