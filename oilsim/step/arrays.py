"""The arrays of one time step, each group returned by the stage that fills it: no physics, no order of stages.

N counts the particles that are listed: those that move, then those that sleep beside them. P and Q count the entries of the lists of
fluid and wall neighbours, with their padding. All are float32 unless said otherwise. None: the step does not need it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from oilsim.backend.arrays import Flags, Index, Real
from oilsim.boundaries.contacts import NO_BODY_PAIRS, NO_CONTACTS, BodyPairs, Contacts
from oilsim.gradients.free_surface import FreeSurface
from oilsim.neighborhood.neighbor_search import Neighborhood, Pairs
from oilsim.pressure.pressure_gradient import PairVectors, PressureSums, PressureVectors
from oilsim.pressure.wall_extrapolation import WallPressure
from oilsim.step.context import StepContext

NO_PAIRS = Pairs(np.zeros(0, np.int64), np.zeros(0, np.uint32), np.zeros(0, np.uint32))


@dataclass(frozen=True)
class Neighbors:
    """Lists of neighbours, and what belongs to their particles, as the search finds them.

    neighborhood        lists of neighbours, and constants of sums over them
    weight (N,)         rho_ref / rho_0 of the particle's phase [1]
    rest_density (N,)   rho_0 [kg/m3]
    body_pairs          pairs of particles and points of moving bodies (see `contacts`)
    touching (T,)       uint32, particles that have such a pair
    by_body (N,)        bool, whether a particle is one of them
    awake               number of particles that move, the first ones
    """

    neighborhood: Neighborhood
    weight: Real
    rest_density: Real
    body_pairs: BodyPairs
    touching: Index
    by_body: Flags
    awake: int

    @property
    def points(self) -> Real:
        """Places [m] and weights of the particles side by side (N, 4), for kernels that gather them."""
        return self.neighborhood.points


@dataclass
class NeighborSums:
    """Sums over neighbours, as the relaxation finds them.

    flow (N, 16)         velocity [m/s], weight [1], velocity gradient [1/s] (see `particle_sums`)
    compression (N,)     sum V W - 1 [1], less `crowding` once positions are relaxed
    crowding             mean compression of liquid that fills its box [1], 0 where a surface is free
    gradient_sum (3, N)  sum V grad W [1/m]
    matrix (N, 8)        Y of `gradient_correction` [1]
    surface (N,)         uint8, a `FreeSurface`: how near one is
    time_unit            of relaxation [s] (see `relaxation_time`)
    """

    flow: Real
    compression: Real
    gradient_sum: Real
    matrix: Real
    surface: NDArray[np.uint8]
    time_unit: float
    crowding: float = 0.0

    @classmethod
    def of(cls, count: int, time_unit: float) -> NeighborSums:
        """Make room for `count` particles; time_unit [s] of the step before."""
        empty, surface = np.empty, np.full(count, FreeSurface.NEAR_SURFACE, np.uint8)
        flow, matrix = empty((count, 16), np.float32), np.zeros((count, 8), np.float32)
        return cls(flow, empty(count, np.float32), empty((3, count), np.float32), matrix, surface, time_unit)


@dataclass(frozen=True)
class PairArrays:
    """Pair vectors, and the sums of them that the pressure operator needs.

    repaired (N, 8)          Y where particles pass each other (`gradient_correction`) [1]
    gradient                 pair vectors (3, P) of fluid neighbours [1/m]
    wall_gradient (3, Q)     pair vectors of wall neighbours [1/m]
    own (3, N)               factor of the particle's own pressure in its force [1/m]
    sums                     diagonal, openness, coverage and wall_slope (see `PressureSums`)
    wall_pressure            K and waterline of the pressure that walls take (see `wall_extrapolation`)
    lever (N, 9)             how bodies feel extrapolated pressures (see `rigid_response`)
    contacts                 Jacobians of particles that touch moving bodies
    """

    repaired: Real | None
    gradient: PairVectors
    wall_gradient: Real
    own: Real
    sums: PressureSums
    wall_pressure: WallPressure | None
    lever: Real | None
    contacts: Contacts = NO_CONTACTS

    @property
    def vectors(self) -> PressureVectors:
        """The vectors of the pressure's force."""
        return PressureVectors(self.gradient, self.wall_gradient, self.own)

    @property
    def extrapolation(self) -> Real | None:
        """K of `wall_extrapolation` (N, 9) [1]."""
        return None if self.wall_pressure is None else self.wall_pressure.extrapolation


@dataclass
class StepArrays:
    """The arrays of the present step."""

    neighbors: Neighbors
    sums: NeighborSums
    pairs: PairArrays

    @classmethod
    def of(cls, context: StepContext) -> StepArrays:
        """Make the arrays of a step without particles."""
        quantum, nothing = context.constants.gradient_quantum, np.empty(0, np.float32)
        neighborhood = context.neighborhood(0, NO_PAIRS, NO_PAIRS)
        marks, touching = np.zeros(0, bool), np.empty(0, np.uint32)
        neighbors = Neighbors(neighborhood, nothing, nothing, NO_BODY_PAIRS, touching, marks, 0)
        vectors = PairVectors(np.empty((3, 0), np.int16), quantum)
        none = np.empty((3, 0), np.float32)
        pairs = PairArrays(None, vectors, none, none, PressureSums(nothing, nothing, nothing, none), None, None)
        return cls(neighbors, NeighborSums.of(0, context.time_unit), pairs)


def reserved(kept: NDArray[Any], pairs: Pairs) -> NDArray[Any]:
    """Return storage (3, P) for a vector per pair [1/m]: `kept` while it is large enough; contents are undefined."""
    return kept if kept.shape[1] >= pairs.neighbor.size else np.empty((3, pairs.neighbor.size), kept.dtype)


@dataclass(frozen=True)
class StepResult:
    """Length of a step [s], its solves' iterations and the mean compression [1] they leave, of positions and to which velocities lead.

    viscosity_error  what the viscous solve leaves of the explicit change [1]
    crowding         mean compression [1] of liquid that fills its box, which no solve can change; 0 where a surface is free
    drops            number of drops that changed places with the liquid ahead of them
    """

    time_step: float
    density_iterations: int
    divergence_iterations: int
    viscosity_iterations: int
    density_error: float
    divergence_error: float
    viscosity_error: float = 0.0
    crowding: float = 0.0
    drops: int = 0
