"""The free surface: one state for each particle, and a list of everything else that tells how much liquid surrounds it.

The sum g_i = sum_j V grad W_ij + sum_b V_b grad W_ib vanishes inside the liquid and points out of it at a free surface. A particle lies
at the surface where |g_i| d exceeds SURFACE, with the particle spacing d. A particle belongs to spray where its density is less than
SPRAY of the rest density. A particle with such a neighbour is near the surface: sums over its neighbours meet particles whose own sums
are incomplete. The array `surface` (N,), uint8, holds these states (`FreeSurface`). The step computes them once, before it relaxes
positions, and the step decides by them wherever it needs a yes or no:

    relaxation           near a surface only compression counts, and particles are not shifted       `particle_shifting`
    shear correction     near a surface the correction matrix Y stays as it is                       `gradient_correction`
    density feedback     near a surface the density is told from the sum and its slope together      `density_feedback`
    viscosity            near a surface the stress has the lattice's fourth moment                   `viscous_system`
    confinement          liquid without particles near a surface fills its box                       `step.stages.relaxation`
    ledger               number of particles near a surface                                          `accounts.ledger`

Other quantities stay beside the state. They change continuously, because a switch would make forces jump, or they belong to another scheme
or to another time within the step:

    SPRAY, as a ramp         density_feedback      how far below SPRAY the density is after relaxation: spray may contract at will
    surface_table            density_feedback      share of the sum that a flat surface leaves at the distance that the slope tells
    THIN to FULL             gradient_correction   smallest eigenvalue of the moment of liquid and walls: Y fades to the lattice's
    REGULAR                  particle_sums         determinant of the liquid's moment: without it there is no velocity gradient
    THIN to FULL             wall_extrapolation    smallest eigenvalue of the liquid's moment: without it no pressure gradient for walls
    OPEN to COVERED          wall_extrapolation    smallest eigenvalue with walls: at the surface walls at rest do not extrapolate
    FLAT                     wall_extrapolation    |S| H, S the sum of pair vectors: inside the liquid the surface has no normal
    PRESSED                  wall_extrapolation    pressure below which the particle is a drop: it has an edge, but bears nothing
    openness                 pressure_gradient     |H 1|^2 rho_ref / rho_0: makes the pressure of the coarse grid 0 at the surface
    FEWEST neighbours        pressure_gradient     the paper's scheme leaves spray alone (Bender and Koschier 2016)
    drop                     wall_contact          share of the kernel that liquid fills: drops keep a distance from walls
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numba import njit

from oilsim.backend.jit import FAST, ONE

# [1] |g_i| d from which a particle lies at a free surface; measured; the flat surface of a lattice has 0.44, the layer
# below it 0.05
SURFACE = np.float32(0.3)
# [1] density over rest density below which a particle is spray and may spread freely; tuned; not on record
SPRAY = np.float32(0.6)


class FreeSurface(IntEnum):
    """The place of a particle relative to a free surface. Greater numbers are more exposed; all but INSIDE are within reach of one."""

    INSIDE = 0
    NEAR_SURFACE = 1
    AT_SURFACE = 2
    IN_SPRAY = 3


INSIDE, AT_SURFACE, IN_SPRAY = (
    np.uint8(state) for state in (FreeSurface.INSIDE, FreeSurface.AT_SURFACE, FreeSurface.IN_SPRAY)
)


@njit(**FAST)
def mark_exposed(begin, end, gradient_sum, compression, spacing, exposed):
    """Fill exposed (N,) uint8 with AT_SURFACE or IN_SPRAY for exposed particles and with INSIDE for others.

    gradient_sum (3, N): g_i [1/m]; compression (N,): e_i [1]; spacing: d [m].
    """
    flat, full = (SURFACE / spacing) ** 2, SPRAY - ONE
    for i in range(begin, end):
        square = gradient_sum[0, i] ** 2 + gradient_sum[1, i] ** 2 + gradient_sum[2, i] ** 2
        bare = AT_SURFACE if square > flat else INSIDE
        exposed[i] = IN_SPRAY if compression[i] < full else bare
