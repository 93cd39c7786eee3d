"""Neighbour lists that are kept over steps while particles hardly move (Verlet 1967).

A search on the grid lists candidates: the pairs nearer than support + skin. While no two particles can have approached by more than the
skin since, by the sum of the two largest displacements, no other pair has come within the support, and particles keep their order. Each
step's lists hold exactly the pairs within the support, as a new search would find them. They are filtered from the candidates, and a
particle's list only once one of its candidates may have crossed the support: every filtering notes the least distance that one has to go.
Water that lies almost still costs one look at the displacements.

A skin pays where particles move little in a step, and costs where they do not. So it is chosen at every build from the motion a step
since the build before. Where no skin pays, neighbours are listed on the grid in each step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.jit import FAST
from oilsim.backend.simd.compaction import PACKS, Ball, append_near
from oilsim.backend.thread_team import BLOCK, Team, block_count
from oilsim.boundaries.walls import Walls
from oilsim.neighborhood.neighbor_search import CellOrder, NeighborSearch, Pairs, Sorted, end_list, nearest_images
from oilsim.state import FluidState

Real = NDArray[np.float32]

# [d] skins that are considered; numerical; not on record
SKINS = (0.02, 0.05, 0.1, 0.2, 0.3, 0.4)
# [searches] cost of listing candidates, without the pairs that a skin adds; measured; 1.6 to 2.7, for the wider ring of cells
BUILD_COST = 2.2
# [searches] cost of filtering all lists; measured; 0.45 to 0.9 where the processor packs, else 0.3 to 0.4
FILTER_COST = 0.8 if PACKS else 0.4
# [searches] cost a step below which lists are kept; numerical; not on record
WORTH = 0.9
# [supports] within which a candidate's way to the support is taken from its distance; numerical; not on record
NEARBY = np.float32(1.1)
_NOWHERE: Real = np.empty((3, 0), np.float32)


class Kept(NamedTuple):
    """Neighbour lists of one kind that are filtered from candidates.

    candidates  lists of the pairs nearer than support + skin
    pairs       lists of those nearer than the support
    expiry      (N,) float64, way of relative motion [m] from which on a list must be filtered again
    """

    candidates: Pairs
    pairs: Pairs
    expiry: NDArray[np.float64]


@njit(**FAST)
def largest_displacements(begin, end, position, before, period, largest):
    """Fill `largest` (blocks, 2) with the two largest squared displacements [m2] of each block of particles.

    position, before (3, N): places now and then [m]; period: lengths of periodic axes [m], None if there are none.
    """
    for i in range(begin, end):
        if i % BLOCK == 0 or i == begin:
            first = second = np.float32(0.0)
        dx, dy, dz = nearest_images(
            position[0, i] - before[0, i], position[1, i] - before[1, i], position[2, i] - before[2, i], period
        )
        square = dx * dx + dy * dy + dz * dz
        second = max(second, min(first, square))
        first = max(first, square)
        largest[i // BLOCK, 0] = first
        largest[i // BLOCK, 1] = second


@njit(**FAST)
def filter_lists(begin, end, position, other, kept, period, support, travelled, rounding):
    """Filter the lists of the particles begin to end that have expired: candidates within the support are neighbours.

    position   (3, N) of the particles [m]
    other      (3, M) of those among which the lists are [m]
    kept       the lists, see `Kept`
    period     lengths of periodic axes [m], None if there are none
    support    radius H [m]
    travelled  sum over the steps of the largest relative motion of two particles [m]
    rounding   largest error of a computed distance [m]
    """
    reach_squared = np.float32(support * support)
    for i in range(begin, end):
        if travelled < kept.expiry[i]:
            continue
        first = kept.candidates.start[i]
        last = first + np.int64(kept.candidates.number[i])
        ball = Ball((position[0, i], position[1, i], position[2, i]), -1, reach_squared, period)
        cursor, margin = append_near(ball, other, kept.candidates.neighbor, first, last, kept.pairs.neighbor, first)
        kept.pairs.number[i] = cursor - first
        end_list(kept.pairs.neighbor, cursor)
        # | r - H | = | r^2 - H^2 | / (r + H), at least this for a candidate nearby, and more than (NEARBY - 1) H for others
        distance = min(margin / ((np.float32(1.0) + NEARBY) * support), (NEARBY - np.float32(1.0)) * support)
        kept.expiry[i] = travelled + distance - rounding


def choose_skin(motion: float, support: float, dimension: int) -> float:
    """Return the skin [d] that makes the search cheapest, 0 if none pays.

    motion     largest relative motion of two particles a step [d]
    support    support radius H [d]
    """
    around = 4.0 * math.pi * support**2 if dimension == 3 else 2.0 * math.pi * support
    margin = 0.5 / around  # mean distance [d] that the candidate next to the support has to go
    expired = motion / (motion + margin)
    best, skin = WORTH, 0.0
    for candidate in SKINS:
        steps = 1.0 + (math.floor(candidate / motion) if motion > candidate * 1e-6 else 1e6)
        pairs = ((support + candidate) / support) ** dimension
        cost = pairs * (BUILD_COST + FILTER_COST * (1.0 + (steps - 1.0) * expired)) / steps
        if cost < best:
            best, skin = cost, candidate
    return skin


@dataclass
class Build:
    """State of the fluid and its walls when candidates were listed.

    id             (A,) uint32 of the A particles awake, in their order
    position       (3, A) of these particles [m]
    wall_position  (3, M) of the moving wall particles [m]
    layout         handles of the resting and of the moving boundaries
    skin           way beyond the support that candidates reach [m]; 0: no lists are kept
    steps          steps since
    """

    id: NDArray[np.uint32]
    position: Real
    wall_position: Real
    layout: tuple[tuple[int, ...], tuple[int, ...]]
    skin: float
    steps: int = 0

    def matches(self, state: FluidState, walls: Walls) -> bool:
        """Return whether the same particles, in the same order, meet the same walls."""
        moving = walls.position.shape[1] - walls.resting
        alike = self.layout == walls.layout and self.wall_position.shape[1] == moving
        return alike and np.array_equal(self.id, state.id[: state.awake])


class VerletLists:
    """Brings the lists of fluid and wall neighbours up to date: filters kept lists, or searches anew, whichever is cheaper."""

    def __init__(self, search: NeighborSearch, team: Team, spacing: float, dimension: int) -> None:
        self._search, self._team, self._spacing, self._dimension = search, team, spacing, dimension
        self._support = search.grid.support_radius
        longest = max((float(p) for p in search.period or ()), default=0.0)
        self._rounding = 4.0 * float(np.finfo(np.float32).eps) * (longest + 2.0 * self._support)
        self._build: Build | None = None
        self._kept: dict[str, Kept] = {}
        self._previous: tuple[Real, Real] = (_NOWHERE, _NOWHERE)
        self._travelled = 0.0
        self._sleepers: NDArray[np.uint32] | None = None  # starts of cells, counted from the first that sleeps

    def update(self, state: FluidState, walls: Walls) -> tuple[Pairs, Pairs]:
        """Return fluid and wall neighbours at the present positions; the state is sorted by cell where lists are not kept."""
        if self._search.cover(state.position, state.awake):
            self._sleepers = None
        walls.place()
        build, motion = self._build, math.inf
        if build is not None and build.matches(state, walls):
            motion = self._motion(state, walls, build.position, build.wall_position)
            build.steps += 1
            if build.skin > 0.0 and motion + self._rounding < build.skin:
                return self._keep(build, state, walls)
            motion /= build.steps
        return self._renew(state, walls, motion)

    def forget(self) -> None:
        """Drop all that is kept, after other particles fell asleep or woke, or the walls became others."""
        self._build = self._sleepers = None
        self._kept.clear()

    def save(self, state: FluidState, walls: Walls) -> dict[str, Any] | None:
        """Return what decides when and from where lists are built next; None where the next step builds them anyway."""
        build = self._build
        if build is None or not build.matches(state, walls):
            return None
        return {name: np.copy(v) if isinstance(v, np.ndarray) else v for name, v in vars(build).items()}

    def restore(self, saved: dict[str, Any] | None) -> None:
        """Restore the state that `save` returned; list candidates again from the positions that they were listed from.

        ValueError for a saved state whose positions are not (3, N).
        """
        self.forget()
        self._build = None if saved is None else Build(**saved)
        if self._build is not None and self._build.position.shape != (3, self._build.id.size):
            shapes = f"{self._build.position.shape} for {self._build.id.size} particles"
            raise ValueError(f"saved state has list positions of shape {shapes}, allowed: (3, N)")

    def _motion(self, state: FluidState, walls: Walls, before: Real, walls_before: Real) -> float:
        """Return a bound on the relative motion [m] of any two particles since the positions `before` and `walls_before` (3, ...) [m]."""
        first, second = self._largest(state.position, before)
        wall, _ = self._largest(walls.moving_position, walls_before)
        return first + max(second, wall)

    def _largest(self, position: Real, before: Real) -> tuple[float, float]:
        """Return the two largest displacements [m] since `before` (3, n) of the first n of `position` (3, N) [m]."""
        count = before.shape[1]
        largest = np.zeros((block_count(count) + 1, 2), np.float32)
        self._team.run(largest_displacements, count, position, before, self._search.period, largest)
        second, first = np.sort(largest, axis=None)[-2:]
        return math.sqrt(first), math.sqrt(second)

    def _renew(self, state: FluidState, walls: Walls, motion: float) -> tuple[Pairs, Pairs]:
        """Sort the state and list its neighbours anew; the `motion` [m] a step decides whether with a skin."""
        skin = 0.0
        if math.isfinite(motion):
            skin = self._spacing * choose_skin(motion / self._spacing, self._support / self._spacing, self._dimension)
        search, awake = self._search, state.awake
        order, cell_start = search.order_by_cell(state.position, awake)
        state.take(np.concatenate([order, np.arange(awake, state.count, dtype=np.uint32)]), self._team)
        moving = walls.moving_position
        skin = skin if search.allows(skin) else 0.0
        self._build = Build(state.id[:awake].copy(), state.position[:, :awake].copy(), moving, walls.layout, skin)
        self._kept.clear()
        if skin > 0.0:
            return self._keep(self._build, state, walls)
        near, by_cell = walls.order_moving(moving)
        asleep = self._order_asleep(state)
        position, count = state.position, state.listed
        fluid = search.list_neighbors("fluid", position, Sorted(position, cell_start), moving=asleep, count=count)
        still = Sorted(walls.position, walls.cell_start)
        wall = search.list_neighbors("walls", position, still, near, by_cell, count=count)
        return fluid, wall

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

    def _keep(self, build: Build, state: FluidState, walls: Walls) -> tuple[Pairs, Pairs]:
        """Filter the lists that have expired, after listing candidates if there are none yet."""
        fresh = not self._kept
        if fresh:
            self._list_candidates(build, state, walls)
        else:
            motion = self._motion(state, walls, *self._previous)
            self._travelled += motion
        fluid, wall = self._kept["fluid"], self._kept["walls"]
        if fresh or motion > 0.0:
            self._previous = (state.position[:, : state.awake].copy(), walls.moving_position)
            for kept, other in ((fluid, state.position), (wall, walls.position)):
                self._team.run(
                    filter_lists, state.listed, state.position, other, kept, self._search.period, np.float32(self._support),
                    self._travelled, self._rounding,
                )  # fmt: skip
        return fluid.pairs, wall.pairs

    def _list_candidates(self, build: Build, state: FluidState, walls: Walls) -> None:
        """List the pairs nearer than support + skin at the positions of the `build`, whose particles lie in cell order."""
        search, position, count = self._search, build.position, state.listed
        _, cell_start = search.order_by_cell(position)
        asleep = self._order_asleep(state)
        if state.asleep:
            position = np.concatenate([position, state.position[:, state.awake : state.listed]], axis=1)
        everywhere = np.concatenate([walls.position[:, : walls.resting], build.wall_position], axis=1)
        _, by_cell = walls.order_moving(build.wall_position)
        fluid = search.list_neighbors(
            "fluid candidates", position, Sorted(position, cell_start), None, asleep, build.skin, count
        )
        still = Sorted(everywhere, walls.cell_start)
        wall = search.list_neighbors("wall candidates", position, still, None, by_cell, build.skin, count)
        for name, listed in (("fluid", fluid), ("walls", wall)):
            room = search.reserve(name, listed.start.size, listed.neighbor.size)
            pairs = Pairs(listed.start, room.number, room.neighbor)
            self._kept[name] = Kept(listed, pairs, np.full(listed.start.size, -np.inf))
