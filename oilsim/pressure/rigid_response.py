"""Bodies that answer inside the pressure solve: one system for fluid and bodies, stable for the lightest boom.

A body of free twist V* and inverse mass M^-1 that receives the impulse P moves with V = V* + M^-1 P. The impulse is what the walls'
part of H (see `divergence`) takes from the liquid,

    P = V rho_ref sum_i [J_i kappa_i + N_i sum_j G_ij kappa_j],
    J_i = w sum_b (G_ib, r_b x G_ib) - N_i sum_j G_ij,     N_i = sum_b (G_ib, r_b x G_ib) x_ib^T (c B)_i,

N being the wrench that the extrapolated pressure adds. By the transpose of the same terms the liquid sees the body move:

    (H^T v)_i -= J_i . V,   and neighbours see (1 + K_j)^T v_j - N_j^T V instead of (1 + K_j)^T v_j.

The system stays symmetric; bodies tied by joints share one M^-1. Lagged forces diverge once the added mass exceeds the body's; this has
no such limit.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.jit import ALLOCATING, FAST
from oilsim.boundaries.walls import Contacts, Walls, add_wrench
from oilsim.gradients.gradient_correction import times_symmetric
from oilsim.neighborhood.neighbor_search import nearest_images

Real = NDArray[np.float32]
Double = NDArray[np.float64]


@njit(**ALLOCATING)
def extend_contacts(
    contacts, points, wall, period, walls, wall_gradient, wall_weight, resting, owner, arm, lever, jacobian, reach
):
    """Fill J (K, 6) and N (K, 6, 3) of the module's docstring from contacts whose jacobian is sum_b (G_ib, r_b x G_ib).

    lever (N, 9): c_i B_i, as six, and sum_j G_ij of the particles that bodies touch (see `wall_extrapolation`).
    """
    single = np.zeros((1, 6), np.float32)
    for c in range(contacts.particle.size):
        i = contacts.particle[c]
        reach[c] = 0.0
        for k in range(walls.start[i], walls.start[i] + np.int64(walls.number[i])):
            b = walls.neighbor[k]
            if b < resting or owner[b - resting] != contacts.body[c]:
                continue
            dx, dy, dz = nearest_images(
                wall[b, 0] - points[i, 0], wall[b, 1] - points[i, 1], wall[b, 2] - points[i, 2], period
            )
            along = times_symmetric(dx, dy, dz, lever[i])
            single[0] = 0.0
            add_wrench(single, 0, arm, b - resting, wall_gradient[0, k], wall_gradient[1, k], wall_gradient[2, k])
            for row in range(6):
                for axis in range(3):
                    reach[c, row, axis] += single[0, row] * along[axis]
        for row in range(6):
            n = reach[c, row]
            extrapolated = n[0] * lever[i, 6] + n[1] * lever[i, 7] + n[2] * lever[i, 8]
            jacobian[c, row] = wall_weight * contacts.jacobian[c, row] - extrapolated


@njit(**FAST)
def gather_impulses(contacts, push, kappa, scale, impulse):
    """impulse (bodies, 6) = scale sum over contacts of kappa_i J_i + N_i push_i, in float64; `push` as from `pressure_velocity`."""
    impulse[:] = 0.0
    for c in range(contacts.particle.size):
        i = contacts.particle[c]
        value = scale * kappa[i]
        for axis in range(6):
            impulse[contacts.body[c], axis] += value * contacts.jacobian[c, axis]
        if push is not None:
            sx, sy, sz = scale * push[i, 0], scale * push[i, 1], scale * push[i, 2]
            for axis in range(6):
                n = contacts.reach[c, axis]
                impulse[contacts.body[c], axis] += n[0] * sx + n[1] * sy + n[2] * sz


@njit(**FAST)
def answer_impulses(inverse_mass, impulse, twist):
    """twist (6 bodies,) = M^-1 impulse; too small for a linear algebra library, whose threads would take the fluid's cores."""
    for row in range(impulse.size):
        value = 0.0
        for column in range(impulse.size):
            value += inverse_mass[row, column] * impulse[column]
        twist[row] = value


@njit(**FAST)
def scatter_twists(contacts, twist, sign, rate):
    """rate_i += sign J_i . twist of the body, over all contacts."""
    for c in range(contacts.particle.size):
        value = 0.0
        for axis in range(6):
            value += contacts.jacobian[c, axis] * twist[contacts.body[c], axis]
        rate[contacts.particle[c]] += sign * value


@njit(**FAST)
def scatter_seen(contacts, twist, sign, seen):
    """seen_i += sign N_i^T twist of the body, over all contacts; nothing where walls do not extrapolate."""
    for c in range(contacts.reach.shape[0]):
        for axis in range(3):
            value = 0.0
            for row in range(6):
                value += contacts.reach[c, row, axis] * twist[contacts.body[c], row]
            seen[contacts.particle[c], axis] += sign * value


@njit(**FAST)
def add_compliance(contacts, inverse_mass, scale, diagonal):
    """diagonal_i += scale J_i . M^-1 J_i, over all contacts."""
    for c in range(contacts.particle.size):
        body = contacts.body[c]
        value = 0.0
        for row in range(6):
            for column in range(6):
                value += contacts.jacobian[c, row] * inverse_mass[body, row, column] * contacts.jacobian[c, column]
        diagonal[contacts.particle[c]] += scale * value


class RigidResponse:
    """The bodies' part of one pressure solve. Twists stay as they are until impulses are handed over."""

    def __init__(self, walls: Walls, contacts: Contacts, push: Real | None, scale: float) -> None:
        """push: as from `pressure_velocity`, None where walls do not extrapolate; scale: V rho_ref [kg], what turns kappa times J into an
        impulse."""
        self._walls, self._contacts, self._push, self._scale = walls, contacts, push, scale
        count = len(walls.moving)
        self._inverse_mass = walls.inverse_mass()
        self._impulse, self._answer = np.zeros((2, count, 6))
        self._way, self._collected = np.zeros((2, 2, count, 6))

    @property
    def present(self) -> bool:
        """Whether any particle touches a moving body."""
        return bool(self._contacts.particle.size)

    def show_motion(self, seen: Real) -> None:
        """What neighbours of touching particles see of the bodies' present motion; before the divergence is taken."""
        scatter_seen(self._contacts, self._walls.twists(), -1.0, seen)

    def add_motion(self, rate: Real) -> None:
        """rate -= J . V, the part of C_i that the bodies' present motion makes."""
        scatter_twists(self._contacts, self._walls.twists(), -1.0, rate)

    def add_compliance(self, diagonal: Real) -> None:
        """Add the bodies' part to the diagonal."""
        count = len(self._impulse)
        blocks = self._inverse_mass.reshape(count, 6, count, 6)[np.arange(count), :, np.arange(count), :]
        add_compliance(self._contacts, np.ascontiguousarray(blocks), self._scale, diagonal)

    def answer(self, kappa: Real) -> None:
        """Let the bodies answer the impulses of `kappa` and its push; `show_answer` and `add_answer` tell the liquid."""
        self._gather(kappa)
        answer_impulses(self._inverse_mass, self._impulse.reshape(-1), self._answer.reshape(-1))

    def show_answer(self, seen: Real) -> None:
        """What neighbours of touching particles see of the answer; before the divergence is taken."""
        scatter_seen(self._contacts, self._answer, 1.0, seen)

    def add_answer(self, rate: Real) -> None:
        """Add the answer's part to the operator's product."""
        scatter_twists(self._contacts, self._answer, 1.0, rate)

    def accept(self, kappa: Real) -> None:
        """Hand the impulses of `kappa` to the bodies."""
        self.answer(kappa)
        self.turn(0.0)
        self.collect(1.0)
        self.hand_over()

    def turn(self, share: float) -> None:
        """The way to collect along becomes the last answer, and `share` of the way so far."""
        self._way = share * self._way + np.stack([self._impulse, self._answer])

    def collect(self, length: float) -> None:
        """Keep `length` times the way for the bodies."""
        self._collected += length * self._way

    def hand_over(self) -> None:
        """Hand the bodies what was collected for them."""
        for body, impulse, answer in zip(self._walls.moving.values(), *self._collected, strict=True):
            body.impulse = body.impulse + impulse
            body.twist = body.twist + answer
        self._collected[:] = 0.0

    def _gather(self, kappa: Real) -> None:
        gather_impulses(self._contacts, self._push, kappa, self._scale, self._impulse)
