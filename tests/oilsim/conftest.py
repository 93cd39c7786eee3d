"""Small fluids for the core's tests."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from oilsim import Fluid, FluidConfig, Phase
from oilsim.backend import thread_team
from oilsim.step.stages.gradients import cache_pair_gradients
from oilsim.step.stages.relaxation import relax_positions
from oilsim.step.stages.search import search_neighbors

WATER = Phase(name="water", rest_density=1000.0)


@pytest.fixture(autouse=True)
def work_is_shared(monkeypatch: pytest.MonkeyPatch) -> None:
    """Threads share the work of small fluids too, where a test asks for several."""
    monkeypatch.setattr(thread_team, "SERIAL_BELOW", 2 * thread_team.BLOCK)


@pytest.fixture
def make_fluid() -> Callable[..., Fluid]:
    """Build a fluid of water with spacing 0.1 m in a box of 2 m, with steps of 10 ms at most; keywords change the configuration."""

    def make(threads: int = 1, **options: Any) -> Fluid:
        settings: dict[str, Any] = {
            "particle_spacing": 0.1,
            "phases": (WATER,),
            "lower": (0.0, 0.0, 0.0),
            "upper": (2.0, 2.0, 2.0),
            "maximum_time_step": 0.01,
        }
        return Fluid(FluidConfig(**(settings | options)), threads=threads)

    return make


def disturbed(positions: NDArray[np.float64], amount: float, seed: int) -> NDArray[np.float64]:
    """Positions moved by a normal deviate of `amount` [m]."""
    return positions + np.random.default_rng(seed).normal(0.0, amount, positions.shape)


def prepare(fluid: Fluid, time_step: float = 1e-9) -> None:
    """Do the part of a split step before its solves: lists, one relaxation, pair gradients.

    In the default time step no velocity is filtered; the relaxation moves particles as it does in any other.
    """
    search_neighbors(fluid.tools, fluid.arrays, fluid.state)
    relax_positions(fluid.tools, fluid.arrays, fluid.state, time_step)
    cache_pair_gradients(fluid.tools, fluid.arrays, fluid.state)
