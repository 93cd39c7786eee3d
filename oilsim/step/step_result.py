"""The result of a time step: its length, iterations and errors."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class StepResult:
    """Length of a step [s], its solves' iterations and the mean compression [1] they leave, of positions and to which velocities lead.

    viscosity_error  what the viscous solve leaves of the explicit change [1]
    crowding         mean compression [1] of liquid that fills its box, which no solve can change; 0 where a surface is free
    """

    time_step: float
    density_iterations: int
    divergence_iterations: int
    viscosity_iterations: int
    density_error: float
    divergence_error: float
    viscosity_error: float = 0.0
    crowding: float = 0.0
