"""The arrays of one time step, which its stages fill and read: no physics, no order of stages.

N counts the particles that are listed: those that move, then those that sleep beside them. P and Q count the entries of the lists of
fluid and wall neighbours, with their padding. All are float32 unless said otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from oilsim.boundaries.contacts import NO_BODY_PAIRS, NO_CONTACTS
from oilsim.gradients.free_surface import FreeSurface
from oilsim.neighborhood.neighbor_search import Pairs
from oilsim.neighborhood.neighborhood import Neighborhood
from oilsim.pressure.pressure_gradient import PairVectors, PressureSums, PressureVectors
from oilsim.pressure.wall_extrapolation import WallPressure

Real = NDArray[np.float32]
Index = NDArray[np.uint32]


@dataclass(frozen=True)
class Needs:
    """Optional arrays that a step needs: `corrected` gradients, pressures `extrapolated` to walls, `levers` of bodies that feel these."""

    corrected: bool
    extrapolated: bool
    levers: bool


class StepArrays:
    """Arrays by the stage that fills them. None: the step does not need it.

    search
        neighborhood             lists of neighbours, and constants of sums over them
        weight (N,)              rho_ref / rho_0 of the particle's phase [1]
        rest_density (N,)        rho_0 [kg/m3]
        points (N, 4)            place [m] and weight side by side, for kernels that gather them
        body_pairs               pairs of particles and points of moving bodies (see `contacts`)
        touching (T,)            uint32, particles that have such a pair
        by_body (N,)             bool, whether a particle is one of them
    relaxation
        flow (N, 16)             velocity [m/s], weight [1], velocity gradient [1/s] (see `particle_sums`)
        compression (N,)         sum V W - 1 [1], less `crowding` once positions are relaxed
        crowding                 mean compression of liquid that fills its box [1], 0 where a surface is free
        gradient_sum (3, N)      sum V grad W [1/m]
        matrix (N, 8)            Y of `gradient_correction` [1]
        surface (N,)             uint8, a `FreeSurface`: how near one is
    gradients
        repaired (N, 8)            Y after `shear_correction` [1]
        gradient                 pair vectors (3, P) of fluid neighbours [1/m]
        wall_gradient (3, Q)     pair vectors of wall neighbours [1/m]
        own (3, N)               factor of the particle's own pressure in its force [1/m]
        diagonal (N,)            of the pressure operator [1/m2]
        coverage (N,)            sum V_b W_ib, the walls' share of the kernel [1]
        wall_slope (3, N)        sum of the walls' pair vectors [1/m]
        openness (N,)            rho_ref / rho_0 |H 1|^2, large at a free surface [1/m2]
        extrapolation (N, 9)     K of `wall_extrapolation` [1]
        waterline (3, N)         change of velocity by which walls at rest hold the water's edge, over dt [m/s2]
        lever (N, 9)             how bodies feel extrapolated pressures (see `rigid_response`)
        contacts                 Jacobians of particles that touch moving bodies
    """

    def __init__(self, neighborhood: Neighborhood, gradient_quantum: np.float32) -> None:
        """Start without particles; gradient_quantum [1/m] is the unit of the rounded pair vectors."""
        self.gradient = PairVectors(np.empty((3, 0), np.int16), gradient_quantum)
        self.wall_gradient: Real = np.empty((3, 0), np.float32)
        self.body_pairs, self.contacts = NO_BODY_PAIRS, NO_CONTACTS
        self.touching: Index = np.empty(0, np.uint32)
        self.weight: Real = np.empty(0, np.float32)
        self.rest_density: Real = np.empty(0, np.float32)
        self.flow: Real = np.empty((0, 16), np.float32)
        self.reserve(neighborhood, Needs(False, False, False))

    def reserve(self, neighborhood: Neighborhood, needs: Needs) -> None:
        """Make room for the particles of a neighbourhood; the contents of the arrays are undefined."""
        count = len(neighborhood.points)
        self.neighborhood = neighborhood
        self.crowding = 0.0
        self.compression, self.coverage, self.diagonal, self.openness = np.empty((4, count), np.float32)
        self.own, self.gradient_sum, self.wall_slope = np.empty((3, 3, count), np.float32)
        self.matrix: Real = np.zeros((count, 8), np.float32)
        self.surface: NDArray[np.uint8] = np.full(count, FreeSurface.NEAR_SURFACE, np.uint8)
        self.by_body: NDArray[np.bool_] = np.zeros(count, bool)
        self.repaired = np.empty_like(self.matrix) if needs.corrected else None
        self.extrapolation = np.empty((count, 9), np.float32) if needs.extrapolated else None
        self.waterline = np.empty((3, count), np.float32) if needs.extrapolated else None
        self.lever = np.empty((count, 9), np.float32) if needs.levers else None
        self.gradient = self.gradient._replace(whole=_reserved(self.gradient.whole, neighborhood.fluid))
        self.wall_gradient = _reserved(self.wall_gradient, neighborhood.walls)

    @property
    def points(self) -> Real:
        """Places [m] and weights of the particles (N, 4)."""
        return self.neighborhood.points

    @property
    def vectors(self) -> PressureVectors:
        """The vectors of the pressure's force."""
        return PressureVectors(self.gradient, self.wall_gradient, self.own)

    @property
    def sums(self) -> PressureSums:
        """The sums that come with these vectors."""
        return PressureSums(self.diagonal, self.openness, self.coverage, self.wall_slope)

    @property
    def wall_pressure(self) -> WallPressure | None:
        """The pressure that walls take; None where it is not extrapolated."""
        if self.extrapolation is None or self.waterline is None:
            return None
        return WallPressure(self.extrapolation, self.waterline)


def _reserved(kept: NDArray[Any], pairs: Pairs) -> NDArray[Any]:
    """Return storage (3, P) for a vector per pair, reused while it is large enough."""
    return kept if kept.shape[1] >= pairs.neighbor.size else np.empty((3, pairs.neighbor.size), kept.dtype)


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
