"""Stages for single particles: they meet walls inelastically, and those that stand for drops change places with the liquid ahead."""

from __future__ import annotations

import math

import numpy as np

from oilsim.backend.arrays import Index, Ints, Real
from oilsim.boundaries.plate_guard import PlateGuard
from oilsim.boundaries.wall_contact import ContactRule, WallSums, wall_approach, wall_contact, wall_push
from oilsim.core.state import FluidState
from oilsim.drops.drift import AMID, FADING, RESTS, choose_partners, fill_drop_shares, fill_shares, pairs_of
from oilsim.pressure.rigid_response import RigidResponse
from oilsim.step.arrays import Neighbors, PairArrays
from oilsim.step.context import StepContext


def apply_wall_contact(
    context: StepContext, neighbors: Neighbors, pairs: PairArrays, compression: Real, position: Real, velocity: Real, time_step: float
) -> None:  # fmt: skip
    """Stop particles that would cross a wall, and move drops out of it (see `wall_contact`); bodies receive the opposite impulse.

    compression (N,) [1]; position, velocity (3, N) [m, m/s], changed in place; time_step [s]. There must be walls.
    """
    walls, run = context.walls, context.team.run
    count, sums = neighbors.awake, WallSums(pairs.sums.coverage, pairs.sums.wall_slope, compression)
    rule, density = contact_rule(context), neighbors.rest_density[: neighbors.awake]
    rate, strength = np.empty((2, count), np.float32)
    run(wall_approach, count, sums.slope, velocity, rate)
    response = RigidResponse(walls, pairs.contacts, None, float(context.constants.volume))
    if response.present:
        response.add_motion(rate)
    reach = np.float32(context.config.particle_spacing / time_step)
    run(wall_contact, count, sums, rule, rate, reach, velocity, strength)
    run(wall_push, count, sums, rule, position)
    if response.present:
        response.accept(strength * density)
    guard = plate_guard(context, neighbors)
    if guard.present:
        neighbors.points[:count, :3] = position[:, :count].T
        guard.stop(neighbors.points, velocity, density, time_step)


def contact_rule(context: StepContext) -> ContactRule:
    """Return when a particle is a drop, and how near walls are by their coverage."""
    constants, spacing = context.constants, np.float32(context.config.particle_spacing)
    return ContactRule(constants.drop, constants.wall_coverages, constants.nearest_wall, spacing)


def plate_guard(context: StepContext, neighbors: Neighbors) -> PlateGuard:
    """Make what keeps the particles of this step on their side of thin plates."""
    config, pairs = context.config, neighbors.body_pairs
    return PlateGuard(
        context.team, context.walls, pairs, context.constants.period, config.particle_spacing, config.dimension
    )


def move_drops(
    context: StepContext, neighbors: Neighbors, minor: list[Index], state: FluidState, time_step: float
) -> tuple[int, Ints]:
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
