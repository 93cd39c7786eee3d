"""Prescribed motions of scenarios beyond those of `coupling.multibody.prescribed_motion`: towing with a smooth rise, and turns."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.multibody.prescribed_motion import (
    UPRIGHT,
    Motion,
    OscillatingMotion,
    PrescribedMotion,
    Quaternion,
    Vector,
    WaypointMotion,
)
from scenarios.schema.bodies import BodySettings, RampMotion, RotationMotion, SineMotion, TableMotion


@dataclass(frozen=True, kw_only=True)
class TowingMotion:
    """A motion from rest to a steady velocity [m/s] and, at `end` [s], to rest at once.

    v(t) = V r(t), r = (1 - cos(pi tau / t_r)) / 2 until tau = t - t_0 = t_r, then 1. While the velocity rises,
    x = x_0 + V (tau / 2 - t_r sin(pi tau / t_r) / (2 pi)), then x = x_0 + V (tau - t_r / 2).
    """

    position: Vector
    velocity: Vector
    orientation: Quaternion = UPRIGHT
    start: float = 0.0
    rise_time: float = 0.0
    end: float = math.inf

    def at(self, time: float) -> Motion:
        """Return the motion at `time` [s]; see `PrescribedMotion.at`."""
        elapsed = min(time, self.end) - self.start
        seconds, share = _risen(elapsed, self.rise_time)
        velocity = np.array(self.velocity)
        moving = 0.0 if time >= self.end else share
        return Motion(np.array(self.position) + seconds * velocity, np.array(self.orientation), moving * velocity)


@dataclass(frozen=True, kw_only=True)
class TurningMotion:
    """A turn by an angle phi(t) [rad] about an axis through `center` [m]; the twist is its exact derivative.

    Steady: phi' = W r, r as of `TowingMotion`. Swing: phi = a r sin(2 pi tau / T). tau is the time since `start`.
    x = c + R(phi) (x_0 - c), v = phi' e x (x - c).
    """

    position: Vector
    orientation: Quaternion
    axis: Vector
    center: Vector
    rate: float | None = None
    amplitude: float = 0.0
    period: float = 1.0
    start: float = 0.0
    rise_time: float = 0.0

    def at(self, time: float) -> Motion:
        """Return the motion at `time` [s]; see `PrescribedMotion.at`."""
        angle, rate = self._turned(time - self.start)
        unit = np.array(self.axis) / np.linalg.norm(self.axis)
        turn = Rotation.from_rotvec(angle * unit)
        arm = turn.apply(np.array(self.position) - self.center)
        orientation = (turn * Rotation.from_quat(self.orientation)).as_quat()
        return Motion(np.array(self.center) + arm, orientation, np.cross(rate * unit, arm), rate * unit)

    def _turned(self, elapsed: float) -> tuple[float, float]:
        """Compute angle [rad] and rate [rad/s] after `elapsed` [s] of the turn."""
        if elapsed <= 0.0:
            return 0.0, 0.0
        seconds, share = _risen(elapsed, self.rise_time)
        if self.rate is not None:
            return self.rate * seconds, self.rate * share
        omega = 2.0 * math.pi / self.period
        growth = 0.0
        if elapsed < self.rise_time:
            growth = 0.5 * math.pi / self.rise_time * math.sin(math.pi * elapsed / self.rise_time)
        sine, cosine = math.sin(omega * elapsed), math.cos(omega * elapsed)
        return self.amplitude * share * sine, self.amplitude * (growth * sine + share * omega * cosine)


def _risen(elapsed: float, rise_time: float) -> tuple[float, float]:
    """Compute distance / V [s] and speed / V after `elapsed` [s] under way, with the smooth rise of `TowingMotion`."""
    if elapsed <= 0.0:
        return 0.0, 0.0
    if elapsed >= rise_time:
        return elapsed - 0.5 * rise_time, 1.0
    angle = math.pi * elapsed / rise_time
    return 0.5 * elapsed - 0.5 * rise_time * math.sin(angle) / math.pi, 0.5 * (1.0 - math.cos(angle))


def prescribed_motion(body: BodySettings, position: Vector, orientation: Quaternion) -> PrescribedMotion | None:
    """Create the motion of a body whose centre of mass starts at `position` [m]; None for a free or fixed body."""
    motion = body.motion
    if isinstance(motion, SineMotion):
        return OscillatingMotion(
            position=position,
            orientation=orientation,
            direction=motion.direction,
            amplitude=motion.amplitude,
            period=motion.period,
            ramp_time=motion.rise_time,
        )
    if isinstance(motion, RampMotion):
        return TowingMotion(
            position=position,
            orientation=orientation,
            velocity=motion.velocity,
            start=motion.start,
            rise_time=motion.rise_time,
            end=math.inf if motion.end is None else motion.end,
        )
    if isinstance(motion, RotationMotion):
        return TurningMotion(
            position=position,
            orientation=orientation,
            axis=motion.axis,
            center=position if motion.center is None else motion.center,
            rate=motion.rate,
            amplitude=motion.amplitude or 0.0,
            period=motion.period or 1.0,
            start=motion.start,
            rise_time=motion.rise_time,
        )
    if isinstance(motion, TableMotion):
        places = np.array(position) + np.array(motion.displacement)
        return WaypointMotion(
            times=motion.time, positions=tuple((p[0], p[1], p[2]) for p in places.tolist()), orientation=orientation
        )
    return None
