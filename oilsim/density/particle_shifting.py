"""One gentle step towards constant density, even order and quiet velocities; positions never become velocity.

    dx_i = sum_j V c_ij (L_i + L_j - (b_i + b_j) (1 - a q^2)) grad W_ij + 2 L_i sum_b V_b grad W_ib - beta_i d^2 g_i
    v_i -= theta sum_j V W_ij c_ij [v_i - v_j + (G_i + G_j) x_ij / 2],    theta = 1 - exp(-dt / tau)
    c_ij = 2 rho_j / (rho_i + rho_j)

The density constraint of Qiu et al. 2021 (Eq. 15-22), L_i = -omega e_i / a_0, mends a share omega of the error a pass, with the lattice's
a_0 = V^2 sum |grad W|^2 for the diagonal of Eq. 13; what is left is carried to the next step. Where that would be too much a pass mends
half as much again, and further ones follow, with inertia (Polyak 1964). Inside the liquid the error counts with both signs; within reach of
a free surface only compression counts. The filter takes off what linear flow cannot explain, so that shear and rotation pass. It acts
in every step: acting in every n-th it would feed the swings of pressed particles (`time_step`) whose half periods are n steps.

Away from free surfaces particle shifting (Lind et al. 2012) keeps neighbours evenly spread, by beta, which grows with the strain of the
flow. Out of reach of walls pairs share it, b = beta d^2 / 2, so that the liquid's centre of mass stays. A push that only drove neighbours
apart would drive particles along grad beta, and compress calm water at the edge of a flow; this one draws together those further apart
than half the support, q = r / H, with the a for which it has no virial on a lattice. Beside walls it keeps
water moving (0.5 % of sqrt(g H) in a column of 32 particles): there a particle goes down g_i alone, the last term. Shifts compress where
they end, at free surfaces and walls; a step finds them, and the next one makes them before it looks at densities, so that no pass is
spent on what they did.

What is moved is put elsewhere in the same flow, and takes the velocity that the flow has there (Lind et al. 2012): with the sum of a
step's pushes and shifts

    v_i += G_i dx_i - |G_i dx_i| sum_k m_k G_k dx_k / sum_k m_k |G_k dx_k|.

Particles that carry their own velocity along mix momentum: shear loses four times as much so, vortices half as much again. Where density
is even such sums vanish but for noise; the last term, shared by those who were moved, lets them. (Pairs that take the mean of their G keep
momentum by themselves, but with strain shifts are no noise, and vortices gain energy.)

Pairs keep their centre of mass and their momentum in all else: c gives each its share, 2 at most. (With rho_ref / rho_i in its place, as in
Eq. 22, liquids of a third of the first one's density were thrown through walls.)
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numba import njit

from oilsim.backend.jit import FAST, inlined
from oilsim.backend.simd import LANES, above_zero, below, gather, gather_four, load, only, root, spread, store, summed
from oilsim.backend.thread_team import BLOCK
from oilsim.density.density_constraint import wall_content
from oilsim.density.density_feedback import SPRAY
from oilsim.gradients.particle_sums import GRADIENT, ONE, STRENGTH, WEIGHT, ZERO, velocity_gradient
from oilsim.neighborhood.neighbor_search import separations
from oilsim.neighborhood.smoothing_kernels import SUPPORT, kernel, kernel_slope_over_q, lattice

HALF, TWO = np.float32(0.5), np.float32(2.0)
OMEGA = 0.2  # share of the density error mended a pass
HURRY = np.float32(1.5)  # times as much where that will not do; with 2 passes overshoot, with 3 they swing
SURFACE = np.float32(0.3)  # |g_i| d from which a particle lies at a free surface
LARGEST_SHIFT = np.float32(0.5)  # beta of any flow
SHIFT_BY_STRAIN = np.float32(10.0)  # beta for each unit of |G| x time step
INERTIA = np.float32(0.7)  # of a pass's motion, repeated by the step's next one: smooth errors mend in fewer passes
LEFT = (
    0.75  # of the mean compression after a pass: in `calm-spread` 0.6 to 0.7 at once, and the step's shift comes after
)
SETTLING = 1.5  # tau, in which noise fades, in units of `time_unit`


@njit(**FAST)
def mark_surface(begin, end, gradient_sum, compression, spacing, surface):
    """Set `surface` (N,), float32, to 1 at free surfaces, where the kernel's gradients do not cancel, and in spray."""
    flat, full = (SURFACE / spacing) ** 2, SPRAY - ONE
    for k in range(begin, end, LANES):
        present, square = below(end, k), spread(ZERO)
        for axis in range(3):
            slope = load(gradient_sum[axis], k, present)
            square += slope * slope
        bare = only(above_zero(square - flat), spread(ONE), ZERO)
        store(surface, k, present, only(above_zero(full - load(compression, k, present)), spread(ONE), bare))


@njit(**FAST)
def mark_near_surface(begin, end, fluid, surface, near):
    """Set `near` (N,) to 1 for surface particles and all that have one among their neighbours."""
    for i in range(begin, end):
        found = spread(surface[i])
        first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
        for k in range(first, last, LANES):
            present = below(last, k)
            found += only(present, gather(surface, load(fluid.neighbor, k, present)), ZERO)
        near[i] = np.uint8(summed(found) > ZERO)


@njit(**FAST)
def relaxation_multiplier(begin, end, compression, near, rate, limit, multiplier):
    """Fill `multiplier` with L_i [m2]: rate omega / a [m2], limit the largest |L| [m2]."""
    for i in range(begin, end):
        error = rate * compression[i]
        least = ZERO if near[i] else -limit
        multiplier[i] = -max(min(error, limit), least)


@inlined
def shift_coefficient(i, field, time_step):
    """beta of particle i."""
    strain = ZERO
    for entry in velocity_gradient(field, i):
        strain += entry * entry
    return min(SHIFT_BY_STRAIN * time_step * math.sqrt(strain), LARGEST_SHIFT)


@njit(**FAST)
def shift_strength(begin, end, near, walls, field, time_step, square):
    """Put b_i [m2] into `field` (N, 16), 0 within reach of free surfaces and walls; square d^2 [m2]."""
    for i in range(begin, end):
        alone = near[i] or walls.number[i] > 0
        field[i, STRENGTH] = ZERO if alone else HALF * shift_coefficient(i, field, time_step) * square


@njit(**FAST)
def end_first_pass(
    begin, end, push, change, near, walls, gradient_sum, field, time_step, square, position, velocity, shift, moved
):
    """Add -beta_i d^2 g_i [m] to `shift` (3, N) beside walls, `push` to `position` and `change` to `velocity`; fill `moved` (3, N) with
    push and shift together [m]; square d^2 [m2].
    """
    for i in range(begin, end):
        beside = walls.number[i] > 0 and not near[i]
        beta = shift_coefficient(i, field, time_step) * square if beside else ZERO
        for axis in range(3):
            position[axis, i] += push[axis, i]
            velocity[axis, i] += change[axis, i]
            if beside:
                shift[axis, i] -= beta * gradient_sum[axis, i]
            moved[axis, i] = push[axis, i] + shift[axis, i]


@njit(**FAST)
def flow_along(begin, end, field, moved, change, sums):
    """Fill `change` (4, N) with G_i dx_i and its length [m/s] for the ways `moved` (3, N) [m].

    Block sums `sums` (blocks, 4) over particles [m/s], of which lighter ones count less.
    """
    for block in range(begin, end, BLOCK):
        px = py = pz = length = 0.0
        for i in range(block, min(block + BLOCK, end)):
            dx, dy, dz, mass = moved[0, i], moved[1, i], moved[2, i], ONE / field[i, WEIGHT]
            xx, xy, xz, yx, yy, yz, zx, zy, zz = velocity_gradient(field, i)
            cx, cy, cz = xx * dx + xy * dy + xz * dz, yx * dx + yy * dy + yz * dz, zx * dx + zy * dy + zz * dz
            size = math.sqrt(cx * cx + cy * cy + cz * cz)
            change[0, i], change[1, i], change[2, i], change[3, i] = cx, cy, cz, size
            px += np.float64(mass * cx)
            py += np.float64(mass * cy)
            pz += np.float64(mass * cz)
            length += np.float64(mass * size)
        sums[block // BLOCK, 0], sums[block // BLOCK, 1] = px, py
        sums[block // BLOCK, 2], sums[block // BLOCK, 3] = pz, length


@njit(**FAST)
def follow_flow(begin, end, change, share, velocity):
    """velocity (3, N) += `change` (4, N) as from `flow_along`, less its length times `share` (3,)."""
    for i in range(begin, end):
        for axis in range(3):
            velocity[axis, i] += change[axis, i] - share[axis] * change[3, i]


@inlined
def linear(field, i, axis, theirs, dx, dy, dz):
    """(G_i + G_j) dx, one component, from the row of G_j."""
    row = GRADIENT + 4 * axis
    return (
        (field[i, row] + theirs[0]) * dx + (field[i, row + 1] + theirs[1]) * dy + (field[i, row + 2] + theirs[2]) * dz
    )


@inlined
def beside_wall(px, py, pz, own, content, slope, touching):
    """The push (px, py, pz) [m] with the walls' part, 2 L_i sum_b V_b grad W_ib, less what leads on into a wall that is reached.

    own: L_i [m2]; content, slope: sum_b V_b W_ib and sum_b V_b grad W_ib [1/m]; touching: content at a flat wall's surface.
    Walls answer by the particle's own multiplier, which draws one to the wall that has too few neighbours, while those behind it push.
    """
    sx, sy, sz = slope
    px, py, pz = px + TWO * own * sx, py + TWO * own * sy, pz + TWO * own * sz
    along = sx * px + sy * py + sz * pz
    if content > touching and along > ZERO:
        share = along / (sx * sx + sy * sy + sz * sz)
        px, py, pz = px - share * sx, py - share * sy, pz - share * sz
    return px, py, pz


@njit(**FAST)
def relax(
    begin, end, points, wall, field, multiplier, balance, first, theta, inertia, touching, period, fluid, walls, sigma, support, volume,
    push, shift, change,
):  # fmt: skip
    """Fill `push` (3, N) with what mends density [m], `inertia` times what it held included; in a step's `first` pass also `shift` (3, N)
    with what evens the order out [m] and `change` (3, N) with what v_i gains [m/s].

    points (N, 4): place [m] and weight; balance a; theta: share of the filter; touching: a wall's coverage of the kernel at its surface.
    """
    inverse_support = ONE / support
    factor = volume * inverse_support * inverse_support
    for i in range(begin, end):
        ui, vi, wi, weight = field[i, 0], field[i, 1], field[i, 2], field[i, WEIGHT]
        own, shifted = multiplier[i], field[i, STRENGTH]
        px = py = pz = ox = oy = oz = sx = sy = sz = spread(ZERO)
        start = fluid.start[i]
        last = start + np.int64(fluid.number[i])
        for k in range(start, last, LANES):
            present = below(last, k)
            j = load(fluid.neighbor, k, present)
            dx, dy, dz, heavier = separations(i, points, points, j, period)
            q = only(present, root(dx * dx + dy * dy + dz * dz) * inverse_support, ONE)
            slope = factor * kernel_slope_over_q(q, sigma)
            share = TWO / (weight + heavier)
            slope *= share
            stretch = slope * (own + gather(multiplier, j))
            px += stretch * dx
            py += stretch * dy
            pz += stretch * dz
            if first:
                strength = gather_four(field, j, GRADIENT)[3]
                order = slope * (shifted + strength) * (balance * q * q - ONE)
                ox += order * dx
                oy += order * dy
                oz += order * dz
                w = kernel(q, sigma) * theta * volume * share
                hx, hy, hz = HALF * dx, HALF * dy, HALF * dz
                uj, vj, wj, _ = gather_four(field, j, 0)
                sx += w * (ui - uj - linear(field, i, 0, gather_four(field, j, GRADIENT), hx, hy, hz))
                sy += w * (vi - vj - linear(field, i, 1, gather_four(field, j, GRADIENT + 4), hx, hy, hz))
                sz += w * (wi - wj - linear(field, i, 2, gather_four(field, j, GRADIENT + 8), hx, hy, hz))
        to_x = inertia * push[0, i] + weight * summed(px)
        to_y = inertia * push[1, i] + weight * summed(py)
        to_z = inertia * push[2, i] + weight * summed(pz)
        if walls.number[i] > 0:
            content, towards = wall_content(i, points, wall, period, walls, sigma, inverse_support)
            to_x, to_y, to_z = beside_wall(to_x, to_y, to_z, own, content, towards, touching)
        push[0, i], push[1, i], push[2, i] = to_x, to_y, to_z
        if first:
            shift[0, i], shift[1, i], shift[2, i] = weight * summed(ox), weight * summed(oy), weight * summed(oz)
            change[0, i], change[1, i], change[2, i] = -weight * summed(sx), -weight * summed(sy), -weight * summed(sz)


@lru_cache
def shift_balance(dimension: int) -> float:
    """a, for which the lattice's sum of (1 - a q^2) (W' / r) r^2 is 0."""
    squares = (lattice(1.0, dimension) ** 2).sum(axis=1) / SUPPORT**2
    virial = kernel_slope_over_q(np.sqrt(squares), 1.0) * squares
    return float(virial.sum() / (virial * squares).sum())
