"""Small fluids for the core's tests."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from oilsim import Fluid, FluidConfig, Phase
from oilsim.backend import thread_team
from oilsim.core.state import Confinement
from oilsim.fluid import schemes
from oilsim.fluid.paper_scheme import constrain_density
from oilsim.stages.pairs import cache_pair_gradients, search_neighbors
from oilsim.stages.pressure import PressureOperator
from oilsim.stages.relaxation import relax_positions, sum_neighbors
from oilsim.stages.viscosity import begin_viscosity
from oilsim.step.arrays import NeighborSums

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


def search(fluid: Fluid) -> None:
    """Do the stage of a step that lists neighbours; sums over them are still undefined."""
    fluid.arrays.neighbors = search_neighbors(fluid.context, fluid.state)
    fluid.arrays.sums = NeighborSums.of(fluid.state.listed, fluid.arrays.sums.time_unit)


def sum_up(fluid: Fluid, time_step: float) -> None:
    """Sum over neighbours as the relaxation does at its beginning."""
    sums = fluid.arrays.sums = NeighborSums.of(fluid.state.listed, fluid.arrays.sums.time_unit)
    sum_neighbors(fluid.context, fluid.arrays.neighbors, fluid.state, sums, time_step)


def relax_once(fluid: Fluid, time_step: float) -> tuple[int, float]:
    """Do the stage of a step that relaxes positions; returns the passes and the mean compression that they leave."""
    unit = fluid.arrays.sums.time_unit
    fluid.arrays.sums, *left = relax_positions(fluid.context, fluid.arrays.neighbors, fluid.state, time_step, unit)
    return left[0], left[1]


def cache(fluid: Fluid) -> None:
    """Do the stage of a step that stores pair vectors."""
    arrays, position = fluid.arrays, fluid.state.position
    arrays.pairs = cache_pair_gradients(fluid.context, arrays.neighbors, arrays.sums, position, arrays.pairs)


def operator_of(fluid: Fluid) -> PressureOperator:
    """The pressure operator at the present positions and velocities."""
    filled = fluid.state.confinement == Confinement.FILLED
    return PressureOperator(fluid.context, fluid.arrays.neighbors, fluid.arrays.pairs, fluid.state.velocity, filled)


def let_viscosity_act(fluid: Fluid, time_step: float) -> tuple[int, float]:
    """Do the stages of viscosity; returns iterations and what they leave."""
    step = begin_viscosity(fluid.context, fluid.state, time_step)
    return schemes.let_viscosity_act(fluid.context, fluid.clock, fluid.arrays, fluid.state, step)


def constrain(fluid: Fluid) -> tuple[int, float, NDArray[np.float32]]:
    """Apply the paper's density constraint to the positions."""
    fluid.arrays.sums = NeighborSums.of(fluid.state.listed, fluid.context.time_unit)
    return constrain_density(fluid.context, fluid.arrays.neighbors, fluid.arrays.sums, fluid.state.position)


def prepare(fluid: Fluid, time_step: float = 1e-9) -> None:
    """Do the part of a split step before its solves: lists, one relaxation, pair gradients.

    In the default time step no velocity is filtered; the relaxation moves particles as it does in any other.
    """
    search(fluid)
    relax_once(fluid, time_step)
    cache(fluid)
