"""The stage of a step in which regions at rest fall asleep and others wake."""

from __future__ import annotations

from oilsim.core.state import FluidState
from oilsim.step.step_tools import StepTools


def part_sleepers(tools: StepTools, state: FluidState, time_step: float, driven: bool) -> None:
    """Sort particles that sleep behind those that are awake (see `sleeping_regions`); driven: more than gravity moves the liquid."""
    if tools.regions is None:
        return
    with tools.stage("sleep"):
        parting = tools.regions.update(state, tools.walls, time_step / tools.time_unit, driven)
    if parting is not None:
        with tools.stage("search"):  # whose accounts follow the particles' order
            state.take(parting.order, tools.team)
            state.asleep, state.bordering = parting.asleep, parting.bordering
            tools.lists.forget()
