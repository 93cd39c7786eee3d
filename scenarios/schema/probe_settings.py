"""The probes of a scenario; each gives series in the recording and the summary as ``probes/<name>...``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from oilsim.core.quantity import quantity
from scenarios.schema.parsing.quantity_fields import Point2, Section, Vector


@dataclass(frozen=True, kw_only=True)
class PressureProbe(Section):
    """Pressure [Pa] at a point, as a transducer in a wall measures it."""

    TAG: ClassVar[tuple[str, str]] = ("kind", "pressure")
    point: Vector = quantity("m")


@dataclass(frozen=True, kw_only=True)
class WaveGauge(Section):
    """Height of the liquid's surface [m] over a point (x, y), without spray; the tank's floor where it is dry."""

    TAG: ClassVar[tuple[str, str]] = ("kind", "wave-gauge")
    point: Point2 = quantity("m")


@dataclass(frozen=True, kw_only=True)
class VelocityProbe(Section):
    """Velocity of the liquid [m/s] at a point: series x, y, z."""

    TAG: ClassVar[tuple[str, str]] = ("kind", "velocity")
    point: Vector = quantity("m")


@dataclass(frozen=True, kw_only=True)
class BodyProbe(Section):
    """Pose of a body and the fluid's force on it: series x, y, z [m], roll, pitch, yaw [deg], force and torque."""

    TAG: ClassVar[tuple[str, str]] = ("kind", "body")
    body: str


Probe = PressureProbe | WaveGauge | VelocityProbe | BodyProbe
