"""The stage of a step in which particles that stand for drops change places with the liquid ahead of them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from oilsim.core.state import FluidState
from oilsim.drops.drift import AMID, FADING, RESTS, choose_partners, fill_drop_shares, fill_shares, pairs_of
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
    chosen = minor[0] if len(minor) == 1 else np.unique(np.concatenate(minor))
    neighborhood, team = neighbors.neighborhood, context.team
    share = np.ones(len(neighbors.points), np.float32)  # of others: amid their own liquid
    team.run(fill_shares, chosen.size, chosen, neighborhood, share)
    chosen = chosen[share[chosen] <= AMID]
    drop = np.empty(chosen.size, np.float32)
    team.run(fill_drop_shares, chosen.size, chosen, neighborhood, share, drop)
    chosen, drop = chosen[drop < FADING[1]], drop[drop < FADING[1]]
    partner = np.empty(chosen.size, np.int64)
    at_rest = math.hypot(*config.gravity) * state.time_step
    scales = config.particle_spacing, time_step, at_rest, config.dimension, state.steps
    team.run(
        choose_partners, chosen.size, chosen, (share, drop), neighborhood, (state.phase, state.id, constants.densities), state.velocity,
        state.pressure_impulse, constants.drop_speeds, scales, partner,
    )  # fmt: skip
    partner[partner >= neighbors.awake] = RESTS
    first, second = pairs_of(chosen, partner, state.id)
    state.swap(first, second, config.rest_volume * constants.densities)
    return first.size, chosen[partner != RESTS].astype(np.int64)
