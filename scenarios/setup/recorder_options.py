"""The options of a scenario's recording: the grid of positions, and the particles and the surface in each frame."""

from __future__ import annotations

from collections.abc import Mapping

from recordings.model.sample import grid_within
from scenarios.schema.liquid import PhaseSettings

FINE = 32  # fewest grid cells in a particle spacing
THINNED = 2  # frames for one frame with water, in a scenario with oil
# [1/s] frames with the surface of a sea by formulas; chosen; enough for long waves, at 1 % of a second's time, 4 % with a window
SEA_RATE = 2.5
# [1] frames with the surface for one frame, in a tank; chosen
SURFACED = 0.5


def grid(precision: float | None, spacing: float) -> float | None:
    """Return the grid [m], a power of two, on which positions are recorded; None keeps every bit; spacing [m] of the particles."""
    wanted = spacing / FINE if precision is None else precision
    return grid_within(wanted) if wanted > 0.0 else None


def thinning(phases: Mapping[str, PhaseSettings]) -> dict[str, int]:
    """Return, by phase, the number of frames for one with its particles; phases in every frame are left out."""
    oily = any(phase.is_oil for phase in phases.values())
    return {name: THINNED for name, phase in phases.items() if oily and not phase.is_oil}


def surface_rate(frame_rate: float, *, in_tank: bool) -> float:
    """Return the frames with the surface of the water and the film of oil on it, a simulated second [1/s], at most."""
    return SURFACED * frame_rate if in_tank else SEA_RATE
