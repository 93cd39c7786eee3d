"""How jointed bodies answer impulses together: the inverse mass and the free acceleration of a constrained system.

Joints hold points together, J V = 0 with rows (v + omega x r)_a - (v + omega x r)_b. Gauss's principle gives

    W_c = W - W J^T (J W J^T)^-1 J W,                         twist by impulse, joints included, W = blockdiag(M^-1)
    a_c = a - W J^T (J W J^T)^-1 (J a + dJ/dt V + J V / h),   acceleration by known forces, joints included,

where J V / h takes back within a step what the joints have drifted. With these the fluid knows what a chain of bodies will do when it
presses on one of them; a free body's inverse mass in their place, with the joint forces of the step before, winds up and blows up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

Array = npt.NDArray[np.float64]

REGULAR = 1e-9  # of the mean diagonal of J W J^T, added to it: two joints on a line hold one direction twice


@dataclass(frozen=True)
class PointJoint:
    """Rows of two bodies and the held point along each one's axes [m]; second row -1 is the world."""

    first: int
    second: int
    first_point: Array
    second_point: Array


class Articulation:
    """Joints among bodies at one instant; pose (B, 7), twist (B, 6), inverse_mass (B, 6, 6)."""

    def __init__(self, joints: list[PointJoint], pose: Array, twist: Array, inverse_mass: Array) -> None:
        count = len(pose)
        self._twist = twist
        self._inverse_mass = _block_diagonal(inverse_mass)
        self._jacobian = np.zeros((3 * len(joints), 6 * count))
        self._bias = np.zeros(3 * len(joints))
        for n, joint in enumerate(joints):
            rows = slice(3 * n, 3 * n + 3)
            for sign, body, point in ((1.0, joint.first, joint.first_point), (-1.0, joint.second, joint.second_point)):
                if body < 0:
                    continue
                arm = Rotation.from_quat(pose[body, 3:]).apply(point)
                self._jacobian[rows, 6 * body : 6 * body + 3] += sign * np.eye(3)
                self._jacobian[rows, 6 * body + 3 : 6 * body + 6] -= sign * _cross_matrix(arm)
                rate = twist[body, 3:]
                self._bias[rows] += sign * np.cross(rate, np.cross(rate, arm))
        spread = self._inverse_mass @ self._jacobian.T
        system = self._jacobian @ spread
        system[np.diag_indices_from(system)] += REGULAR * np.trace(system) / max(len(system), 1)
        self._answer = np.linalg.solve(system, spread.T) if len(system) else np.zeros((0, 6 * count))
        self._spread = spread

    def inverse_mass(self) -> Array:
        """W_c (6 B, 6 B) [1/kg, 1/(kg m), 1/(kg m2)]."""
        constrained = self._inverse_mass - self._spread @ self._answer
        return 0.5 * (constrained + constrained.T)

    def acceleration(self, free: Array, step_size: float) -> Array:
        """a_c (B, 6) for accelerations `free` (B, 6) that the bodies would have without joints; h is `step_size` [s]."""
        error = self._jacobian @ free.ravel() + self._bias + self._jacobian @ self._twist.ravel() / step_size
        return free - (self._answer.T @ error).reshape(free.shape)


def _block_diagonal(blocks: Array) -> Array:
    count, size, _ = blocks.shape
    matrix = np.zeros((count, size, count, size))
    matrix[np.arange(count), :, np.arange(count), :] = blocks
    return matrix.reshape(count * size, count * size)


def _cross_matrix(arm: Array) -> Array:
    """[r]x with [r]x w = r x w."""
    x, y, z = arm
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
