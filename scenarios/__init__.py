"""Scenarios: a scenario file becomes a run, by the `oilsim` command or from Python.

The names of `__all__` are the package's own; its rooms may change. A name is imported when it is asked for.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scenarios.bench.scenario_run import ScenarioRun
    from scenarios.cli import main
    from scenarios.running.assembly import build
    from scenarios.spec.load import load_scenario

__all__ = ["ScenarioRun", "build", "load_scenario", "main"]
_HOMES = {"ScenarioRun": "bench.scenario_run", "build": "running.assembly", "load_scenario": "spec.load", "main": "cli"}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used; AttributeError for another one."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}, allowed: {', '.join(__all__)}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
