"""The common answer of jointed bodies to impulses: the inverse mass and the free acceleration of a constrained system.

Joints hold points together, J V = 0 with rows (v + omega x r)_a - (v + omega x r)_b, and omega_a - omega_b if they hold the turn, too.
Gauss's principle gives

    W_c = W - W J^T (J W J^T)^-1 J W,                         twist by impulse, joints included, W without them
    a_c = a - W J^T (J W J^T)^-1 (J a + dJ/dt V + J V / h),   acceleration by known forces, joints included,

where J V / h corrects within a step the drift of the joints. With these the fluid knows the motion of a chain of bodies when it presses on
one of them; with a free body's inverse mass instead, and the joint forces of the step before, the simulation becomes unstable.

The engine is given the joints' own forces, f = -(J W J^T)^-1 (J a + J V / h + e g / h^2), with g the gaps, of which the part e should close
in a step h. The engine closes joints one by one, in rounds. It would leave most of a pull to the next step if a light body, such as a tow
line, is between heavy ones, or if a chain is long.

Under these forces bodies swing as strings under tension do: a body that turns by theta gets the torque -K theta, with the sum over its
joints, at the arms r, K = sum (f . r) 1 - r f^T. Symplectic Euler is stable for a swing while omega h < 2, which light links of a taut
line soon exceed.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from coupling.rigid.rotations import applied, cross, rotation_matrices
from coupling.rigid.skyline_cholesky import EnvelopeCholesky

Array = npt.NDArray[np.float64]

REGULAR = 1e-9  # relative to the mean diagonal of J W J^T and added to it, because two joints on a line hold one direction twice
AFTER, BEFORE = np.array([1, 2, 0]), np.array([2, 0, 1])  # axes, in cyclic order


@dataclass(frozen=True)
class PointJoint:
    """A joint between two rows, with the held point (3,) [m] along each body's axes; second row -1 is the world. It may hold the turn."""

    first: int
    second: int
    first_point: Array
    second_point: Array
    holds_turn: bool = False


class Joints:
    """The joints among bodies as arrays, with one row for each body that a joint holds; constant while the bodies move.

    first_row: row of J of each joint in the given order. Joints of one body have rows close to each other.
    """

    def __init__(self, joints: Sequence[PointJoint], body_count: int) -> None:
        self.first_row = _first_rows(joints, body_count)
        sides = [
            (start, sign, body, point, joint.holds_turn)
            for start, joint in zip(self.first_row, joints, strict=True)
            for sign, body, point in ((1.0, joint.first, joint.first_point), (-1.0, joint.second, joint.second_point))
            if body >= 0
        ]
        start = np.array([side[0] for side in sides], dtype=np.int64)
        self._sign = np.array([side[1] for side in sides], dtype=np.float64)
        self._body = np.array([side[2] for side in sides], dtype=np.int64)
        self._point = np.array([side[3] for side in sides], dtype=np.float64).reshape(-1, 3)
        turning = np.array([side[4] for side in sides], dtype=bool)
        self._row_count = sum(_row_count(joint) for joint in joints)
        self._row = start[:, None] + np.arange(3)
        column = 6 * self._body[:, None, None] + np.stack([np.arange(3), 3 + AFTER, 3 + BEFORE], axis=1)
        turn_row, turn_column = self._row[turning] + 3, 6 * self._body[turning, None] + 3 + np.arange(3)
        self._turn_sign = np.repeat(self._sign[turning], 3)
        row = np.concatenate([np.repeat(self._row.ravel(), 3), turn_row.ravel()])
        column = np.concatenate([column.ravel(), turn_column.ravel()])
        self._order = np.lexsort((column, row))
        row_start = np.concatenate([[0], np.cumsum(np.bincount(row, minlength=self._row_count))])
        shape = (self._row_count, 6 * body_count)
        self._pattern = csr_array((np.arange(len(row)), column[self._order], row_start), shape=shape)
        self._transposed = self._pattern.T.tocsr()
        self._held = np.zeros(self._row_count)  # minus the points of the world
        for start, joint in zip(self.first_row, joints, strict=True):
            if joint.second < 0:
                self._held[start : start + 3] = -joint.second_point

    def arms(self, pose: Array) -> Array:
        """Return the arms (S, 3) [m] from the centre of each held body to the held point, world frame; pose (B, 7)."""
        return applied(rotation_matrices(pose[self._body, 3:]), self._point)

    def jacobian(self, arm: Array, twist: Array) -> tuple[csr_array, csr_array, Array]:
        """Return J (R, 6 B), three rows for a joint and three more if it holds the turn, J^T, and dJ/dt V (R,).

        arm (S, 3) [m] from `arms`; twist (B, 6) [m/s, rad/s].
        """
        rate = twist[self._body, 3:]
        bend = self._sign[:, None] * cross(rate, cross(rate, arm))
        bias: Array = np.bincount(self._row.ravel(), bend.ravel(), self._row_count).astype(np.float64)
        # (v + omega x r)_axis = v_axis + omega_after r_before - omega_before r_after
        entries = self._sign[:, None, None] * np.stack([np.ones_like(arm), arm[:, BEFORE], -arm[:, AFTER]], axis=2)
        values = np.concatenate([entries.ravel(), self._turn_sign])[self._order]
        # copies, because scipy's checks of new matrices would take longer than all the rest
        jacobian, transposed = copy(self._pattern), copy(self._transposed)
        jacobian.data, transposed.data = values, values[self._transposed.data]
        return jacobian, transposed, bias

    def stiffness(self, force: Array, arm: Array, body_count: int) -> Array:
        """Return K (B, 3, 3) [N m]: under constant joint forces (R,) [N], a body that turns by theta gets the torque -K theta.

        K = sum (f . r) 1 - r f^T, the symmetric part; `arm` (S, 3) from `arms`.
        """
        own = self._sign[:, None] * force[self._row]
        outward = (own * arm).sum(axis=1)[:, None, None] * np.eye(3)
        stiffness = np.zeros((body_count, 3, 3))
        np.add.at(stiffness, self._body, outward - arm[:, :, None] * own[:, None, :])
        return 0.5 * (stiffness + stiffness.transpose(0, 2, 1))

    def gaps(self, pose: Array, arm: Array) -> Array:
        """Return g (R,) [m], first point minus second; 0 in rows that hold the turn. `arm` (S, 3) from `arms`; pose (B, 7)."""
        apart = self._sign[:, None] * (pose[self._body, :3] + arm)
        return self._held + np.bincount(self._row.ravel(), apart.ravel(), self._row_count)


class Articulation:
    """Joints among bodies at one instant; pose (B, 7) [m, 1], twist (B, 6) [m/s, rad/s], inverse_mass (6 B, 6 B) [1/kg] without joints."""

    def __init__(self, joints: Joints, pose: Array, twist: Array, inverse_mass: csr_array) -> None:
        self._joints, self._pose, self._twist = joints, pose, twist
        self._inverse_mass, self._arm = inverse_mass, joints.arms(pose)
        self._jacobian, self._transposed, self._bias = joints.jacobian(self._arm, twist)
        self._spread = self._jacobian @ inverse_mass
        system = (self._spread @ self._transposed).toarray()
        mean = float(np.trace(system)) / max(len(system), 1)
        system.flat[:: len(system) + 1] += REGULAR * mean or 1.0  # nothing moves if motors hold everything
        self._system = EnvelopeCholesky(system)
        self._answer: Array | None = None

    def inverse_mass(self, chosen: npt.NDArray[np.int64] | None = None) -> Array:
        """Return W_c [1/kg, 1/(kg m), 1/(kg m2)] (6 B, 6 B), or its rows and columns `chosen`; it must not be written to."""
        if self._answer is None:
            self._answer = self._inverse_mass.toarray()
            self._answer -= self._spread.T @ self._system.solved(self._spread.toarray())
        return self._answer if chosen is None else self._answer[chosen[:, None], chosen]

    def acceleration(self, free: Array, step_size: float) -> Array:
        """Return a_c (B, 6) [m/s2, rad/s2] for accelerations `free` (B, 6) without joints; h is `step_size` [s]."""
        error = self._jacobian @ (free + self._twist / step_size).ravel() + self._bias
        return free - (self._spread.T @ self._system.solved(error[:, None])[:, 0]).reshape(free.shape)

    def forces(self, free: Array, step_size: float, closing: float) -> tuple[Array, Array]:
        """Return forces (J, 3) [N] of joints on their first bodies, and the wrench J^T f (B, 6) of all; `free` and h as in `acceleration`.

        closing: share of the gaps that they close within h.
        """
        gaps = self._joints.gaps(self._pose, self._arm)
        force = self._holding(free + self._twist / step_size, closing / step_size**2 * gaps)
        rows = self._joints.first_row[:, None] + np.arange(3)
        return force[rows], (self._transposed @ force).reshape(free.shape)

    def swing(self, free: Array, inverse_inertia: Array, enough: float) -> float:
        """Return a bound [rad/s] of the swing of bodies under their joints' forces; below `enough`, any such bound.

        The frequencies are those of W_c K, and not higher than those of W K for each body alone (Rayleigh: joints leave fewer motions).
        Only bodies that exceed `enough` by themselves are computed with joints: omega^4 = tr(A A) with A = W_c K, at least the square of
        its largest eigenvalue. `free` as in `acceleration`; inverse_inertia (B, 3, 3) [1/(kg m2)].
        """
        stiffness = self._joints.stiffness(self._holding(free, self._bias), self._arm, len(free))
        alone = _spectral_bound(inverse_inertia @ stiffness)
        fast = np.flatnonzero(alone > enough**2)
        rest = float(np.delete(alone, fast).max(initial=0.0))
        if fast.size == 0:
            return math.sqrt(rest)
        answer = self.inverse_mass((6 * fast[:, None] + np.arange(3, 6)).ravel()).reshape(-1, fast.size, 3)
        together = np.einsum("abi,bij->abj", answer, stiffness[fast]).reshape(len(answer), -1)
        return math.sqrt(rest + float(_spectral_bound(together[None])[0]))

    def _holding(self, free: Array, besides: Array) -> Array:
        """Return forces (R,) [N, N m] of joints under which J a is -`besides` (R,), and without which it would be J `free` (B, 6)."""
        return -self._system.solved((self._jacobian @ free.ravel() + besides)[:, None])[:, 0]


def _spectral_bound(matrices: Array) -> Array:
    """Return upper bounds (n,) of the largest eigenvalues of matrices (n, k, k) with real eigenvalues."""
    return np.sqrt(np.maximum(np.einsum("bij,bji->b", matrices, matrices), 0.0))


def _row_count(joint: PointJoint) -> int:
    """Return the number of rows of J that a joint takes."""
    return 6 if joint.holds_turn else 3


def _first_rows(joints: Sequence[PointJoint], body_count: int) -> npt.NDArray[np.int64]:
    """Return the first row of J of every joint; joints that share a body are close to each other, so that rows of J W J^T are short."""
    holds = np.zeros((len(joints), body_count), dtype=np.int64)
    for index, joint in enumerate(joints):
        holds[index, [body for body in (joint.first, joint.second) if body >= 0]] = 1
    neighbors = csr_array(holds) @ csr_array(holds.T)
    order = reverse_cuthill_mckee(neighbors, symmetric_mode=True) if joints else np.zeros(0, dtype=np.int64)
    before = itertools.accumulate((_row_count(joints[index]) for index in order[:-1]), initial=0)
    first = np.zeros(len(joints), dtype=np.int64)
    first[order] = list(before)[: len(joints)]
    return first
