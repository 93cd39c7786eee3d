"""Turbulent dispersion of floating parcels as a random walk, and how a slick grows along the wind (Lehr et al. 1984).

A walk of independent normal steps sqrt(2 K dt) in each direction gives a cloud of variance 2 K t (Einstein 1905). Lehr's ellipse has the
axes, in metres,

    Q = 53.76 (D V)^(1/3) t^(1/4)            across the wind: a modified gravity-viscous spreading
    R = Q + 0.95 W^(4/3) t^(3/4)             along it

with D = rho_water / rho_oil - 1, V in barrels, t in minutes and W in knots (Lehr, Cekirge, Fraga and Belen 1984, Oil Petrochem. Pollut. 2,
7-11: area 2270 (D V)^(2/3) t^(1/2) + 40 (D V)^(1/3) W^(4/3) t in m2, which is pi / 4 Q R).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from oilsim.core.quantity import Quantity, quantity, require

Double = NDArray[np.float64]

# [m] minor axis for 1 barrel with D = 1 after 1 minute; paper (Lehr et al. 1984); 53.76, from its area of 2270 m2
LEHR_MINOR = 53.76
# [m] growth of the major axis by 1 knot in 1 minute; paper (Lehr et al. 1984); 0.95, from its area of 40 m2
LEHR_MAJOR = 0.95
# [m3] a barrel of oil; paper (API); 42 US gallons
BARREL = 0.158987294928
# [m/s] a knot; paper (International Extraordinary Hydrographic Conference 1929); 1852 m an hour
KNOT = 1852.0 / 3600.0
# [s] a minute; theory; 60 s
MINUTE = 60.0

LEHR_QUANTITIES = {
    "volume": Quantity(unit="m3", at_least=0.0),
    "density_ratio": Quantity(above=1.0),
    "wind_speed": Quantity(unit="m/s", at_least=0.0),
    "time": Quantity(unit="s", at_least=0.0),
}


def lehr_axes(*, volume: float, density_ratio: float, wind_speed: float, time: float) -> tuple[float, float]:
    """Return the minor and the major axis [m], whole lengths, of Lehr's ellipse.

    volume [m3]; density_ratio rho_water / rho_oil [-], above 1; wind_speed [m/s] at 10 m; time [s] since an instant release.
    Raises ValueError for values that are not allowed.
    """
    given = {"volume": volume, "density_ratio": density_ratio, "wind_speed": wind_speed, "time": time}
    faults = [f"{name} {fault}" for name, value in given.items() if (fault := LEHR_QUANTITIES[name].fault(value))]
    if faults:
        raise ValueError("lehr ellipse: " + "; ".join(faults))
    minutes, buoyant_barrels = time / MINUTE, (density_ratio - 1.0) * volume / BARREL
    minor = LEHR_MINOR * buoyant_barrels ** (1.0 / 3.0) * minutes**0.25
    return minor, minor + LEHR_MAJOR * (wind_speed / KNOT) ** (4.0 / 3.0) * minutes**0.75


def lehr_diffusivity(wind_speed: float, age: ArrayLike) -> Double:
    """Return the diffusivity along the wind (N,) [m2/s] that makes a cloud of `age` (N,) [s] grow as Lehr's major axis does by wind.

    An evenly covered ellipse of the axis R has the deviation R / 4. The wind's part of it, 0.95 W^(4/3) t^(3/4) / 4, grows by
    K = 1/2 d(deviation^2)/dt. wind_speed W [m/s].
    """
    scale = 0.25 * LEHR_MAJOR * (wind_speed / KNOT) ** (4.0 / 3.0)
    return 0.75 * scale * scale * np.sqrt(np.asarray(age, np.float64) / MINUTE) / MINUTE


@dataclass(frozen=True, kw_only=True)
class Turbulence:
    """Dispersion of parcels at the surface.

    diffusivity   K [m2/s], equal in all horizontal directions; 0.1 to 10 at sea
    stretch       whether parcels also disperse along the wind with `lehr_diffusivity`
    seed          of the steps
    Raises ValueError for values that are not allowed.
    """

    diffusivity: float = quantity("m2/s", default=1.0, at_least=0.0)
    stretch: bool = False
    seed: int = quantity("", default=1, at_least=0, whole=True)

    def __post_init__(self) -> None:
        require("turbulence", Turbulence, vars(self))

    def displacement(self, count: int, step: int, time_step: float, wind: Double, age: ArrayLike) -> Double:
        """Draw the displacements (N, 2) [m] of `count` N parcels in one step of `time_step` [s].

        They depend on the seed, on the number of the step and on a parcel's row alone, so that a run that is continued repeats them.
        wind (2,) [m/s] mean at 10 m; age scalar or (N,) [s] of the parcels at the middle of the step. Raises ValueError for a step or a
        time that is not allowed.
        """
        if step < 0 or not time_step >= 0.0:
            raise ValueError(f"turbulence: step is {step}, time_step {time_step} s, allowed: 0 or more each")
        random = np.random.Generator(np.random.Philox(key=self.seed, counter=[0, 0, 0, step]))
        normal = random.standard_normal((count, 2))
        speed = math.hypot(*wind)
        along = np.array(wind) / speed if speed > 0.0 else np.array([1.0, 0.0])
        across = np.array([-along[1], along[0]])
        stretched = self.diffusivity + (lehr_diffusivity(speed, age) if self.stretch else 0.0)
        deviation = np.sqrt(2.0 * time_step * np.broadcast_to(np.asarray(stretched, np.float64), count))
        sideways = math.sqrt(2.0 * time_step * self.diffusivity) * normal[:, 1]
        return (deviation * normal[:, 0])[:, None] * along + sideways[:, None] * across
