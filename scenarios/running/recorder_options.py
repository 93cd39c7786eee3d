"""On what terms a scenario is recorded: the grid of positions, and which particles every frame holds."""

from __future__ import annotations

from recordings.sample import grid_within
from scenarios.scenario import Scenario

FINE = 32  # grid cells in a particle spacing, at least
THINNED = 2  # frames for one of water, where there is oil to look at


def grid(scenario: Scenario) -> float | None:
    """Grid [m] of a power of two that positions are recorded on; None: with every bit."""
    wanted = scenario.recording.precision
    if wanted is None:
        wanted = scenario.fluid.particle_spacing / FINE
    return grid_within(wanted) if wanted > 0.0 else None


def thinning(scenario: Scenario) -> dict[str, int]:
    """By phase, in how many frames it is recorded once; phases in every frame are left out."""
    oily = any(phase.is_oil for phase in scenario.phases.values())
    every = scenario.recording.water_every or (THINNED if oily else 1)
    return {name: every for name, phase in scenario.phases.items() if every > 1 and not phase.is_oil}
