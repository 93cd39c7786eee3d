"""The state of many rigid bodies as arrays with one row for each body, and its momentum, energy and compliance.

Frames and reference points as in `coupling.master.participant`: centre of mass, world axes.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.master.saved_fields import SavedFields
from coupling.multibody.prescribed_motion import Motion
from coupling.multibody.rotations import applied, cross, in_world
from coupling.solids.bodies import MassProperties
from oilsim.backend.arrays import Array, Flags
from oilsim.backend.jit import njit

ALL = slice(None)
MOVING = ("pose", "twist", "wrench", "applied_wrench", "line_wrench", "reaction", "earlier_reaction")
SEA = ("sea_wrench", "sea_load")  # of the environment; computed anew wherever a state is restored


class RigidBodyState(SavedFields):
    """The rows of bodies.

    Attributes:
        pose: (B, 7) position [m], orientation xyzw.
        twist: (B, 6) linear [m/s] and angular velocity [rad/s].
        wrench: (B, 6) of the fluid [N, N m].
        applied_wrench: (B, 6) of other known causes, without gravity [N, N m].
        line_wrench: (B, 6) of elastic lines [N, N m].
        reaction: (B, 6) of joints and contacts, mean over the last step [N, N m]; earlier_reaction: over the step before.
        mass: (B,) [kg]; inertia: (B, 3, 3) along the body's axes [kg m2]; own_inverse_inertia: its inverses, 0 where a body is not free.
        is_free: (B,) true for bodies that move under forces.
        sea_wrench: (B, 6) of the environment, mean over the last step [N, N m].
        sea_load: (B, 6) of the environment at the present instant, before the bodies answer it [N, N m].
        resistance: (B, 6, 6) what the environment adds to the mass matrices, A + h D of `environment`; None without an environment.
    """

    name = "rigid bodies"
    STATE = MOVING

    def __init__(self) -> None:
        self.pose = np.zeros((0, 7))
        self.twist = np.zeros((0, 6))
        self.wrench = np.zeros((0, 6))
        self.applied_wrench = np.zeros((0, 6))
        self.line_wrench = np.zeros((0, 6))
        self.reaction = np.zeros((0, 6))
        self.earlier_reaction = np.zeros((0, 6))
        self.mass = np.zeros(0)
        self.inertia: Array = np.zeros((0, 3, 3))
        self.is_free = np.zeros(0, dtype=bool)
        self.sea_wrench = np.zeros((0, 6))
        self.sea_load = np.zeros((0, 6))
        self.resistance: Array | None = None
        self._resisted: Array = np.zeros((0, 6, 6))  # inverse masses of all bodies with that resistance
        self.own_inverse_inertia: Array = np.zeros((0, 3, 3))
        self._ease = np.zeros(0)  # 1 / mass, 0 for a fixed or prescribed body
        self._kept: tuple[Array, Array, Array] | None = None  # poses (B, 7), and the inertias at them

    def append(self, properties: MassProperties, start: Motion, *, is_free: bool) -> None:
        """Add the row of a body."""
        self.pose = np.vstack([self.pose, pose_of(start)])
        self.twist = np.vstack([self.twist, twist_of(start)])
        for key in (*MOVING[2:], *SEA):
            setattr(self, key, np.vstack([getattr(self, key), np.zeros(6)]))
        self.mass = np.append(self.mass, properties.mass)
        self.inertia = np.concatenate([self.inertia, properties.inertia[None]])
        self.own_inverse_inertia = np.asarray(np.linalg.inv(self.inertia), dtype=np.float64)
        self.is_free = np.append(self.is_free, is_free)
        self.own_inverse_inertia[~self.is_free] = 0.0
        self._ease = np.where(self.is_free, 1.0 / self.mass, 0.0)

    def _at_pose(self) -> tuple[Array, Array]:
        """Return `world_inertia` and `inverse_inertia`, which are kept until a body moves."""
        if self._kept is None or not np.array_equal(self._kept[0], self.pose):
            inertia = in_world(self.pose[:, 3:], self.inertia)
            self._kept = (self.pose.copy(), inertia, in_world(self.pose[:, 3:], self.own_inverse_inertia))
        return self._kept[1:]

    def world_inertia(self) -> Array:
        """Return R I R^T (B, 3, 3) [kg m2]; it must not be written to."""
        return self._at_pose()[0]

    def inverse_inertia(self) -> Array:
        """Return the inverses of R I R^T (B, 3, 3) [1/(kg m2)], 0 for a fixed or prescribed body; it must not be written to."""
        return self._at_pose()[1]

    def momenta(self) -> Array:
        """Return m v [kg m/s] and R I R^T omega about each centre of mass [kg m2/s], (B, 6)."""
        angular = applied(self.world_inertia(), self.twist[:, 3:])
        return np.hstack([self.mass[:, None] * self.twist[:, :3], angular])

    def gyroscopic_torque(self, rows: slice = ALL) -> Array:
        """Return omega x (I omega) (B, 3) [N m] of the bodies of these rows."""
        rate = self.twist[rows, 3:]
        return cross(rate, applied(self.world_inertia()[rows], rate))

    def rates_for_midpoint(self, duration: float, impulse: Array) -> Array:
        """Return angular velocities (B, 3) [rad/s] from which an explicit gyroscopic step leads to the middle of a free turn.

        The step of `duration` [s] leads to omega_m = I_m^-1 L with R_m = exp(duration omega / 2) R, plus the effect of `impulse` (B, 3) [N
        m s]: h = omega_m + I^-1 impulse + duration I^-1 (h x I h), by iteration (each round gains an order in duration).
        """
        if len(self.pose) == 0:
            return np.zeros((0, 3))
        inertia = self.world_inertia()
        half_turn = Rotation.from_rotvec(0.5 * duration * self.twist[:, 3:]).as_matrix()
        middle = half_turn @ inertia @ half_turn.transpose(0, 2, 1)
        target = np.linalg.solve(middle, self.momenta()[:, 3:, None])[:, :, 0]
        target += np.linalg.solve(inertia, impulse[:, :, None])[:, :, 0]
        rate = target
        for _ in range(2):
            torque = cross(rate, applied(inertia, rate))
            rate = target + duration * np.linalg.solve(inertia, torque[:, :, None])[:, :, 0]
        return rate

    def resist(self, rows: list[int], resistance: Array) -> None:
        """Let the environment add `resistance` (n, 6, 6) [kg, kg m, kg m2] to the mass matrices of these rows, until it is set again."""
        self.resistance = np.zeros((len(self.pose), 6, 6))
        self.resistance[rows] = resistance
        self._resisted = np.zeros((len(self.pose), 6, 6))
        if not _carry(self.mass, self.world_inertia(), self.resistance, self.is_free, self._resisted):
            raise FloatingPointError(
                "the mass matrix of a body at sea is not positive definite; its simulation is unstable"
            )

    def inverse_masses(self) -> Array:
        """Return the twist by impulse of each body (B, 6, 6), with what the environment adds to its mass; 0 where not free."""
        if self.resistance is not None:
            return self._resisted
        blocks = np.zeros((len(self.pose), 6, 6))
        blocks[:, range(3), range(3)] = self._ease[:, None]
        blocks[:, 3:, 3:] = self.inverse_inertia()
        return blocks

    def inverse_mass(self, row: int) -> Array:
        """Return the twist by impulse of one body (6, 6) [1/kg, 1/(kg m2)], diag(1 / m, (R I R^T)^-1) without an environment."""
        if self.resistance is not None:
            return self._resisted[row].copy()
        matrix = np.zeros((6, 6))
        matrix[:3, :3] = np.eye(3) * self._ease[row]
        matrix[3:, 3:] = self.inverse_inertia()[row]
        return matrix

    def mass_matrix(self, row: int) -> Array:
        """Return the impulse by twist (6, 6) [kg, kg m2], diag(m, R I R^T)."""
        rotation = Rotation.from_quat(self.pose[row, 3:]).as_matrix()
        matrix = np.zeros((6, 6))
        matrix[:3, :3] = np.eye(3) * self.mass[row]
        matrix[3:, 3:] = rotation @ self.inertia[row] @ rotation.T
        return matrix

    def free_acceleration(self, row: int, gravity: Array) -> Array:
        """Return d(twist)/dt (6,) [m/s2, rad/s2] of a free body by everything but the fluid.

        M^-1 (applied wrench + lines + lasting reaction of joints and contacts) + gravity, and - I^-1 omega x I omega.
        """
        lasting = steady(self.earlier_reaction[row], self.reaction[row])
        return self.known_accelerations(gravity, slice(row, row + 1))[0] + self.inverse_mass(row) @ lasting

    def known_accelerations(self, gravity: Array, rows: slice = ALL) -> Array:
        """Return accelerations (B, 6) [m/s2, rad/s2] as `free_acceleration`, without joints and contacts; 0 where not free."""
        return self.accelerations_under(
            self.applied_wrench[rows] + self.line_wrench[rows] + self.sea_load[rows], gravity, rows
        )

    def accelerations_under(self, wrench: Array, gravity: Array, rows: slice = ALL) -> Array:
        """Return accelerations (B, 6) [m/s2, rad/s2] by a wrench (B, 6), gravity and turning; 0 where not free."""
        torque = wrench[:, 3:] - self.gyroscopic_torque(rows)
        if self.resistance is not None:
            force = wrench[:, :3] + self.mass[rows, None] * gravity
            return applied(self._resisted[rows], np.hstack([force, torque]))
        acceleration = np.empty(wrench.shape)
        acceleration[:, :3] = self._ease[rows, None] * wrench[:, :3] + self.is_free[rows, None] * gravity
        acceleration[:, 3:] = applied(self.inverse_inertia()[rows], torque)
        return acceleration

    def settle_reaction(self, momenta_before: Array, duration: float, gravity: Array) -> None:
        """Record as reaction of joints and contacts the change of momentum (B, 6) [kg m/s] that known wrenches do not explain."""
        self.earlier_reaction = self.reaction
        known = self.wrench + self.applied_wrench + self.line_wrench + self.sea_wrench
        known[:, :3] += self.mass[:, None] * gravity
        self.reaction = (self.momenta() - momenta_before) / duration - known
        self.reaction[~self.is_free] = 0.0

    def let_go(self, rows: tuple[int, int]) -> None:
        """Forget the reactions on two bodies between which a joint parts: what held them does not last."""
        self.reaction[list(rows)] = self.earlier_reaction[list(rows)] = 0.0

    def total_momentum(self) -> Array:
        """Return the momentum (6,) of the free bodies: linear [kg m/s], angular about the world's origin [kg m2/s]."""
        momenta = self.momenta()
        momenta[:, 3:] += cross(self.pose[:, :3], momenta[:, :3])
        return momenta[self.is_free].sum(axis=0)

    def energy(self, gravity: Array) -> float:
        """Return the kinetic and potential energy [J] of the free bodies; potential energy is 0 at the origin. gravity (3,) [m/s2]."""
        kinetic = 0.5 * np.einsum("bi,bi->b", self.momenta(), self.twist)
        potential = -self.mass * (self.pose[:, :3] @ gravity)
        return float((kinetic + potential)[self.is_free].sum())


def steady(earlier: Array, later: Array) -> Array:
    """Return the lasting part of two successive values (B, 6) [-], each in its unit: the smaller if they agree in sign, else 0.

    The pull of a rope lasts; an impact of one step does not, and the fluid must not take it for a lasting force.
    """
    return np.where(earlier * later > 0.0, np.sign(later) * np.minimum(np.abs(earlier), np.abs(later)), 0.0)


@njit(nogil=True, cache=True, error_model="numpy")
def _carry(mass: Array, inertia: Array, resistance: Array, is_free: Flags, inverse: Array) -> bool:
    """Write (diag(m, I) + resistance)^-1 of free bodies to `inverse` (B, 6, 6), by Cholesky's factor; tell whether all have one.

    mass (B,) [kg], inertia (B, 3, 3) [kg m2], resistance (B, 6, 6) [kg, kg m, kg m2], symmetric.
    """
    factor, column = np.zeros((6, 6)), np.zeros(6)
    for b in range(len(mass)):
        if not is_free[b]:
            continue
        for i in range(6):
            for j in range(i + 1):
                value = resistance[b, i, j]
                if i >= 3 and j >= 3:
                    value += inertia[b, i - 3, j - 3]
                elif i == j:
                    value += mass[b]
                for k in range(j):
                    value -= factor[i, k] * factor[j, k]
                if j < i:
                    factor[i, j] = value / factor[j, j]
                elif value > 0.0:
                    factor[i, i] = np.sqrt(value)
                else:
                    return False
        for unit in range(6):
            for i in range(6):
                value = 1.0 if i == unit else 0.0
                for k in range(i):
                    value -= factor[i, k] * column[k]
                column[i] = value / factor[i, i]
            for i in range(5, -1, -1):
                value = column[i]
                for k in range(i + 1, 6):
                    value -= factor[k, i] * inverse[b, k, unit]
                inverse[b, i, unit] = value / factor[i, i]
    return True


def pose_of(motion: Motion) -> Array:
    """Return position [m] and orientation xyzw (7,)."""
    return np.concatenate([motion.position, motion.orientation])


def twist_of(motion: Motion) -> Array:
    """Return linear [m/s] and angular velocity [rad/s] (6,)."""
    return np.concatenate([motion.linear_velocity, motion.angular_velocity])
