"""Contexts and states of a few particles, made by hand: no stage needs a `Fluid`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

from oilsim import FluidConfig, Phase
from oilsim.backend.thread_team import Team
from oilsim.core.state import FluidState
from oilsim.step.context import StepContext

SPACING = 0.1
WATER = Phase(name="water", rest_density=1000.0)
OIL = Phase(name="oil", rest_density=800.0)


@pytest.fixture
def make_context() -> Callable[..., StepContext]:
    """Make the context of water and oil without weight in a box of 2 m; keywords change the configuration."""

    def make(**options: Any) -> StepContext:
        settings: dict[str, Any] = {
            "particle_spacing": SPACING, "phases": (WATER, OIL), "lower": (-1.0,) * 3, "upper": (1.0,) * 3, "gravity": (0.0,) * 3,
        }  # fmt: skip
        return StepContext.of(FluidConfig(**(settings | options)), Team(1))

    return make


def state_of(position: ArrayLike, velocity: ArrayLike = (0.0, 0.0, 0.0), phases: tuple[int, ...] = ()) -> FluidState:
    """A state of water at `position` (N, 3) [m], or of the phase of each particle."""
    points = np.array(position, np.float64).reshape(-1, 3)
    state = FluidState(viscous_time=np.zeros(2))
    state.append(points, np.broadcast_to(np.array(velocity, np.float64), points.shape), 0)
    if phases:
        state.phase[:] = phases
    return state
