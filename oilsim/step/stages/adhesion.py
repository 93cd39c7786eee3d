"""The stage of a step in which liquid is drawn to walls and bodies."""

from __future__ import annotations

import numpy as np

from oilsim.boundaries.adhesion import adhesion_acceleration, adhesion_reaction
from oilsim.core.state import FluidState
from oilsim.step.step_arrays import StepArrays
from oilsim.step.step_tools import StepTools


def apply_adhesion(tools: StepTools, arrays: StepArrays, state: FluidState, time_step: float) -> None:
    """Change velocities by adhesion to walls; moving bodies receive the opposite impulse."""
    strength = tools.constants.adhesion
    if strength is None:
        return
    walls, neighborhood = tools.walls, arrays.neighborhood
    with tools.stage("adhesion"):
        pull = np.zeros_like(state.velocity)
        wall = walls.particles
        tools.team.run(
            adhesion_acceleration, state.awake, state.position, state.phase, strength, wall, neighborhood, pull
        )
        state.velocity += np.float32(time_step) * pull
        if arrays.touching.size:
            force = walls.zero_forces()
            adhesion_reaction(
                arrays.body_pairs, state.position, state.phase, strength, arrays.rest_density, wall, neighborhood, force
            )
            walls.receive(time_step * force)
