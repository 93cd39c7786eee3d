"""The stage of a step that moves particles by their velocities."""

from __future__ import annotations

import numpy as np

from oilsim.core.state import FluidState
from oilsim.step.step_tools import StepTools


def advect(tools: StepTools, state: FluidState, time_step: float) -> None:
    """Move the particles by their velocities, and bring those that crossed a periodic side back in at the other."""
    with tools.stage("advection"):
        moving = slice(0, state.awake)
        state.position[:, moving] += np.float32(time_step) * state.velocity[:, moving]
    wrap_periodic(tools, state)


def wrap_periodic(tools: StepTools, state: FluidState) -> None:
    """Bring particles that crossed a periodic side back in at the other."""
    period = tools.constants.period
    if period is None:
        return
    with tools.stage("wrap"):
        for axis, length in enumerate(period):
            if length > 0.0:
                low = np.float32(tools.config.lower[axis])
                state.position[axis] -= length * np.floor((state.position[axis] - low) / length)
