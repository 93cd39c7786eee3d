"""The film of liquid between a body and a solid that is held, too thin for particles, as under a body that lies on the floor.

No surface is so even that liquid does not get in between, and press as it does beside. So what of a held solid lies within reach of a
body's surface counts for that surface as liquid, at the pressure that hydrostatics continue from the rim, the liquid that touches both:

    P = -2 dt sum_b V_b f_b sum_c p_bc V_c grad W_bc / m_0,     p_bc = max(p + rho g . (x_bc - x), 0),  x_bc half way

b the body's wall particles, c those of other solids that are held, p, rho and x the mean over the rim, m_0 the lattice's moment: the force
of `divergence` with walls in place of liquid, whose lattice they continue. f is 1 where they and the liquid surround the body's surface,
and makes up for the gap that neither fills where they do not, FILLED at most:

    f_b = (o . e) / (o . o),     o = sum_c V_c grad W_bc,     e = -sum V grad W_b over the body's own points and the liquid.

A body so has its lift on the floor, where else all the water above would press it down, and while it leaves it. The solid across, if it is
a body that is held, gets the opposite. Between two bodies that can both move there is no film.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.jit import ALLOCATING, FAST, inlined
from oilsim.boundaries.walls import Contacts, Walls, add_wrench
from oilsim.neighborhood.neighbor_search import Pairs, nearest_images
from oilsim.neighborhood.smoothing_kernels import kernel_slope_over_q

Real = NDArray[np.float32]
Double = NDArray[np.float64]

PRESSURE, DENSITY, PLACE = 1, 2, 3  # columns of a rim, whose first one is the number of its particles
HALF = np.float32(0.5)
FILLED = (
    3.0  # of the force of what there is, at most: two layers of wall seen across a gap of three quarters of a spacing
)


@njit(**FAST)
def add_rims(contacts, walls, resting, held, kappa, per_kappa, density, position, rims):
    """Add each particle to the row in rims (bodies, 6) of every body that it touches beside a solid that is held, if that is not.

    contacts: of one particle beside each other; held (bodies,): which of the moving bodies are; kappa (N,) [m2/s], `per_kappa` times
    which is the pressure [Pa], density (N,) [kg/m3], position (3, N) [m].
    """
    begin = 0
    while begin < contacts.particle.size:
        i, end, holding = contacts.particle[begin], begin, 0
        while end < contacts.particle.size and contacts.particle[end] == i:
            holding += held[contacts.body[end]]
            end += 1
        at_rest = walls.neighbor[walls.start[i]] < resting  # lists name those at rest first
        for c in range(begin, end):
            rim = rims[contacts.body[c]]
            if not held[contacts.body[c]] and (at_rest or holding > 0):
                rim[0] += 1.0
                rim[PRESSURE] += per_kappa * kappa[i]
                rim[DENSITY] += density[i]
                for axis in range(3):
                    rim[PLACE + axis] += position[axis, i]
        begin = end


@njit(**FAST)
def add_liquid(touching, walls, place, position, resting, rims, owner, period, sigma, support, volume, slope):
    """Add V grad W_bi H^2 of the `touching` particles to slope (M, 3), for the moving wall particles b of bodies with a rim.

    place (N, 4): of the particles, position (3, all) of the wall particles [m].
    """
    for i in touching:
        for k in range(walls.start[i], walls.start[i] + np.int64(walls.number[i])):
            b = np.int64(walls.neighbor[k]) - resting
            if b < 0 or rims[owner[b], 0] == 0.0:
                continue
            dx, dy, dz = nearest_images(
                position[0, resting + b] - place[i, 0], position[1, resting + b] - place[i, 1],
                position[2, resting + b] - place[i, 2], period,
            )  # fmt: skip
            weight = volume * kernel_slope_over_q(math.sqrt(dx * dx + dy * dy + dz * dz) / support, sigma)
            slope[b, 0] += weight * dx
            slope[b, 1] += weight * dy
            slope[b, 2] += weight * dz


@inlined
def towards(position, c, b, volume, period, sigma, support):
    """x_b - x_c [m] as three, and V_c times what makes it grad W_bc H^2."""
    dx, dy, dz = nearest_images(
        position[0, b] - position[0, c], position[1, b] - position[1, c], position[2, b] - position[2, c], period
    )
    q = math.sqrt(dx * dx + dy * dy + dz * dz) / support
    return dx, dy, dz, volume[c] * kernel_slope_over_q(q, sigma)


@njit(**FAST)
def gap_filling(b, own, near, others, position, volume, resting, owner, held, surroundings, period, sigma, support):
    """f of the module's docstring, of the moving wall particle b of the body `own`; 0 where no solid that is held is near.

    near: wall particles near it, of which `others` becomes 1 for those of held solids; surroundings (3,): sum V grad W_b H^2 of the liquid.
    """
    ex, ey, ez = -surroundings[0], -surroundings[1], -surroundings[2]
    ox = oy = oz = 0.0
    for k in range(near.size):
        c = np.int64(near[k])
        dx, dy, dz, weight = towards(position, c, resting + b, volume, period, sigma, support)
        others[k] = c < resting or (owner[c - resting] != own and held[owner[c - resting]])
        if others[k]:
            ox, oy, oz = ox + weight * dx, oy + weight * dy, oz + weight * dz
        elif owner[c - resting] == own:
            ex, ey, ez = ex - weight * dx, ey - weight * dy, ez - weight * dz
    square = ox * ox + oy * oy + oz * oz
    return min(max((ox * ex + oy * ey + oz * ez) / square, 1.0), FILLED) if square > 0.0 else 0.0


@njit(**ALLOCATING)
def press_films(
    chosen, near, position, volume, arm, owner, resting, held, rims, slope, gravity, period, sigma, support, scale, wrench
):  # fmt: skip
    """Add to wrench (bodies, 6) [N, N m] what films press with on the `chosen` of the moving wall particles, and on those across.

    near: all wall particles near each of the chosen; rims: means, as from `add_rims`; slope (M, 3): as from `add_liquid`; scale:
    2 / (m_0 H^2).
    """
    others = np.empty(near.number[: chosen.size].max(), np.bool_)
    for n in range(chosen.size):
        b, first = chosen[n], near.start[n]
        own, rim, around = owner[b], rims[owner[b]], near.neighbor[first : first + np.int64(near.number[n])]
        share = -scale * volume[resting + b]
        share *= gap_filling(
            b, own, around, others, position, volume, resting, owner, held, slope[b], period, sigma, support
        )
        for k in range(around.size if share != 0.0 else 0):
            if not others[k]:
                continue
            c = np.int64(around[k])
            dx, dy, dz, weight = towards(position, c, resting + b, volume, period, sigma, support)
            pressure = rim[PRESSURE]
            for axis, way in enumerate((dx, dy, dz)):
                pressure += (
                    rim[DENSITY] * gravity[axis] * (position[axis, resting + b] - HALF * way - rim[PLACE + axis])
                )
            force = share * weight * max(pressure, 0.0)
            add_wrench(wrench, own, arm, b, force * dx, force * dy, force * dz)
            if c >= resting:
                add_wrench(wrench, owner[c - resting], arm, c - resting, -force * dx, -force * dy, -force * dz)


def film_wrenches(
    walls: Walls, wall_pairs: Pairs, contacts: Contacts, touching: NDArray[np.uint32], points: Real, liquid: tuple[Real, float, Real, Real],
    gravity: tuple[np.float32, ...], period: tuple[np.float32, ...] | None, kernel: tuple[np.float32, ...],
) -> Double:  # fmt: skip
    """Wrenches (bodies, 6) [N, N m] of all films on the moving bodies.

    touching: particles that touch bodies; points (N, 4): places of all [m]; liquid: their kappa (N,) [m2/s], the pressure of one
    [Pa s/m2], density (N,) [kg/m3] and position (3, N) [m]; kernel: its constant, its support, a particle's volume and the lattice's m_0.
    """
    wrench, rims = walls.zero_forces(), walls.zero_forces()
    held = walls.held()
    if not held.all() and (walls.resting or held.any()):
        add_rims(contacts, wall_pairs, walls.resting, held, *liquid, rims)
    if not rims.any():
        return wrench
    rims /= np.maximum(rims[:, :1], 1.0)
    sigma, support, volume, moment = kernel
    slope, where = np.zeros((walls.owner.size, 3)), (walls.position, walls.resting)
    add_liquid(touching, wall_pairs, points, *where, rims, walls.owner, period, sigma, support, volume, slope)
    chosen = np.flatnonzero(rims[walls.owner, 0] > 0.0)
    press_films(
        chosen, walls.near_moving(chosen, held), walls.position, walls.volume, walls.arm, walls.owner, walls.resting, held, rims, slope,
        gravity, period, sigma, support, np.float32(2.0) / (moment * support * support), wrench,
    )  # fmt: skip
    return wrench
