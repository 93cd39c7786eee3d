"""Wind and current that change during a run: every part that uses them is informed."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from oilsim.forcing import AiryWaves, Current, Wind
from scenarios.schema.weather import horizontal

if TYPE_CHECKING:
    from oilsim import Fluid
    from vessels.control import ManualControl, VesselControl
    from vessels.windage import WindOnBodies


class CurrentListener(Protocol):
    """A part that uses speeds through the water."""

    def take_current(self, velocity: NDArray[np.float64]) -> None:
        """Use `velocity` (3,) [m/s] as the velocity of the current from now on."""


def set_wind(
    fluid: Fluid,
    controls: Iterable[VesselControl | ManualControl],
    bodies: WindOnBodies | None,
    speed: float,
    direction: float,
) -> None:
    """Set the mean wind [m/s], [rad], for the liquid, for vessels and for other bodies; only the liquid has gusts."""
    for forcing in fluid.forcings:
        if isinstance(forcing, Wind):
            forcing.speed, forcing.direction = speed, direction
    for control in controls:
        control.set(f"{control.vessel.name}.wind", np.array(horizontal(speed, direction)))
    if bodies is not None:
        bodies.set("wind", np.array(horizontal(speed, direction)))


def set_current(fluid: Fluid, listener: CurrentListener, speed: float, direction: float) -> None:
    """Set the current [m/s], [rad], for the liquid, for its waves, and for speeds through the water."""
    velocity = horizontal(speed, direction)
    for forcing in fluid.forcings:
        if isinstance(forcing, Current):
            forcing.velocity = velocity
        elif isinstance(forcing, AiryWaves):
            forcing.drift = velocity[:2]
    listener.take_current(np.array(velocity))
