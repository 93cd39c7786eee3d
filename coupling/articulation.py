"""How jointed bodies answer impulses together: the inverse mass and the free acceleration of a constrained system.

Joints hold points together, J V = 0 with rows (v + omega x r)_a - (v + omega x r)_b, and omega_a - omega_b where they hold the turn too.
Gauss's principle gives

    W_c = W - W J^T (J W J^T)^-1 J W,                         twist by impulse, joints included, W without them
    a_c = a - W J^T (J W J^T)^-1 (J a + dJ/dt V + J V / h),   acceleration by known forces, joints included,

where J V / h takes back within a step what the joints have drifted. With these the fluid knows what a chain of bodies will do when it
presses on one of them; a free body's inverse mass in their place, with the joint forces of the step before, winds up and blows up.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import cho_solve, solve_triangular
from scipy.sparse import csr_array

from coupling.rotations import rotation_matrices

Array = npt.NDArray[np.float64]

REGULAR = 1e-9  # of the mean diagonal of J W J^T, added to it: two joints on a line hold one direction twice


@dataclass(frozen=True)
class PointJoint:
    """Rows of two bodies and the held point along each one's axes [m]; second row -1 is the world. It may hold the turn too."""

    first: int
    second: int
    first_point: Array
    second_point: Array
    holds_turn: bool = False


class Articulation:
    """Joints among bodies at one instant; pose (B, 7), twist (B, 6), inverse_mass (6 B, 6 B) without them."""

    def __init__(self, joints: list[PointJoint], pose: Array, twist: Array, inverse_mass: Array) -> None:
        self._twist = twist
        self._inverse_mass = inverse_mass
        self._jacobian, self._bias = _hold(joints, rotation_matrices(pose[:, 3:]), twist)
        self._spread = (self._jacobian @ inverse_mass).T  # W is symmetric, and J has a few entries a row only
        system = self._jacobian @ self._spread
        system[np.diag_indices_from(system)] += REGULAR * np.trace(system) / max(len(system), 1)
        self._factor = np.linalg.cholesky(system)

    def inverse_mass(self, chosen: list[int] | None = None) -> Array:
        """W_c [1/kg, 1/(kg m), 1/(kg m2)] (6 B, 6 B), or its rows and columns `chosen`."""
        rows = slice(None) if chosen is None else chosen
        half = solve_triangular(self._factor, self._spread[rows].T, lower=True)
        return np.asarray(self._inverse_mass[rows][:, rows] - half.T @ half)

    def acceleration(self, free: Array, step_size: float) -> Array:
        """a_c (B, 6) for accelerations `free` (B, 6) that the bodies would have without joints; h is `step_size` [s]."""
        error = self._jacobian @ (free + self._twist / step_size).ravel() + self._bias
        return free - (self._spread @ cho_solve((self._factor, True), error)).reshape(free.shape)


def _hold(joints: list[PointJoint], rotations: Array, twist: Array) -> tuple[csr_array, Array]:
    """J (R, 6 B), three rows a joint and three more where it holds the turn, and dJ/dt V (R,)."""
    counts = np.array([6 if joint.holds_turn else 3 for joint in joints], dtype=np.int64)
    first_row = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    bias = np.zeros(first_row[-1])
    rows, columns, values = [], [], []
    for sign, side in ((1.0, "first"), (-1.0, "second")):
        held = [n for n, joint in enumerate(joints) if getattr(joint, side) >= 0]
        if not held:
            continue
        body = np.array([getattr(joints[n], side) for n in held])
        point = np.array([getattr(joints[n], f"{side}_point") for n in held])
        arm, rate, start = np.einsum("jab,jb->ja", rotations[body], point), twist[body, 3:], first_row[held]
        np.add.at(bias, start[:, None] + np.arange(3), sign * np.cross(rate, np.cross(rate, arm)))
        turning = np.array([joints[n].holds_turn for n in held])
        for row, column, value in _entries(arm, turning):
            chosen = turning if row >= 3 else np.ones(len(held), dtype=bool)
            rows.append(start[chosen] + row)
            columns.append(6 * body[chosen] + column)
            values.append(sign * value[chosen])
    if not rows:
        return csr_array((first_row[-1], twist.size)), bias
    entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    return csr_array(entries, shape=(first_row[-1], twist.size)), bias


def _entries(arm: Array, turning: npt.NDArray[np.bool_]) -> Iterator[tuple[int, int, Array]]:
    """Row, column and value (J,) of what a body's twist adds to a held point's velocity, v + omega x r, and to its turn."""
    one = np.ones(len(arm))
    for axis in range(3):
        after, before = (axis + 1) % 3, (axis + 2) % 3
        yield axis, axis, one
        yield axis, 3 + after, arm[:, before]  # (omega x r)_axis = omega_after r_before - omega_before r_after
        yield axis, 3 + before, -arm[:, after]
        if turning.any():
            yield 3 + axis, 3 + axis, one
