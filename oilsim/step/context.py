"""The context of a step's stages: constants, threads, walls, neighbour lists, solvers, and a clock for each stage.

The lists of fluid and wall neighbours of a step, found anew at its positions.
"""

from __future__ import annotations

import math
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from oilsim.accounts.budget import Budget
from oilsim.backend.arrays import Array, Index, Real
from oilsim.backend.thread_team import Team
from oilsim.boundaries.adhesion import adhesion_scale
from oilsim.boundaries.boundary_particles import wall_coverage
from oilsim.boundaries.wall_contact import DISTANCES, NEAREST, PLACES, drop_share
from oilsim.boundaries.walls import Walls
from oilsim.core.config import FluidConfig
from oilsim.core.phases import least_pressure
from oilsim.core.state import FluidState
from oilsim.density.density_feedback import surface_table
from oilsim.density.particle_shifting import SETTLING, shift_balance
from oilsim.drops.drift import drop_speeds
from oilsim.gradients.gradient_correction import STRETCH, exact_share, largest_stretch
from oilsim.gradients.relaxation_time import LONGEST, froude_unit
from oilsim.neighborhood.neighbor_search import CellOrder, Neighborhood, NeighborSearch, Pairs, Sorted, make_grid
from oilsim.neighborhood.smoothing_kernels import lattice_moment, normalisation, steepest_slope
from oilsim.pressure.bounded_solver import BoundConstrainedSolver
from oilsim.pressure.coarse_grid import CoarsePressure
from oilsim.pressure.pressure_gradient import PressureConstants
from oilsim.step.sleeping_regions import SleepingRegions
from oilsim.viscosity.pair_stiffness import viscosity_matrix
from oilsim.viscosity.viscous_system import FINEST


class NeighborLists:
    """Sorts the particles by cell and lists their neighbours; particles that sleep are sorted once."""

    def __init__(self, search: NeighborSearch, team: Team) -> None:
        self._search, self._team = search, team
        self._sleepers: Index | None = None  # starts of cells, counted from the first that sleeps

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


class StepConstants:
    """Numbers that follow from the configuration, in the precision of the kernels.

    period                     of the axes that repeat [m], 0 of the others; None if none does
    support, sigma, volume     radius [m] and constant of the kernel, volume of a particle at rest
    plane                      two dimensions: y is absent
    moment                     m_0, moment of a lattice [1]
    gravity                    (3,) [m/s2]; weightless: it is 0
    reducible                  one liquid whose weight walls bear: where it fills its box, the solve finds the reduced pressure
    corrected                  pair vectors are corrected, walls take extrapolated pressures: our scheme, not the paper's
    wall_weight                w of `pressure_gradient` [1]
    shift_balance              a of `particle_shifting` [1]
    surface_table              table of `density_feedback`
    pressure                   constants of `pressure_gradient`
    densities, viscosities     of the phases [kg/m3], [Pa s]; reference_density: that of the first
    weights                    rho_ref / rho_0 of the phases [1]
    exact                      share of M^-1 in the correction matrices of the phases [1]
    pair_viscosity             between phases (P, P) [Pa s]
    adhesion                   of the phases, as `adhesion_acceleration` takes it; None where none sticks
    tensions                   of the phases (P,) [N/m]; None where none has any
    drop_speeds                of the phases in each other, as `drift.choose_partners` takes them; None for one liquid, or without gravity
    least_pressure             mean pressure [Pa] at least of liquid that fills a box
    touching_wall, nearest_wall  coverage of the kernel at a wall's surface, and where a drop's contact begins [1]
    wall_coverages             that at even distances from a wall (see `wall_contact`)
    drop                       share of its kernel up to which liquid makes a drop [1]
    gradient_quantum           unit of the rounded pair vectors [1/m]
    """

    def __init__(self, config: FluidConfig) -> None:
        d, dimension = config.particle_spacing, config.dimension
        period = exact_period(config)
        self.period = None if period is None else (np.float32(period[0]), np.float32(period[1]), np.float32(period[2]))
        self.support = np.float32(config.support_radius)
        self.sigma = np.float32(normalisation(d, dimension))
        self.volume = np.float32(config.rest_volume)
        self.plane = dimension == 2
        self.moment = np.float32(lattice_moment(dimension))
        self.gravity = tuple(np.float32(g) for g in config.gravity)
        self.weightless = not any(config.gravity)
        self.corrected = config.scheme == "split"
        falls = any(g != 0.0 and endless for g, endless in zip(config.gravity, config.periodic, strict=True))
        self.reducible = self.corrected and len(config.phases) == 1 and not (self.weightless or falls)
        self.wall_weight = np.float32(2.0 if self.corrected else 1.0)
        self.shift_balance = np.float32(shift_balance(dimension))
        self.surface_table = surface_table(d, dimension)
        self.pressure = PressureConstants(self.moment, self.wall_weight, self.plane, self.gravity)
        self.densities: Array = np.array([phase.rest_density for phase in config.phases])
        self.reference_density = float(self.densities[0])
        self.weights: Real = (self.reference_density / self.densities).astype(np.float32)
        self.viscosities = [config.viscosity_correction * phase.dynamic_viscosity for phase in config.phases]
        filter_time = 0.0 if self.weightless else SETTLING * froude_unit(d, config.gravity)
        damping = FINEST * np.array(self.viscosities) / self.densities / d**2 * filter_time
        self.exact: Real = np.array([exact_share(rate) for rate in damping], np.float32)
        self.pair_viscosity: Real = viscosity_matrix(self.viscosities, same_phase_only=not self.corrected)
        scale = adhesion_scale(dimension) / d**dimension
        strength = [phase.adhesion * scale / phase.rest_density for phase in config.phases]
        self.adhesion = np.array(strength, np.float32) if any(strength) else None
        tensions = [phase.interfacial_tension for phase in config.phases]
        self.tensions = np.array(tensions, np.float32) if any(tensions) else None
        speed_of_drops = drop_speeds(config.phases, d, dimension, math.hypot(*config.gravity))
        self.drop_speeds = speed_of_drops if speed_of_drops[0].any() else None
        self.least_pressure = least_pressure(config.phases, d)
        self.touching_wall = np.float32(wall_coverage(0.0, dimension))
        self.nearest_wall = np.float32(wall_coverage(float(NEAREST), dimension))
        self.wall_coverages: Real = np.array(
            [wall_coverage(float(h), dimension) for h in np.linspace(*DISTANCES, PLACES)], np.float32
        )
        self.drop = drop_share(float(self.sigma) * config.rest_volume)
        longest = config.rest_volume * steepest_slope(d, dimension)
        longest *= largest_stretch(lattice_moment(dimension), float(self.exact.max())) + STRETCH
        self.gradient_quantum = np.float32(longest / np.iinfo(np.int16).max)


def exact_period(config: FluidConfig) -> tuple[float, float, float] | None:
    """Return the lengths [m] of the axes that repeat, 0 of the others; None if none does."""
    if not any(config.periodic):
        return None
    sides = zip(config.lower, config.upper, config.periodic, strict=True)
    x, y, z = (high - low if repeats else 0.0 for low, high, repeats in sides)
    return x, y, z


@dataclass(frozen=True)
class StepContext:
    """Everything that the stages of all steps of one fluid share, beside the arrays that they read.

    config, constants, team   settings, numbers that follow from them, threads
    walls                     walls and bodies, whose motion advances
    lists, regions            neighbour lists, and regions that may sleep; None where water never sleeps
    coarse, solver            coarse grid and solver of the pressure
    time_unit                 of relaxation [s] with gravity (see `relaxation_time`); weightless liquid finds its own in every step
    """

    config: FluidConfig
    constants: StepConstants
    team: Team
    walls: Walls
    lists: NeighborLists
    regions: SleepingRegions | None
    coarse: CoarsePressure
    solver: BoundConstrainedSolver
    time_unit: float

    @classmethod
    def of(cls, config: FluidConfig, team: Team) -> StepContext:
        """Make the context of a fluid of this configuration, without walls."""
        constants, period = StepConstants(config), exact_period(config)
        grid = make_grid(config.lower, config.upper, config.periodic, config.support_radius, config.dimension)
        search = NeighborSearch(grid, team, period)
        unit = LONGEST if constants.weightless else froude_unit(config.particle_spacing, config.gravity)
        return cls(
            config, constants, team,
            Walls(search, config.lower, period), NeighborLists(search, team),
            SleepingRegions(config, team) if config.sleep_speed > 0.0 else None, CoarsePressure(config, team),
            BoundConstrainedSolver(team), min(unit, config.capillary_time),
        )  # fmt: skip

    def neighborhood(self, count: int, fluid: Pairs, walls: Pairs) -> Neighborhood:
        """Make a neighbourhood of `count` particles, whose places are still undefined, with these lists of neighbours."""
        constants, points = self.constants, np.empty((count, 4), np.float32)
        return Neighborhood(
            points, self.walls.points, constants.period, fluid, walls, constants.sigma, constants.support, constants.volume
        )  # fmt: skip


class StepClock:
    """Wall time and accounts by stage: `seconds` by name, and the `budget` of energy and momentum, None unless asked for."""

    def __init__(self) -> None:
        self.seconds: defaultdict[str, float] = defaultdict(float)
        self.budget: Budget | None = None

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Add the wall time of a block to the named stage, and its changes to the budget if one is kept."""
        if self.budget is not None:
            self.budget.enter(name)
        begin = time.perf_counter()
        yield
        self.seconds[name] += time.perf_counter() - begin
        if self.budget is not None:
            self.budget.leave(name)

    @contextmanager
    def booked(self) -> Iterator[None]:
        """Let the budget, if one is kept, count what a block between advances changes."""
        if self.budget is not None:
            self.budget.open()
        yield
        if self.budget is not None:
            self.budget.suspend()
