"""The options of a scenario's recording: the grid of positions, and the particles and the surface in each frame."""

from __future__ import annotations

from recordings.model.sample import grid_within
from scenarios.scenario import Scenario

FINE = 32  # fewest grid cells in a particle spacing
THINNED = 2  # frames for one frame with water, in a scenario with oil
SEA_RATE = 2.5  # [1/s] of a sea by formulas; enough for long waves, at 1 % of a second's time, 4 % with a window
SURFACED = 0.5  # [1] frames with the surface for one frame, in a tank


def grid(scenario: Scenario) -> float | None:
    """Return the grid [m], a power of two, on which positions are recorded; None keeps every bit."""
    wanted = scenario.recording.precision
    if wanted is None:
        wanted = scenario.fluid.particle_spacing / FINE
    return grid_within(wanted) if wanted > 0.0 else None


def thinning(scenario: Scenario) -> dict[str, int]:
    """Return, by phase, the number of frames for one with its particles; phases in every frame are left out."""
    oily = any(phase.is_oil for phase in scenario.phases.values())
    every = scenario.recording.water_every or (THINNED if oily else 1)
    return {name: every for name, phase in scenario.phases.items() if every > 1 and not phase.is_oil}


def surface_rate(scenario: Scenario) -> float:
    """Return how many frames a simulated second [1/s] hold the water's surface."""
    recording = scenario.recording
    if recording.surface_rate is not None:
        return recording.surface_rate
    return SURFACED * recording.frame_rate if scenario.run.has_particles else SEA_RATE
