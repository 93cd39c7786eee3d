"""The result of a time step: its length, iterations and errors."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class StepResult:
    """Length of a step [s], its solves' iterations and the mean compression [1] they leave, of positions and to which velocities lead."""

    time_step: float
    density_iterations: int
    divergence_iterations: int
    viscosity_iterations: int
    density_error: float
    divergence_error: float
