"""Warnings about pybullet's defaults that spoil physics in another program's world: each is given once, with the call that helps."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from coupling.bullet.client_links import StepOutcome
from coupling.bullet.links import LinkedBody
from coupling.bullet.pybullet_import import pybullet
from oilsim.backend.arrays import Array

DEFAULT_DAMPING = 0.04  # [1/s] and [1/m]: pybullet's, of every link unless changeDynamics sets another
BRAKED = 8  # steps in a row: in a few it may be a controller's force, on its way through 0
SPEED_LIMIT = 100.0  # [m/s] and [rad/s]: of every coordinate of a body with joints, and before motors hold these
ASTRAY = 0.5  # of a held body's move in a step: what its velocity, and the change of it, may fail to explain
LEAST_MOVE = 1e-9  # [m, rad]
STEPPED = 0.05  # of a loose body's way between two steps: what whole steps of the engine may fail to explain
LEAST_STEP = 1e-5  # [m] of such a way, above what contacts set right
IN_A_ROW = 3  # times that it must happen before it is said
TURN_LIMIT = 0.5  # [rad] in a step, for which forces and the inverse mass of joints are those of its beginning
LOST = TURN_LIMIT  # of the forces on a body's links: the engine itself errs by as much as links turn in a step


@dataclass(frozen=True)
class _Carried:
    """A held body at the last reading: its pose (7,), twist (6,), and whether its velocity did not explain its place."""

    pose: Array
    twist: Array
    is_astray: bool


@dataclass(frozen=True)
class _Led:
    """A joint without a rate at the last reading: its coordinates [rad, m], and whether somebody had set them since the reading before."""

    place: tuple[float, ...]
    is_set: bool


@dataclass(frozen=True)
class _Left:
    """A free body after a step: its expected place (3,) [m] at the next one, its velocity (3,) [m/s], and how often it was elsewhere."""

    place: Array
    velocity: Array
    times: int


class DefaultsWatch:
    """A watch that compares the motion of links in a step with the expected motion, and gives each warning once."""

    def __init__(self, client: int, gravity: Sequence[float]) -> None:
        """Prepare the watch; `gravity` (3,) [m/s2] is the fluid's."""
        self._client = client
        self._gravity = np.array(gravity)
        self._told: set[tuple[str, int]] = set()
        self._carried: dict[int, _Carried] = {}  # held bodies
        self._led: dict[int, dict[int, _Led]] = {}  # by body, joints that rested at the last reading
        self._braked: dict[int, int] = {}  # loose bodies: in how many of the last steps just as default damping does
        self._left: dict[int, _Left] = {}  # loose bodies

    def forget(self, body: int) -> None:
        """Forget a body that was removed; its number may be used again."""
        self._told = {(finding, of) for finding, of in self._told if of != body}
        self._carried.pop(body, None)
        self._led.pop(body, None)
        self._braked.pop(body, None)
        self._left.pop(body, None)

    def look(self, bodies: Mapping[int, LinkedBody], outcome: StepOutcome) -> None:
        """Look at what a step did to the links of these bodies."""
        (system, _, gravity, duration), wrenches, twists, unexplained = outcome
        self._look_for_gravity(gravity)
        for row in np.flatnonzero(~system.is_free):
            self._look_for_carrying(system.keys[row][0], system.pose[row], system.twist[row], duration)
        for row in np.flatnonzero(system.is_free):
            body, link = system.keys[row]
            if link < 0:
                self._look_for_damping(body, system.twist[row], unexplained[row])
                self._look_for_other_steps(body, system.pose[row, :3], system.twist[row, :3], twists[row, :3], duration)
            if wrenches[row].any():
                self._look_for_turning(body, link, duration * float(np.linalg.norm(twists[row, 3:])), duration)
        first = 0
        for name, linked in bodies.items():
            rows = slice(first, first := first + len(linked.keys))
            self._look_for_led_joints(name, linked.resting_joints, duration)
            self._look_for_clipping(name, linked, wrenches[rows], unexplained[rows], gravity, duration)

    def _look_for_gravity(self, gravity: Array) -> None:
        """Look for bodies and fluid with different gravity."""
        if not np.array_equal(gravity, self._gravity) and not np.allclose(gravity, self._gravity):
            self._tell(
                ("gravity", -1),
                f"gravity is {gravity.tolist()} m/s2 in the client and {self._gravity.tolist()} m/s2 in the fluid; make them equal with "
                f"setGravity{tuple(self._gravity.tolist())} or FluidConfig(gravity=...)",
            )

    def _look_for_carrying(self, body: int, pose: Array, twist: Array, duration: float) -> None:
        """Look for a held body that is moved step after step, but not at its velocity: it does not push the fluid as it moves."""
        before = self._carried.get(body)
        if before is None or np.array_equal(pose, before.pose):
            self._carried[body] = _Carried(pose, twist, is_astray=False)
            return
        turn = Rotation.from_quat(pose[3:]) * Rotation.from_quat(before.pose[3:]).inv()
        moved = np.concatenate([pose[:3] - before.pose[:3], turn.as_rotvec()])
        astray = any(
            _is_astray(moved[part], duration * twist[part], duration * before.twist[part])
            for part in (slice(0, 3), slice(3, 6))
        )
        self._carried[body] = _Carried(pose, twist, astray)
        if astray and before.is_astray:
            velocity = [[float(f"{value:.3g}") for value in part] for part in (moved / duration).reshape(2, 3)]
            self._tell(
                ("carried", body),
                f"body {body} is held and moved step after step, but its velocity for the fluid is "
                f"{twist[:3].tolist()} m/s; call resetBaseVelocity({body}, {velocity[0]}, {velocity[1]}) after "
                "resetBasePositionAndOrientation",
            )

    def _look_for_led_joints(self, body: int, resting: Mapping[int, tuple[float, ...]], duration: float) -> None:
        """Look for joints that are set elsewhere step after step, at rest: their links do not push the fluid as they move.

        A step of the engine moves a joint by its new rate. A joint without a rate that is elsewhere was set there.
        """
        before, self._led[body] = self._led.get(body, {}), {}
        for joint, place in resting.items():
            last = before.get(joint)
            is_set = last is not None and place != last.place
            self._led[body][joint] = _Led(place, is_set)
            if last is None or not (is_set and last.is_set):
                continue
            call = f"resetJointStateMultiDof({body}, {joint}, ...)"
            if len(place) == 1:
                call = (
                    f"resetJointState({body}, {joint}, ..., targetVelocity={(place[0] - last.place[0]) / duration:.3g})"
                )
            self._tell(
                (f"joint {joint} prescribed", body),
                f"joint {joint} of body {body} is set step after step, but without a velocity, so that its link is at rest for the fluid; "
                f"give resetJointState its targetVelocity, as in {call}",
            )

    def _look_for_other_steps(
        self, body: int, place: Array, velocity: Array, next_velocity: Array, duration: float
    ) -> None:
        """Look for a free body that has moved between steps as whole steps of the engine would move it."""
        left, times = self._left.get(body), 0
        if left is not None:
            further, step = place - left.place, 0.5 * duration * (left.velocity + velocity)
            way, length = float(np.linalg.norm(further)), float(np.linalg.norm(step))
            count = max(1, round(way / max(length, LEAST_MOVE)))
            is_stepped = way > LEAST_STEP and np.linalg.norm(further - count * step) < STEPPED * way
            times = left.times + 1 if is_stepped else 0
        self._left[body] = _Left(place + duration * next_velocity, next_velocity, times)
        if times == IN_A_ROW:
            self._tell(
                ("stepped", -1),
                f"body {body} moves between the steps of the fluid's world, as by pybullet.stepSimulation, and the water does not push "
                f"it then; call world.step() instead",
            )

    def _look_for_damping(self, body: int, twist: Array, unexplained: Array) -> None:
        """Look for default damping, which pybullet does not report: -c v (1 + |v|) is all that is unexplained of a body's acceleration."""
        speed = float(np.linalg.norm(twist[:3]))
        expected = -DEFAULT_DAMPING * twist[:3] * (1.0 + speed)
        is_braked = speed > 0.05 and np.linalg.norm(unexplained[:3] - expected) < 0.05 * np.linalg.norm(expected)
        self._braked[body] = self._braked.get(body, 0) + 1 if is_braked else 0
        if self._braked[body] == BRAKED:
            self._tell(
                ("damping", -1),
                f"body {body} has pybullet's default damping (a fall ends at 15 m/s); switch it off with "
                f"changeDynamics({body}, link, linearDamping=0, angularDamping=0, jointDamping=0) for the base (-1) "
                "and every link",
            )

    def _look_for_turning(self, body: int, link: int, turn: float, duration: float) -> None:
        """Look for an angle [rad] in a step that is too large for forces that are constant over it."""
        if turn > TURN_LIMIT:
            self._tell(
                ("turning", body),
                f"body {body}, link {link} turns by {turn:.2g} rad in a step; forces and joints are not reliable beyond "
                f"{TURN_LIMIT:g} rad; take shorter steps, as setTimeStep({0.5 * TURN_LIMIT / turn * duration:.1g})",
            )

    def _look_for_clipping(
        self, name: int, body: LinkedBody, wrenches: Array, unexplained: Array, gravity: Array, duration: float
    ) -> None:
        """Look for joints that were clipped before their motors acted: a free body that touches nothing loses momentum."""
        if len(body.keys) == 1 or body.is_held or not wrenches.any() or ("clipping", name) in self._told:
            return
        lost, given = body.masses @ unexplained[:, :3], np.linalg.norm(wrenches[:, :3], axis=1).sum()
        if np.linalg.norm(lost) <= LOST * given or pybullet.getContactPoints(name, physicsClientId=self._client):
            return
        change = body.fastest_change(wrenches, gravity, duration)
        if change > SPEED_LIMIT:
            self._tell(
                ("clipping", name),
                f"body {name} took less than the fluid gave it: its joints would reach {change:.3g} m/s or rad/s in a step before motors "
                f"act, and pybullet limits that to {SPEED_LIMIT:g}; remove the limit with changeDynamics({name}, -1, maxJointVelocity=1e9)",
            )

    def _tell(self, finding: tuple[str, int], text: str) -> None:
        if finding not in self._told:
            self._told.add(finding)
            warnings.warn(text, stacklevel=6)


def _is_astray(moved: Array, prescribed: Array, prescribed_before: Array) -> bool:
    """Tell whether a body moved otherwise than by its velocity, now or before; a body that turns round moves by something in between."""
    way = float(np.linalg.norm(moved))
    return bool(
        np.linalg.norm(moved - prescribed) - np.linalg.norm(prescribed - prescribed_before) > ASTRAY * way > LEAST_MOVE
    )


def tell_inertia(body: int, link: int, mesh: trimesh.Trimesh, mass: float, inertia: Array) -> None:
    """Warn of an inertia (3,) [kg m2] that is that of the bounding box and not of the solid; mass [kg]."""
    if not mesh.is_watertight or mesh.body_count > 1:
        return
    size2 = np.asarray(mesh.extents) ** 2
    of_box = mass / 12.0 * (size2.sum() - size2)
    of_solid = np.diag(mesh.moment_inertia) * mass / (float(mesh.volume) * float(mesh.density))
    if np.allclose(inertia, of_box, rtol=0.1) and not np.allclose(inertia, of_solid, rtol=0.2):
        warnings.warn(
            f"body {body}, link {link} has the inertia of its bounding box; if it is solid throughout, set its own with "
            f"changeDynamics({body}, {link}, localInertiaDiagonal={[float(f'{value:.4g}') for value in of_solid]})",
            stacklevel=5,
        )
