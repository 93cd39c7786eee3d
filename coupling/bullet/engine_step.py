"""One sub-step of pybullet, in which angular momentum is kept to rounding and unknown forces are refused.

A wrench is given as the change of velocity that it makes, h = omega + dt I_0^-1 tau: pybullet would compute the same from it, and a force
that is never handed over cannot stay behind. pybullet changes the angular velocity with the inertia at the beginning of a sub-step and
turns the body afterwards:

    omega' = h + I_0^-1 (J - dt h x I_0 h),  J the impulses of joints and contacts
    R_1 = exp(dt omega') R_0

J = I_0 (omega' - h) + dt h x I_0 h is added with dt tau to the angular momentum, which is kept through the turn:
L_1 = L_0 + dt tau + J, omega_1 = I_1^-1 L_1. A body without joints gets the h that makes omega' the velocity of the middle of the
sub-step, I_m^-1 L_0 with R_m = exp(dt omega_0 / 2) R_0, plus dt I_0^-1 tau. This makes the turn second order. Without it, pybullet gains
9 % of the energy of a tumbling box in 10 s at 240 Hz.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.bullet.bullet_client import BulletBody, BulletClient
from coupling.multibody.contact_free_step import FreeBodies, step_without_contacts
from coupling.multibody.prescribed_motion import Motion, PrescribedMotion
from coupling.multibody.rigid_state import RigidBodyState
from coupling.multibody.rotations import applied, cross
from oilsim.backend.arrays import Array
from oilsim.backend.jit import njit

SPEED_LIMIT = 100.0  # [m/s] per component; no floating body is as fast
TURN_LIMIT = 1.0  # [rad] per component in a sub-step; faster turns are not resolved
FOREIGN = 1e-7  # relative to a body's momentum and impulses; rounding is far below, a forgotten force far above


@dataclass(eq=False)
class Body:
    """One body: its row in the state, its motion, and pybullet's part of it."""

    name: str
    row: int
    motion: str | PrescribedMotion
    bullet: BulletBody
    is_jointed: bool = False


class EngineStep:
    """The stepper of a client's bodies, which keeps `state` up to date."""

    def __init__(self, client: BulletClient, state: RigidBodyState, gravity: Array) -> None:
        self._client, self._state, self._gravity = client, state, gravity
        self.touched: set[tuple[int, int]] = set()  # unique ids of pairs in contact since this was emptied
        self.is_behind = False  # its bodies have not followed steps without it
        self._moved: tuple[Sequence[Body], FreeBodies] | None = None  # by the last step without it

    def forget(self) -> None:
        """Forget what is known of bodies, because bodies or joints were added or taken away."""
        self._moved = None

    def step_without_engine(self, free: Sequence[Body], wrench: Array, sub_step: float) -> None:
        """Move `free` bodies, which touch nothing, by `wrench` (B, 6) [N, N m] as `step` would.

        The engine's bodies follow when it is needed again.
        """
        state = self._state
        if self._moved is None or self._moved[0] is not free:
            rows, jointed = np.array([body.row for body in free]), np.array([body.is_jointed for body in free])
            self._moved = free, FreeBodies(rows, jointed, state.mass, state.inertia, state.own_inverse_inertia)
        bodies = self._moved[1]
        step_without_contacts(bodies, state.pose, state.twist, wrench, self._gravity, sub_step)
        self.is_behind = True
        _refuse_runaways(free, state.twist[bodies.row], sub_step)

    def catch_up(self, bodies: Sequence[Body]) -> None:
        """Put the engine's free `bodies` where the state says, if it was left behind."""
        if not self.is_behind:
            return
        self.is_behind = False
        for body in bodies:
            pose, twist = self._state.pose[body.row], self._state.twist[body.row]
            self._client.place(body.bullet, Motion(pose[:3], pose[3:], twist[:3], twist[3:]))

    def step(
        self, free: Sequence[Body], prescribed: Sequence[tuple[Body, Motion]], wrench: Array, sub_step: float
    ) -> None:
        """Move `free` bodies by `wrench` (B, 6) [N, N m] of all rows over `sub_step` [s], and `prescribed` ones to their places."""
        self.catch_up(free)
        rows, bullets, impulse = [body.row for body in free], [body.bullet for body in free], sub_step * wrench
        for body, target in prescribed:
            self._aim(body, target, sub_step)
        handed = self._handed_over(free, rows, impulse, sub_step)
        self._client.set_velocities(bullets, handed)
        self._client.step(sub_step)
        self.touched |= self._client.touching()
        self._read_back(free, rows, handed, impulse[rows], sub_step)

    def _aim(self, body: Body, target: Motion, sub_step: float) -> None:
        """Give a body on a prescribed motion the velocity that takes it to `target`, which joints and contacts then see.

        Gravity, which pybullet adds to the velocity first, is subtracted.
        """
        pose = self._state.pose[body.row]
        turn = Rotation.from_quat(target.orientation) * Rotation.from_quat(pose[3:]).inv()
        velocity = (target.position - pose[:3]) / sub_step - self._gravity * sub_step
        self._client.set_velocities([body.bullet], np.concatenate([velocity, turn.as_rotvec() / sub_step])[None])

    def _handed_over(self, free: Sequence[Body], rows: list[int], impulse: Array, sub_step: float) -> Array:
        """Compute the twists (F, 6) with which pybullet steps free bodies under impulses (B, 6) of all rows."""
        state = self._state
        handed = state.twist[rows]
        handed[:, :3] += impulse[rows, :3] / state.mass[rows, None]
        handed[:, 3:] += applied(state.inverse_inertia()[rows], impulse[rows, 3:])
        alone = [index for index, body in enumerate(free) if not body.is_jointed]
        if alone:
            handed[alone, 3:] = state.rates_for_midpoint(sub_step, impulse[:, 3:])[[rows[index] for index in alone]]
        return handed

    def _read_back(self, free: Sequence[Body], rows: list[int], handed: Array, impulse: Array, sub_step: float) -> None:
        """Read poses and velocities of free bodies after a sub-step with impulses (F, 6), and keep angular momentum (see the module)."""
        state = self._state
        pose, moving = self._client.read([body.bullet for body in free])
        _refuse_runaways(free, moving, sub_step)
        mass, momenta = state.mass[rows], state.momenta()[rows]
        gained = _gained(mass, state.world_inertia()[rows], handed, moving, sub_step)
        weight = sub_step * mass[:, None] * self._gravity
        self._refuse_foreign(free, _unexplained(gained, weight, np.abs(momenta) + np.abs(impulse)))
        state.pose[rows] = pose
        moving[:, 3:] = applied(state.inverse_inertia()[rows], (momenta + impulse + gained)[:, 3:])
        state.twist[rows] = moving

    def _refuse_foreign(self, free: Sequence[Body], unexplained: Array) -> None:
        """Raise RuntimeError for an impulse (6,) that no wrench, joint or contact explains: another program left a force pending."""
        hit = set(chain.from_iterable(self.touched))
        for index in np.flatnonzero(unexplained.any(axis=1)):
            body = free[int(index)]
            if not body.is_jointed and body.bullet.unique_id not in hit:
                raise RuntimeError(
                    f"body {body.name!r} gets an impulse of {unexplained[index].tolist()} N s and N m s that no wrench, joint or "
                    f"contact explains, allowed: forces by set_wrench and set_applied_wrench, none applied to the client directly"
                )


def _refuse_runaways(free: Sequence[Body], twists: Array, sub_step: float) -> None:
    """Raise FloatingPointError for a body at a speed that shows an unstable simulation."""
    if np.abs(twists).max() < min(SPEED_LIMIT, TURN_LIMIT / sub_step):
        return
    limits = np.repeat((SPEED_LIMIT, TURN_LIMIT / sub_step), 3)
    runaway = ~(np.abs(twists) < limits).all(axis=1)
    if runaway.any():
        first = int(np.argmax(runaway))
        raise FloatingPointError(
            f"body {free[first].name!r} moves at {twists[first].tolist()} m/s and rad/s, "
            f"allowed: below {SPEED_LIMIT:g} m/s and {limits[-1]:.3g} rad/s; its simulation is unstable"
        )


def _gained(mass: Array, inertia: Array, before: Array, after: Array, duration: float) -> Array:
    """Compute the impulses (B, 6) by which pybullet changed twists from `before` (B, 6) to `after` [N s, N m s]; see the module."""
    rate, gained = before[:, 3:], np.empty(before.shape)
    gained[:, :3] = mass[:, None] * (after - before)[:, :3]
    gained[:, 3:] = applied(inertia, after[:, 3:] - rate) + duration * cross(rate, applied(inertia, rate))
    return gained


@njit(nogil=True, cache=True, error_model="numpy")
def _unexplained(gained: Array, weight: Array, size: Array) -> Array:
    """Return the part of impulses (B, 6) that is not the weight's (B, 3); 0 if it is rounding of momenta of `size` (B, 6).

    Compiled, because so many array operations on a few rows would take as long as the engine's own step.
    """
    rest = gained.copy()
    rest[:, :3] -= weight
    for n in range(len(gained)):
        scale = size[n].max() + np.abs(gained[n]).max() + np.abs(weight[n]).max()
        if np.abs(rest[n]).max() <= FOREIGN * scale:
            rest[n] = 0.0
    return rest
