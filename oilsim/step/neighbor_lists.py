"""The lists of fluid and wall neighbours of a step, found anew at its positions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from oilsim.backend.thread_team import Team
from oilsim.boundaries.walls import Walls
from oilsim.core.state import FluidState
from oilsim.neighborhood.neighbor_search import CellOrder, NeighborSearch, Pairs, Sorted


class NeighborLists:
    """Sorts the particles by cell and lists their neighbours; particles that sleep are sorted once."""

    def __init__(self, search: NeighborSearch, team: Team) -> None:
        self._search, self._team = search, team
        self._sleepers: NDArray[np.uint32] | None = None  # starts of cells, counted from the first that sleeps

    def update(self, state: FluidState, walls: Walls) -> tuple[Pairs, Pairs]:
        """Return fluid and wall neighbours at the present positions, after sorting the state by cell."""
        search, awake = self._search, state.awake
        if search.cover(state.position, awake):
            self.forget()
        walls.place()
        order, cell_start = search.order_by_cell(state.position, awake)
        state.take(np.concatenate([order, np.arange(awake, state.count, dtype=np.uint32)]), self._team)
        near, moving = walls.order_moving(walls.moving_position)
        asleep = self._order_asleep(state)
        position, count = state.position, state.listed
        fluid = search.list_neighbors("fluid", position, Sorted(position, cell_start), moving=asleep, count=count)
        resting = Sorted(walls.position, walls.cell_start)
        return fluid, search.list_neighbors("walls", position, resting, near, moving, count)

    def forget(self) -> None:
        """Drop the order of the particles that sleep, after others fell asleep or woke."""
        self._sleepers = None

    def _order_asleep(self, state: FluidState) -> CellOrder | None:
        """Sort the particles that sleep beside others by cell, once, and return where those of each cell lie; None where none sleeps.

        Particles behind them have no row in the arrays of a step, and belong in no list.
        """
        if not state.asleep:
            return None
        awake, listed = np.uint32(state.awake), state.listed
        if self._sleepers is None:
            order, self._sleepers = self._search.order_by_cell(state.position[:, awake:listed].copy())
            others = np.arange(listed, state.count, dtype=np.uint32)
            moved = np.concatenate([np.arange(awake, dtype=np.uint32), order + awake, others])
            state.take(moved, self._team)
        return CellOrder(None, self._sleepers + awake)
