"""Relaxation: one gentle step towards constant density, even order and smooth velocities (XSPH). Positions never become velocity.

    dx_i = sum_j V c_ij (L_i + L_j - (b_i + b_j) (1 - a q^2)) grad W_ij + 2 L_i sum_b V_b grad W_ib - beta_i d^2 g_i
    v_i -= theta sum_j V W_ij c_ij [v_i - v_j + (G_i + G_j) x_ij / 2],    theta = 1 - exp(-dt / tau)
    c_ij = 2 rho_j / (rho_i + rho_j),    q = r / H

with the particle spacing d, the support radius H, the lattice's a, and e_i, g_i, G_i of `particle_sums`.

**Density.** The multipliers L_i = -omega e_i / a_0 are those of the density constraint of Qiu et al. 2021 (Eq. 15-22), with the lattice's
a_0 = V^2 sum |grad W|^2 for the diagonal of Eq. 13. A pass repairs a share omega of the error and leaves the rest to the next step. Where
that is too little, a pass repairs half as much again, and further passes follow, with inertia (Polyak 1964). Inside the liquid the error
counts with both signs; near a free surface only compression counts.

**Quiet.** The filter removes motion that linear flow cannot explain, so that shear and rotation pass. It acts in every step. If it acted in
every n-th step only, it would feed swings of pressed particles (`time_step`) whose half period is n steps. Liquids that
slip past each other make no noise. So where interfaces have a tension, and are resolved, the filter acts within each liquid alone. Across
an interface it is a drag, which holds down the waves that slip raises. Without tension it acts within a liquid where that is so thick that
some of it is out of the others' reach, from three particles on. A thinner slick follows the water by that drag; without it oil leaves
booms round their ends.

**Order.** Away from free surfaces particle shifting (Lind et al. 2012) keeps neighbours evenly spread, by beta, which grows with the
strain of the flow. Out of reach of walls pairs share the shift, b = beta d^2 / 2, and the centre of mass of the liquid stays. A push that
only drove neighbours apart would drive particles along grad beta and compress calm water at the edge of a flow. This one draws particles
together that are further apart than half the support, with the a for which it has no virial on a lattice. Beside walls such a push keeps
water moving (0.5 % of sqrt(g H) in a column of 32 particles). There a particle goes down g_i alone, by the last term of dx_i. Shifts
compress the liquid where they end, at free surfaces and walls. A step finds the shifts, and the next step makes them before it looks at
densities, so that no pass is spent on the compression that they cause.

**Velocity of moved particles.** A particle that is put elsewhere in the same flow takes the velocity that the flow has there (Lind et al.
2012). With the sum dx_i of a step's pushes and shifts

    v_i += G_i dx_i - |G_i dx_i| sum_k m_k G_k dx_k / sum_k m_k |G_k dx_k|.

If particles carried their own velocity along, they would mix momentum: shear would lose four times as much, and vortices half as much
again. Where density is even the sum of G_k dx_k is noise, and the last term, shared by the particles that moved, takes it off. (Pairs
that take the mean of their G keep momentum by themselves. But shifts follow the strain and are no noise, and vortices would gain energy.)

**Momentum.** c_ij gives each particle of a pair its share, at most 2, so that pairs keep their centre of mass and their momentum in
everything else. (With rho_ref / rho_i in its place, as in Eq. 22, liquids of a third of the first one's density were thrown through walls.)
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numba import njit

from oilsim.backend.arrays import Real
from oilsim.backend.jit import FAST, HALF, ONE, TWO, ZERO, inlined
from oilsim.backend.simd import LANES, above_zero, below, gather, gather_four, load, only, root, spread, summed
from oilsim.backend.thread_team import BLOCK
from oilsim.gradients.particle_sums import coverage_and_slope
from oilsim.gradients.relaxation_time import GRADIENT, LIQUID, STRENGTH, WEIGHT, velocity_gradient
from oilsim.neighborhood.neighbor_search import separations
from oilsim.neighborhood.smoothing_kernels import SUPPORT, kernel, kernel_slope_over_q, lattice

# [1] omega, share of the density error that a pass repairs; tuned; not on record
OMEGA = 0.2
# [1] by how much more a pass repairs where omega will not do; measured; with 2 passes overshoot, with 3 they swing
HURRY = np.float32(1.5)
# [1] beta of any flow at most; tuned; not on record
LARGEST_SHIFT = np.float32(0.5)
# [1] beta for each unit of |G| dt; tuned; not on record
SHIFT_BY_STRAIN = np.float32(10.0)
# [1] share of a pass's push that the step's next pass repeats; measured (form: Polyak 1964); smooth errors are repaired in fewer passes
INERTIA = np.float32(0.7)
# [1] share of the mean compression taken to be left after a pass; measured; 0.6 to 0.7 in `calm-spread`, and the step's shift comes after
LEFT = 0.75
# [t_u] tau, in which noise fades; tuned; not on record
SETTLING = 1.5


class RelaxationConstants(NamedTuple):
    """Constants of a step's passes.

    balance      a, for which the shift has no virial on a lattice [1]
    theta        share of the noise that the filter takes off in this step [1]
    inertia      share of the last pass's push that is repeated [1]
    touching     coverage sum_b V_b W_ib of a particle on a flat wall's surface [1]
    """

    balance: np.float32
    theta: np.float32
    inertia: np.float32
    touching: np.float32


class Relaxation(NamedTuple):
    """Changes that relaxation makes.

    push (3, N)       way by which the last pass repairs density [m]
    shift (3, N)      way by which the step's first pass evens out the order, made by the next step [m]
    change (3, N)     change of velocity by the filter, in the first pass [m/s]
    moved (3, N)      sum of the step's pushes and of the shift [m]
    """

    push: Real
    shift: Real
    change: Real
    moved: Real


class ShiftScales(NamedTuple):
    """Scales of particle shifting in a step: dt [s] and d^2 [m2]."""

    time_step: np.float32
    area: np.float32


@njit(**FAST)
def relaxation_multiplier(begin, end, compression, surface, rate, limit, multiplier):
    """Fill multiplier (N,) with L_i [m2].

    compression (N,): e_i [1]; surface (N,): `FreeSurface`, near which only compression counts; rate: omega / a_0 [m2]; limit: largest
    |L_i| [m2].
    """
    for i in range(begin, end):
        error = rate * compression[i]
        least = ZERO if surface[i] else -limit
        multiplier[i] = -max(min(error, limit), least)


@inlined
def shift_coefficient(i, flow, time_step):
    """Return beta_i [1] of a step of `time_step` [s]; flow (N, 16) holds velocity gradients [1/s]."""
    strain = ZERO
    for entry in velocity_gradient(flow, i):
        strain += entry * entry
    return min(SHIFT_BY_STRAIN * time_step * math.sqrt(strain), LARGEST_SHIFT)


@njit(**FAST)
def shift_strength(begin, end, surface, walls, scales, flow):
    """Fill the column STRENGTH of flow (N, 16) with b_i [m2]: 0 near free surfaces and walls.

    surface (N,): `FreeSurface`; walls: lists of wall neighbours; scales: `ShiftScales`.
    """
    for i in range(begin, end):
        alone = surface[i] or walls.number[i] > 0
        flow[i, STRENGTH] = ZERO if alone else HALF * shift_coefficient(i, flow, scales.time_step) * scales.area


@njit(**FAST)
def end_first_pass(begin, end, surface, walls, gradient_sum, flow, scales, relaxation, position, velocity):
    """Add a step's first push to positions and the filter's change to velocities, and complete the shift beside walls.

    surface (N,)           `FreeSurface`
    walls                  lists of wall neighbours
    gradient_sum (3, N)    g_i [1/m]
    flow (N, 16)           columns as in `flow`
    scales                 `ShiftScales`
    relaxation             `Relaxation`: -beta_i d^2 g_i is added to `shift` beside walls, and `moved` becomes push plus shift
    position (3, N) [m], velocity (3, N) [m/s]
    """
    push, shift, change, moved = relaxation
    for i in range(begin, end):
        beside = walls.number[i] > 0 and not surface[i]
        beta = shift_coefficient(i, flow, scales.time_step) * scales.area if beside else ZERO
        for axis in range(3):
            position[axis, i] += push[axis, i]
            velocity[axis, i] += change[axis, i]
            if beside:
                shift[axis, i] -= beta * gradient_sum[axis, i]
            moved[axis, i] = push[axis, i] + shift[axis, i]


@njit(**FAST)
def flow_along(begin, end, flow, moved, change, sums):
    """Compute the change of the flow's velocity along the way of each particle, and its sums.

    flow (N, 16)         columns as in `flow`
    moved (3, N)         way dx_i [m]
    change (4, N)        becomes G_i dx_i and its length |G_i dx_i| [m/s]
    sums (blocks, 4)     become block sums of both over particles, weighted by rho_0 / rho_ref [m/s]
    """
    for block in range(begin, end, BLOCK):
        px = py = pz = length = 0.0
        for i in range(block, min(block + BLOCK, end)):
            dx, dy, dz, mass = moved[0, i], moved[1, i], moved[2, i], ONE / flow[i, WEIGHT]
            xx, xy, xz, yx, yy, yz, zx, zy, zz = velocity_gradient(flow, i)
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
    """Add the change (4, N) [m/s] of `flow_along` to velocity (3, N) [m/s], less its length times share (3,) [1]."""
    for i in range(begin, end):
        for axis in range(3):
            velocity[axis, i] += change[axis, i] - share[axis] * change[3, i]


@inlined
def linear(flow, i, axis, theirs, dx, dy, dz):
    """Return one component of (G_i + G_j) dx [m/s] for lanes of neighbours j.

    flow (N, 16)  rows as from `particle_sums`, with G_i [1/s] from column GRADIENT on
    axis          the component, 0 to 2
    theirs        row `axis` of G_j, three vectors of lanes [1/s]
    dx, dy, dz    lanes of dx [m]
    """
    row = GRADIENT + 4 * axis
    return (flow[i, row] + theirs[0]) * dx + (flow[i, row + 1] + theirs[1]) * dy + (flow[i, row + 2] + theirs[2]) * dz


@inlined
def push_beside_wall(px, py, pz, own, coverage, slope, touching):
    """Return the push (px, py, pz) [m] with the walls' part 2 L_i sum_b V_b grad W_ib, without what leads further into a touched wall.

    own: L_i [m2]; coverage: sum_b V_b W_ib [1]; slope: sum_b V_b grad W_ib [1/m] (3); touching: coverage at a flat wall's surface [1].
    Walls respond by the multiplier of the particle. It draws a particle with too few neighbours to the wall, while the particles behind
    push.
    """
    sx, sy, sz = slope
    px, py, pz = px + TWO * own * sx, py + TWO * own * sy, pz + TWO * own * sz
    along = sx * px + sy * py + sz * pz
    if coverage > touching and along > ZERO:
        share = along / (sx * sx + sy * sy + sz * sz)
        px, py, pz = px - share * sx, py - share * sy, pz - share * sz
    return px, py, pz


@njit(**FAST)
def relax(begin, end, constants, neighborhood, flow, multiplier, first, relaxation):
    """Compute the push of a pass, and in a step's first pass also the shift and the filter's change of velocity.

    constants         `RelaxationConstants`
    neighborhood              the `Neighborhood`
    flow (N, 16)      columns as in `flow`
    multiplier (N,)   L_i [m2]
    first             whether this is the step's first pass
    relaxation        `Relaxation`: `push` of the last pass becomes that of this one; if `first`, `shift` and `change` are filled
    """
    balance, theta, inertia, touching = constants
    points, period, fluid, sigma, volume = (
        neighborhood.points,
        neighborhood.period,
        neighborhood.fluid,
        neighborhood.sigma,
        neighborhood.volume,
    )
    push, shift, change, _ = relaxation
    inverse_support = ONE / neighborhood.support
    factor = volume * inverse_support * inverse_support
    for i in range(begin, end):
        ui, vi, wi, weight = flow[i, 0], flow[i, 1], flow[i, 2], flow[i, WEIGHT]
        own, shifted, liquid = multiplier[i], flow[i, STRENGTH], flow[i, LIQUID]
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
                strength = gather_four(flow, j, GRADIENT)[3]
                order = slope * (shifted + strength) * (balance * q * q - ONE)
                ox += order * dx
                oy += order * dy
                oz += order * dz
                hx, hy, hz = HALF * dx, HALF * dy, HALF * dz
                uj, vj, wj, _ = gather_four(flow, j, 0)
                rise = gather_four(flow, j, GRADIENT + 4)
                other = liquid - rise[3]  # in the column LIQUID
                w = only(above_zero(other * other), ZERO, kernel(q, sigma) * theta * volume * share)
                sx += w * (ui - uj - linear(flow, i, 0, gather_four(flow, j, GRADIENT), hx, hy, hz))
                sy += w * (vi - vj - linear(flow, i, 1, rise, hx, hy, hz))
                sz += w * (wi - wj - linear(flow, i, 2, gather_four(flow, j, GRADIENT + 8), hx, hy, hz))
        to_x = inertia * push[0, i] + weight * summed(px)
        to_y = inertia * push[1, i] + weight * summed(py)
        to_z = inertia * push[2, i] + weight * summed(pz)
        if neighborhood.walls.number[i] > 0:
            coverage, towards = coverage_and_slope(i, neighborhood)
            to_x, to_y, to_z = push_beside_wall(to_x, to_y, to_z, own, coverage, towards, touching)
        push[0, i], push[1, i], push[2, i] = to_x, to_y, to_z
        if first:
            shift[0, i], shift[1, i], shift[2, i] = weight * summed(ox), weight * summed(oy), weight * summed(oz)
            change[0, i], change[1, i], change[2, i] = -weight * summed(sx), -weight * summed(sy), -weight * summed(sz)


@lru_cache
def shift_balance(dimension: int) -> float:
    """Return a [1], for which the lattice's sum of (1 - a q^2) (W' / r) r^2 is 0."""
    squares = (lattice(1.0, dimension) ** 2).sum(axis=1) / SUPPORT**2
    virial = kernel_slope_over_q(np.sqrt(squares), 1.0) * squares
    return float(virial.sum() / (virial * squares).sum())
