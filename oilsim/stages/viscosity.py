"""The stage of a step in which viscosity acts, explicitly or implicitly, and at once or with a lag.

A liquid so thin that one step changes nothing gets the viscosity of many steps at once. Each liquid has its own lag, so that sea water
beside thick oil costs no more than alone. The shear between two liquids goes with the thinner one: their harmonic mean is its viscosity, or
up to twice that.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from oilsim.backend.arrays import Array, Real
from oilsim.core.state import FluidState
from oilsim.step.arrays import Neighbors, PairArrays
from oilsim.step.context import StepContext
from oilsim.viscosity.pair_stiffness import PairGradients, ViscousLiquid, wall_factor
from oilsim.viscosity.viscous_response import Motion, ViscousResponse
from oilsim.viscosity.viscous_system import ViscousSystem, implicit_share, is_mild

Phases = NDArray[np.uint8]


class ViscousStep(NamedTuple):
    """The viscosity that is due in a step, and the motion before the step's forces; None where the viscous solve does not need it."""

    due: Due
    start: Motion | None


def begin_viscosity(context: StepContext, state: FluidState, time_step: float) -> ViscousStep:
    """Find the viscosity that is due in a step of `time_step` [s], before the forces of the step act; the state's lag follows.

    The trapezoidal rule takes viscosity from the motion at both
    ends of a step, and forces from neither. If it took v + dt a for the motion at the step's beginning, thick liquid would overshoot what
    forces do, and pressure that responds from step to step would grow.
    """
    due = _due(context, state, time_step)
    state.viscous_time = due.lagged
    start = None if _theta(context, due) == 1.0 else Motion(state.velocity.copy(), context.walls.twists())
    return ViscousStep(due, start)


def apply_viscosity(
    context: StepContext, system: ViscousSystem, neighbors: Neighbors, pairs: PairArrays, velocity: Real, step: ViscousStep
) -> tuple[int, float]:  # fmt: skip
    """Let viscosity that is due act on `velocity` (3, N) [m/s] and on bodies.

    Returns the iterations of the implicit solve and what it leaves [1], both 0 for an explicit step. system: as from `viscous_system`;
    step: as from `begin_viscosity`.
    """
    due, start = step
    explicit, theta, density = _is_explicit(context, due), _theta(context, due), neighbors.rest_density
    bodies = _viscous_response(context, neighbors, pairs, system, due.span, theta)
    solved = 0, 0.0
    if explicit:
        system.explicit(velocity, density, due.span, bodies)
    else:
        middle = None if start is None else start.towards(Motion(velocity, context.walls.twists()), theta)
        tolerance, most = context.config.viscosity_tolerance, context.config.viscosity_iterations
        solved = system.solve(velocity, density, due.span, theta, bodies, tolerance, most, middle)
    if bodies is not None:
        bodies.hand_over(velocity, explicit)
    return solved


def _due(context: StepContext, state: FluidState, time_step: float) -> Due:
    """Find which viscosity is due in a step of `time_step` [s]; the span is 0 where none is."""
    constants, viscosity = context.constants, _present_viscosity(context, state)
    if not viscosity.any():
        return Due(0.0, constants.pair_viscosity, 0.0, state.viscous_time)
    lagged = np.where(viscosity > 0.0, state.viscous_time + time_step, 0.0)
    least = NEGLIGIBLE if constants.corrected else 0.0
    inertia = constants.densities * context.config.particle_spacing**2
    return viscosity_due(lagged, viscosity, constants.pair_viscosity, inertia, least)


def _is_explicit(context: StepContext, due: Due) -> bool:
    """Tell whether the viscosity that is due is stepped forward in time."""
    return context.config.explicit_viscosity or is_mild(due.number)


def _theta(context: StepContext, due: Due) -> float:
    """Return the implicit share [1] of the viscosity that is due; 1 where none is, and in an explicit step."""
    if due.span == 0.0 or not context.constants.corrected or _is_explicit(context, due):
        return 1.0
    return implicit_share(due.number)


def _present_viscosity(context: StepContext, state: FluidState) -> Array:
    """Return the viscosity (P,) [Pa s] of each liquid that has particles that move; 0 for others, which must not cost a solve."""
    phase = state.phase[: state.awake]
    viscosities = enumerate(context.constants.viscosities)
    return np.array([mu if mu > 0.0 and (phase == k).any() else 0.0 for k, mu in viscosities])


def _viscous_response(
    context: StepContext, neighbors: Neighbors, pairs: PairArrays, system: ViscousSystem, time_step: float, theta: float
) -> ViscousResponse | None:  # fmt: skip
    """Make the response of moving bodies to the drag of liquids that they hold; None where no liquid touches one."""
    walls = context.walls
    if not walls.bodies_hold or not neighbors.touching.size:
        return None
    volume = neighbors.neighborhood.volume
    return ViscousResponse(
        walls, neighbors.body_pairs, pairs.wall_gradient, system.stiffness.walls, volume, time_step, theta
    )


def viscous_system(
    context: StepContext, neighbors: Neighbors, pairs: PairArrays, phase: Phases, surface: Phases | None, viscosity: Real
) -> ViscousSystem:  # fmt: skip
    """Assemble the system of liquids with a `viscosity` (P, P) [Pa s] and of the walls that hold them, at the present positions.

    phase (N,) uint8; surface (N,) uint8, a `FreeSurface` of each particle, None in the paper's scheme.
    """
    config, walls, awake = context.config, context.walls, neighbors.awake
    viscous = viscosity.max(axis=1) > 0.0
    chosen = np.arange(awake) if viscous.all() else np.flatnonzero(viscous[phase[:awake]])
    liquid = ViscousLiquid(chosen.astype(np.uint32), neighbors.points, phase, viscosity)
    gradients = PairGradients(pairs.gradient, pairs.wall_gradient)
    system = ViscousSystem(context.team, liquid, neighbors.neighborhood, gradients)
    no_slip = walls.no_slip
    if no_slip is not None:
        # one sheet of walls, of whatever volume, holds the liquid; points without any are no walls
        held = walls.area * np.float32(wall_factor(config.dimension, surface is None) * config.particle_spacing)
        no_slip = np.divide(no_slip * held, walls.volume, out=np.zeros_like(held), where=walls.volume > 0.0)
    system.assemble(walls.points, no_slip, config.particle_spacing, config.dimension, surface)
    return system


# [1] nu t / d^2 up to which viscosity waits; theory; decay of the finest wave, of 2 d, is off by (10 of this)^2 / 2
NEGLIGIBLE = 1e-3


class Due(NamedTuple):
    """The viscosity that is due in a step.

    span    time for which it acts [s], 0 if none is due
    matrix  (P, P) float32, viscosities of pairs of the P liquids [Pa s]
    number  largest viscous number nu t / d^2 [1]
    lagged    (P,) time for which each liquid's viscosity lags after the step [s]
    """

    span: float
    matrix: Real
    number: float
    lagged: Array


def viscosity_due(lagged: Array, viscosity: Array, matrix: Real, per_number: Array, least: float) -> Due:
    """Return the viscosity that is due of P liquids.

    lagged        (P,) time for which each liquid's viscosity lags [s]
    viscosity   (P,) [Pa s], 0 of liquids that are absent
    matrix      (P, P) float32, viscosities of pairs [Pa s]
    per_number  (P,) rho d^2 [kg/m]
    least       viscous number from which on a liquid's viscosity is due [1]
    """
    number = viscosity * lagged / per_number
    due = (viscosity > 0.0) & (number >= least)
    span = float(lagged[due].max(initial=0.0))
    rank = np.argsort(np.argsort(viscosity, kind="stable"))
    thinner = np.where(rank[:, None] < rank, *np.indices(matrix.shape))
    share = np.divide(lagged, span, out=np.zeros_like(lagged), where=due)[thinner]
    return Due(span, matrix * share.astype(np.float32), float(number[due].max(initial=0.0)), np.where(due, 0.0, lagged))
