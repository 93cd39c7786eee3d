"""The pressure operator of one step, liquid and bodies together: its application, the compression of a motion, and its effect."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.jit import FAST
from oilsim.backend.simd import LANES, below, load, store
from oilsim.core.state import Confinement, FluidState
from oilsim.neighborhood.neighbor_search import indices, mark_around
from oilsim.pressure.bounded_solver import Index, System
from oilsim.pressure.pressure_gradient import pressure_velocity, seen_velocity, velocity_divergence
from oilsim.pressure.rest_pressure import RestPressure
from oilsim.pressure.rigid_response import RigidResponse, extend_jacobians, sum_reach
from oilsim.step.step_arrays import StepArrays
from oilsim.step.step_tools import StepTools

Real = NDArray[np.float32]


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


def with_neighbors(tools: StepTools, arrays: StepArrays, state: FluidState, group: Index) -> NDArray[np.bool_]:
    """Return a mask (awake,) of the awake particles that belong to a group (K,) of indices or have a neighbour in it."""
    near = np.zeros(state.listed, np.uint8)
    tools.team.run(mark_around, group.size, group, arrays.neighborhood.fluid, near)
    return near[: state.awake].view(np.bool_)


def pressure_response(tools: StepTools, arrays: StepArrays, push: Real | None) -> RigidResponse:
    """Make the response of bodies to pressures, extrapolated ones too where there are levers.

    push (N, 3): the sums sum_j G_ij kappa_j [m/s] of `pressure_velocity`, by which extrapolated pressures act; None where there are none.
    """
    walls, contacts, neighborhood, constants = tools.walls, arrays.contacts, arrays.neighborhood, tools.constants
    if arrays.lever is not None and contacts.particle.size:
        jacobian = np.empty_like(contacts.jacobian)
        reach = np.empty((*jacobian.shape, 3), np.float32)
        sum_reach(
            contacts, arrays.body_pairs, arrays.points, walls.points, neighborhood.period, arrays.wall_gradient, arrays.lever, reach
        )  # fmt: skip
        extend_jacobians(contacts, arrays.lever, constants.wall_weight, reach, jacobian)
        contacts = contacts._replace(jacobian=jacobian, reach=reach)
    return RigidResponse(walls, contacts, push, float(constants.volume) * constants.reference_density)


class PressureOperator(System):
    """A = H^T (rho_ref / rho_0) H with the responses of moving bodies (see `pressure_gradient` and `rigid_response`)."""

    def __init__(self, tools: StepTools, arrays: StepArrays, state: FluidState) -> None:
        self._tools, self._arrays, self._state, self._count = tools, arrays, state, state.awake
        self._filled = state.confinement == Confinement.FILLED
        self._all, self._vectors = np.arange(self._count, dtype=np.uint32), arrays.vectors
        self._push = np.empty((self._count, 3), np.float32) if arrays.lever is not None else None
        self._response = pressure_response(tools, arrays, self._push)
        self._change, self._direction = np.empty((2, 3, state.listed), np.float32)
        self._seen = np.empty((state.listed, 4), np.float32)
        self._change[:, self._count :] = self._direction[:, self._count :] = 0.0  # what sleeps
        self._seen[self._count :] = 0.0
        if self._response.present:
            self._response.add_compliance(arrays.diagonal)

    def compression_rate(self) -> Real:
        """Return H^T v (N,) [1/s] of the present velocities and the bodies' present motion (Qiu et al. 2021, Eq. 14)."""
        velocity = self._state.velocity
        rate = np.zeros(self._state.listed, np.float32)
        arrays = self._arrays
        walls = arrays.neighborhood.walls
        self._tools.team.run(seen_velocity, self._count, walls, arrays.extrapolation, velocity, self._seen)
        if self._response.present:
            self._response.show_motion(self._seen)
        self._diverge(velocity, rate, self._all)
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
        near = with_neighbors(self._tools, self._arrays, self._state, group)
        near[self._arrays.touching] = True  # by which bodies find the pressure on them
        return PartialOperator(self, group, indices(near), self._state.listed)

    def centre(self, values: Real) -> None:
        """Subtract the mean of the values (N,) [1/s] from them in a filled box."""
        if self._filled:
            values -= np.float32(values.mean(dtype=np.float64))

    def correct(self, residual: Real, free: Real, correction: Real) -> None:
        """Add to the correction (N,) [m2/s] the coarse grid's correction of a residual (N,) [1/s] in the free set (N,).

        0 in a filled box.
        """
        if not self._filled:
            self._tools.coarse.correct(residual, free, correction)

    def set_direction(self, beta: float) -> None:
        """Set the search direction to the velocities of the last application plus `beta` times the last direction."""
        if beta == 0.0:
            self._direction, self._change = self._change, self._direction
        else:
            self._tools.team.run(update_direction, self._count, np.float32(beta), self._change, self._direction)
        if self._response.present:
            self._response.set_direction(beta)

    def take_step(self, length: float) -> None:
        """Move the velocities with kappa, which has moved by -length along the search direction; bodies wait for `hand_over`."""
        self._tools.team.run(add_step, self._count, np.float32(length), self._direction, self._state.velocity)
        if self._response.present:
            self._response.collect(-length)

    def hand_over(self) -> None:
        """Give the bodies the impulses of all steps that were taken."""
        if self._response.present:
            self._response.hand_over()

    def accelerate(self, kappa: Real, rest: RestPressure | None = None) -> None:
        """Subtract u of kappa (N,) [m2/s] from the velocities and give the bodies their impulses; `rest` acts by its slope."""
        self._pressure_velocity(kappa if rest is None else kappa - rest.impulse, self._all)
        velocity = self._state.velocity[:, : self._count]
        velocity -= self._change[:, : self._count]
        if rest is not None:
            velocity[2] += self._arrays.weight[: self._count] * rest.slope[: self._count]
        if self._response.present:
            if rest is not None:
                self._pressure_velocity(kappa, self._arrays.touching)  # for the push of the whole pressure
            self._response.accept(kappa)

    def _pressure_velocity(self, kappa: Real, chosen: Index) -> None:
        arrays = self._arrays
        self._tools.team.run(
            pressure_velocity, chosen.size, chosen, arrays.neighborhood, self._vectors, arrays.extrapolation, kappa, self._change,
            self._seen, self._push,
        )  # fmt: skip

    def _diverge(self, velocity: Real, rate: Real, chosen: Index) -> None:
        fluid = self._arrays.neighborhood.fluid
        self._tools.team.run(velocity_divergence, chosen.size, chosen, fluid, self._vectors, velocity, self._seen, rate)


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
