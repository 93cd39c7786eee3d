"""The matrices Y_i of the pressure's pair vectors, G_ij = (Y_i + Y_j) / 2 V grad W_ij and G_ib = (Y_i + 1 / m_0) / 2 V_b grad W_ib.

    Y_i = (1 - z) / m_0 + z M_i^-1,   z = EXACT smoothstep(lambda_i; THIN, FULL)

with the smallest eigenvalue lambda of M and the lattice's moment m_0. With Y = M^-1 gradients of linear pressures and divergences of
linear flows are exact in the mean of the two (Lanson & Vila 2008, Hopkins 2015). With Y = 1 / m_0 the force would be the gradient of an
energy, and water at rest an elastic solid: its particles, pressed into a crystal, resist shear with a modulus of the order of the
pressure. Waves of 5 % steepness then run 4 to 5 % too fast at any spacing.

But the force of M^-1 alone is no energy's gradient and does work on particles that come back to where they were: deep water left to
itself circulates ever faster, a plane column of 32 spacings at 3 % of sqrt(g H) after 100 s. A twentieth of the elastic force holds it
(0.3 %) and is too weak to change a wave of 64 spacings by more than 0.2 %: that is what EXACT leaves.
Walls, which are a lattice, have its matrix: with Y_i alone water in a tank moves twice as much at rest. Where M is nearly singular, in
spray and thin films, Y fades to the lattice's too.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from oilsim.lanes import gather
from oilsim.moments import inverse, smallest_eigenvalue
from oilsim.smoothing_kernels import FAST

ZERO, ONE, TWO, THREE = np.float32(0.0), np.float32(1.0), np.float32(2.0), np.float32(3.0)
HALF = np.float32(0.5)
THIN, FULL = np.float32(0.6), np.float32(0.9)
EXACT = np.float32(0.95)  # share of M^-1 inside; a half calms plane columns no more, and waves run 2 to 3 % faster


@njit(inline="always", **FAST)
def fill_face_matrix(i, moment, lattice, matrix):
    """Fill column i of `matrix` (6, N) with Y from the moment matrix M (tuple of 6); lattice m_0."""
    z = max(min((smallest_eigenvalue(moment) - THIN) / (FULL - THIN), ONE), ZERO)
    z *= EXACT * z * (THREE - TWO * z)
    plain = (ONE - z) / lattice
    if z <= ZERO:
        moment = (ONE, ZERO, ZERO, ONE, ZERO, ONE)
    xx, xy, xz, yy, yz, zz = inverse(moment)
    matrix[0, i], matrix[1, i], matrix[2, i] = plain + z * xx, z * xy, z * xz
    matrix[3, i], matrix[4, i], matrix[5, i] = plain + z * yy, z * yz, plain + z * zz


def largest_stretch(lattice: float) -> float:
    """The most that Y, and so a mean of two, lengthens a vector, for the lattice's m_0: the greatest over the fade."""
    eigenvalue = np.linspace(THIN, FULL, 101)
    z = (eigenvalue - THIN) / (FULL - THIN)
    z *= float(EXACT) * z * (3.0 - 2.0 * z)
    return max(1.0, float(((1.0 - z) / lattice + z / eigenvalue).max()))


@njit(inline="always", **FAST)
def times_symmetric(vx, vy, vz, m):
    """m v for symmetric m, which is also the row vector v m."""
    return (
        vx * m[0] + vy * m[1] + vz * m[2],
        vx * m[1] + vy * m[3] + vz * m[4],
        vx * m[2] + vy * m[4] + vz * m[5],
    )


@njit(inline="always", **FAST)
def face_between(matrix, i, j, ax, ay, az):
    """(Y_i + Y_j) / 2 a."""
    xx, xy = HALF * (matrix[0, i] + gather(matrix[0], j)), HALF * (matrix[1, i] + gather(matrix[1], j))
    xz, yy = HALF * (matrix[2, i] + gather(matrix[2], j)), HALF * (matrix[3, i] + gather(matrix[3], j))
    yz, zz = HALF * (matrix[4, i] + gather(matrix[4], j)), HALF * (matrix[5, i] + gather(matrix[5], j))
    return times_symmetric(ax, ay, az, (xx, xy, xz, yy, yz, zz))


@njit(inline="always", **FAST)
def face_to_walls(matrix, i, lattice):
    """(Y_i + 1 / m_0) / 2 as six; lattice m_0."""
    own = ONE / lattice
    return (
        HALF * (matrix[0, i] + own), HALF * matrix[1, i], HALF * matrix[2, i],
        HALF * (matrix[3, i] + own), HALF * matrix[4, i], HALF * (matrix[5, i] + own),
    )  # fmt: skip
