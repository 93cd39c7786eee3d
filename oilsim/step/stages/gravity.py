"""The stage of a step in which gravity acts on the liquid, and everything but the liquid on the bodies."""

from __future__ import annotations

import numpy as np

from oilsim.core.state import FluidState
from oilsim.step.step_tools import StepTools


def apply_gravity(tools: StepTools, state: FluidState, time_step: float) -> None:
    """Add dt g to the velocities of particles that are awake, and dt times their free acceleration to the bodies' twists."""
    with tools.stage("gravity"):
        for axis, g in enumerate(tools.config.gravity):
            if g != 0.0:
                state.velocity[axis, : state.awake] += np.float32(time_step * g)
        for body in tools.walls.moving.values():
            body.twist = body.twist + time_step * body.free_acceleration
