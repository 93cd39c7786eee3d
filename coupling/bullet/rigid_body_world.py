"""Rigid bodies, joints and contacts on a pybullet client of our own.

Modules `bullet_client` and `engine_step` put right what pybullet does wrong by default.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import chain
from typing import Literal

import numpy as np
import trimesh

from coupling.bullet.bullet_client import BulletClient
from coupling.bullet.engine_step import Body, EngineStep
from coupling.bullet.loaded_bodies import CHOSEN_FOR, LoadedBodies, step_rate
from coupling.multibody.broad_phase import BroadPhase
from coupling.multibody.joint_constraints import PointJoint
from coupling.multibody.joint_twist import twists_of
from coupling.multibody.prescribed_motion import (
    AT_REST,
    STILL,
    UPRIGHT,
    Motion,
    PrescribedMotion,
    Quaternion,
    Vector,
)
from coupling.multibody.rigid_state import pose_of, twist_of
from coupling.solids.bodies import MassProperties, require_closed
from oilsim.backend.arrays import Array
from oilsim.core.physical_constants import GRAVITY
from oilsim.fluid.checks import finite

FRICTION = 0.5  # coefficient of contacts, where nothing else is said


class RigidBodyWorld(LoadedBodies):
    """A world of rigid bodies; every quantity is of the centre of mass, in the world frame, in SI units."""

    def __init__(
        self,
        gravity: Vector = (0.0, 0.0, -GRAVITY),
        sub_step: float = 0.01,
        solver_iterations: int = 50,
        communication_step: float | None = None,
    ) -> None:
        """Create an empty world; `sub_step` [s] is the longest step of the rigid body solver, `solver_iterations` are those of contacts.

        Steps are shorter if a body would move deep into another one (`coupling.multibody.broad_phase`), if one turns or swings fast, and if
        lines are stiff. A prescribed motion gives its mean acceleration over the coming `communication_step` [s], or over a sub-step.
        Raises ValueError for a step or a number of iterations that is not above 0.
        """
        if not (math.isfinite(sub_step) and sub_step > 0.0):
            raise ValueError(f"rigid bodies: sub_step is {sub_step} s, allowed: above 0")
        if solver_iterations < 1:
            raise ValueError(f"rigid bodies: solver_iterations is {solver_iterations}, allowed: 1 or more")
        super().__init__(gravity, sub_step)
        self.time = 0.0
        self._sub_step = sub_step
        self._ahead = communication_step or sub_step
        self._broad_phase = BroadPhase()
        self._joints: dict[str, int] = {}
        self._parted: list[str] = []
        self._tensions: dict[str, float] = {}
        self._free: list[Body] = []
        self._prescribed: list[tuple[Body, PrescribedMotion]] = []
        self._last_duration = sub_step
        self._client = BulletClient(gravity, solver_iterations)
        self._engine = EngineStep(self._client, self._state, self._gravity)

    @property
    def body_names(self) -> tuple[str, ...]:
        """Names of all bodies, in the order in which they were added."""
        return tuple(self._bodies)

    @property
    def free_body_names(self) -> tuple[str, ...]:
        """Names of the bodies that move by their forces."""
        return tuple(body.name for body in self._free)

    @property
    def met(self) -> frozenset[tuple[str, str]]:
        """Pairs of bodies that ran into each other in the last advance, each sorted by name; "" is a half-space."""
        if not self._engine.touched:
            return frozenset()
        names = {body.bullet.unique_id: name for name, body in self._bodies.items()}
        pairs = (sorted((names.get(one, ""), names.get(other, ""))) for one, other in self._engine.touched)
        return frozenset((one, other) for one, other in pairs)

    @property
    def disturbed(self) -> tuple[str, ...]:
        """Free bodies that ran into something in the last advance, or are connected by joints to one that did."""
        hit = set(chain.from_iterable(self.met)) - {""}
        all_jointed = any(self._bodies[name].is_jointed for name in hit)
        return tuple(
            name for name in self.free_body_names if name in hit or (all_jointed and self._bodies[name].is_jointed)
        )

    def overlaps(self) -> list[tuple[str, str, float]]:
        """List free bodies that overlap with another one or, "", with a half-space, and the depth [m]; they would be thrown apart."""
        names = {body.bullet.unique_id: name for name, body in self._bodies.items()}
        found = []
        for pair, depth in self._client.overlaps().items():
            first, second = (names.get(unique_id, "") for unique_id in pair)
            if depth > 0.0:
                found.append((first, second, depth) if first else (second, first, depth))
        return found

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints that hold, in the order in which they were added."""
        return tuple(self._joints)

    def add_body(
        self,
        name: str,
        mesh: trimesh.Trimesh,
        mass_properties: MassProperties,
        position: Vector = STILL,
        orientation: Quaternion = UPRIGHT,
        *,
        motion: Literal["free", "fixed"] | PrescribedMotion = "free",
        twist: Sequence[float] | Array = AT_REST,
        friction: float | None = FRICTION,
    ) -> None:
        """Place a body. `mesh` [m] is about its centre of mass; `position` [m] is where the centre of mass lies.

        twist: (6,) linear and angular velocity at the start [m/s, rad/s]; a prescribed motion gives pose and twist itself. friction:
        coefficient where it touches others, a free body with its convex hull, a held one with its mesh as it is; None for a body that
        touches nothing. ValueError for a name that is taken, an open mesh and numbers that are not finite.
        """
        if name in self._bodies:
            raise ValueError(f"rigid bodies: body {name!r} is added twice, allowed: each name once")
        require_closed(mesh, f"rigid bodies: mesh of {name!r}")
        start = Motion(
            finite(f"rigid bodies: position of {name!r}", position, 3),
            finite(f"rigid bodies: orientation of {name!r}", orientation, 4),
            *np.split(finite(f"rigid bodies: twist of {name!r}", twist, 6), 2),
        )
        if not math.isclose(float(np.linalg.norm(start.orientation)), 1.0, rel_tol=1e-6):
            raise ValueError(f"rigid bodies: orientation of {name!r} is {orientation}, allowed: a unit quaternion")
        if not isinstance(motion, str):
            start = motion.at(self.time)
        elif motion == "fixed":
            start = Motion(start.position, start.orientation)
        elif motion != "free":
            raise ValueError(f"rigid bodies: motion of {name!r} is {motion!r}, allowed: 'free', 'fixed' or a motion")
        bullet = self._client.add_body(
            mesh,
            mass_properties,
            is_free=motion == "free",
            is_prescribed=not isinstance(motion, str),
            contact=friction is not None,
            friction=FRICTION if friction is None else friction,
        )
        body = Body(name, len(self._bodies), motion, bullet)
        self._bodies[name] = body
        if motion == "free":
            self._free.append(body)
        elif not isinstance(motion, str):
            self._prescribed.append((body, motion))
        self._broad_phase.add_body(mesh.bounds, is_free=motion == "free", touches=friction is not None)
        self._state.append(mass_properties, start, is_free=motion == "free")
        self._place(body, start)
        self._engine.forget()
        self._mobility.forget()

    def add_half_space(self, point: Vector, normal: Vector, friction: float = FRICTION) -> None:
        """Let free bodies run into a plane through `point` [m], such as a tank's side; `normal`, a unit vector, points to their side."""
        self._client.add_half_space(point, normal, friction)
        self._broad_phase.add_half_space(np.array(point, np.float64), np.array(normal, np.float64))

    def add_joint(
        self,
        name: str,
        body_a: str,
        body_b: str | None,
        point: Vector,
        *,
        twisting_stiffness: float = 0.0,
        relaxation_time: float = 0.0,
    ) -> None:
        """Hold two bodies together at `point` (world frame, [m]), free to turn; with `body_b` None, hold one to the world.

        twisting_stiffness [N m/rad], relaxation_time [s]: with which it resists that one rolls against the other about their x axes
        (`coupling.multibody.joint_twist`).

        Two joints on a line make a hinge. Jointed bodies do not collide with each other. Raises ValueError for a name in use, an unknown
        body.
        """
        if name in self._joints or name in self._parted:
            raise ValueError(f"rigid bodies: joint {name!r} is added twice, allowed: each name once")
        first = self._body(body_a)
        second = None if body_b is None else self._body(body_b)
        first_point = self._own_point(first, point)
        second_point = np.array(point) if second is None else self._own_point(second, point)
        self._joints[name] = self._client.add_joint(
            first.bullet, first_point, None if second is None else second.bullet, second_point
        )
        for body in (first, second):
            if body is not None:
                body.is_jointed = True
        if second is not None:
            self._broad_phase.keep_apart(first.row, second.row)
        self._tensions[name] = 0.0
        row = -1 if second is None else second.row
        joint = PointJoint(
            first.row,
            row,
            first_point,
            second_point,
            twisting_stiffness=twisting_stiffness,
            relaxation_time=relaxation_time,
        )
        self._mobility.joints.append(joint)
        self.lines.twists = twists_of(self._mobility.joints)
        self._engine.forget()
        self._mobility.forget()

    def part_joint(self, name: str) -> None:
        """Let a joint part: from now on it holds nothing, and its tension is 0. ValueError for one that does not hold.

        The bodies that it held pass through each other, as before: they overlap where the joint was.
        """
        if name not in self._joints:
            raise ValueError(f"rigid bodies: joint {name!r} does not hold, allowed: {', '.join(self._joints)}")
        place = list(self._joints).index(name)
        self._client.remove_joint(self._joints.pop(name))
        parted = self._mobility.joints.pop(place)
        self._state.let_go((parted.first, parted.second))
        del self._tensions[name]
        self.lines.twists = twists_of(self._mobility.joints)
        self._parted.append(name)
        for body in self._bodies.values():
            body.is_jointed = any(body.row in (joint.first, joint.second) for joint in self._mobility.joints)
        self._engine.forget()
        self._mobility.forget()

    def pose(self, name: str) -> Array:
        """Return position [m] and orientation xyzw (7,)."""
        return self._state.pose[self._body(name).row].copy()

    def poses(self, names: Sequence[str]) -> Array:
        """Return positions [m] and orientations xyzw (n, 7) of several bodies."""
        return self._state.pose[self._rows(names)]

    def twist(self, name: str) -> Array:
        """Return linear [m/s] and angular velocity [rad/s] (6,)."""
        return self._state.twist[self._body(name).row].copy()

    def twists(self, names: Sequence[str]) -> Array:
        """Return linear [m/s] and angular velocities [rad/s] (n, 6) of several bodies."""
        return self._state.twist[self._rows(names)]

    def wrench(self, name: str) -> Array:
        """Return the fluid's wrench (6,) [N, N m] as last set."""
        return self._state.wrench[self._body(name).row].copy()

    def inverse_mass(self, name: str) -> Array:
        """Return the twist by impulse (6, 6) [1/kg, 1/(kg m2)], world frame; 0 for a fixed or prescribed body."""
        self._mobility.meet_sea(self.time)
        return self._state.inverse_mass(self._body(name).row)

    def mass_matrix(self, name: str) -> Array:
        """Return the impulse by twist (6, 6) [kg, kg m2] of the body itself, without joints, world frame."""
        return self._state.mass_matrix(self._body(name).row)

    def coupled_inverse_mass(self, names: Sequence[str]) -> Array:
        """Return the twists (6 n, 6 n) [1/kg] of the named bodies by impulses on them, joints included; 0 for fixed or prescribed ones."""
        rows = np.array(self._rows(names))
        return self._mobility.articulated(self.time).inverse_mass((6 * rows[:, None] + np.arange(6)).ravel())

    def free_acceleration(self, name: str) -> Array:
        """Return d(twist)/dt (6,) [m/s2, rad/s2] by everything but the fluid; for a prescribed body, that of its motion.

        Joints answer the known forces at once (see `coupling.multibody.joint_constraints`); contacts enter with what lasted over the last
        steps.
        """
        body = self._body(name)
        self._mobility.meet_sea(self.time)
        if body.motion == "free":
            if not body.is_jointed:
                return self._state.free_acceleration(body.row, self._gravity)
            return self._mobility.accelerations(self.time, self._last_duration)[body.row]
        if isinstance(body.motion, str):
            return np.zeros(6)
        now, later = body.motion.at(self.time), body.motion.at(self.time + self._ahead)
        return (twist_of(later) - twist_of(now)) / self._ahead

    def tension(self, name: str) -> float:
        """Return the magnitude of the force [N] in a joint or a line, mean over the last advance; ValueError for an unknown name."""
        if name in self.lines.names:
            return self.lines.tension(name)
        if name in self._parted:
            return 0.0
        if name not in self._joints:
            raise ValueError(f"rigid bodies: joint {name!r} does not exist, allowed: {', '.join(self._joints)}")
        return self._tensions[name]

    def momentum(self) -> Array:
        """Return the momentum (6,) of all free bodies: linear [kg m/s], angular about the world's origin [kg m2/s]."""
        return self._state.total_momentum()

    def energy(self) -> float:
        """Return the kinetic and potential energy [J] of all free bodies."""
        return self._state.energy(self._gravity)

    def move_to_time(self, time: float) -> None:
        """Set the clock to `time` [s], and put every prescribed body where its motion says."""
        self.time = time
        for body, motion in self._prescribed:
            self._place(body, motion.at(time))

    def advance(self, duration: float) -> None:
        """Advance by `duration` [s] under the wrenches as set, in equal stretches not longer than the longest sub-step."""
        count = max(1, math.ceil(duration / self._sub_step - 1e-9))
        momenta_before, begin = self._state.momenta(), self.time
        impulses = np.zeros(len(self._joints))
        self._engine.touched.clear()
        self.lines.begin(duration, len(self._bodies))
        self._mobility.sea.begin()
        stretches = math.ceil(count / CHOSEN_FOR) if self._mobility.sea.rows else count
        stretch = duration / stretches
        for index in range(stretches):
            self._advance_stretch(begin + index * stretch, stretch, math.ceil(count / stretches), impulses)
        self._tensions = dict(zip(self._joints, (impulses / duration).tolist(), strict=True))
        self._last_duration = duration
        self._mobility.sea.end(duration)
        self._state.line_wrench = self.lines.end(duration)
        self._state.settle_reaction(momenta_before, duration, self._gravity)
        self._state.line_wrench = self.lines.present_pull(self._state.pose, self._state.twist)

    def save_state(self) -> dict[str, object]:
        """Return everything that moves, as plain data that can be pickled."""
        self._engine.catch_up(self._free)
        return {
            "bullet": self._client.save(),
            "time": self.time,
            "last_duration": self._last_duration,
            "arrays": self._state.save_state(),
            "tensions": dict(self._tensions),
            "lines": self.lines.save_state(),
        }

    def restore_state(self, state: Mapping[str, object]) -> None:
        """Restore a state that `save_state` returned, bit for bit.

        Raises TypeError for another object, KeyError for a missing entry, and ValueError for damage or other bodies or joints.
        """
        content, arrays, tensions, time = (state[key] for key in ("bullet", "arrays", "tensions", "time"))
        if not (isinstance(content, bytes) and isinstance(arrays, dict) and isinstance(tensions, dict)):
            raise TypeError("rigid bodies: restore_state got another object, allowed: a state that save_state returned")
        if set(tensions) != set(self._joints):
            raise ValueError(f"rigid bodies: state has joints {sorted(tensions)}, allowed: {sorted(self._joints)}")
        self._client.restore(content)
        self._engine.is_behind = False
        self._state.restore_state(arrays)
        self._tensions = dict(tensions)
        self.lines.restore_state(state["lines"])
        self._mobility.moved()
        self.time = float(time)  # type: ignore[arg-type]
        self._last_duration = float(state["last_duration"])  # type: ignore[arg-type]

    def close(self) -> None:
        """Disconnect the client; the world cannot be used afterwards."""
        self._client.close()

    def _place(self, body: Body, motion: Motion) -> None:
        """Put a body where `motion` says."""
        self._client.place(body.bullet, motion)
        self._mobility.placed()
        self._state.pose[body.row] = pose_of(motion)
        self._state.twist[body.row] = twist_of(motion)

    def _advance_stretch(self, begin: float, duration: float, least: int, impulses: Array) -> None:
        """Advance by `duration` [s] from the time `begin` in `least` equal sub-steps or more.

        The impulses of joints are added to `impulses` (J,) [N s].
        """
        longest = duration / least
        self._mobility.meet_sea(self.time, longest)
        held = self._mobility.articulated(self.time) if self._mobility.is_needed else None
        rate = step_rate(self._state, self._gravity, held, self.lines, self._broad_phase, (longest, duration))
        count = max(least, math.ceil(duration * rate - 1e-9))
        sub_step = duration / count
        for index in range(count):
            forces = self._advance_once(begin + (index + 1) * sub_step, sub_step)
            impulses += np.array([math.hypot(*force) for force in forces.tolist()]) * sub_step

    def _advance_once(self, end: float, sub_step: float) -> Array:
        """Make one sub-step that ends at the time `end`; the engine is skipped if no free body moves, or if none at sea can touch anything.

        Return the forces (J, 3) [N] of joints on their first bodies, including those that the engine adds because of contacts.
        """
        self._mobility.meet_sea(self.time, sub_step)
        pull = self.lines.pull_for(sub_step, self._state.pose, self._state.twist)
        wrench = self._state.wrench + self._state.applied_wrench + pull + self._state.sea_load
        free, prescribed = self._free, [(body, motion.at(end)) for body, motion in self._prescribed]
        forces, joint_wrench = self._mobility.forces(self.time, wrench, sub_step)
        if free:
            handed = wrench + joint_wrench
            handed = handed - self._mobility.sea.resisted(handed, self._gravity, sub_step)
            if not self._mobility.sea.rows or self._broad_phase.any_near(self._state.pose, self._state.twist, sub_step):
                self._engine.step(free, prescribed, handed, sub_step)
                forces = forces + self._client.joint_forces(self._joints.values())
            else:
                self._engine.step_without_engine(free, handed, sub_step)
            self._mobility.moved()
        for body, motion in prescribed:
            self._place(body, motion)
        self.time = end
        return forces
