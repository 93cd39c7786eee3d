"""Two ways to put the constraints together into a time step: ours ("split") and the paper's.

split   1. x += dt v, regions at rest fall asleep, neighbours
        2. what neighbours tell (`particle_sums`)
        3. density, order and quiet (`relaxation`): positions move, velocities only as the flow's field asks
        4. v* = v + dt (gravity, forcing, adhesion), viscosity implicitly
        5. bounded pressure solve for H^T v* (`divergence`), bodies answering inside it; v = v* - u
        6. contact of single drops with walls; liquid off the walls gets lost momentum back (`momentum_correction`)
paper   (Qiu et al. 2021, Alg. 3)
        1. v* = v + dt gravity, x* = x + dt v*, neighbours
        2. density constraint on positions, v* = (x_cd - x) / dt
        3. forcing and adhesion, divergence constraint by Alg. 1
        4. viscosity

The paper's feedback of position corrections into velocity acts as a viscosity of the order of spacing times speed and keeps calm water
moving; "split" has neither, at the price of a density error that is carried, not converted into motion.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from oilsim.backend.thread_team import block_count, total
from oilsim.density.density_feedback import RETURN, RETURN_IN_A_BOX, add_density_feedback
from oilsim.pressure.bounded_solver import BoundConstrainedSolver
from oilsim.pressure.pressure_gradient import divergence_multiplier
from oilsim.state import FluidState
from oilsim.step.momentum_correction import LostMomentum
from oilsim.step.paper_density_stage import constrain_density
from oilsim.step.pressure_operator import PressureOperator
from oilsim.step.relaxation_stage import relax_liquid
from oilsim.step.step_arrays import Workspace

Real = NDArray[np.float32]
Drive = Callable[[FluidState, float], None]
FILLED = 0.1  # of the tolerance, in a filled box: nothing but pressure keeps its flow, and vortices lose by what solves leave


@dataclass(frozen=True)
class StepResult:
    """Length of a step [s], its solves' iterations and the mean compression they leave, of positions and to which velocities lead."""

    time_step: float
    density_iterations: int
    divergence_iterations: int
    viscosity_iterations: int
    density_error: float
    divergence_error: float


def split_step(
    work: Workspace, state: FluidState, solver: BoundConstrainedSolver, time_step: float, drive: Drive, driven: bool
) -> StepResult:
    """What follows in a step on the flight of its particles, in place.

    `drive(state, dt)` adds currents, waves and wind to the velocities; driven: something moves liquid so.
    """
    work.sleep(state, time_step, driven)
    work.search(state)
    lost_momentum = LostMomentum(work, state)
    with lost_momentum.watch():
        density_iterations, density_error = relax_liquid(work, state, time_step)
    work.linearise(state)
    work.accelerate(state, time_step)
    work.press_films(state, time_step)
    drive(state, time_step)
    with lost_momentum.watch():
        work.adhere(state, time_step)
        viscosity_iterations = work.resist(state, time_step)
        divergence_iterations, divergence_error = project_velocity(work, state, solver, time_step)
        work.touch_walls(state, time_step)
    lost_momentum.give_back()
    return StepResult(
        time_step, density_iterations, divergence_iterations, viscosity_iterations, density_error, divergence_error
    )


def project_velocity(
    work: Workspace, state: FluidState, solver: BoundConstrainedSolver, time_step: float
) -> tuple[int, float]:
    """Make velocities and bodies free of compression by one bounded pressure solve; returns its products and the mean residual."""
    config = work.config
    kappa = state.pressure_impulse
    if state.filled and not work.closed:
        kappa -= min(kappa.min(), np.float32(0.0))  # suction in a filled box has no level; what has parted sets one
    elif not work.closed:
        np.maximum(kappa, 0.0, out=kappa)
    if state.time_step > 0.0:
        kappa *= np.float32(time_step / state.time_step)
    state.time_step = time_step
    with work.stage("divergence"):
        operator = PressureOperator(work, state)
        if not work.closed:
            work.coarse.lay(state.position[:, : state.awake], work.points, work.openness)
        work.hold_waterline(state, time_step)
        operator.apply(kappa)
        excess = operator.compression_rate()
        work.team.run(
            add_density_feedback, state.awake, work.compression, work.gradient_sum, work.near, kappa, work.pressed(time_step),
            work.field, *work.surface_shares, np.float32(time_step),
            np.float32((RETURN_IN_A_BOX if work.closed else RETURN) * work.time_unit), excess,
        )  # fmt: skip
        tolerance = config.divergence_tolerance * (FILLED if work.closed else 1.0)
        used, residual = solver.solve(
            operator, -excess, work.diagonal, kappa[: state.listed], tolerance / time_step,
            config.divergence_iterations, work.closed, [work.touching, *work.lesser_liquids(state)],
            state.awake,
        )  # fmt: skip
        operator.hand_over()
    return used, residual * time_step


def paper_step(work: Workspace, state: FluidState, time_step: float, drive: Drive) -> StepResult:
    """Advance `state` in place by Alg. 3."""
    work.accelerate(state, time_step)
    work.fly(state, time_step)
    work.search(state)
    predicted = state.position.copy()
    density_iterations, density_error, pushed = constrain_density(work, state, time_step)
    with work.stage("density"):
        state.velocity += (state.position - predicted) / np.float32(time_step)
    work.linearise(state)
    drive(state, time_step)
    work.adhere(state, time_step)
    divergence_iterations, divergence_error = correct_velocity(work, state, time_step)
    state.pressure_impulse += pushed
    viscosity_iterations = work.resist(state, time_step)
    work.touch_walls(state, time_step)
    return StepResult(
        time_step, density_iterations, divergence_iterations, viscosity_iterations, density_error, divergence_error
    )


def correct_velocity(work: Workspace, state: FluidState, time_step: float) -> tuple[int, float]:
    """Alg. 1: Jacobi corrections of the velocity where density would rise; returns the iterations and the mean residual."""
    config, run, count = work.config, work.team.run, state.count
    correction, error = np.empty(count, np.float32), np.zeros(block_count(count))
    state.pressure_impulse[:] = 0.0
    state.time_step = time_step
    with work.stage("divergence"):
        operator = PressureOperator(work, state)
        for iteration in range(config.divergence_iterations + 1):
            rate = operator.compression_rate()
            run(
                divergence_multiplier, count, rate, work.diagonal, work.fluid_pairs, np.float32(time_step),
                state.pressure_impulse, correction, error,
            )  # fmt: skip
            residual = total(error) / max(count, 1)
            settled = residual <= config.divergence_tolerance and iteration > 0
            if settled or iteration == config.divergence_iterations:
                return iteration, residual
            operator.apply(correction)
    raise AssertionError("the loop returns")
