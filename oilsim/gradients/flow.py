"""The columns of the array `flow` (N, 16), which holds the motion of a particle and of the liquid around it.

    0 to 2      velocity v_i [m/s]
    3           WEIGHT: rho_ref / rho_0 of the particle's phase [1]
    4 to 6      GRADIENT: first row of the velocity gradient G_i, the derivatives of v_x along x, y and z [1/s]
    7           STRENGTH: b_i of particle shifting [m2] (see `particle_shifting`)
    8 to 10     second row of G_i [1/s]
    11          LIQUID: number of the particle's phase [1], 0 for all where interfaces have no tension (see `particle_shifting`)
    12 to 14    third row of G_i [1/s]

Column 15 holds nothing of use. Kernels read the row of a neighbour in fours (`simd.gather_four`), and so every four columns
hold numbers that are needed together.
"""

from __future__ import annotations

from oilsim.backend.jit import inlined

# [1] column of the weight rho_ref / rho_0; layout; behind the velocity, which it is gathered with
WEIGHT = 3
# [1] first column of the velocity gradient, whose rows are 4 columns apart; layout; rows begin at multiples of four
GRADIENT = 4
# [1] column of the strength b of particle shifting; layout; behind the first row of the gradient, which it is gathered with
STRENGTH = 7
# [1] column of the number of the phase; layout; behind the second row of the gradient, which it is gathered with
LIQUID = 11


@inlined
def velocity_gradient(flow, i):
    """Return G_i [1/s] row by row, as nine numbers; flow (N, 16)."""
    return (
        flow[i, 4], flow[i, 5], flow[i, 6], flow[i, 8], flow[i, 9], flow[i, 10], flow[i, 12], flow[i, 13], flow[i, 14],
    )  # fmt: skip


@inlined
def set_velocity_gradient(i, sums, spans, flow):
    """Fill G_i in flow (N, 16) from sums over the liquid neighbours j.

    sums      -sum_j V (v_i - v_j) grad W_ij^T [1/s], row by row, as nine numbers
    spans     inverse (six numbers xx, xy, xz, yy, yz, zz) of the moment matrix of the liquid neighbours [1]
    """
    bxx, bxy, bxz, byy, byz, bzz = spans
    for axis in range(3):
        ax, ay, az = sums[3 * axis], sums[3 * axis + 1], sums[3 * axis + 2]
        row = GRADIENT + 4 * axis
        flow[i, row] = ax * bxx + ay * bxy + az * bxz
        flow[i, row + 1] = ax * bxy + ay * byy + az * byz
        flow[i, row + 2] = ax * bxz + ay * byz + az * bzz
