"""Wind and current that change while a run goes on: every part that feels them is told."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from oilsim.forcing import AiryWaves, Current, Wind
from scenarios.schema.weather import horizontal

if TYPE_CHECKING:
    from oilsim.solver import Fluid
    from vessels.control import VesselControl
    from vessels.manual import ManualControl


class CurrentListener(Protocol):
    """Whoever reckons speeds through the water."""

    def take_current(self, velocity: NDArray[np.float64]) -> None:
        """The velocity of the current is `velocity` (3,) [m/s] from now on."""


def set_wind(fluid: Fluid, controls: Iterable[VesselControl | ManualControl], speed: float, direction: float) -> None:
    """The mean wind [m/s], [rad], for the liquid and for vessels; gusts are felt by the liquid only."""
    for forcing in fluid.forcings:
        if isinstance(forcing, Wind):
            forcing.speed, forcing.direction = speed, direction
    for control in controls:
        control.set(f"{control.vessel.name}.wind", np.array(horizontal(speed, direction)))


def set_current(fluid: Fluid, listener: CurrentListener, speed: float, direction: float) -> None:
    """The current [m/s], [rad], what waves are carried by, and what speeds through the water are reckoned against."""
    velocity = horizontal(speed, direction)
    for forcing in fluid.forcings:
        if isinstance(forcing, Current):
            forcing.velocity = velocity
        elif isinstance(forcing, AiryWaves):
            forcing.drift = velocity[:2]
    listener.take_current(np.array(velocity))
