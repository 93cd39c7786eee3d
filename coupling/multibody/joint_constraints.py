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
line soon exceed."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from coupling.multibody.rotations import applied, cross
from coupling.multibody.skyline_cholesky import EnvelopeCholesky, Skyline, empty_skyline, skyline_of
from oilsim.backend.arrays import Array, Ints
from oilsim.backend.jit import njit
from oilsim.loads.body_axes import rotation_matrices

# Two swings of each of n links sum to sqrt(2 n) omega^2; a link alone, which turns about its middle, has sqrt(2) 4 omega^2: as much for 16
TOGETHER = 16
REGULAR = 1e-9  # relative to the mean diagonal of J W J^T and added to it, because two joints on a line hold one direction twice


@dataclass(frozen=True)
class PointJoint:
    """A joint between two rows, with the held point (3,) [m] along each body's axes; second row -1 is the world. It may hold the turn.

    twisting_stiffness [N m/rad] and relaxation_time [s]: see `coupling.multibody.joint_twist`.
    """

    first: int
    second: int
    first_point: Array
    second_point: Array
    holds_turn: bool = False
    twisting_stiffness: float = 0.0
    relaxation_time: float = 0.0


class Sides(NamedTuple):
    """The sides of all joints, one for each body that a joint holds.

    first row of J, sign, body, and number of rows, 3 or 6, each (S,) [1].
    """

    start: Ints
    sign: Array
    body: Ints
    rows: Ints


class Joints:
    """The joints among bodies as arrays, with one side for each body that a joint holds; constant while the bodies move.

    first_row: row of J of each joint in the given order. Joints of one body have rows close to each other. row_count: of J. pairs
    (P, 2): sides of the same body. first_entries (R,): column of the first entry of each row of J W J^T, if W is of bodies each by itself.
    """

    def __init__(self, joints: Sequence[PointJoint], body_count: int) -> None:
        self.first_row, self.body_count = _first_rows(joints, body_count), body_count
        sides = [
            (start, sign, body, _row_count(joint), point)
            for start, joint in zip(self.first_row, joints, strict=True)
            for sign, body, point in ((1.0, joint.first, joint.first_point), (-1.0, joint.second, joint.second_point))
            if body >= 0
        ]
        start, body, rows = (np.array([side[n] for side in sides], dtype=np.int64) for n in (0, 2, 3))
        self.sides = Sides(start, np.array([side[1] for side in sides], dtype=np.float64), body, rows)
        self._point = np.array([side[4] for side in sides], dtype=np.float64).reshape(-1, 3)
        self.row_count = sum(_row_count(joint) for joint in joints)
        of_body: dict[int, list[int]] = {}
        for side, row in enumerate(body.tolist()):
            of_body.setdefault(row, []).append(side)
        pairs = [pair for together in of_body.values() for pair in itertools.product(together, repeat=2)]
        self.pairs = np.array(pairs, dtype=np.int64).reshape(-1, 2)
        self.first_entries = np.arange(self.row_count)
        for one, other in pairs:
            own = slice(start[one], start[one] + rows[one])
            self.first_entries[own] = np.minimum(self.first_entries[own], start[other])
        self._held = np.zeros(self.row_count)  # minus the points of the world
        for first, joint in zip(self.first_row, joints, strict=True):
            if joint.second < 0:
                self._held[first : first + 3] = -joint.second_point

    def arms(self, pose: Array) -> Array:
        """Return the arms (S, 3) [m] from the centre of each held body to the held point, world frame; pose (B, 7)."""
        return applied(rotation_matrices(pose[self.sides.body, 3:]), self._point)

    def jacobian(self, arm: Array) -> Array:
        """Return J (R, 6 B), three rows for a joint and three more if it holds the turn; arm (S, 3) [m] from `arms`."""
        jacobian = np.zeros((self.row_count, 6 * self.body_count))
        _fill_spread(
            self.sides, arm, np.tile(np.eye(6), (self.body_count, 1, 1)), np.arange(6 * self.body_count), jacobian
        )
        return jacobian

    def bias(self, arm: Array, twist: Array) -> Array:
        """Return dJ/dt V (R,); arm (S, 3) [m] from `arms`; twist (B, 6) [m/s, rad/s]."""
        rate = twist[self.sides.body, 3:]
        return self._summed(self.sides.sign[:, None] * cross(rate, cross(rate, arm)))

    def stiffness(self, force: Array, arm: Array) -> Array:
        """Return K (B, 3, 3) [N m]: under constant joint forces (R,) [N], a body that turns by theta gets the torque -K theta.

        K = sum (f . r) 1 - r f^T, the symmetric part; `arm` (S, 3) from `arms`.
        """
        own = self.sides.sign[:, None] * force[self.sides.start[:, None] + np.arange(3)]
        outward = (own * arm).sum(axis=1)[:, None, None] * np.eye(3)
        stiffness = np.zeros((self.body_count, 3, 3))
        np.add.at(stiffness, self.sides.body, outward - arm[:, :, None] * own[:, None, :])
        return 0.5 * (stiffness + stiffness.transpose(0, 2, 1))

    def gaps(self, pose: Array, arm: Array) -> Array:
        """Return g (R,) [m], first point minus second; 0 in rows that hold the turn. `arm` (S, 3) from `arms`; pose (B, 7)."""
        return self._held + self._summed(self.sides.sign[:, None] * (pose[self.sides.body, :3] + arm))

    def _summed(self, values: Array) -> Array:
        """Return the sums (R,) of `values` (S, 3) of all sides, in the first three rows of each joint."""
        rows = self.sides.start[:, None] + np.arange(3)
        return np.bincount(rows.ravel(), values.ravel(), self.row_count).astype(np.float64)


class Articulation:
    """Joints among bodies at one instant.

    pose (B, 7) [m, 1], twist (B, 6) [m/s, rad/s]; inverse_mass without joints [1/kg, 1/(kg m), 1/(kg m2)]: (B, 6, 6) of bodies each by
    itself, or (6 B, 6 B).
    """

    def __init__(self, joints: Joints, pose: Array, twist: Array, inverse_mass: Array) -> None:
        self._joints, self._pose, self._twist = joints, pose, twist
        self._inverse_mass, self._arm = inverse_mass, joints.arms(pose)
        self._bias = joints.bias(self._arm, twist)
        if inverse_mass.ndim == 3:
            system = empty_skyline(joints.first_entries)
            _fill_system(joints.sides, self._arm, joints.pairs, inverse_mass, system)
        else:
            jacobian = joints.jacobian(self._arm)
            system = skyline_of(jacobian @ inverse_mass @ jacobian.T)
        mean = float(system.values[system.diagonal].sum()) / max(joints.row_count, 1)
        system.values[system.diagonal] += REGULAR * mean or 1.0  # nothing moves if motors hold everything
        self._system = EnvelopeCholesky(system)

    def inverse_mass(self, chosen: Ints | None = None) -> Array:
        """Return W_c [1/kg, 1/(kg m), 1/(kg m2)] (6 B, 6 B), or its rows and columns `chosen`."""
        size = 6 * self._joints.body_count
        columns = np.arange(size) if chosen is None else chosen
        if self._inverse_mass.ndim == 3:
            spread = np.zeros((self._joints.row_count, len(columns)))
            place = np.full(size, -1)
            place[columns] = np.arange(len(columns))
            _fill_spread(self._joints.sides, self._arm, self._inverse_mass, place, spread)
            body, axis = columns // 6, columns % 6
            answer, (one, other) = np.zeros((len(columns), len(columns))), np.nonzero(body[:, None] == body)
            answer[one, other] = self._inverse_mass[body[one], axis[one], axis[other]]
        else:
            spread = (self._joints.jacobian(self._arm) @ self._inverse_mass)[:, columns]
            answer = self._inverse_mass[columns[:, None], columns]
        half = self._system.half_solved(spread)
        return np.asarray(answer - half.T @ half)

    def acceleration(self, free: Array, step_size: float) -> Array:
        """Return a_c (B, 6) [m/s2, rad/s2] for accelerations `free` (B, 6) without joints; h is `step_size` [s]."""
        force = self._holding(free + self._twist / step_size, self._bias)
        return free + self._response(_transposed(self._joints.sides, self._arm, force, len(free)))

    def forces(self, free: Array, step_size: float, closing: float) -> tuple[Array, Array]:
        """Return forces (J, 3) [N] of joints on their first bodies, and the wrench J^T f (B, 6) of all; `free` and h as in `acceleration`.

        closing: share of the gaps that they close within h.
        """
        gaps = self._joints.gaps(self._pose, self._arm)
        force = self._holding(free + self._twist / step_size, closing / step_size**2 * gaps)
        rows = self._joints.first_row[:, None] + np.arange(3)
        return force[rows], _transposed(self._joints.sides, self._arm, force, len(free))

    def swing(self, free: Array, inverse_inertia: Array, enough: float) -> float:
        """Return a bound [rad/s] of the swing of bodies under their joints' forces; below `enough`, any such bound.

        The frequencies are those of W_c K, and not higher than those of W K for each body alone (Rayleigh: joints leave fewer motions).
        Only bodies that exceed `enough` by themselves are computed with joints: omega^4 = tr(A A) with A = W_c K, at least the square of
        its largest eigenvalue. The trace sums over all swings: for more than `TOGETHER` bodies of a chain it is a worse bound than that of
        the bodies alone, which holds then. `free` as in `acceleration`; inverse_inertia (B, 3, 3) [1/(kg m2)].
        """
        stiffness = self._joints.stiffness(self._holding(free, self._bias), self._arm)
        alone = _spectral_bound(inverse_inertia @ stiffness)
        fast = np.flatnonzero(alone > enough**2)
        rest = float(np.delete(alone, fast).max(initial=0.0))
        if fast.size == 0 or fast.size > TOGETHER:
            return math.sqrt(float(alone.max(initial=0.0)))
        answer = self.inverse_mass((6 * fast[:, None] + np.arange(3, 6)).ravel()).reshape(-1, fast.size, 3)
        together = np.einsum("abi,bij->abj", answer, stiffness[fast]).reshape(len(answer), -1)
        return math.sqrt(rest + float(_spectral_bound(together[None])[0]))

    def _holding(self, free: Array, besides: Array) -> Array:
        """Return forces (R,) [N, N m] of joints under which J a is -`besides` (R,), and without which it would be J `free` (B, 6)."""
        return -self._system.solved(_closing_rate(self._joints.sides, self._arm, free, besides))

    def _response(self, wrench: Array) -> Array:
        """Return the accelerations W w (B, 6) [m/s2, rad/s2] without joints under a wrench w (B, 6) [N, N m]."""
        if self._inverse_mass.ndim == 3:
            return applied(self._inverse_mass, wrench)
        return np.asarray((self._inverse_mass @ wrench.ravel()).reshape(wrench.shape))


@njit(nogil=True, cache=True, error_model="numpy")
def _spread_rows(sides: Sides, s: int, arm: Array, inverse_mass: Array, rows: Array) -> None:
    """Write J W of a side (its rows, 6) to `rows` (6, 6); inverse_mass (6, 6) of its body. J's rows are e_v + r x e_w, and e_w."""
    sign = sides.sign[s]
    for axis in range(3):
        after, before = (axis + 1) % 3, (axis + 2) % 3
        for column in range(6):
            # (v + omega x r)_axis = v_axis + omega_after r_before - omega_before r_after
            along = inverse_mass[axis, column] + inverse_mass[3 + after, column] * arm[s, before]
            rows[axis, column] = sign * (along - inverse_mass[3 + before, column] * arm[s, after])
            rows[3 + axis, column] = sign * inverse_mass[3 + axis, column]


@njit(nogil=True, cache=True, error_model="numpy")
def _add(system: Skyline, row: int, column: int, value: float) -> None:
    """Add `value` to an entry, if it lies in the lower half."""
    if column <= row:
        system.values[system.start[row] + column] += value


@njit(nogil=True, cache=True, error_model="numpy")
def _fill_system(sides: Sides, arm: Array, pairs: Ints, inverse_mass: Array, system: Skyline) -> None:
    """Add the lower half of J W J^T to `system` of R rows; arm (S, 3), pairs (P, 2), inverse_mass (B, 6, 6)."""
    rows, last = np.empty((6, 6)), -1
    for pair in pairs:
        s, t = pair[0], pair[1]
        if s != last:
            _spread_rows(sides, s, arm, inverse_mass[sides.body[s]], rows)
            last = s
        row, column, sign = sides.start[s], sides.start[t], sides.sign[t]
        if row < column:
            continue
        for i in range(sides.rows[s]):
            for axis in range(3):
                after, before = (axis + 1) % 3, (axis + 2) % 3
                across = rows[i, 3 + after] * arm[t, before] - rows[i, 3 + before] * arm[t, after]
                _add(system, row + i, column + axis, sign * (rows[i, axis] + across))
                if sides.rows[t] == 6:
                    _add(system, row + i, column + 3 + axis, sign * rows[i, 3 + axis])


@njit(nogil=True, cache=True, error_model="numpy")
def _fill_spread(sides: Sides, arm: Array, inverse_mass: Array, place: Ints, spread: Array) -> None:
    """Add J W to `spread` (R, N), whose columns `place` (6 B,) names, -1 for none; arm (S, 3), inverse_mass (B, 6, 6)."""
    rows = np.empty((6, 6))
    for s in range(len(sides.start)):
        _spread_rows(sides, s, arm, inverse_mass[sides.body[s]], rows)
        for column in range(6):
            chosen = place[6 * sides.body[s] + column]
            if chosen >= 0:
                for i in range(sides.rows[s]):
                    spread[sides.start[s] + i, chosen] += rows[i, column]


@njit(nogil=True, cache=True, error_model="numpy")
def _closing_rate(sides: Sides, arm: Array, motion: Array, besides: Array) -> Array:
    """Return J m + `besides` (R,) of a motion m (B, 6), a twist or an acceleration; arm (S, 3)."""
    result = besides.copy()
    for s in range(len(sides.start)):
        row, sign, own = sides.start[s], sides.sign[s], motion[sides.body[s]]
        for axis in range(3):
            after, before = (axis + 1) % 3, (axis + 2) % 3
            result[row + axis] += sign * (own[axis] + own[3 + after] * arm[s, before] - own[3 + before] * arm[s, after])
            if sides.rows[s] == 6:
                result[row + 3 + axis] += sign * own[3 + axis]
    return result


@njit(nogil=True, cache=True, error_model="numpy")
def _transposed(sides: Sides, arm: Array, force: Array, body_count: int) -> Array:
    """Return the wrenches J^T f (B, 6) [N, N m] of joint forces f (R,) [N, N m]; arm (S, 3)."""
    wrench = np.zeros((body_count, 6))
    for s in range(len(sides.start)):
        row, sign, own = sides.start[s], sides.sign[s], wrench[sides.body[s]]
        for axis in range(3):
            after, before = (axis + 1) % 3, (axis + 2) % 3
            own[axis] += sign * force[row + axis]
            own[3 + axis] += sign * (arm[s, after] * force[row + before] - arm[s, before] * force[row + after])
            if sides.rows[s] == 6:
                own[3 + axis] += sign * force[row + 3 + axis]
    return wrench


def _spectral_bound(matrices: Array) -> Array:
    """Return upper bounds (n,) of the largest eigenvalues of matrices (n, k, k) with real eigenvalues."""
    return np.sqrt(np.maximum(np.einsum("bij,bji->b", matrices, matrices), 0.0))


def _row_count(joint: PointJoint) -> int:
    """Return the number of rows of J that a joint takes."""
    return 6 if joint.holds_turn else 3


def _first_rows(joints: Sequence[PointJoint], body_count: int) -> Ints:
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
