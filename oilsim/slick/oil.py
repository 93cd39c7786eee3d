"""The properties of an oil that a slick depends on."""

from __future__ import annotations

from dataclasses import dataclass

from oilsim.core.quantity import quantity, require


@dataclass(frozen=True, kw_only=True)
class Oil:
    """An oil on water, at the temperature of the run.

    density              [kg/m3]
    dynamic_viscosity    [Pa s]
    interfacial_tension  [N/m]  between oil and water; it resists the tearing of droplets
    spreading_tension    [N/m]  net tension that pulls a thin slick outwards: that of water less those of oil and interface (Fay 1971)
    number               [1]    place among the oils of a run, from 0; parcels of different oils never merge

    Raises ValueError for a value that is not allowed.
    """

    density: float = quantity("kg/m3", above=0.0)
    dynamic_viscosity: float = quantity("Pa s", above=0.0)
    interfacial_tension: float = quantity("N/m", at_least=1e-3, at_most=0.1)
    spreading_tension: float = quantity("N/m", default=0.01, at_least=0.0)
    number: int = 0

    def __post_init__(self) -> None:
        require("oil", Oil, vars(self))
