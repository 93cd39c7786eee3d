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

from oilsim.backend.jit import inlined
from oilsim.backend.simd import gather_four
from oilsim.gradients.symmetric_3x3 import inverse, smallest_eigenvalue

ZERO, ONE, TWO, THREE = np.float32(0.0), np.float32(1.0), np.float32(2.0), np.float32(3.0)
HALF = np.float32(0.5)
THIN, FULL = np.float32(0.6), np.float32(0.9)
EXACT = np.float32(0.95)  # share of M^-1 inside; a half calms plane columns no more, and waves run 2 to 3 % faster


@inlined
def fill_face_matrix(i, moment, lattice, matrix):
    """Fill row i of `matrix` (N, 8) with Y from the moment matrix M (tuple of 6); lattice m_0."""
    z = max(min((smallest_eigenvalue(moment) - THIN) / (FULL - THIN), ONE), ZERO)
    z *= EXACT * z * (THREE - TWO * z)
    plain = (ONE - z) / lattice
    if z <= ZERO:
        moment = (ONE, ZERO, ZERO, ONE, ZERO, ONE)
    xx, xy, xz, yy, yz, zz = inverse(moment)
    matrix[i, 0], matrix[i, 1], matrix[i, 2] = plain + z * xx, z * xy, z * xz
    matrix[i, 3], matrix[i, 4], matrix[i, 5] = plain + z * yy, z * yz, plain + z * zz


def largest_stretch(lattice: float) -> float:
    """The most that Y, and so a mean of two, lengthens a vector, for the lattice's m_0: the greatest over the fade."""
    eigenvalue = np.linspace(THIN, FULL, 101)
    z = (eigenvalue - THIN) / (FULL - THIN)
    z *= float(EXACT) * z * (3.0 - 2.0 * z)
    return max(1.0, float(((1.0 - z) / lattice + z / eigenvalue).max()))


@inlined
def times_symmetric(vx, vy, vz, m):
    """m v for symmetric m, which is also the row vector v m."""
    return (
        vx * m[0] + vy * m[1] + vz * m[2],
        vx * m[1] + vy * m[3] + vz * m[4],
        vx * m[2] + vy * m[4] + vz * m[5],
    )


@inlined
def face_between(matrix, i, j, ax, ay, az):
    """(Y_i + Y_j) / 2 a."""
    xx, xy, xz, yy = gather_four(matrix, j, 0)
    yz, zz, _, _ = gather_four(matrix, j, 4)
    ax, ay, az = HALF * ax, HALF * ay, HALF * az
    own = (
        matrix[i, 0] + xx,
        matrix[i, 1] + xy,
        matrix[i, 2] + xz,
        matrix[i, 3] + yy,
        matrix[i, 4] + yz,
        matrix[i, 5] + zz,
    )
    return times_symmetric(ax, ay, az, own)


@inlined
def face_to_walls(matrix, i, lattice):
    """(Y_i + 1 / m_0) / 2 as six; lattice m_0."""
    own = ONE / lattice
    return (
        HALF * (matrix[i, 0] + own), HALF * matrix[i, 1], HALF * matrix[i, 2],
        HALF * (matrix[i, 3] + own), HALF * matrix[i, 4], HALF * (matrix[i, 5] + own),
    )  # fmt: skip
