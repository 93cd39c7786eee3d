"""Checks of floating bodies: draft, heel and trim, metacentric height."""

from __future__ import annotations

import math

from scipy.spatial.transform import Rotation

from coupling.solids.hydrostatics import hydrostatics
from coupling.testkit.readings import Readings
from coupling.testkit.sources import readings_of
from coupling.testkit.verdict import require_near


def assert_draft(source: object, body: str, expected: float, *, within: float, level: float | None = None) -> None:
    """Require that the body's lowest point lies `expected` [m] below the still-water level, to `within` [m].

    level [m]: of the still water; by default it follows from the tank and all liquid in it. Raises CheckFailed, an AssertionError, if not.
    """
    readings = readings_of(source)
    found = _level(readings, level) - float(readings.placed(body).bounds[0, 2])
    require_near(f"draft of {body!r}", found, expected, within, "m", readings.context(body))


def assert_heel(source: object, body: str, expected: float, *, within: float) -> None:
    """Require that the body has turned by `expected` [rad] about its own x axis, to `within` [rad]; CheckFailed if not."""
    _assert_angle(readings_of(source), body, 2, "heel", expected, within)


def assert_trim(source: object, body: str, expected: float, *, within: float) -> None:
    """Require that the body has turned by `expected` [rad] about its y axis, bow down positive, to `within` [rad]; CheckFailed if not."""
    _assert_angle(readings_of(source), body, 1, "trim", expected, within)


def assert_metacentric_height(
    source: object, body: str, expected: float, *, within: float, level: float | None = None
) -> None:
    """Require that GM = I / V + z_B - z_G at the draft at which the body floats is `expected` [m], to `within` [m]; CheckFailed if not.

    I [m4]: second moment of the waterplane about the body's x axis; V [m3], z_B [m]: displaced volume and its centre; z_G: centre of mass.
    """
    readings = readings_of(source)
    afloat = hydrostatics(readings.placed(body), _level(readings, level))
    found = afloat.metacentric_height(float(readings.body(body).pose[-1, 2]))
    require_near(f"metacentric height of {body!r}", found, expected, within, "m", readings.context(body))


def _level(readings: Readings, level: float | None) -> float:
    return readings.level() if level is None else level


def _assert_angle(readings: Readings, body: str, axis: int, name: str, expected: float, within: float) -> None:
    """Compare an angle [rad] of yaw, pitch and roll (axis 0, 1, 2), turned in this order."""
    angle = float(Rotation.from_quat(readings.body(body).pose[-1, 3:]).as_euler("ZYX")[axis])
    found = expected + math.remainder(angle - expected, 2.0 * math.pi)
    require_near(f"{name} of {body!r}", found, expected, within, "rad", readings.context(body))
