"""The stage of a step in which liquid too thin for particles presses on bodies that lie on something held."""

from __future__ import annotations

from oilsim.boundaries.contact_film import RimLiquid, film_wrenches
from oilsim.core.state import FluidState
from oilsim.step.step_arrays import StepArrays
from oilsim.step.step_tools import StepTools


def press_films(tools: StepTools, arrays: StepArrays, state: FluidState, time_step: float) -> None:
    """Give the bodies the impulses of the films under them (see `contact_film`), by the pressure of the last step."""
    if not (arrays.contacts.particle.size and state.time_step > 0.0):
        return
    constants, neighborhood = tools.constants, arrays.neighborhood
    with tools.stage("films"):
        per_kappa = constants.reference_density / state.time_step
        liquid = RimLiquid(state.position, arrays.rest_density, state.pressure_impulse, per_kappa)
        wrench = film_wrenches(
            tools.walls, neighborhood, arrays.contacts, arrays.body_pairs, liquid, constants.gravity, constants.moment
        )  # fmt: skip
        if wrench.any():
            tools.walls.receive(time_step * wrench)
