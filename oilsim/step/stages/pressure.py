"""The stage of a step that makes velocities and bodies free of compression by one bounded pressure solve."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from oilsim.core.config import swing_head
from oilsim.core.state import Confinement, FluidState
from oilsim.density.density_feedback import RETURN, RETURN_IN_A_BOX, FeedbackScales, add_density_feedback
from oilsim.neighborhood.neighbor_search import indices
from oilsim.pressure.bounded_solver import BoundConstrainedSolver, Pressures
from oilsim.pressure.rest_pressure import RestPressure, needed_share, rest_pressure, top_of_rest
from oilsim.pressure.wall_extrapolation import PRESSED, hold_waterline
from oilsim.step.pressure_operator import PressureOperator, with_neighbors
from oilsim.step.step_arrays import StepArrays
from oilsim.step.step_tools import StepTools

Real = NDArray[np.float32]
# [1] share of the tolerance in a filled box; measured; only pressure keeps its flow, and vortices lose by the residual of solves
FILLED = 0.1


def apply_last_pressure(tools: StepTools, arrays: StepArrays, state: FluidState, time_step: float) -> PressureOperator:
    """Let the pressure of the last step act on velocities and bodies; returns the operator, with which `project_velocity` repairs it.

    It comes before viscosity, which then meets forces in balance: the incremental pressure correction of van Kan (1986). Viscosity that met
    gravity alone would brake liquid at rest beside no-slip walls, and leave it moving at a share of g dt.
    """
    filled = state.confinement == Confinement.FILLED
    _start_from_last(state, time_step)
    with tools.stage("divergence"):
        operator = PressureOperator(tools, arrays, state)
        if not filled:
            tools.coarse.lay(state.position[:, : state.awake], arrays.points, arrays.openness)
        _hold_waterline(tools, arrays, state, time_step)
        operator.accelerate(state.pressure_impulse[: state.listed], _rest(tools, arrays, state, time_step))
    return operator


def _rest(tools: StepTools, arrays: StepArrays, state: FluidState, time_step: float) -> RestPressure | None:
    """Return the part of the pressure that acts by its slope, of all particles that are listed; None where this step needs none.

    Only a well-balanced liquid with a free surface has it.
    """
    config = tools.config
    if not config.well_balanced or state.awake == 0:
        return None
    height, moving = state.position[2, : state.listed], slice(0, state.awake)
    scales = config.particle_spacing, -config.gravity[2] * time_step
    state.rest_top = top_of_rest(height[moving], arrays.surface[moving], state.pressure_impulse[moving], *scales)
    if not height.min() < state.rest_top:
        return None
    deepest = rest_pressure(height[moving].min(keepdims=True), state.rest_top, *scales, 1.0).impulse
    highest = float(state.pressure_impulse[moving].max()) / time_step
    allowed = swing_head(config.particle_spacing, config.dimension, time_step)
    share = needed_share(highest, float(deepest[0]) / time_step, allowed)
    return rest_pressure(height, state.rest_top, *scales, share) if share > 0.0 else None


def project_velocity(
    tools: StepTools, arrays: StepArrays, state: FluidState, solver: BoundConstrainedSolver, operator: PressureOperator
) -> tuple[int, float]:
    """Take compression off the velocities, bodies responding, by a change of the pressure that `apply_last_pressure` has begun with.

    Returns applications of the operator and the mean residual [1].
    """
    config, kappa, time_step = tools.config, state.pressure_impulse, state.time_step
    filled = state.confinement == Confinement.FILLED
    with tools.stage("divergence"):
        excess = operator.compression_rate()
        _add_feedback(tools, arrays, state, time_step, excess)
        tolerance = config.divergence_tolerance * (FILLED if filled else 1.0)
        level = tools.constants.least_pressure * time_step / tools.constants.reference_density if filled else None
        used, residual = solver.solve(
            operator, Pressures(kappa[: state.listed], -excess, arrays.diagonal), tolerance / time_step, config.divergence_iterations,
            level, [arrays.touching, *minority_phases(tools, arrays, state)], state.awake,
        )  # fmt: skip
        operator.hand_over()
    return used, residual * time_step


def _start_from_last(state: FluidState, time_step: float) -> None:
    """Make the last step's pressure a start for one of `time_step` [s]: none negative, where something sets its level."""
    kappa = state.pressure_impulse
    if state.confinement == Confinement.PARTED:
        # suction in a filled box has no level; particles that have parted set one
        kappa -= min(kappa.min(), np.float32(0.0))
    elif state.confinement == Confinement.OPEN:
        np.maximum(kappa, 0.0, out=kappa)
    if state.time_step > 0.0:
        kappa *= np.float32(time_step / state.time_step)
    state.time_step = time_step


def _add_feedback(tools: StepTools, arrays: StepArrays, state: FluidState, time_step: float, rate: Real) -> None:
    """Add to `rate` [1/s] what strain and wrong densities ask of the divergence (see `density_feedback`)."""
    unit = tools.time_unit * (RETURN_IN_A_BOX if state.confinement == Confinement.FILLED else RETURN)
    scales = FeedbackScales(pressed(tools, time_step), np.float32(time_step), np.float32(unit))
    tools.team.run(
        add_density_feedback, state.awake, arrays.compression, arrays.gradient_sum, arrays.surface, arrays.flow, state.pressure_impulse,
        tools.constants.surface_table, scales, rate,
    )  # fmt: skip


def _hold_waterline(tools: StepTools, arrays: StepArrays, state: FluidState, time_step: float) -> None:
    """Let walls at rest hold up the water's edge, as far as the pressure of the last step asks (see `wall_extrapolation`)."""
    if arrays.waterline is None or tools.constants.weightless:
        return
    tools.team.run(
        hold_waterline, state.awake, arrays.neighborhood.walls, arrays.waterline, state.pressure_impulse, pressed(tools, time_step),
        np.float32(time_step), state.velocity,
    )  # fmt: skip


def pressed(tools: StepTools, time_step: float) -> np.float32:
    """Return kappa [m2/s] from which a particle at a free surface bears others and is no drop: hydrostatic, PRESSED spacings deep."""
    config = tools.config
    return np.float32(PRESSED * config.particle_spacing * math.hypot(*config.gravity) * time_step + 1e-20)


def minority_phases(tools: StepTools, arrays: StepArrays, state: FluidState) -> list[NDArray[np.uint32]]:
    """List the awake particles (K,) of each liquid but the most abundant one, with their neighbours: a liquid spreads by its rim."""
    liquids = range(len(tools.constants.densities))
    if len(liquids) == 1:
        return []
    phase = state.phase[: state.awake]
    counts = [np.count_nonzero(phase == k) for k in liquids]
    lesser = [k for k, count in enumerate(counts) if count and k != np.argmax(counts)]
    return [indices(with_neighbors(tools, arrays, state, indices(phase == k))) for k in lesser]
