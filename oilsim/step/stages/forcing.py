"""The stage of a step in which currents, waves and wind drive the liquid."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from oilsim.core.state import FluidState
from oilsim.forcing import Forcing, ForcingView
from oilsim.step.step_arrays import StepArrays
from oilsim.step.step_tools import StepTools

Drive = Callable[[float], None]  # adds to the velocities what drives the liquid in a step of so many seconds


def apply_forcings(
    tools: StepTools, arrays: StepArrays, state: FluidState, forcings: Sequence[Forcing], time: float, time_step: float
) -> None:
    """Let every forcing change the velocities of particles that are awake, at `time` [s].

    ValueError for one that moves a plane's liquid along y.
    """
    if not forcings:
        return
    constants = tools.constants
    awake = slice(0, state.awake)
    with tools.stage("forcing"):
        view = ForcingView(
            time, time_step, state.position[:, awake], state.velocity[:, awake], state.phase[awake], arrays.gradient_sum[:, awake],
            constants.densities, float(constants.volume),
        )  # fmt: skip
        for forcing in forcings:
            forcing.apply(view)
            if constants.plane and state.velocity[1].any():
                raise ValueError(f"{type(forcing).__name__} moves liquid along y, allowed: x and z in two dimensions")
