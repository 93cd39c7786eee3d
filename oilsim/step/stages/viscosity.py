"""The stage of a step in which viscosity acts, explicitly or implicitly."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from oilsim.core.state import FluidState
from oilsim.step.step_arrays import StepArrays
from oilsim.step.step_tools import StepTools
from oilsim.viscosity.lagged_viscosity import NEGLIGIBLE, Due, viscosity_due
from oilsim.viscosity.pair_stiffness import PairGradients, ViscousLiquid, wall_factor
from oilsim.viscosity.viscous_response import Motion, ViscousResponse
from oilsim.viscosity.viscous_system import ViscousSystem, implicit_share, is_mild

Real = NDArray[np.float32]


class ViscousStep(NamedTuple):
    """The viscosity that is due in a step, and the motion before the step's forces; None where the viscous solve does not need it."""

    due: Due
    start: Motion | None


def begin_viscosity(tools: StepTools, state: FluidState, time_step: float) -> ViscousStep:
    """Find the viscosity that is due in a step of `time_step` [s], before the forces of the step act.

    The trapezoidal rule takes viscosity from the motion at both ends of a step, and forces from neither. If it took v + dt a for the motion
    at the step's beginning, thick liquid would overshoot what forces do, and pressure that answers from step to step would grow.
    """
    due = _due(tools, state, time_step)
    start = None if _theta(tools, due) == 1.0 else Motion(state.velocity.copy(), tools.walls.twists())
    return ViscousStep(due, start)


def apply_viscosity(tools: StepTools, arrays: StepArrays, state: FluidState, step: ViscousStep) -> tuple[int, float]:
    """Let viscosity act on velocities; returns the iterations of the implicit solve and what it leaves [1], both 0 for an explicit step.

    Liquids so thin that a step changes nothing are lagged it (see `lagged_viscosity`). step: as from `begin_viscosity`.
    """
    due, start = step
    state.viscous_time = due.lagged
    if due.span == 0.0:
        return 0, 0.0
    with tools.stage("viscosity"):
        system = viscous_system(tools, arrays, state, due.matrix)
        explicit, theta, solved = _is_explicit(tools, due), _theta(tools, due), (0, 0.0)
        bodies = _viscous_response(tools, arrays, system, due.span, theta)
        if explicit:
            system.explicit(state.velocity, arrays.rest_density, due.span, bodies)
        else:
            middle = None if start is None else start.towards(Motion(state.velocity, tools.walls.twists()), theta)
            solved = system.solve(
                state.velocity, arrays.rest_density, due.span, theta, bodies, tools.config.viscosity_tolerance,
                tools.config.viscosity_iterations, middle,
            )  # fmt: skip
        if bodies is not None:
            bodies.hand_over(state.velocity, explicit)
    return solved


def _due(tools: StepTools, state: FluidState, time_step: float) -> Due:
    """Find which viscosity is due in a step of `time_step` [s]; the span is 0 where none is."""
    constants, viscosity = tools.constants, _present_viscosity(tools, state)
    if not viscosity.any():
        return Due(0.0, constants.pair_viscosity, 0.0, state.viscous_time)
    lagged = np.where(viscosity > 0.0, state.viscous_time + time_step, 0.0)
    least = NEGLIGIBLE if constants.corrected else 0.0
    inertia = constants.densities * tools.config.particle_spacing**2
    return viscosity_due(lagged, viscosity, constants.pair_viscosity, inertia, least)


def _is_explicit(tools: StepTools, due: Due) -> bool:
    """Tell whether the viscosity that is due is stepped forward in time."""
    return tools.config.explicit_viscosity or is_mild(due.number)


def _theta(tools: StepTools, due: Due) -> float:
    """Return the implicit share [1] of the viscosity that is due; 1 where none is, and in an explicit step."""
    if due.span == 0.0 or not tools.constants.corrected or _is_explicit(tools, due):
        return 1.0
    return implicit_share(due.number)


def _present_viscosity(tools: StepTools, state: FluidState) -> NDArray[np.float64]:
    """Return the viscosity (P,) [Pa s] of each liquid that has particles that move; 0 for others, which must not cost a solve."""
    phase = state.phase[: state.awake]
    viscosities = enumerate(tools.constants.viscosities)
    return np.array([mu if mu > 0.0 and (phase == k).any() else 0.0 for k, mu in viscosities])


def _viscous_response(
    tools: StepTools, arrays: StepArrays, system: ViscousSystem, time_step: float, theta: float
) -> ViscousResponse | None:
    """Make the answer of moving bodies to the drag of liquids that they hold; None where no liquid touches one."""
    walls, neighborhood = tools.walls, arrays.neighborhood
    if not walls.bodies_hold or not arrays.touching.size:
        return None
    return ViscousResponse(
        walls, arrays.body_pairs, arrays.wall_gradient, system.stiffness.walls, neighborhood.volume, time_step, theta
    )


def viscous_system(tools: StepTools, arrays: StepArrays, state: FluidState, viscosity: Real) -> ViscousSystem:
    """Assemble the system of liquids with a `viscosity` (P, P) [Pa s] and of the walls that hold them, at the present positions."""
    config, walls, neighborhood = tools.config, tools.walls, arrays.neighborhood
    corrected = tools.constants.corrected
    viscous = viscosity.max(axis=1) > 0.0
    chosen = np.arange(state.awake) if viscous.all() else np.flatnonzero(viscous[state.phase[: state.awake]])
    liquid = ViscousLiquid(chosen.astype(np.uint32), arrays.points, state.phase, viscosity)
    gradients = PairGradients(arrays.gradient, arrays.wall_gradient)
    system = ViscousSystem(tools.team, liquid, neighborhood, gradients)
    no_slip = walls.no_slip
    if no_slip is not None:
        # one sheet of walls, of whatever volume, holds the liquid; points without any are no walls
        held = walls.area * np.float32(wall_factor(config.dimension, not corrected) * config.particle_spacing)
        no_slip = np.divide(no_slip * held, walls.volume, out=np.zeros_like(held), where=walls.volume > 0.0)
    surface = arrays.surface if corrected else None
    system.assemble(walls.points, no_slip, config.particle_spacing, config.dimension, surface)
    return system
