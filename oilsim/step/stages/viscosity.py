"""The stage of a step in which viscosity acts, explicitly or implicitly."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from oilsim.state import FluidState
from oilsim.step.step_arrays import StepArrays
from oilsim.step.step_tools import StepTools
from oilsim.viscosity.deferred_viscosity import NEGLIGIBLE, viscosity_due
from oilsim.viscosity.pair_stiffness import PairGradients, ViscousLiquid, wall_factor
from oilsim.viscosity.viscous_response import ViscousResponse
from oilsim.viscosity.viscous_system import ViscousSystem, implicit_share, is_mild

Real = NDArray[np.float32]


def apply_viscosity(tools: StepTools, arrays: StepArrays, state: FluidState, time_step: float) -> int:
    """Let viscosity act on velocities; returns the iterations of the implicit solve, 0 for an explicit step.

    Liquids so thin that a step changes nothing are owed it (see `deferred_viscosity`).
    """
    config, constants, viscosity = tools.config, tools.constants, _present_viscosity(tools, state)
    if not viscosity.any():
        return 0
    owed = np.where(viscosity > 0.0, state.viscous_time + time_step, 0.0)
    least = NEGLIGIBLE if constants.corrected else 0.0
    span, matrix, number, state.viscous_time = viscosity_due(
        owed, viscosity, constants.pair_viscosity, constants.densities * config.particle_spacing**2, least
    )
    if span == 0.0:
        return 0
    with tools.stage("viscosity"):
        system = viscous_system(tools, arrays, state, matrix)
        explicit, used = config.explicit_viscosity or is_mild(number), 0
        theta = implicit_share(number) if constants.corrected and not explicit else 1.0
        bodies = _viscous_response(tools, arrays, system, span, theta)
        if explicit:
            system.explicit(state.velocity, arrays.rest_density, span, bodies)
        else:
            used = system.solve(
                state.velocity, arrays.rest_density, span, theta, bodies, config.viscosity_tolerance, config.viscosity_iterations
            )  # fmt: skip
        if bodies is not None:
            bodies.hand_over(state.velocity, explicit)
    return used


def _present_viscosity(tools: StepTools, state: FluidState) -> NDArray[np.float64]:
    """Return the viscosity (P,) [Pa s] of each liquid that has particles that move; 0 for others, which must not cost a solve."""
    phase = state.phase[: state.awake]
    viscosities = enumerate(tools.constants.viscosities)
    return np.array([mu if mu > 0.0 and (phase == k).any() else 0.0 for k, mu in viscosities])


def _viscous_response(
    tools: StepTools, arrays: StepArrays, system: ViscousSystem, time_step: float, theta: float
) -> ViscousResponse | None:
    """Make the answer of moving bodies to the drag of liquids that they hold; None where no liquid touches one."""
    walls, hood = tools.walls, arrays.neighborhood
    if not walls.bodies_hold or not arrays.touching.size:
        return None
    return ViscousResponse(
        walls, arrays.body_pairs, arrays.wall_gradient, system.stiffness.walls, hood.volume, time_step, theta
    )


def viscous_system(tools: StepTools, arrays: StepArrays, state: FluidState, viscosity: Real) -> ViscousSystem:
    """Assemble the system of liquids with a `viscosity` (P, P) [Pa s] and of the walls that hold them, at the present positions."""
    config, walls, hood = tools.config, tools.walls, arrays.neighborhood
    corrected = tools.constants.corrected
    viscous = viscosity.max(axis=1) > 0.0
    chosen = np.arange(state.awake) if viscous.all() else np.flatnonzero(viscous[state.phase[: state.awake]])
    liquid = ViscousLiquid(chosen.astype(np.uint32), arrays.points, state.phase, viscosity)
    gradients = PairGradients(arrays.gradient, arrays.wall_gradient)
    system = ViscousSystem(tools.team, liquid, hood, gradients)
    no_slip = walls.no_slip
    if no_slip is not None:
        # one sheet of walls, of whatever volume, holds the liquid; points without any are no walls
        held = walls.area * np.float32(wall_factor(config.dimension, not corrected) * config.particle_spacing)
        no_slip = np.divide(no_slip * held, walls.volume, out=np.zeros_like(held), where=walls.volume > 0.0)
    surface = arrays.surface if corrected else None
    system.assemble(walls.points, no_slip, config.particle_spacing, config.dimension, surface)
    return system
