"""Bodies that respond inside the pressure solve: one system for fluid and bodies, which keeps the lightest boom stable.

A body of free twist V* and inverse mass M^-1 that receives the impulse P moves with V = V* + M^-1 P. The walls' part of H (see
`pressure_gradient`) takes this impulse from the liquid:

    P = V rho_ref sum_i [J_i kappa_i + N_i sum_j G_ij kappa_j],
    J_i = w sum_b (G_ib, r_b x G_ib) - N_i sum_j G_ij,     N_i = sum_b (G_ib, r_b x G_ib) x_ib^T (c B)_i,

N being the wrench that the extrapolated pressure adds (see `wall_extrapolation`). By the transpose of the same terms the liquid sees the
body move:

    (H^T v)_i -= J_i . V,   and neighbours see (1 + K_j)^T v_j - N_j^T V instead of (1 + K_j)^T v_j.

The system stays symmetric, and bodies tied by joints share one M^-1. Forces that lag by a step diverge once the added mass exceeds the
body's; this has no such limit.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from oilsim.backend.arrays import Real
from oilsim.backend.jit import ALLOCATING, FAST, ZERO
from oilsim.boundaries.contacts import Contacts, add_wrench
from oilsim.boundaries.walls import Walls
from oilsim.gradients.gradient_correction import times_symmetric
from oilsim.neighborhood.neighbor_search import nearest_images


@njit(**ALLOCATING)
def sum_reach(contacts, pairs, points, wall, period, wall_gradient, lever, reach):
    """Fill `reach` (K, 6, 3) with N of the module's docstring, one for each contact [1/m, 1].

    contacts       the step's `Contacts`, which name the contact of each pair
    pairs          the step's `BodyPairs`
    points         (N, 4) place [m] and weight of the particles
    wall           (M, 4) place [m] and volume of the wall particles
    period         lengths of periodic axes [m], None if there are none
    wall_gradient  (3, Q) G_ib, pair vectors of wall neighbours [1/m]
    lever          (N, 9) c_i B_i as six numbers, and sum_j G_ij, of the particles that bodies touch (see `wall_extrapolation`)
    """
    single = np.zeros((1, 6), np.float32)
    reach[:] = 0.0
    for n in range(pairs.particle.size):
        i, k, b, c = pairs.particle[n], pairs.pair[n], pairs.point[n], contacts.of_pair[n]
        dx, dy, dz = nearest_images(
            wall[b, 0] - points[i, 0], wall[b, 1] - points[i, 1], wall[b, 2] - points[i, 2], period
        )
        along = times_symmetric(dx, dy, dz, lever[i])
        single[0] = 0.0
        add_wrench(single, 0, pairs.arm, n, wall_gradient[0, k], wall_gradient[1, k], wall_gradient[2, k])
        for row in range(6):
            for axis in range(3):
                reach[c, row, axis] += single[0, row] * along[axis]


@njit(**FAST)
def extend_jacobians(contacts, lever, wall_weight, reach, jacobian):
    """Fill `jacobian` (K, 6) with J of the module's docstring [1/m, 1], from contacts whose own is sum_b (G_ib, r_b x G_ib).

    lever (N, 9), reach (K, 6, 3) as for `sum_reach`; wall_weight w [1].
    """
    for c in range(contacts.particle.size):
        i = contacts.particle[c]
        for row in range(6):
            n = reach[c, row]
            extrapolated = n[0] * lever[i, 6] + n[1] * lever[i, 7] + n[2] * lever[i, 8]
            jacobian[c, row] = wall_weight * contacts.jacobian[c, row] - extrapolated


@njit(**FAST)
def turn_freely(contacts, turns, owner):
    """Take from the contacts' wrenches their moment about the axes of bodies of revolution, which pressure does not turn.

    It acts along normals, which meet the axis. Sums over particles add moments, of which water's edge gives the most: some
    0.6 rho g d^2 R a metre brake a wheel that turns in the surface. turns (T, 6) [m, 1] and owner (T,) as from `Walls.turns`.
    """
    for c in range(contacts.particle.size):
        for t in range(owner.size):
            if owner[t] != contacts.body[c]:
                continue
            turn, wrench = turns[t], contacts.jacobian[c]
            moment = ZERO
            for row in range(6):
                moment += np.float32(turn[row]) * wrench[row]
            for row in range(3, 6):
                wrench[row] -= moment * np.float32(turn[row])
            for axis in range(3 if contacts.reach.size else 0):
                moment = ZERO
                for row in range(6):
                    moment += np.float32(turn[row]) * contacts.reach[c, row, axis]
                for row in range(3, 6):
                    contacts.reach[c, row, axis] -= moment * np.float32(turn[row])


@njit(**FAST)
def gather_impulses(contacts, push, kappa, scale, impulse):
    """Fill `impulse` (bodies, 6) with scale times the sum over contacts of kappa_i J_i + N_i push_i [N s, N m s], in float64.

    contacts: the step's `Contacts`; push (N, 3) as from `pressure_velocity` [m/s], None where walls do not extrapolate; kappa (N,) [m2/s];
    scale V rho_ref [kg].
    """
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
def twist_changes(inverse_mass, impulse, twist):
    """Fill `twist` (6 bodies,) [m/s, rad/s] with M^-1 times `impulse` (6 bodies,) [N s, N m s].

    inverse_mass: M^-1 (6 bodies, 6 bodies) [1/kg, 1/(kg m2)].

    The matrix is too small for a linear algebra library, whose threads would take the fluid's cores.
    """
    for row in range(impulse.size):
        value = 0.0
        for column in range(impulse.size):
            value += inverse_mass[row, column] * impulse[column]
        twist[row] = value


@njit(**FAST)
def scatter_twists(contacts, twist, sign, rate):
    """Add sign J_i . twist of the body to `rate` (N,) [1/s], over all contacts; twist (bodies, 6) [m/s, rad/s]."""
    for c in range(contacts.particle.size):
        value = 0.0
        for axis in range(6):
            value += contacts.jacobian[c, axis] * twist[contacts.body[c], axis]
        rate[contacts.particle[c]] += sign * value


@njit(**FAST)
def scatter_seen(contacts, twist, sign, seen):
    """Add sign N_i^T twist of the body to `seen` (N, 4) [m/s], over all contacts; twist (bodies, 6) [m/s, rad/s].

    Nothing is added where walls do not extrapolate.
    """
    for c in range(contacts.reach.shape[0]):
        for axis in range(3):
            value = 0.0
            for row in range(6):
                value += contacts.reach[c, row, axis] * twist[contacts.body[c], row]
            seen[contacts.particle[c], axis] += sign * value


@njit(**FAST)
def add_compliance(contacts, inverse_mass, scale, diagonal):
    """Add scale J_i . M^-1 J_i to `diagonal` (N,) [1/m2], over all contacts.

    inverse_mass (bodies, 6, 6): the bodies' own blocks of M^-1 [1/kg, 1/(kg m2)]; scale V rho_ref [kg].
    """
    for c in range(contacts.particle.size):
        body = contacts.body[c]
        value = 0.0
        for row in range(6):
            for column in range(6):
                value += contacts.jacobian[c, row] * inverse_mass[body, row, column] * contacts.jacobian[c, column]
        diagonal[contacts.particle[c]] += scale * value


class RigidResponse:
    """The bodies' part of one pressure solve; their twists stay as they are until impulses are handed over."""

    def __init__(self, walls: Walls, contacts: Contacts, push: Real | None, scale: float) -> None:
        """Start with bodies at their present twists.

        push (N, 3) as from `pressure_velocity` [m/s], None where walls do not extrapolate; scale V rho_ref [kg] turns kappa times J into an
        impulse.
        """
        self._walls, self._contacts, self._push, self._scale = walls, contacts, push, scale
        count = len(walls.moving)
        self._inverse_mass = walls.inverse_mass()
        self._impulse, self._change = np.zeros((2, count, 6))
        self._direction, self._collected = np.zeros((2, 2, count, 6))

    @property
    def present(self) -> bool:
        """Return whether any particle touches a moving body."""
        return bool(self._contacts.particle.size)

    def show_motion(self, seen: Real) -> None:
        """Add the bodies' present motion to what neighbours of touching particles see, `seen` (N, 4) [m/s]; before the divergence."""
        scatter_seen(self._contacts, self._walls.twists(), -1.0, seen)

    def add_motion(self, rate: Real) -> None:
        """Subtract J . V, the bodies' present motion, from the compression rate (N,) [1/s]."""
        scatter_twists(self._contacts, self._walls.twists(), -1.0, rate)

    def add_compliance(self, diagonal: Real) -> None:
        """Add the bodies' part to the operator's diagonal (N,) [1/m2]."""
        count = len(self._impulse)
        blocks = self._inverse_mass.reshape(count, 6, count, 6)[np.arange(count), :, np.arange(count), :]
        add_compliance(self._contacts, np.ascontiguousarray(blocks), self._scale, diagonal)

    def respond(self, kappa: Real) -> None:
        """Let the bodies respond to the impulses of kappa (N,) [m2/s] and its push; `show_response` and `add_response` show the liquid."""
        self._gather(kappa)
        twist_changes(self._inverse_mass, self._impulse.reshape(-1), self._change.reshape(-1))

    def show_response(self, seen: Real) -> None:
        """Add the response to what neighbours of touching particles see, `seen` (N, 4) [m/s]; before the divergence."""
        scatter_seen(self._contacts, self._change, 1.0, seen)

    def add_response(self, rate: Real) -> None:
        """Add the response's part to the operator's application (N,) [1/s]."""
        scatter_twists(self._contacts, self._change, 1.0, rate)

    def accept(self, kappa: Real) -> None:
        """Give the impulses of kappa (N,) [m2/s] to the bodies."""
        self.respond(kappa)
        self.set_direction(0.0)
        self.collect(1.0)
        self.hand_over()

    def set_direction(self, beta: float) -> None:
        """Set the search direction to the last response plus `beta` times the last direction; `collect` goes along it."""
        self._direction = beta * self._direction + np.stack([self._impulse, self._change])

    def collect(self, length: float) -> None:
        """Keep `length` times the search direction for the bodies until `hand_over`."""
        self._collected += length * self._direction

    def hand_over(self) -> None:
        """Give the bodies the impulses that were collected for them, and their changes of twist."""
        for body, impulse, change in zip(self._walls.moving.values(), *self._collected, strict=True):
            body.impulse = body.impulse + impulse
            body.twist = body.twist + change
        self._collected[:] = 0.0

    def _gather(self, kappa: Real) -> None:
        gather_impulses(self._contacts, self._push, kappa, self._scale, self._impulse)
