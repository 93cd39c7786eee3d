"""The loads on the bodies of a world: elastic lines and mooring legs that pull on them, a sea, and wrenches of other causes.

They give the length of a step, too: no body turns, swings or moves into another one too far, and lines are stable.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.bullet.engine_step import Body
from coupling.multibody.broad_phase import BroadPhase
from coupling.multibody.constrained_mobility import ConstrainedMobility, Environment, MetEnvironment
from coupling.multibody.ground_tackle import Anchor, LegPart
from coupling.multibody.joint_constraints import Articulation
from coupling.multibody.lines import ElasticLine, Line, Lines, stiffest
from coupling.multibody.mooring_leg import MooringLeg
from coupling.multibody.prescribed_motion import Vector
from coupling.multibody.rigid_state import RigidBodyState, steady
from oilsim.backend.arrays import Array


class LoadedBodies:
    """Bodies by name, their state, the `lines` between them and the sea around them; `RigidBodyWorld` moves them."""

    def __init__(self, gravity: Vector, sub_step: float) -> None:
        """Begin without bodies; gravity (3,) [m/s2], sub_step [s] the longest step of the solver."""
        self._gravity = np.array(gravity, dtype=np.float64)
        self._bodies: dict[str, Body] = {}
        self._state = RigidBodyState()
        self._mobility = ConstrainedMobility(self._state, self._gravity, sub_step)
        self.lines = Lines()

    def add_line(
        self,
        name: str,
        body_a: str,
        body_b: str | None,
        points: tuple[Vector, Vector],
        *,
        length: float,
        stiffness: float,
        relaxation_time: float = 0.0,
        breaking_load: float = math.inf,
    ) -> None:
        """Add an elastic line from body_a to body_b (None: the world) between `points` of the world [m]; see `coupling.multibody.lines`.

        length [m], stiffness [N], relaxation_time [s], breaking_load [N]. Raises ValueError for a line that is too stiff, with the largest
        stiffness allowed.
        """
        bodies = (self._body(body_a), None if body_b is None else self._body(body_b))
        places = [p if body is None else self._own_point(body, p) for body, p in zip(bodies, points, strict=True)]
        rows = tuple(-1 if body is None else body.row for body in bodies)
        line = ElasticLine((rows[0], rows[1]), np.array(places, dtype=np.float64), stiffness, relaxation_time, length)
        line.breaking_load = breaking_load
        self._string(name, line)

    def add_mooring_leg(
        self,
        name: str,
        body: str,
        point: Vector,
        parts: Sequence[LegPart],
        anchor: Anchor,
        *,
        relaxation_time: float = 0.0,
    ) -> None:
        """Hold a body at `point` of the world [m] by a leg of `parts`, from there down, to an anchor; see `coupling.multibody`.

        Raises ValueError for a leg that is too stiff, with the largest stiffness allowed.
        """
        held = self._body(body)
        self._string(name, MooringLeg(held.row, self._own_point(held, point), tuple(parts), anchor, relaxation_time))

    def part_line(self, name: str) -> None:
        """Let an elastic line part: from now on it does not pull. ValueError for an unknown name."""
        if name not in self.lines.names:
            raise ValueError(f"rigid bodies: line {name!r} does not exist, allowed: {', '.join(self.lines.names)}")
        self.lines.part(name)
        self._state.line_wrench = self.lines.present_pull(self._state.pose, self._state.twist)

    def loosen_line(self, name: str) -> None:
        """Let one end of an elastic line be free: it does not pull until it is made fast. ValueError for an unknown name."""
        self.lines.loosen(name)
        self._state.line_wrench = self.lines.present_pull(self._state.pose, self._state.twist)

    def make_line_fast(self, name: str) -> None:
        """Make a loosened line fast where its ends are now, as long as they are apart. ValueError for an unknown name."""
        self.lines.make_fast(name, self._state.pose)
        self._state.line_wrench = self.lines.present_pull(self._state.pose, self._state.twist)

    def line_distance(self, name: str) -> float:
        """Return the distance [m] of the two points of an elastic line now."""
        return self.lines.distance(name, self._state.pose)

    def line_ends(self, name: str) -> Array:
        """Return the places (2, 3) [m] of both ends of a line, the anchor of a mooring leg last."""
        return self.lines.ends(name, self._state.pose)

    def _rows(self, names: Sequence[str]) -> list[int]:
        bodies = self._bodies
        try:
            return [bodies[name].row for name in names]
        except KeyError:
            return [self._body(name).row for name in names]

    def _body(self, name: str) -> Body:
        if name not in self._bodies:
            raise ValueError(f"rigid bodies: body {name!r} does not exist, allowed: {', '.join(self._bodies)}")
        return self._bodies[name]

    def _string(self, name: str, line: Line) -> None:
        """Add a line to the others; ValueError for one that is too stiff to be stepped."""
        limit = stiffest(line, self._state.pose, self._state.inverse_masses(), SHORTEST)
        if line.stiffness > limit:
            raise ValueError(
                f"line {name!r}: stiffness is {line.stiffness:g} N, allowed: up to {limit:.3g} N for its bodies"
            )
        self.lines.add(name, line)
        self._state.line_wrench = self.lines.present_pull(self._state.pose, self._state.twist)

    def _own_point(self, body: Body, point: Vector) -> Array:
        """Convert a world point to the body's axes, from its centre of mass."""
        pose = self._state.pose[body.row]
        return Rotation.from_quat(pose[3:]).inv().apply(np.array(point) - pose[:3])

    def set_environment(self, environment: Environment, names: Sequence[str]) -> None:
        """Let a sea load the named bodies, all of which have been added; ValueError for an unknown body, or one that is not free."""
        rows = self._rows(names)
        held = [name for name in names if self._bodies[name].motion != "free"]
        if held:
            raise ValueError(
                f"rigid bodies: the environment loads {held[0]!r}, which is not free, allowed: free bodies"
            )
        self._mobility.sea = MetEnvironment(environment, rows, self._state)
        self._mobility.moved()

    @property
    def environment(self) -> Environment | None:
        """The sea that loads bodies; None without one."""
        return self._mobility.sea.environment

    @property
    def loaded_names(self) -> tuple[str, ...]:
        """Names of the bodies that the sea loads, in its order; empty without one."""
        by_row = {body.row: name for name, body in self._bodies.items()}
        return tuple(by_row[row] for row in self._mobility.sea.rows)

    def change_environment(self, environment: Environment) -> None:
        """Let another sea load the bodies that one loads already, from now on; ValueError without one."""
        if self.environment is None:
            raise ValueError("rigid bodies: no environment can be changed, allowed: after set_environment")
        self._mobility.sea.environment = environment
        self._mobility.moved()

    def sea_wrench(self, name: str) -> Array:
        """Return the wrench (6,) [N, N m] of the environment on a body, mean over the last advance."""
        return self._state.sea_wrench[self._body(name).row].copy()

    def set_wrench(self, name: str, wrench: Array) -> None:
        """Set the fluid's wrench (6,) [N, N m] on a body; it acts until it is set again."""
        self._state.wrench[self._body(name).row] = wrench

    def set_applied_wrench(self, name: str, wrench: Array) -> None:
        """Set the wrench (6,) [N, N m] of other causes, such as thrust; it acts until it is set again."""
        self._state.applied_wrench[self._body(name).row] = wrench
        self._mobility.pushed()


TURNED = (
    0.025  # [rad], largest turn; a tumbling body then gains or loses less than a thousandth of its energy in ten turns
)
TURNED_AT_SEA = (
    0.1  # [rad], largest turn of bodies that a sea loads: its damping takes far more energy than the step's error makes
)
SWUNG = 0.5  # [rad], largest swing under the forces of joints; from 2 on swings grow
SWUNG_AT_SEA = 1.0  # [rad], the same of bodies that a sea loads, whose damping takes what swings gain
CHOSEN_FOR = 2  # longest sub-steps at sea for which the sub-step is chosen at once; waves change little within them
SHORTEST = 5e-4  # [s], shortest step because of turns and swings, and of any single line when it is added


def step_rate(
    state: RigidBodyState,
    gravity: Array,
    held: Articulation | None,
    lines: Lines,
    broad_phase: BroadPhase,
    spans: tuple[float, float],
) -> float:
    """Return the steps per second that bodies, joints (`held`) and lines need now; gravity (3,) [m/s2].

    spans [s]: the longest step that is allowed anyway, and the time within which bodies may run into each other.
    """
    longest, duration = spans
    spin = np.linalg.norm(state.twist[state.is_free, 3:], axis=1)
    at_sea = state.resistance is not None
    patient = float(spin.max(initial=0.0)) / (TURNED_AT_SEA if at_sea else TURNED)
    wrench = state.wrench + state.applied_wrench + lines.present_pull(state.pose, state.twist) + state.sea_load
    if held is not None:
        free = state.accelerations_under(wrench, gravity)
        inverse_inertia = state.inverse_masses()[:, 3:, 3:] if at_sea else state.inverse_inertia()
        swung = SWUNG_AT_SEA if at_sea else SWUNG
        patient = max(patient, held.swing(free, inverse_inertia, swung / longest) / swung)
    # a resting body is not accelerated by its weight: joints and contacts last
    lasting = wrench + steady(state.earlier_reaction, state.reaction)
    later = state.twist + duration * state.accelerations_under(lasting, gravity)
    leaping = (broad_phase.rate(state.pose, twist, duration) for twist in (state.twist, later))
    stiff = 1.0 / lines.longest_step(state.pose, state.inverse_masses())
    return max(min(patient, 1.0 / SHORTEST), stiff, *leaping)
