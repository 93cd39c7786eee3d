"""The stage of a step in which particles that stand for drops change places with the liquid ahead of them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from oilsim.core.state import FluidState
from oilsim.drops.drift import RESTS, choose_partners, fill_shares, pairs_of
from oilsim.step.arrays import Index, Neighbors
from oilsim.step.context import StepContext


def move_drops(
    context: StepContext, neighbors: Neighbors, minor: list[Index], state: FluidState, time_step: float
) -> tuple[int, NDArray[np.int64]]:
    """Let drops change places in a step of `time_step` [s]; returns how many did, and the indices (n,) of all that are on their way.

    minor: indices (K,) of the particles of each minority phase with their neighbours (see `minority_phases`).
    """
    config, constants = context.config, context.constants
    assert constants.drop_speeds is not None
    chosen = np.unique(np.concatenate(minor))
    partner, share = np.empty(chosen.size, np.int64), np.ones(len(neighbors.points))  # of others: amid their own liquid
    neighborhood = neighbors.neighborhood
    context.team.run(fill_shares, chosen.size, chosen, neighborhood, state.phase, share)
    at_rest = math.hypot(*config.gravity) * state.time_step
    scales = config.particle_spacing, time_step, at_rest, config.dimension, state.steps
    context.team.run(
        choose_partners, chosen.size, chosen, neighborhood, (state.phase, state.id, share, constants.densities), state.velocity,
        state.pressure_impulse, constants.drop_speeds, scales, partner,
    )  # fmt: skip
    partner[partner >= neighbors.awake] = RESTS
    first, second = pairs_of(chosen, partner, state.id)
    state.swap(first, second, config.rest_volume * constants.densities)
    return first.size, chosen[partner != RESTS].astype(np.int64)
