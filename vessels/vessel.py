"""A vessel: a hull with propulsion, steering, a tow point and a superstructure that catches the wind."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from oilsim.backend.arrays import Array
from oilsim.core.physical_constants import AIR_DENSITY
from oilsim.core.quantity import quantity, require
from vessels.course import Course

if TYPE_CHECKING:  # a scenario's limits are read from these classes without the meshes of hulls
    from vessels.drive import DriveModel
    from vessels.hull import Hull
    from vessels.hull_forces import HullForces
    from vessels.windage import Windage


@dataclass(frozen=True, kw_only=True)
class Propulsion:
    """The limits of the machinery.

    bollard_pull [N]: largest thrust ahead; astern_pull [N]: largest thrust astern; yaw_moment [N m]: largest steering moment of rudder or
    azimuth drives; side_thrust [N]: largest thrust of transverse thrusters, 0 without them. Raises ValueError for a negative limit.
    """

    bollard_pull: float = quantity("N", at_least=0.0)
    astern_pull: float = quantity("N", at_least=0.0)
    yaw_moment: float = quantity("N m", at_least=0.0)
    side_thrust: float = quantity("N", default=0.0, at_least=0.0)

    def __post_init__(self) -> None:
        require("propulsion", Propulsion, vars(self))


@dataclass(frozen=True, kw_only=True)
class Superstructure:
    """The part that stands in the wind: F = 0.5 rho_air Cd A V |V|, at `center` (3,) [m] in the body frame.

    area [m2]: projected on the wind, taken the same from every side; drag_coefficient Cd [-].
    """

    area: float
    drag_coefficient: float = 1.0
    center: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def wind_force(self, wind: Array, velocity: Array) -> Array:
        """Compute the force (3,) [N] along the relative wind V = wind - velocity [m/s], both (3,)."""
        relative = np.asarray(wind, dtype=np.float64) - velocity
        return 0.5 * AIR_DENSITY * self.drag_coefficient * self.area * float(np.linalg.norm(relative)) * relative


@dataclass(frozen=True, kw_only=True)
class ControlGains:
    """Gains of the control loops that follow a vessel's orders; each loop scales its gain by the vessel's mass or inertia.

    speed_bandwidth, heading_bandwidth, lane_bandwidth [rad/s]: natural frequencies of the loops of thrust, steering and
    side thrusters, each critically damped; lookahead [m]: distance ahead on the line at which a vessel without side
    thrusters points its bow to come back to it, 0 meaning twice the hull's length; acceleration [m/s2]: at which an
    ordered speed is approached; None: at once.
    """

    speed_bandwidth: float = quantity("rad/s", default=1.0, above=0.0)
    heading_bandwidth: float = quantity("rad/s", default=1.0, above=0.0)
    lane_bandwidth: float = quantity("rad/s", default=0.5, above=0.0)
    lookahead: float = quantity("m", default=0.0, at_least=0.0)
    acceleration: float | None = quantity("m/s2", default=None, above=0.0)

    def __post_init__(self) -> None:
        require("control gains", ControlGains, vars(self))


@dataclass(frozen=True, kw_only=True)
class Vessel:
    """A vessel: its hull, machinery, course and place at the start.

    course: the orders of its helmsman, None without one; position (x, y) [m]: of midships at the start; heading [rad]: counter-clockwise
    about z from +x; tow_point (3,) [m]: in the body frame, where a tow line is made fast; superstructure, windage: what stands in the
    wind on deck, and the hull above the water; None where the wind does not act. engine_runs: without its engine, a vessel has neither
    thrust nor steering. drive: screws and rudders or azimuth thrusters; without one, thrust and moment are given as ordered, up to the
    limits of `propulsion`. screws: whether the port and the starboard screw of the drive run. hull_forces: of water on the hull under way,
    in a run without particles, where a sea loads the hull and its superstructure; None where particles do.
    """

    name: str
    hull: Hull
    propulsion: Propulsion
    course: Course | None
    position: tuple[float, float]
    heading: float
    tow_point: tuple[float, float, float]
    gains: ControlGains = field(default_factory=ControlGains)
    superstructure: Superstructure | None = None
    windage: Windage | None = None
    engine_runs: bool = True
    drive: DriveModel | None = None
    screws: tuple[bool, bool] = (True, True)
    hull_forces: HullForces | None = None

    def thrust_limits(self, ahead: float) -> tuple[float, float]:
        """Return the largest thrust astern, below 0, and ahead [N] at a speed [m/s] ahead."""
        if self.drive is None:
            return -self.propulsion.astern_pull, self.propulsion.bollard_pull
        low, high = self.drive.limits(ahead)
        count = sum(self.screws[: self.drive.drive.count])
        return count * low, count * high

    def initial_pose(self, water_level: float) -> tuple[Array, Array]:
        """Return position (3,) [m] of the centre of mass and orientation (4,) xyzw at the start, afloat at the design draft."""
        midships = rotated(self.hull.deck_point(0.0), self.heading)
        x, y = np.array(self.position) - midships[:2]
        half = 0.5 * self.heading
        position = np.array([x, y, water_level - self.hull.waterline])
        return position, np.array([0.0, 0.0, math.sin(half), math.cos(half)])

    def initial_tow_point(self, water_level: float) -> Array:
        """Return the tow point (3,) [m] in the world at the start; water_level [m]."""
        return self.initial_pose(water_level)[0] + rotated(np.array(self.tow_point), self.heading)

    def wind_wrench(self, pose: Array, twist: Array, wind: Array) -> Array:
        """Compute force [N] and moment [N m] (6,) of the wind (3,) [m/s] on the superstructure and on the hull above the water.

        pose (7,) [m, 1], twist (6,) [m/s, rad/s]; about the centre of mass, in the world frame.
        """
        if self.hull_forces is not None:
            return np.zeros(6)  # the sea blows on it
        on_hull = np.zeros(6) if self.windage is None else self.windage.wrench(pose, twist, wind)
        if self.superstructure is None:
            return on_hull
        arm = _rotate(pose[3:], np.array(self.superstructure.center))
        velocity = twist[:3] + np.cross(twist[3:], arm)
        force = self.superstructure.wind_force(wind, velocity)
        force[2] = 0.0
        return on_hull + np.concatenate([force, np.cross(arm, force)])


def moved_by(
    vessel: Vessel,
    motion: tuple[Array, Array, Array],
    wanted: tuple[float, float, float],
    rudder: float,
    step_size: float,
) -> tuple[Array, tuple[float, float, float], float]:
    """Return wrench (6,) [N, N m] of machinery and hull, thrust ahead and to port [N] and moment [N m] given, and the rudder's angle [rad].

    motion: pose (7,) [m, 1], twist (6,) [m/s, rad/s] and the current (2,) [m/s]; wanted: thrust ahead and to port [N] and moment [N m];
    rudder: its angle [rad] at the beginning of the step [s].
    """
    pose, twist, current = motion
    _, heading, surge, sway, turn_rate = planar_motion(pose, twist)
    c, s = math.cos(heading), math.sin(heading)
    ahead = surge - float(c * current[0] + s * current[1])
    to_port = sway - float(c * current[1] - s * current[0])
    given = wanted
    if vessel.drive is not None:
        running = vessel.screws if vessel.engine_runs else (False, False)
        push, rudder = vessel.drive.push(
            (wanted[0], wanted[2]), (ahead, to_port, turn_rate), rudder, step_size, running
        )
        given = (push[0], push[1] + wanted[1], push[2])
    total = np.array(given)
    if vessel.hull_forces is not None:
        total = total + vessel.hull_forces.push(ahead, to_port, turn_rate)
    return planar_wrench(heading, *(float(part) for part in total)), given, rudder


def heading_of(orientation: Array) -> float:
    """Return the heading [rad] of a body with orientation (4,) xyzw: its x axis, counter-clockwise about z from the world's +x."""
    x, y, z, w = (float(component) for component in orientation)
    return math.atan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z))


def planar_motion(pose: Array, twist: Array) -> tuple[Array, float, float, float, float]:
    """Split a body's pose (7,) and twist (6,) into its motion in the plane.

    Returns position (2,) [m], heading [rad], speed ahead and to port [m/s], and rate of turn [rad/s].
    """
    heading = heading_of(pose[3:])
    c, s = math.cos(heading), math.sin(heading)
    return pose[:2], heading, c * twist[0] + s * twist[1], c * twist[1] - s * twist[0], float(twist[5])


def planar_wrench(heading: float, thrust: float, side_thrust: float, yaw_moment: float) -> Array:
    """Build the wrench (6,) [N, N m] in the world frame of thrusts ahead and to port [N] and a moment about z [N m]."""
    c, s = math.cos(heading), math.sin(heading)
    return np.array([thrust * c - side_thrust * s, thrust * s + side_thrust * c, 0.0, 0.0, 0.0, yaw_moment])


def _rotate(orientation: Array, vector: Array) -> Array:
    """Rotate a body vector (3,) into the world frame: v + 2 q x (q x v + w v)."""
    axis, w = orientation[:3], orientation[3]
    return vector + 2.0 * np.cross(axis, np.cross(axis, vector) + w * vector)


def rotated(vector: Array, heading: float) -> Array:
    """Turn a vector (3,) of any unit [-] by `heading` [rad] about z."""
    c, s = math.cos(heading), math.sin(heading)
    return np.array([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1], vector[2]])
