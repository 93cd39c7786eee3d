"""The sea as a slick sees it: one function, which any model of a sea can offer."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class SurfaceFlow(Protocol):
    """The motion of floating oil where no boom is: current, Stokes drift and drift of the wind, added up.

    The velocity is the mean over waves. Turbulence finer than the flow's own scale is not in it: `SlickSettings.diffusivity` stands for it.
    """

    def surface_velocity(self, points_xy: Array, time: float) -> Array:
        """Return the velocity (N, 2) [m/s] at points (N, 2) [m] in the world at `time` [s]; it must not write into the points."""
