"""The sea: waves, current and wind by formulas, at any points and any time. Needs numpy and numba only.

`Sea` evaluates a frozen `SeaDescription`; the other names describe its parts. `SeaForcing` lets it drive the particles of a tank. The page
"Sea" of the documentation gives equations, sources, check values and what is left out. Descriptions need no compiler: `Sea` and
`SeaForcing` are imported only when they are asked for.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from oilsim.sea.description import Continuation, CurrentProfile, SeaDescription, WindField
from oilsim.sea.flows import FlowTable, SteadyFlow, TidalFlow, Tide
from oilsim.sea.jonswap import JonswapWaves
from oilsim.sea.regular_waves import RegularWaves
from oilsim.sea.wind_stress import KaimalGusts, LangmuirCells, WindDrift

if TYPE_CHECKING:
    from oilsim.sea.driving import SeaForcing, Zone
    from oilsim.sea.sea import Kinematics, Sea

__all__ = [
    "Continuation", "CurrentProfile", "FlowTable", "JonswapWaves", "KaimalGusts", "Kinematics", "LangmuirCells", "RegularWaves", "Sea",
    "SeaDescription", "SeaForcing", "SteadyFlow", "TidalFlow", "Tide", "WindDrift", "WindField", "Zone",
]  # fmt: skip
_WITH_KERNELS = {"Sea": "sea", "Kinematics": "sea", "SeaForcing": "driving", "Zone": "driving"}


def __getattr__(name: str) -> Any:
    """Return `Sea` or another name whose kernels take time to import; AttributeError for one that is not there."""
    if name not in _WITH_KERNELS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"oilsim.sea.{_WITH_KERNELS[name]}"), name)
