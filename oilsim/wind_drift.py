"""The drift that an established wind has given to the water near the surface: the state from which a run with wind starts.

Wind takes minutes to set the water moving, so that a run of an exercise would never see it.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from oilsim.core.physical_constants import AIR_DENSITY
from oilsim.forcing import ForcingView, Wind, heading

# [1] drift of the surface / the wind at 10 m; paper; 2 % by shear, 0.53 u* (Wu 1975), and 1 % Stokes drift of the waves
SURFACE_DRIFT = 0.03
# [1] von Karman's constant; paper; law of the wall (Wu 1975)
KARMAN = 0.4
# [m] length over which the shear begins; tuned; with it the drift at 10 m/s ends 10 m down
ROUGHNESS = 1e-3


def friction_velocity(wind_speed: float, water_density: float, drag_coefficient: float) -> float:
    """Return the friction velocity [m/s] in the water under a wind [m/s] at 10 m: sqrt(rho_air C_D / rho) U; density [kg/m3]."""
    return math.sqrt(AIR_DENSITY * drag_coefficient / water_density) * wind_speed


def wind_drift(depth: NDArray[Any], wind_speed: float, friction: float, *, waves: float = 0.0) -> NDArray[np.float64]:
    """Return the speed [m/s] along the wind at depths (N,) [m] below the surface: 3 % of the wind there, less below.

    u(z) = U_s - u* / kappa ln(1 + z / z0), not below 0: a layer of constant stress (law of the wall). `friction` [m/s] is u*; `waves`
    [m/s] is the Stokes drift at the surface of waves that the run has itself, which U_s then leaves out.
    """
    surface = max(0.0, SURFACE_DRIFT * wind_speed - waves)
    below = np.maximum(np.asarray(depth, dtype=np.float64), 0.0)
    return np.maximum(0.0, surface - friction / KARMAN * np.log1p(below / ROUGHNESS))


class WindDrift:
    """Keeps the shear of the drift under an established wind, which the particles' own mixing would even out within a minute.

    Each step takes the share 1 - exp(-dt / `KEEPING`) of what the liquid's mean shear lacks: du = share (1 - a) (s - mean s) along the
    established wind, with s the drift of `wind_drift` at each particle's depth and a = sum u (s - mean s) / sum (s - mean s)^2. It adds no
    momentum: the stress of the `Wind` does that. When the wind changes, the established wind follows within `SPIN_UP`.
    """

    # [s] within which lost shear comes back; numerical; a tenth of the time in which the mixing takes it away
    KEEPING = 1.0
    # [s] time constant with which the drift follows a wind that changes; tuned; of the order of ten minutes at sea
    SPIN_UP = 600.0

    def __init__(self, wind: Wind, *, level: float, spacing: float, water_density: float, waves: float = 0.0) -> None:
        """Keep the drift under `wind`, established from the start.

        level [m] of the still water; spacing [m] of the particles; water_density [kg/m3]; waves [m/s]: Stokes drift of the run's own.
        """
        self._wind, self._level, self._spacing = wind, level, spacing
        self._density, self._waves = water_density, waves
        self.established = self._blowing()

    def speeds(self, height: NDArray[Any]) -> NDArray[np.float64]:
        """Return the speeds (N,) [m/s] along the established wind at heights (N,) [m]; the uppermost layer of particles is the surface."""
        wind = float(np.hypot(*self.established))
        friction = friction_velocity(wind, self._density, self._wind.drag_coefficient)
        return wind_drift(self._level - 0.5 * self._spacing - height, wind, friction, waves=self._waves)

    def velocities(self, height: NDArray[Any]) -> NDArray[np.float64]:
        """Return the horizontal velocities (2, N) [m/s] at heights (N,) [m]."""
        return self._along()[:, None] * self.speeds(height)

    def apply(self, view: ForcingView) -> None:
        """Let the established wind follow the wind, then give back the shear that has been lost since the last step."""
        following = -math.expm1(-view.time_step / self.SPIN_UP)
        self.established = self.established + following * (self._blowing() - self.established)
        shear = self.speeds(view.position[2])
        shear -= shear.mean() if len(shear) else 0.0
        whole = float(shear @ shear)
        if whole == 0.0:
            return
        along = self._along()
        there = float(shear @ (along[0] * view.velocity[0] + along[1] * view.velocity[1])) / whole
        change = -math.expm1(-view.time_step / self.KEEPING) * (1.0 - there) * shear
        for axis in (0, 1):
            if along[axis]:
                view.velocity[axis] += (along[axis] * change).astype(np.float32)

    def _along(self) -> NDArray[np.float64]:
        """Return the unit vector (2,) of the established wind; 0 without wind."""
        wind = float(np.hypot(*self.established))
        return self.established / wind if wind > 0.0 else np.zeros(2)

    def _blowing(self) -> NDArray[np.float64]:
        return self._wind.speed * np.array(heading(self._wind.direction))

    def save(self) -> dict[str, Any]:
        """Return the established wind, for `restore`."""
        return {"established": self.established.copy()}

    def restore(self, saved: dict[str, Any]) -> None:
        """Restore the established wind that `save` returned."""
        self.established = np.array(saved["established"])
