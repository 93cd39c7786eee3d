"""The stages of a step that make velocities and bodies free of compression by one bounded pressure solve.

From top to bottom: the last step's pressure acts, the solve finds its change, and the operator tells what a pressure does to liquid and
bodies. Beside this file `pressure.bounded_solver` solves, `pressure.coarse_grid` preconditions, `pressure.pressure_gradient` and
`pressure.rigid_response` hold the kernels of the operator, `pressure.rest_pressure` and `density.density_feedback` the two terms of a
pressure that is known and of a density that is wrong.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.arrays import Array, Index, Ints, Real
from oilsim.backend.jit import FAST
from oilsim.backend.simd import LANES, below, load, store
from oilsim.boundaries.wall_curvature import add_wall_curvature
from oilsim.boundaries.walls import Walls
from oilsim.core.config import swing_head
from oilsim.core.state import Confinement, FluidState
from oilsim.density.density_feedback import RETURN, RETURN_IN_A_BOX, FeedbackScales, add_density_feedback
from oilsim.neighborhood.neighbor_search import indices
from oilsim.pressure.bounded_solver import Pressures, System
from oilsim.pressure.pressure_gradient import pressure_velocity, seen_velocity, velocity_divergence
from oilsim.pressure.rest_pressure import RestLaw, RestPressure, needed_share, top_of_rest
from oilsim.pressure.rigid_response import RigidResponse, extend_jacobians, sum_reach, turn_freely
from oilsim.pressure.wall_extrapolation import PRESSED, hold_waterline
from oilsim.stages.explicit import add_gravity
from oilsim.stages.pairs import with_neighbors
from oilsim.step.arrays import Neighbors, NeighborSums, PairArrays
from oilsim.step.context import StepContext

# [1] share of the tolerance in a filled box; measured; only pressure keeps its flow, and vortices lose by the residual of solves
FILLED = 0.1


def apply_last_pressure(
    context: StepContext, neighbors: Neighbors, pairs: PairArrays, surface: NDArray[np.uint8], state: FluidState, time_step: float
) -> PressureOperator:  # fmt: skip
    """Let the pressure of the last step act on velocities and bodies; returns the operator, with which `project_velocity` corrects it.

    It comes before viscosity, which then meets forces in balance: the incremental pressure correction of van Kan (1986). Viscosity that met
    gravity alone would brake liquid at rest beside no-slip walls, and leave it moving at a share of g dt. surface (N,) uint8: `FreeSurface`
    of each particle; time_step [s].
    """
    filled = state.confinement == Confinement.FILLED
    _start_from_last(state, time_step)
    operator = PressureOperator(context, neighbors, pairs, state.velocity, filled)
    if not filled:
        context.coarse.lay(state.position[:, : state.awake], neighbors.points, pairs.sums.openness)
    if pairs.wall_pressure is not None and not (context.constants.weightless or state.is_reduced):
        context.team.run(
            hold_waterline, state.awake, neighbors.neighborhood.walls, pairs.wall_pressure.waterline, state.pressure_impulse,
            pressed(context, time_step), np.float32(time_step), state.velocity,
        )  # fmt: skip
    law = _rest_law(context, surface, state, time_step)
    rest = None if law is None else law.of(state.position[2, : state.listed])
    operator.accelerate(state.pressure_impulse[: state.listed], rest)
    if law is not None and pairs.contacts.particle.size:
        context.walls.receive(lift_of_rest(context, law, pairs.contacts.body))
    if state.is_reduced:
        apply_rest_pressure(context, state, time_step)
    return operator


def apply_rest_pressure(context: StepContext, state: FluidState, time_step: float) -> None:
    """Let the pressure at rest of liquid that fills its box act for `time_step` [s]: it takes off gravity's kick, and lifts bodies."""
    up = [-g for g in context.config.gravity]
    add_gravity(state.velocity[:, : state.awake], up, time_step)
    arm, volume, owner = context.walls.displaced()
    push = context.constants.reference_density * time_step * volume[:, None] * np.array(up)
    context.walls.receive(wrenches_of(context.walls, arm, owner, push))


def lift_of_rest(context: StepContext, law: RestLaw, touching: NDArray[np.integer]) -> Array:
    """Return the impulses (bodies, 6) [N s, N m s] of water at rest on the bodies that it touches, by their numbers `touching` (K,)."""
    walls = context.walls
    arm, volume, owner = walls.displaced()
    middle = np.array([body.position[2] for body in walls.moving.values()])
    wet = np.isin(owner, touching)
    push = np.zeros(arm.shape)
    push[:, 2] = wet * volume * law.of(arm[:, 2] + middle[owner]).slope * context.constants.reference_density
    return wrenches_of(walls, arm, owner, push)


def wrenches_of(walls: Walls, arm: Array, owner: Ints, push: Array) -> Array:
    """Sum impulses `push` (K, 3) [N s] at `arm` (K, 3) [m] from the centres of the bodies `owner` (K,); (bodies, 6) [N s, N m s]."""
    impulse, parts = walls.zero_forces(), np.hstack([push, np.cross(arm, push)])
    for axis in range(6):
        impulse[:, axis] = np.bincount(owner, parts[:, axis], len(impulse))
    return impulse


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


def _rest_law(context: StepContext, surface: NDArray[np.uint8], state: FluidState, time_step: float) -> RestLaw | None:
    """Return the part of the pressure that acts by its slope; None where this step needs none.

    Only a well-balanced liquid with a free surface has it.
    """
    config = context.config
    if not config.well_balanced or state.awake == 0 or state.is_reduced:
        return None
    height, moving = state.position[2, : state.listed], slice(0, state.awake)
    kick = -config.gravity[2] * time_step
    state.rest_top = top_of_rest(
        height[moving], surface[moving], state.pressure_impulse[moving], config.particle_spacing, kick
    )
    if not height.min() < state.rest_top:
        return None
    whole = RestLaw(state.rest_top, config.particle_spacing, kick, 1.0)
    deepest = float(whole.of(height[moving].min(keepdims=True)).impulse[0]) / time_step
    highest = float(state.pressure_impulse[moving].max()) / time_step
    share = needed_share(highest, deepest, swing_head(config.particle_spacing, config.dimension, time_step))
    return whole._replace(share=share) if share > 0.0 else None


def project_velocity(
    context: StepContext, neighbors: Neighbors, sums: NeighborSums, pairs: PairArrays, state: FluidState, operator: PressureOperator,
    minor: list[Index],
) -> tuple[int, float]:  # fmt: skip
    """Take compression off the velocities, bodies responding, by a change of the pressure that `apply_last_pressure` has begun with.

    minor: indices (K,) of the particles of each minority phase, with their neighbours, whose compression the solve watches too.
    Returns applications of the operator and the mean residual [1].
    """
    config, constants, time_step = context.config, context.constants, state.time_step
    filled = state.confinement == Confinement.FILLED
    excess = operator.compression_rate()
    unit = sums.time_unit * (RETURN_IN_A_BOX if filled else RETURN)
    scales = FeedbackScales(pressed(context, time_step), np.float32(time_step), np.float32(unit))
    context.team.run(
        add_density_feedback, state.awake, sums.compression, sums.gradient_sum, sums.surface, sums.flow, state.pressure_impulse,
        constants.surface_table, scales, excess,
    )  # fmt: skip
    walls = context.walls
    if walls.curvature.rows is not None:
        centres = np.ascontiguousarray(walls.twists()[:, :3].T, np.float32)
        context.team.run(
            add_wall_curvature, state.awake, neighbors.neighborhood, pairs.wall_gradient, walls.curvature.rows, (walls.owner, centres),
            state.velocity, (np.float32(time_step), constants.wall_weight), excess,
        )  # fmt: skip
    tolerance = config.divergence_tolerance * (FILLED if filled else 1.0)
    level = constants.least_pressure * time_step / constants.reference_density if filled else None
    pressures = Pressures(state.pressure_impulse[: state.listed], -excess, pairs.sums.diagonal)
    watched = [neighbors.touching, *minor]
    used, residual = context.solver.solve(
        operator, pressures, tolerance / time_step, config.divergence_iterations, level, watched, state.awake
    )
    operator.hand_over()
    return used, residual * time_step


def pressed(context: StepContext, time_step: float) -> np.float32:
    """Return kappa [m2/s] from which a particle at a free surface bears others and is no drop: hydrostatic, PRESSED spacings deep."""
    config = context.config
    return np.float32(PRESSED * config.particle_spacing * math.hypot(*config.gravity) * time_step + 1e-20)


def minority_phases(context: StepContext, neighbors: Neighbors, phase: NDArray[np.uint8]) -> list[Index]:
    """List the awake particles (K,) of each liquid but the most abundant one, with their neighbours: a liquid spreads by its rim.

    phase (N,) uint8 of the particles.
    """
    liquids = range(len(context.constants.densities))
    if len(liquids) == 1:
        return []
    phase = phase[: neighbors.awake]
    counts = [np.count_nonzero(phase == k) for k in liquids]
    minor = [k for k, count in enumerate(counts) if count and k != np.argmax(counts)]
    return [indices(with_neighbors(context, neighbors, indices(phase == k))) for k in minor]


def pressure_response(
    context: StepContext, neighbors: Neighbors, pairs: PairArrays, push: Real | None
) -> RigidResponse:
    """Make the response of bodies to pressures, extrapolated ones too where there are levers.

    push (N, 3): the sums sum_j G_ij kappa_j [m/s] of `pressure_velocity`, by which extrapolated pressures act; None where there are none.
    """
    walls, contacts, constants = context.walls, pairs.contacts, context.constants
    if pairs.lever is not None and contacts.particle.size:
        jacobian = np.empty_like(contacts.jacobian)
        reach = np.empty((*jacobian.shape, 3), np.float32)
        sum_reach(
            contacts, neighbors.body_pairs, neighbors.points, walls.points, constants.period, pairs.wall_gradient, pairs.lever, reach
        )  # fmt: skip
        extend_jacobians(contacts, pairs.lever, constants.wall_weight, reach, jacobian)
        contacts = contacts._replace(jacobian=jacobian, reach=reach)
    turns, owner = walls.turns()
    if owner.size and contacts.particle.size:
        turn_freely(contacts, turns, owner)
    return RigidResponse(walls, contacts, push, float(constants.volume) * constants.reference_density)


class PressureOperator(System):
    """A = H^T (rho_ref / rho_0) H with the responses of moving bodies (see `pressure_gradient` and `rigid_response`)."""

    def __init__(
        self, context: StepContext, neighbors: Neighbors, pairs: PairArrays, velocity: Real, filled: bool
    ) -> None:
        """Start at `velocity` (3, N) [m/s], which moves with the pressure; filled: the liquid has no free surface."""
        self._team, self._neighbors, self._pairs = context.team, neighbors, pairs
        self._context, self._velocity, self._filled, self._count = context, velocity, filled, neighbors.awake
        listed = len(neighbors.points)
        self._all, self._vectors = np.arange(self._count, dtype=np.uint32), pairs.vectors
        self._push = np.empty((self._count, 3), np.float32) if pairs.lever is not None else None
        self._response = pressure_response(context, neighbors, pairs, self._push)
        self._change, self._direction = np.empty((2, 3, listed), np.float32)
        self._seen = np.empty((listed, 4), np.float32)
        self._change[:, self._count :] = self._direction[:, self._count :] = 0.0  # what sleeps
        self._seen[self._count :] = 0.0
        if self._response.present:
            self._response.add_compliance(pairs.sums.diagonal)

    def compression_rate(self) -> Real:
        """Return H^T v (N,) [1/s] of the present velocities and the bodies' present motion (Qiu et al. 2021, Eq. 14)."""
        rate, walls = np.zeros(len(self._seen), np.float32), self._neighbors.neighborhood.walls
        self._team.run(seen_velocity, self._count, walls, self._pairs.extrapolation, self._velocity, self._seen)
        if self._response.present:
            self._response.show_motion(self._seen)
        self._diverge(self._velocity, rate, self._all)
        if self._response.present:
            self._response.add_motion(rate)
        return rate

    def apply(self, kappa: Real, result: Real) -> None:
        """Write A kappa (N,) [1/s] into result; kappa (N,) [m2/s]."""
        self.apply_to(kappa, result, self._all, self._all)

    def apply_to(self, kappa: Real, result: Real, around: Index, chosen: Index) -> None:
        """Write (A kappa)_i [1/s] of the particles `chosen` (K,) into result (N,); kappa (N,) [m2/s].

        around: indices of all particles that have neighbours under pressure.
        """
        self._pressure_velocity(kappa, around)
        if self._response.present:
            self._response.respond(kappa)
            self._response.show_response(self._seen)
        self._diverge(self._change, result, chosen)
        if self._response.present:
            self._response.add_response(result)

    def part(self, group: Index) -> PartialOperator:
        """Return A restricted to the particles of a group (K,) of indices."""
        near = with_neighbors(self._context, self._neighbors, group)
        near[self._neighbors.touching] = True  # by which bodies find the pressure on them
        return PartialOperator(self, group, indices(near), len(self._seen))

    def centre(self, values: Real) -> None:
        """Subtract the mean of the values (N,) [1/s] from them in a filled box."""
        if self._filled:
            values -= np.float32(values.mean(dtype=np.float64))

    def correct(self, residual: Real, free: Real, correction: Real) -> None:
        """Add to the correction (N,) [m2/s] the coarse grid's correction of a residual (N,) [1/s] in the free set (N,).

        0 in a filled box.
        """
        if not self._filled:
            self._context.coarse.correct(residual, free, correction)

    def set_direction(self, beta: float) -> None:
        """Set the search direction to the velocities of the last application plus `beta` times the last direction."""
        if beta == 0.0:
            self._direction, self._change = self._change, self._direction
        else:
            self._team.run(update_direction, self._count, np.float32(beta), self._change, self._direction)
        if self._response.present:
            self._response.set_direction(beta)

    def take_step(self, length: float) -> None:
        """Move the velocities with kappa, which has moved by -length along the search direction; bodies wait for `hand_over`."""
        self._team.run(add_step, self._count, np.float32(length), self._direction, self._velocity)
        if self._response.present:
            self._response.collect(-length)

    def hand_over(self) -> None:
        """Give the bodies the impulses of all steps that were taken."""
        if self._response.present:
            self._response.hand_over()

    def accelerate(self, kappa: Real, rest: RestPressure | None = None) -> None:
        """Subtract u of kappa (N,) [m2/s] from the velocities and give the bodies their impulses.

        `rest` acts on the liquid by its slope, and not on the bodies.
        """
        seen = kappa if rest is None else kappa - rest.impulse
        self._pressure_velocity(seen, self._all)
        velocity = self._velocity[:, : self._count]
        velocity -= self._change[:, : self._count]
        if rest is not None:
            velocity[2] += self._neighbors.weight[: self._count] * rest.slope[: self._count]
        if self._response.present:
            self._response.accept(seen)

    def _pressure_velocity(self, kappa: Real, chosen: Index) -> None:
        self._team.run(
            pressure_velocity, chosen.size, chosen, self._neighbors.neighborhood, self._vectors, self._pairs.extrapolation, kappa,
            self._change, self._seen, self._push,
        )  # fmt: skip

    def _diverge(self, velocity: Real, rate: Real, chosen: Index) -> None:
        fluid = self._neighbors.neighborhood.fluid
        self._team.run(velocity_divergence, chosen.size, chosen, fluid, self._vectors, velocity, self._seen, rate)


class PartialOperator(System):
    """A among some particles, the pressure of all others as it is: the rest of the sea hears of it by an application of the whole."""

    def __init__(self, whole: PressureOperator, chosen: Index, around: Index, room: int) -> None:
        self._whole, self._chosen, self._around = whole, chosen, around
        self._kappa, self._rate = np.zeros((2, room), np.float32)

    def apply(self, kappa: Real, result: Real) -> None:
        """Write A kappa [1/s] into result, both (chosen,)."""
        self._kappa[self._chosen] = kappa
        self._whole.apply_to(self._kappa, self._rate, self._around, self._chosen)
        result[:] = self._rate[self._chosen]


@njit(**FAST)
def update_direction(begin, end, beta, change, direction):
    """Set `direction` to `change` + beta `direction`, (3, N) each [m/s]."""
    for axis in range(3):
        for k in range(begin, end, LANES):
            present = below(end, k)
            store(
                direction[axis], k, present, load(change[axis], k, present) + beta * load(direction[axis], k, present)
            )


@njit(**FAST)
def add_step(begin, end, length, direction, velocity):
    """Add length `direction` to `velocity`, (3, N) each [m/s]."""
    for axis in range(3):
        for k in range(begin, end, LANES):
            present = below(end, k)
            store(
                velocity[axis],
                k,
                present,
                load(velocity[axis], k, present) + length * load(direction[axis], k, present),
            )
