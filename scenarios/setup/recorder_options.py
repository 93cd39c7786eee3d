"""The options of a scenario's recording: the grid of positions, and the particles and the surface in each frame."""

from __future__ import annotations

from recordings.model.sample import grid_within
from scenarios.spec.resolve import RunSpec

FINE = 32  # fewest grid cells in a particle spacing
THINNED = 2  # frames for one frame with water, in a scenario with oil


def grid(scenario: RunSpec) -> float | None:
    """Return the grid [m], a power of two, on which positions are recorded; None keeps every bit."""
    wanted = scenario.recording.precision
    if wanted is None:
        wanted = scenario.fluid.particle_spacing / FINE
    return grid_within(wanted) if wanted > 0.0 else None


def thinning(scenario: RunSpec) -> dict[str, int]:
    """Return, by phase, the number of frames for one with its particles; phases in every frame are left out."""
    oily = any(phase.is_oil for phase in scenario.phases.values())
    every = scenario.recording.water_every or (THINNED if oily else 1)
    return {name: every for name, phase in scenario.phases.items() if every > 1 and not phase.is_oil}
