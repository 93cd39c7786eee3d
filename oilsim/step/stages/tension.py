"""The stage of a step in which interfacial tension pulls on liquids and bodies."""

from __future__ import annotations

import numpy as np

from oilsim.core.state import FluidState
from oilsim.step.step_arrays import StepArrays
from oilsim.step.step_tools import StepTools
from oilsim.tension.interface_stress import fill_slopes, pull_along_interfaces, pull_on_bodies, smooth_tensions


def apply_tension(tools: StepTools, arrays: StepArrays, state: FluidState, time_step: float) -> None:
    """Change velocities by interfacial tension (see `interface_stress`); moving bodies receive the opposite impulse."""
    constants, run, neighborhood, count = tools.constants, tools.team.run, arrays.neighborhood, state.listed
    if constants.tensions is None:
        return
    wetting = tools.walls.wetting
    with tools.stage("tension"):
        smoothed, slopes = np.empty(count, np.float32), np.empty((count, 8), np.float32)
        run(smooth_tensions, count, neighborhood, constants.tensions.take(state.phase[:count]), smoothed)
        run(fill_slopes, count, neighborhood, constants.plane, smoothed, slopes)
        scale = np.float32(time_step / (constants.moment * constants.reference_density))
        run(pull_along_interfaces, state.awake, neighborhood, wetting, slopes, scale, state.velocity)
        if arrays.touching.size:
            force = tools.walls.zero_forces()
            pull_on_bodies(arrays.body_pairs, neighborhood, wetting, slopes, constants.moment, force)
            tools.walls.receive(time_step * force)
