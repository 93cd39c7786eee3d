"""Bodies that answer inside the pressure solve: one system for fluid and bodies, stable for the lightest boom.

A body of free twist V* and inverse mass M^-1 that receives P = V rho_ref sum_i kappa_i J_i moves with V = V* + M^-1 P. Seen by the fluid,

    source:    C_i(v*)     - J_i . V*,
    operator:  (A kappa)_i + J_i . M^-1 V rho_ref sum_k J_k kappa_k,       diagonal + V rho_ref J_i . M^-1 J_i,

which keeps the system symmetric; bodies tied by joints share one M^-1.
Lagged forces diverge once the added mass exceeds the body's; this has no such limit.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.smoothing_kernels import FAST
from oilsim.walls import Contacts, Walls

Real = NDArray[np.float32]
Double = NDArray[np.float64]


@njit(**FAST)
def gather_impulses(contacts, kappa, scale, impulse):
    """impulse (bodies, 6) = scale sum over contacts of kappa J, in float64."""
    impulse[:] = 0.0
    for c in range(contacts.particle.size):
        value = scale * kappa[contacts.particle[c]]
        for axis in range(6):
            impulse[contacts.body[c], axis] += value * contacts.jacobian[c, axis]


@njit(**FAST)
def answer_impulses(inverse_mass, impulse, twist):
    """twist (bodies, 6) = M^-1 impulse; too small for a linear algebra library, whose threads would take the fluid's cores."""
    count = impulse.shape[0]
    for row in range(6 * count):
        value = 0.0
        for column in range(6 * count):
            value += inverse_mass[row, column] * impulse[column // 6, column % 6]
        twist[row // 6, row % 6] = value


@njit(**FAST)
def scatter_twists(contacts, twist, sign, rate):
    """rate_i += sign J_i . twist of the body, over all contacts."""
    for c in range(contacts.particle.size):
        value = 0.0
        for axis in range(6):
            value += contacts.jacobian[c, axis] * twist[contacts.body[c], axis]
        rate[contacts.particle[c]] += sign * value


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
    """The bodies' part of one pressure solve. Twists are the free ones until `accept` hands the impulses over."""

    def __init__(self, walls: Walls, contacts: Contacts, scale: float) -> None:
        """scale: V rho_ref [kg], what turns kappa / rho_ref times J into an impulse."""
        self._walls, self._contacts, self._scale = walls, contacts, scale
        count = len(walls.moving)
        self._inverse_mass = walls.inverse_mass()
        self._impulse, self._answer = np.zeros((2, count, 6))

    @property
    def present(self) -> bool:
        """Whether any particle touches a moving body."""
        return bool(self._contacts.particle.size)

    def add_motion(self, rate: Real) -> None:
        """rate -= J . V, the part of C_i that the bodies' present motion makes."""
        twist = np.array([body.twist for body in self._walls.moving.values()])
        scatter_twists(self._contacts, twist, -1.0, rate)

    def add_compliance(self, diagonal: Real) -> None:
        """Add the bodies' part to the diagonal."""
        count = len(self._impulse)
        blocks = self._inverse_mass.reshape(count, 6, count, 6)[np.arange(count), :, np.arange(count), :]
        add_compliance(self._contacts, np.ascontiguousarray(blocks), self._scale, diagonal)

    def add_answer(self, kappa: Real, rate: Real) -> None:
        """Add the bodies' part of the operator's product with kappa."""
        gather_impulses(self._contacts, kappa, self._scale, self._impulse)
        answer_impulses(self._inverse_mass, self._impulse, self._answer)
        scatter_twists(self._contacts, self._answer, 1.0, rate)

    def accept(self, kappa: Real) -> None:
        """Hand the impulses of `kappa` to the bodies."""
        gather_impulses(self._contacts, kappa, self._scale, self._impulse)
        self._walls.receive(self._impulse)
