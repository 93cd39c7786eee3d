"""The readings of a scenario's probes at one communication point, as named numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from oilsim import Fluid
from scenarios.schema.probe_settings import PressureProbe, Probe, VelocityProbe, WaveGauge

Array = NDArray[np.float64]
Reading = Callable[[], Mapping[str, float]]
BodyReading = Callable[[str], tuple[Array, Array]]  # a body's pose (7,) and the fluid's wrench on it (6,)

AXES = ("x", "y", "z")


def probe_readings(probes: Mapping[str, Probe], fluid: Fluid, body: BodyReading, floor: float) -> Reading:
    """Return a reading of all probes of a scenario; its series are named ``probes/<name>`` or ``probes/<name>/<component>``.

    floor [m] of the tank, which a wave gauge reads where it is dry.
    """
    readings = [_reading(f"probes/{name}", probe, fluid, body, floor) for name, probe in probes.items()]
    return lambda: {name: value for reading in readings for name, value in reading().items()}


def _reading(path: str, probe: Probe, fluid: Fluid, body: BodyReading, floor: float) -> Reading:
    if isinstance(probe, PressureProbe):
        points = np.array([probe.point])
        return lambda: {path: float(fluid.pressure_at(points)[0])}
    if isinstance(probe, WaveGauge):
        places = np.array([probe.point])
        return lambda: {path: max(floor, float(fluid.surface_height_at(places)[0]))}
    if isinstance(probe, VelocityProbe):
        points = np.array([probe.point])
        return lambda: _components(path, AXES, fluid.velocity_at(points)[0])
    name = probe.body
    return lambda: _body_components(path, *body(name))


def _body_components(path: str, pose: Array, wrench: Array) -> dict[str, float]:
    """Return position [m], roll, pitch and yaw [deg], force [N] and torque [N m]."""
    angles = Rotation.from_quat(pose[3:]).as_euler("xyz", degrees=True)
    return (
        _components(path, AXES, pose[:3])
        | _components(path, ("roll_deg", "pitch_deg", "yaw_deg"), angles)
        | _components(path, [f"force_{axis}" for axis in AXES], wrench[:3])
        | _components(path, [f"torque_{axis}" for axis in AXES], wrench[3:])
    )


def _components(path: str, names: tuple[str, ...] | list[str], values: Array) -> dict[str, float]:
    return {f"{path}/{name}": float(value) for name, value in zip(names, values, strict=True)}
