"""The paper's divergence constraint on velocities (Qiu et al. 2021, Alg. 1): Jacobi steps where density would rise."""

from __future__ import annotations

import numpy as np

from oilsim.backend.thread_team import block_count, total
from oilsim.core.state import Confinement, FluidState
from oilsim.pressure.pressure_gradient import divergence_multiplier
from oilsim.step.arrays import Neighbors, PairArrays
from oilsim.step.context import StepContext
from oilsim.step.stages.pressure import PressureOperator


def correct_velocity(
    context: StepContext, neighbors: Neighbors, pairs: PairArrays, state: FluidState, time_step: float
) -> tuple[int, float]:
    """Apply Alg. 1 to the velocities in place, bodies responding; returns the iterations and the mean residual [1]."""
    config, run, count = context.config, context.team.run, state.count
    correction, error = np.empty(count, np.float32), np.zeros(block_count(count))
    state.pressure_impulse[:] = 0.0
    state.time_step = time_step
    operator = PressureOperator(context, neighbors, pairs, state.velocity, state.confinement == Confinement.FILLED)
    for iteration in range(config.divergence_iterations + 1):
        rate = operator.compression_rate()
        run(
            divergence_multiplier, count, rate, pairs.sums.diagonal, neighbors.neighborhood.fluid, np.float32(time_step),
            state.pressure_impulse, correction, error,
        )  # fmt: skip
        residual = total(error) / max(count, 1)
        settled = residual <= config.divergence_tolerance and iteration > 0
        if settled or iteration == config.divergence_iterations:
            return iteration, residual
        operator.accelerate(correction)
    raise AssertionError("the loop returns")
