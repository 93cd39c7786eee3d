"""The sea without particles: waves, current and wind by formulas, at any points and any time. Needs numpy and numba only.

`Sea` evaluates a frozen `SeaDescription`; the other names describe its parts. The page "Sea" of the documentation gives equations,
sources, check values and what is left out. Descriptions need no compiler: `Sea` is imported only when it is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from oilsim.sea.description import Continuation, CurrentProfile, SeaDescription, WindField
from oilsim.sea.flows import FlowTable, SteadyFlow, TidalFlow
from oilsim.sea.gusts import KaimalGusts
from oilsim.sea.jonswap import JonswapWaves
from oilsim.sea.langmuir import LangmuirCells
from oilsim.sea.regular_waves import RegularWaves
from oilsim.sea.tide import Tide
from oilsim.sea.turbulence import Turbulence
from oilsim.sea.wind_stress import WindDrift

if TYPE_CHECKING:
    from oilsim.sea.sea import Kinematics, Sea

__all__ = [
    "Continuation", "CurrentProfile", "FlowTable", "JonswapWaves", "KaimalGusts", "Kinematics", "LangmuirCells", "RegularWaves", "Sea",
    "SeaDescription", "SteadyFlow", "TidalFlow", "Tide", "Turbulence", "WindDrift", "WindField",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    """Return `Sea` or `Kinematics`, whose kernels take time to import; AttributeError for another name."""
    if name not in ("Sea", "Kinematics"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from oilsim.sea import sea

    return getattr(sea, name)
