"""The options of a scenario's recording: the grid of positions, and the particles and the surface in each frame."""

from __future__ import annotations

from recordings.model.sample import grid_within
from scenarios.spec.resolve import RunSpec

FINE = 32  # fewest grid cells in a particle spacing
THINNED = 2  # frames for one frame with water, in a scenario with oil
# [1/s] frames with the surface of a sea by formulas; chosen; enough for long waves, at 1 % of a second's time, 4 % with a window
SEA_RATE = 2.5
# [1] frames with the surface for one frame, in a tank; chosen
SURFACED = 0.5


def grid(scenario: RunSpec) -> float | None:
    """Return the grid [m], a power of two, on which positions are recorded; None keeps every bit."""
    wanted = scenario.recording.precision
    if wanted is None:
        wanted = scenario.fluid.particle_spacing / FINE
    return grid_within(wanted) if wanted > 0.0 else None


def thinning(scenario: RunSpec) -> dict[str, int]:
    """Return, by phase, the number of frames for one with its particles; phases in every frame are left out."""
    oily = any(phase.is_oil for phase in scenario.phases.values())
    return {name: THINNED for name, phase in scenario.phases.items() if oily and not phase.is_oil}


def surface_rate(scenario: RunSpec) -> float:
    """Return the frames with the surface of the water and the film of oil on it, a simulated second [1/s], at most."""
    return SURFACED * scenario.recording.frame_rate if scenario.tanks else SEA_RATE
