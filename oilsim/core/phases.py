"""The liquids of a run and their material constants."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass

from oilsim.core.quantity import quantity, require

# [deg] contact angle of walls that do not draw one liquid more than another; theory; Young's law
RIGHT_ANGLE = 90.0
# [kg/m3] heaviest liquid; measured; molten osmium has 20,000
HEAVIEST = 25000.0
# [Pa s] most viscous liquid; measured; pitch has 2e8 (Edgeworth et al. 1984)
THICKEST = 1e9
# [1] largest nu dt / d^2 of explicit viscosity; measured; beyond it noise beside walls grows by Eq. 25, from 0.26 on by the split scheme
EXPLICIT_UP_TO = 0.2
# [1/d] steepest gradient of the smoothed field of a flat interface between liquids of 0 and 1; theory; half as much again as the
# kernel's integral over a plane through its middle, 0.54 in two and 0.55 in three dimensions
STEEPEST = 0.8


@dataclass(frozen=True, kw_only=True)
class Phase:
    """One liquid.

    rest_density       [kg/m3]  density at rest
    dynamic_viscosity  [Pa s]   Newtonian viscosity; 0 is an inviscid liquid
    adhesion           [J/m2]   work of adhesion to walls and bodies, the work that separates one square metre of contact
    interfacial_tension  [N/m]  with liquids that have none, as of an oil with water; two liquids have the difference of theirs

    Raises ValueError for an empty name, and for numbers that are not allowed.
    """

    name: str
    rest_density: float = quantity("kg/m3", above=0.0, at_most=HEAVIEST)
    dynamic_viscosity: float = quantity("Pa s", default=0.0, at_least=0.0, at_most=THICKEST)
    adhesion: float = quantity("J/m2", default=0.0, at_least=0.0)
    interfacial_tension: float = quantity("N/m", default=0.0, at_least=0.0)

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name:
            raise ValueError(f"phase: name is {self.name!r}, allowed: a text of one letter or more")
        require(f"phase {self.name!r}", Phase, vars(self))


@dataclass(frozen=True, kw_only=True)
class Wetting:
    """The way in which liquids meet a wall.

    contact_angle  [deg] at which interfaces meet it, through the liquid with the larger interfacial tension
    """

    contact_angle: float = quantity("deg", default=RIGHT_ANGLE, at_least=0.0, at_most=180.0)

    def __post_init__(self) -> None:
        require("wetting", Wetting, vars(self))


def least_pressure(phases: Iterable[Phase], spacing: float) -> float:
    """Return the pressure [Pa] above which no interface of the phases is under a pull (see `interface_stress`); spacing d [m]."""
    return STEEPEST * max((phase.interfacial_tension for phase in phases), default=0.0) / spacing


def weak_depth(phases: Iterable[Phase], spacing: float, gravity: float) -> float:
    """Return the depth [m] under a free surface above which interfaces may break up, as their pull exceeds the pressure of still liquid.

    It is that of `least_pressure` in the lightest liquid that has a tension, 0 where none has; spacing d [m]; gravity [m/s2].
    """
    pulling = [phase for phase in phases if phase.interfacial_tension > 0.0]
    lightest = min((phase.rest_density for phase in pulling), default=math.inf)
    weight = lightest * gravity
    return least_pressure(pulling, spacing) / weight if weight > 0.0 else math.inf


def capillary_inertia(phases: Iterable[Phase]) -> float:
    """Return the least (rho_1 + rho_2) / sigma [kg/(m3 N/m)] of all interfaces; infinite where none has a tension.

    It sets the speed of capillary waves, omega^2 = sigma k^3 / (rho_1 + rho_2) (Lamb 1932, art. 266).
    """
    pairs = itertools.combinations(phases, 2)
    tensions = [
        (one.rest_density + other.rest_density, abs(one.interfacial_tension - other.interfacial_tension))
        for one, other in pairs
    ]
    return min((inertia / tension for inertia, tension in tensions if tension > 0.0), default=math.inf)
