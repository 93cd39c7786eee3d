"""Forces that drive a fluid from outside. Each object changes the velocities of one time step; `oilsim.sea.driving` has that of a sea.

A forcing has `apply(view)`; it changes `view.velocity` in place and reads the rest. Its own random state, if any, is part of
`save()` and `restore(saved)`, so that a run continued from a saved state is the same run.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from oilsim.backend.arrays import Array, Real


class ForcingView(NamedTuple):
    """The view that a forcing has of a time step.

    time, time_step [s]; position, velocity, gradient_sum g_i = sum V grad W (3, N) [m, m/s, 1/m]; phase (N,);
    rest_density per phase [kg/m3]; volume of a particle [m3].
    """

    time: float
    time_step: float
    position: Real
    velocity: Real
    phase: NDArray[np.uint8]
    gradient_sum: Real
    rest_density: Array
    volume: float


class Forcing(Protocol):
    """An object that changes the velocities once in each time step."""

    def apply(self, view: ForcingView) -> None:
        """Change view.velocity (3, N) [m/s] in place."""

    def save(self) -> dict[str, Any]:
        """Return what `restore` needs to continue exactly."""

    def restore(self, saved: dict[str, Any]) -> None:
        """Restore the state that `save` returned."""
