"""Links of a pybullet client that somebody else owns, as the partner of a fluid.

One step: `observe` reads where the links are and how they answer impulses, `set_wrench` tells what the fluid does to them, `advance`
lets that act over one step of the client, with the client's own time step and all its sub-steps. No setting of the client is changed.

Contacts, motors, damping and forces of the client's owner announce themselves to nobody. What a link's acceleration owes to them is
learnt after each step, and what lasts of it belongs to the link's free acceleration.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from coupling.bullet.links import LinkedBody, LinkKey, LinkSystem, read_links, read_loads
from coupling.bullet.pybullet_import import pybullet
from coupling.master.saved_fields import SavedFields
from coupling.multibody.rigid_state import steady
from oilsim.backend.arrays import Array


class Observation(NamedTuple):
    """Links as a step begins: gravity (3,) [m/s2] and time step [s] are the client's own, free_acceleration (L, 6) [m/s2, rad/s2] is that
    without the fluid.
    """

    system: LinkSystem
    free_acceleration: Array
    gravity: Array
    duration: float


class StepOutcome(NamedTuple):
    """Outcome of a step for the observed links: the fluid's wrenches [N, N m], the twists since [m/s, rad/s], and the accelerations that
    neither fluid, gravity nor joints explain [m/s2, rad/s2], all (L, 6).
    """

    before: Observation
    wrenches: Array
    twists: Array
    unexplained: Array


@dataclass(frozen=True)
class _Residual:
    """Unexplained acceleration (6,) of a link in the step before the last and in the last one, and its twist (6,) after that."""

    earlier: Array
    later: Array
    twist: Array


class ClientLinks(SavedFields):
    """All links of the bodies added; those named as they are added meet the fluid."""

    STATE = ("_bodies", "_wrenches")

    def __init__(self, client: int) -> None:
        self.client = client
        self.outcome: StepOutcome | None = None
        self._bodies: dict[int, LinkedBody] = {}
        self._wrenches: dict[LinkKey, Array] = {}  # of the links that meet the fluid
        self._residuals: dict[LinkKey, _Residual] = {}
        self._observed: Observation | None = None  # since the last step
        self._row: dict[LinkKey, int] = {}
        self._pose, self._twist = np.zeros((0, 7)), np.zeros((0, 6))
        self._acceleration, self._inverse_mass = np.zeros((0, 6)), np.zeros((0, 0))

    @property
    def bodies(self) -> Mapping[int, LinkedBody]:
        """The bodies by their unique ids, in the order in which they were added."""
        return self._bodies

    @property
    def met(self) -> tuple[LinkKey, ...]:
        """Links that meet the fluid, in the order in which they were added."""
        return tuple(self._wrenches)

    def add(self, body: LinkedBody, met: Iterable[LinkKey]) -> None:
        """Add a body, of whose links those of `met` meet the fluid."""
        self._bodies[body.unique_id] = body
        read_loads(self.client, [body])  # the client may have made steps already
        self._wrenches |= {key: np.zeros(6) for key in met}
        self._observed = None

    def remove(self, body: int) -> None:
        """Take a body out again, and forget what was learnt of it."""
        for key in self._bodies.pop(body).keys:
            self._residuals.pop(key, None)
            self._wrenches.pop(key, None)
        self._observed = None

    def observe(self) -> Observation:
        """Read the client; ValueError for settings that no step can be made with, and for a body that is lost or is another one.

        To be called once a step: motors and constraints are learnt from what changed since the last call.
        """
        duration, gravity = self._settings()
        system = read_links(self.client, self._bodies.values(), gravity, duration)
        self._row = {key: row for row, key in enumerate(system.keys)}
        self._pose, self._twist, self._acceleration = system.pose, system.twist, system.acceleration.copy()
        for key in self._wrenches:
            row = self._row[key]
            self._acceleration[row] += self._lasting(key, system.twist[row], duration)
        rows = [self._row[key] for key in self._wrenches]
        self._inverse_mass = _blocks(system.inverse_mass, rows)
        self._observed = Observation(system, self._acceleration, gravity, duration)
        return self._observed

    def observed(self) -> Observation:
        """Return what was observed since the last step, or observe if nothing was."""
        return self.observe() if self._observed is None else self._observed

    def pose(self, key: LinkKey) -> Array:
        """Return the pose (7,) of a link's centre of mass: position [m] and orientation xyzw, as observed or after the last step."""
        return self._pose[self._row[key]].copy()

    def twist(self, key: LinkKey) -> Array:
        """Return the twist (6,) [m/s, rad/s] of a link's centre of mass, as observed or after the last step."""
        return self._twist[self._row[key]].copy()

    def free_acceleration(self, key: LinkKey) -> Array:
        """Return the acceleration (6,) [m/s2, rad/s2] of a link without the fluid, as last observed."""
        return self._acceleration[self._row[key]].copy()

    def inverse_mass(self) -> Array:
        """Return the inverse mass matrix (6 n, 6 n) of the n links that meet the fluid, joints included, as last observed.

        It gives the changes of their twists by impulses on them; its blocks are in [1/kg, 1/(kg m), 1/(kg m2)].
        """
        return self._inverse_mass.copy()

    def wrench(self, key: LinkKey) -> Array:
        """Return the wrench (6,) [N, N m] of the fluid on a link, as last set; KeyError for a link that does not meet the fluid."""
        return self._wrenches[key].copy()

    def set_wrench(self, key: LinkKey, wrench: Array) -> None:
        """Let a wrench (6,) [N, N m] of the fluid act on a link in the steps to come."""
        self._wrenches[key] = wrench.copy()

    def advance(self) -> StepOutcome:
        """Make one step of the client under the wrenches as set."""
        before = self.observed()
        self._push(before.system)
        self._observed = None
        pybullet.stepSimulation(physicsClientId=self.client)
        self.outcome = self._learn(before)
        return self.outcome

    def save_state(self) -> dict[str, Any]:
        """Return everything that was learnt of the bodies, and the wrenches on them; the client saves their motion."""
        return super().save_state() | {"residuals": dict(self._residuals)}

    def require_same_bodies(self, saved: Mapping[str, Any]) -> None:
        """Refuse what `save_state` returned of other bodies; ValueError."""
        if saved["bodies"].keys() != self._bodies.keys():
            raise ValueError(
                f"state is of the bodies {', '.join(map(str, saved['bodies'])) or 'none'}, allowed: "
                f"{', '.join(map(str, self._bodies)) or 'none'}, which meet the fluid"
            )

    def restore_state(self, state: Any) -> None:
        """Go back to what `save_state` returned; ValueError for other bodies."""
        self.require_same_bodies(state)
        super().restore_state(state)
        self._residuals = dict(state["residuals"])
        self._observed = None

    def _settings(self) -> tuple[float, Array]:
        """The client's own time step [s] and gravity (3,) [m/s2]; ValueError for what no step can be made with."""
        parameters = pybullet.getPhysicsEngineParameters(physicsClientId=self.client)
        gravity = np.array([parameters[f"gravityAcceleration{axis}"] for axis in "XYZ"])
        duration = float(parameters["fixedTimeStep"])
        if not 0.0 < duration < np.inf:
            raise ValueError(f"the client's time step is {duration} s, allowed: setTimeStep above 0")
        if not np.isfinite(gravity).all():
            raise ValueError(f"the client's gravity is {gravity.tolist()} m/s2, allowed: setGravity of finite numbers")
        return duration, gravity

    def _lasting(self, key: LinkKey, twist: Array, duration: float) -> Array:
        """The part of a link's acceleration (6,) that lasts and that nothing known explains.

        A velocity that the owner sets between the steps counts as such.
        """
        if key not in self._residuals:
            return np.zeros(6)
        known = self._residuals[key]
        later = known.later + (twist - known.twist) / duration
        self._residuals[key] = _Residual(known.earlier, later, twist)
        return steady(known.earlier, later)

    def _push(self, system: LinkSystem) -> None:
        """Let the wrenches act over the coming step and all its sub-steps."""
        client, frame = self.client, pybullet.WORLD_FRAME
        moving = {system.keys[row][0] for row in np.flatnonzero(system.twist.any(axis=1))}
        for row in np.flatnonzero(system.is_free):
            wrench = self._wrenches.get(system.keys[row])
            if wrench is None or not wrench.any():
                continue
            body, link = system.keys[row]
            # what lies still may sleep, which nobody can ask for, and would feel nothing; waking it changes no setting of the body
            if body not in moving:
                moving.add(body)
                awake = pybullet.ACTIVATION_STATE_WAKE_UP
                pybullet.changeDynamics(body, -1, activationState=awake, physicsClientId=client)
            place = system.pose[row, :3].tolist()
            pybullet.applyExternalForce(body, link, wrench[:3].tolist(), place, frame, physicsClientId=client)
            pybullet.applyExternalTorque(body, link, wrench[3:].tolist(), frame, physicsClientId=client)

    def _learn(self, before: Observation) -> StepOutcome:
        """Read how the links move now, and keep what of their accelerations nothing known explains."""
        system, duration = before.system, before.duration
        wrenches = np.array([self._wrenches.get(key, np.zeros(6)) for key in system.keys])
        read_loads(self.client, self._bodies.values())
        motions = [body.motion() for body in self._bodies.values()]
        self._pose = np.concatenate([np.zeros((0, 7)), *(pose for pose, _ in motions)])
        twists = self._twist = np.concatenate([np.zeros((0, 6)), *(twist for _, twist in motions)])
        known = system.acceleration + (system.inverse_mass @ wrenches.ravel()).reshape(-1, 6)
        unexplained = (twists - system.twist) / duration - known
        for row in np.flatnonzero(system.is_free):
            key = system.keys[row]
            last = self._residuals.get(key)
            self._residuals[key] = _Residual(last.later if last else np.zeros(6), unexplained[row], twists[row])
        return StepOutcome(before, wrenches, twists, unexplained)


def _blocks(matrix: Array, rows: list[int]) -> Array:
    """The blocks of 6 by 6 in these rows and columns of a matrix (6 n, 6 n); itself if they are all, in order."""
    if rows == list(range(len(matrix) // 6)):
        return matrix
    axes = (6 * np.array(rows, dtype=int)[:, None] + np.arange(6)).ravel()
    return np.asarray(matrix[np.ix_(axes, axes)])
