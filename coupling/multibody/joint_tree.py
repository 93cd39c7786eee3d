"""The answer of a tree of joints to impulses, in the coordinates of the joints, in which joints cannot separate.

Twists of the links (6 L) follow from the rates q' of the tree's free coordinates, V = S q'; the base's own six are among them unless it is
fixed. With M = blockdiag(m 1, I) of the links,

    W_c = S (S^T M S)^-1 S^T                                              twist by impulse,
    a_c = S (S^T M S)^-1 S^T (f - M b) + b,   b = dS/dt q',               acceleration by the wrenches f.

A joint holds its point and its axes in both links. Seen from the parent p, with the joint's point j in the child c moving at the rate s
along its slides and the child turning at the rate w about its hinges,

    b_j = b_p + beta_p x r_pj + omega_p x (omega_p x r_pj) + 2 omega_p x s,     beta_c = beta_p + omega_p x w,
    b_c = b_j + beta_c x r_jc + omega_c x (omega_c x r_jc).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from oilsim.backend.arrays import Array


def cross(first: Array, second: Array) -> Array:
    """Compute first x second, (3,) or (3, K) each [-]; ten times faster than numpy's for the many single vectors of a tree."""
    (a, b, c), (x, y, z) = first, second
    return np.array([b * z - c * y, c * x - a * z, a * y - b * x])


def no_axes() -> Array:
    """Return no axes (0, 3) [-], for a joint without freedoms of one kind."""
    return np.zeros((0, 3))


@dataclass(frozen=True, kw_only=True, eq=False)
class TreeLink:
    """One link at one instant, world frame.

    Attributes:
        parent: index of its parent link, which is before it in the tree; -1 for the base.
        position: (3,) of the centre of mass [m]; twist: (6,) [m/s, rad/s].
        mass: [kg]; inertia: (3, 3) about the centre of mass [kg m2].
        joint_point: (3,) [m]; for the base, anything.
        slides, turns: (k, 3) unit axes along and about which it moves freely against its parent.
    """

    parent: int
    position: Array
    twist: Array
    mass: float
    inertia: Array
    joint_point: Array
    slides: Array = field(default_factory=no_axes)
    turns: Array = field(default_factory=no_axes)


class ArticulatedTree:
    """The links of one body, base first; `is_fixed`: the base does not move under forces."""

    def __init__(self, links: list[TreeLink], *, is_fixed: bool) -> None:
        self._links = links
        self._freedoms = [0 if is_fixed else 6, *(len(link.slides) + len(link.turns) for link in links[1:])]
        freedoms = sum(self._freedoms)
        self._motion = np.zeros((len(links), 6, freedoms))  # S
        self._bias = np.zeros((len(links), 6))  # b
        if not is_fixed:
            self._motion[0, :, :6] = np.eye(6)
        at = 0 if is_fixed else 6
        for index, link in enumerate(links[1:], 1):
            at = self._hang(index, link, links[link.parent], at)
        self._momentum = np.array([self._mass_times(link, s) for link, s in zip(links, self._motion, strict=True)])
        matrix = np.einsum("lak,lan->kn", self._motion, self._momentum)
        self._inverse = np.zeros((freedoms, freedoms))
        # the other coordinates have no inertia, and pybullet does not move them
        loaded = np.flatnonzero(matrix.diagonal() > 0.0)
        axes = np.ix_(loaded, loaded)
        self._inverse[axes] = np.linalg.inv(matrix[axes])

    def inverse_mass(self) -> Array:
        """Return W_c, (6 L, 6 L) [1/kg, 1/(kg m), 1/(kg m2)]."""
        motion = self._motion.reshape(6 * len(self._links), -1)
        return motion @ self._inverse @ motion.T

    def mobility(self) -> Array:
        """Return the largest rate change (L,) by an impulse along a link's own freedoms, 0 without any [1/kg, 1/(kg m2)]."""
        parts = np.split(np.diagonal(self._inverse), np.cumsum(self._freedoms)[:-1])
        return np.array([part.max(initial=0.0) for part in parts])

    def acceleration(self, gravity: Array) -> Array:
        """Return accelerations (L, 6) [m/s2, rad/s2] under gravity (3,) [m/s2] and the links' own turning."""
        return self._motion @ (self._inverse @ self._forces(gravity)) + self._bias

    def rate_changes(self, gravity: Array, wrenches: Array) -> Array:
        """Return d q'/dt (n,) [m/s2, rad/s2] under gravity (3,) [m/s2], the links' own turning and wrenches (L, 6) [N, N m]."""
        return self._inverse @ (self._forces(gravity) + np.einsum("lan,la->n", self._motion, wrenches))

    def _forces(self, gravity: Array) -> Array:
        """Compute S^T (f - M b) of weight and turning."""
        force = np.zeros(len(self._inverse))
        for n, link in enumerate(self._links):
            wrench = -self._mass_times(link, self._bias[n])
            wrench[:3] += link.mass * gravity
            wrench[3:] -= cross(link.twist[3:], link.inertia @ link.twist[3:])
            force += self._motion[n].T @ wrench
        return force

    def _hang(self, index: int, link: TreeLink, parent: TreeLink, at: int) -> int:
        """Set columns and bias of a link from its parent's; `at` is its first own column. Return that of the next link."""
        to_joint, to_center = link.joint_point - parent.position, link.position - link.joint_point
        of_parent = self._motion[link.parent]
        motion = self._motion[index]
        motion[3:] = of_parent[3:]
        motion[:3] = of_parent[:3] + cross(of_parent[3:], to_joint + to_center)
        for axis in link.slides:
            motion[:3, at] = axis
            at += 1
        for axis in link.turns:
            motion[:3, at], motion[3:, at] = cross(axis, to_center), axis
            at += 1
        rate, turn = parent.twist[3:], link.twist[3:]
        slip = link.twist[:3] - cross(turn, to_center) - parent.twist[:3] - cross(rate, to_joint)
        linear, angular = self._bias[link.parent, :3], self._bias[link.parent, 3:]
        at_joint = linear + cross(angular, to_joint) + cross(rate, cross(rate, to_joint)) + 2 * cross(rate, slip)
        own = angular + cross(rate, turn - rate)
        self._bias[index, :3] = at_joint + cross(own, to_center) + cross(turn, cross(turn, to_center))
        self._bias[index, 3:] = own
        return at

    @staticmethod
    def _mass_times(link: TreeLink, motion: Array) -> Array:
        """Multiply rows of linear and angular motion (6, ...) by M."""
        return np.concatenate([link.mass * motion[:3], link.inertia @ motion[3:]])
