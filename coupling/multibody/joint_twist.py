"""Joints that resist a twist: fabric between two bodies, which turns one along when the other rolls about the line through both.

With t the unit mean of the bodies' own x axes, theta the angle from the first body's z axis to the second's about t, K the stiffness
[N m/rad] and tau the relaxation time [s] (Kelvin-Voigt), the first body gets the torque

    K (theta + tau t . (omega_b - omega_a)) t,

and the second its opposite. Bending is free. Symplectic Euler is stable as for lines (`coupling.multibody.lines`): along a chain of equal
bodies the stiffest mode turns neighbours against each other, with 4 K on each body.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from coupling.multibody.joint_constraints import PointJoint
from oilsim.backend.arrays import Array, Ints
from oilsim.backend.jit import njit
from oilsim.loads.body_axes import rotation_matrices


class Twists(NamedTuple):
    """The joints (J,) that resist a twist: first and second bodies, stiffness [N m/rad], relaxation time [s]."""

    first: Ints
    second: Ints
    stiffness: Array
    relaxation_time: Array


def twists_of(joints: Sequence[PointJoint]) -> Twists:
    """Return those of the joints that resist a twist; a joint to the world resists none."""
    stiff = [joint for joint in joints if joint.twisting_stiffness > 0.0 and joint.second >= 0]
    return Twists(
        np.array([joint.first for joint in stiff], dtype=np.int64),
        np.array([joint.second for joint in stiff], dtype=np.int64),
        np.array([joint.twisting_stiffness for joint in stiff], dtype=np.float64),
        np.array([joint.relaxation_time for joint in stiff], dtype=np.float64),
    )


def twist_torques(twists: Twists, pose: Array, twist: Array) -> Array:
    """Return the wrenches (B, 6) [N, N m] of all bodies, torques alone; pose (B, 7), twist (B, 6) [m/s, rad/s]."""
    wrench = np.zeros((len(pose), 6))
    if len(twists.first):
        _add_torques(twists, rotation_matrices(pose[:, 3:]), twist, wrench)
    return wrench


def longest_twist_step(twists: Twists, pose: Array, inverse_masses: Array, limit: float) -> float:
    """Return the longest stable sub-step [s] of the stiffest mode, `limit` of the 4 that the module's condition allows; none: infinite.

    pose (B, 7), inverse_masses (B, 6, 6) [1/(kg m2)] of bodies each by itself. Each body is taken to turn against two neighbours.
    """
    if not len(twists.first):
        return math.inf
    along = rotation_matrices(pose[:, 3:])[:, :, 0]
    mobility = np.einsum("bi,bij,bj->b", along, inverse_masses[:, 3:, 3:], along)
    both = 2.0 * twists.stiffness * (mobility[twists.first] + mobility[twists.second])
    elastic, damping = float(both.max()), float((both * twists.relaxation_time).max())
    return limit / (damping + math.sqrt(damping**2 + limit * elastic)) if elastic > 0.0 else math.inf


@njit(nogil=True, cache=True, error_model="numpy")
def _add_torques(twists: Twists, turn: Array, twist: Array, wrench: Array) -> None:
    """Add the torques to `wrench` (B, 6); turn (B, 3, 3) from the bodies' axes to the world's, twist (B, 6)."""
    along, across = np.empty(3), np.empty(3)
    for n in range(len(twists.first)):
        a, b = twists.first[n], twists.second[n]
        along[:] = turn[a, :, 0] + turn[b, :, 0]
        along /= max(math.sqrt((along**2).sum()), 1e-12)
        one, two = turn[a, :, 2], turn[b, :, 2]
        for axis in range(3):
            after, before = (axis + 1) % 3, (axis + 2) % 3
            across[axis] = one[after] * two[before] - one[before] * two[after]
        sine = (along * across).sum()
        cosine = (one * two).sum() - (along * one).sum() * (along * two).sum()
        rate = (along * (twist[b, 3:] - twist[a, 3:])).sum()
        torque = twists.stiffness[n] * (math.atan2(sine, cosine) + twists.relaxation_time[n] * rate)
        wrench[a, 3:] += torque * along
        wrench[b, 3:] -= torque * along
