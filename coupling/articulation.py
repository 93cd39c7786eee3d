"""How jointed bodies answer impulses together: the inverse mass and the free acceleration of a constrained system.

Joints hold points together, J V = 0 with rows (v + omega x r)_a - (v + omega x r)_b, and omega_a - omega_b where they hold the turn too.
Gauss's principle gives

    W_c = W - W J^T (J W J^T)^-1 J W,                         twist by impulse, joints included, W without them
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
        rows = [self._hold(joint, pose) for joint in joints]
        self._jacobian = np.concatenate([np.zeros((0, twist.size)), *(jacobian for jacobian, _ in rows)])
        self._bias = np.concatenate([np.zeros(0), *(bias for _, bias in rows)])
        spread = self._inverse_mass @ self._jacobian.T
        system = self._jacobian @ spread
        system[np.diag_indices_from(system)] += REGULAR * np.trace(system) / max(len(system), 1)
        self._answer = np.linalg.solve(system, spread.T) if len(system) else np.zeros((0, twist.size))
        self._spread = spread

    def inverse_mass(self) -> Array:
        """W_c (6 B, 6 B) [1/kg, 1/(kg m), 1/(kg m2)]."""
        constrained = self._inverse_mass - self._spread @ self._answer
        return 0.5 * (constrained + constrained.T)

    def acceleration(self, free: Array, step_size: float) -> Array:
        """a_c (B, 6) for accelerations `free` (B, 6) that the bodies would have without joints; h is `step_size` [s]."""
        error = self._jacobian @ free.ravel() + self._bias + self._jacobian @ self._twist.ravel() / step_size
        return free - (self._answer.T @ error).reshape(free.shape)

    def _hold(self, joint: PointJoint, pose: Array) -> tuple[Array, Array]:
        """Rows of J (3 or 6, 6 B) of one joint, and of dJ/dt V."""
        count = 6 if joint.holds_turn else 3
        jacobian, bias = np.zeros((count, self._twist.size)), np.zeros(count)
        for sign, body, point in ((1.0, joint.first, joint.first_point), (-1.0, joint.second, joint.second_point)):
            if body < 0:
                continue
            arm = Rotation.from_quat(pose[body, 3:]).apply(point)
            linear, angular = slice(6 * body, 6 * body + 3), slice(6 * body + 3, 6 * body + 6)
            jacobian[:3, linear] += sign * np.eye(3)
            jacobian[:3, angular] -= sign * _cross_matrix(arm)
            jacobian[3:, angular] += sign * np.eye(3)[: count - 3]
            rate = self._twist[body, 3:]
            bias[:3] += sign * np.cross(rate, np.cross(rate, arm))
        return jacobian, bias


def _cross_matrix(arm: Array) -> Array:
    """[r]x with [r]x w = r x w."""
    x, y, z = arm
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
