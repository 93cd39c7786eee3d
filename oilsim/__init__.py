"""The fluid core: particles of oil and water among walls and bodies. Needs numpy and numba only.

    from oilsim import Fluid, FluidConfig, Phase, block

The names of `__all__` are the package's own; its rooms may change. A name is imported when it is asked for, so that a run without
particles compiles none.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from oilsim.boundaries.boundary_particles import BoundaryParticles, solid_box, tank_walls
    from oilsim.core.config import FluidConfig
    from oilsim.core.initial_conditions import block, cylinder, sphere
    from oilsim.core.phases import Phase
    from oilsim.fluid.advance_report import AdvanceReport
    from oilsim.fluid.emitter import PipeEmitter
    from oilsim.fluid.fluid import Fluid, FluidError

__all__ = [
    "AdvanceReport", "BoundaryParticles", "Fluid", "FluidConfig", "FluidError", "Phase", "PipeEmitter", "block", "cylinder",
    "solid_box", "sphere", "tank_walls",
]  # fmt: skip

_MODULES = {
    "boundaries.boundary_particles": ("BoundaryParticles", "solid_box", "tank_walls"),
    "core.config": ("FluidConfig",),
    "core.initial_conditions": ("block", "cylinder", "sphere"),
    "core.phases": ("Phase",),
    "fluid.advance_report": ("AdvanceReport",),
    "fluid.emitter": ("PipeEmitter",),
    "fluid.fluid": ("Fluid", "FluidError"),
}
_HOMES = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    """Import a public name from its room; AttributeError for another name."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}, allowed: {', '.join(__all__)}")
    value = globals()[name] = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    return value
