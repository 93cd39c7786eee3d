"""The film of liquid between a body and a fixed solid, too thin for particles, as under a body that lies on the floor.

No surface is so even that liquid does not get in between, and the film transmits pressure like the liquid beside it. So near a body, wall
particles of fixed solids count as liquid, at the pressure that hydrostatics continue from the rim, the liquid that touches both:

    P = -2 dt sum_b V_b f_b sum_c p_bc V_c grad W_bc / m_0,     p_bc = max(p + rho g . (x_bc - x), 0),  x_bc half way.

Here b are the body's wall particles and c those of fixed solids; p, rho and x are means over the rim; m_0 is the lattice's moment. It is
the force of `pressure_gradient` with walls in place of liquid, since walls continue the liquid's lattice. The factor f is 1 where fixed
solids and liquid surround the body's surface. Where a gap is left that neither fills, f makes up for it, up to FILLED:

    f_b = (o . e) / (o . o),     o = sum_c V_c grad W_bc,     e = -sum V grad W_b over the body's own points and the liquid.

So a body on the floor has its lift, where all the water above would press it down otherwise, and keeps it while it leaves. A fixed solid
that is a body itself gets the opposite wrench. Between two bodies that can both move there is no film.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from oilsim.backend.arrays import Array, Flags, Real
from oilsim.backend.jit import ALLOCATING, FAST, inlined
from oilsim.boundaries.contacts import BodyPairs, Contacts, add_wrench
from oilsim.boundaries.walls import Walls
from oilsim.neighborhood.neighbor_search import Neighborhood, nearest_images
from oilsim.neighborhood.smoothing_kernels import kernel_slope_over_q

# [1] columns of a rim, the sums over its particles; layout; the first column counts them
PRESSURE, DENSITY, PLACE = 1, 2, 3
HALF = np.float32(0.5)
# [1] largest factor f on the force of the walls that are there; theory; two layers of wall seen across a gap of three quarters of a spacing
FILLED = 3.0


class RimLiquid(NamedTuple):
    """The liquid's particles as rims ask for them.

    position      (3, N) [m]
    rest_density  (N,) [kg/m3]
    kappa         (N,) pressure impulse over rho_ref [m2/s]
    per_kappa     pressure for each unit of kappa [Pa s/m2]
    """

    position: Real
    rest_density: Real
    kappa: Real
    per_kappa: float


class Films(NamedTuple):
    """The films of one step.

    held   (bodies,) bool, bodies that no impulse moves
    rims   (bodies, 6) of each body's rim: 1 if there is one, then means of pressure [Pa], density [kg/m3] and place [m]
    slope  (M - R, 3) float64, sum of V grad W_bi H^2 over the liquid, of every moving wall particle [m]
    """

    held: Flags
    rims: Array
    slope: Array


@njit(**FAST)
def add_rims(contacts, walls, resting, held, liquid, rims):
    """Add each particle that touches a body and a fixed solid to the body's row in rims (bodies, 6), if the body is not fixed itself.

    contacts  the step's `Contacts`
    walls     lists of wall neighbours, which name the `resting` wall particles first
    held      (bodies,) bool, bodies that no impulse moves
    liquid    the `RimLiquid`
    rims      number of particles, then sums of pressure [Pa], density [kg/m3] and place [m]
    """
    begin = 0
    while begin < contacts.particle.size:
        i, end, holding = contacts.particle[begin], begin, 0
        while end < contacts.particle.size and contacts.particle[end] == i:
            holding += held[contacts.body[end]]
            end += 1
        at_rest = walls.neighbor[walls.start[i]] < resting
        for c in range(begin, end):
            rim = rims[contacts.body[c]]
            if not held[contacts.body[c]] and (at_rest or holding > 0):
                rim[0] += 1.0
                rim[PRESSURE] += liquid.per_kappa * liquid.kappa[i]
                rim[DENSITY] += liquid.rest_density[i]
                for axis in range(3):
                    rim[PLACE + axis] += liquid.position[axis, i]
        begin = end


@njit(**FAST)
def add_liquid(pairs, position, wall, rims, neighborhood, slope):
    """Add V grad W_bi H^2 [m] of the liquid to slope (M - R, 3), for the moving wall particles b of bodies with a rim.

    pairs     the step's `BodyPairs`
    position  (3, N) of the particles [m]
    wall      the `WallParticles`
    rims      (bodies, 6) as from `add_rims`
    """
    sigma, support, volume = neighborhood.sigma, neighborhood.support, neighborhood.volume
    n = 0
    while n < pairs.particle.size:
        i = pairs.particle[n]
        while n < pairs.particle.size and pairs.particle[n] == i:
            b = np.int64(pairs.point[n])
            if rims[pairs.body[n], 0] != 0.0:
                dx, dy, dz = nearest_images(
                    wall.position[0, b] - position[0, i], wall.position[1, b] - position[1, i],
                    wall.position[2, b] - position[2, i], neighborhood.period,
                )  # fmt: skip
                weight = volume * kernel_slope_over_q(math.sqrt(dx * dx + dy * dy + dz * dz) / support, sigma)
                slope[b - wall.resting, 0] += weight * dx
                slope[b - wall.resting, 1] += weight * dy
                slope[b - wall.resting, 2] += weight * dz
            n += 1


@inlined
def towards(wall, c, b, neighborhood):
    """Return x_b - x_c [m] as three numbers, and V_c (dW/dq) / q, which makes them V_c grad W_bc H^2; wall: the `WallParticles`."""
    position, period = wall.position, neighborhood.period
    dx, dy, dz = nearest_images(
        position[0, b] - position[0, c], position[1, b] - position[1, c], position[2, b] - position[2, c], period
    )
    q = math.sqrt(dx * dx + dy * dy + dz * dz) / neighborhood.support
    return dx, dy, dz, wall.points[c, 3] * kernel_slope_over_q(q, neighborhood.sigma)


@njit(**FAST)
def gap_filling(b, near, wall, films, neighborhood, others):
    """Return f of the module's docstring [1] for the moving wall particle b; 0 where no fixed solid is near.

    b       counted from the first moving wall particle
    near    (n,) uint32, wall particles near it
    wall    the `WallParticles`
    films   the `Films`
    others  (n,) bool, becomes true for those of `near` that belong to fixed solids
    """
    resting, own, surroundings = wall.resting, wall.owner[b], films.slope[b]
    ex, ey, ez = -surroundings[0], -surroundings[1], -surroundings[2]
    ox = oy = oz = 0.0
    for k in range(near.size):
        c = np.int64(near[k])
        dx, dy, dz, weight = towards(wall, c, resting + b, neighborhood)
        others[k] = c < resting or (wall.owner[c - resting] != own and films.held[wall.owner[c - resting]])
        if others[k]:
            ox, oy, oz = ox + weight * dx, oy + weight * dy, oz + weight * dz
        elif wall.owner[c - resting] == own:
            ex, ey, ez = ex - weight * dx, ey - weight * dy, ez - weight * dz
    square = ox * ox + oy * oy + oz * oz
    return min(max((ox * ex + oy * ey + oz * ez) / square, 1.0), FILLED) if square > 0.0 else 0.0


@njit(**ALLOCATING)
def press_films(chosen, near, wall, films, gravity, scale, neighborhood, wrench):
    """Add to wrench (bodies, 6) [N, N m] the force of films on the `chosen` (K,) of the moving wall particles, and its opposite.

    near     lists of all wall particles near each of the chosen
    wall     the `WallParticles`
    films    the `Films`
    gravity  (x, y, z) [m/s2]
    scale    2 / (m_0 H^2) [1/m2]
    """
    position, resting = wall.position, wall.resting
    others = np.empty(near.number[: chosen.size].max(), np.bool_)
    for n in range(chosen.size):
        b, first = chosen[n], near.start[n]
        own, around = wall.owner[b], near.neighbor[first : first + np.int64(near.number[n])]
        rim = films.rims[own]
        share = -scale * wall.points[resting + b, 3]
        share *= gap_filling(b, around, wall, films, neighborhood, others)
        for k in range(around.size if share != 0.0 else 0):
            if not others[k]:
                continue
            c = np.int64(around[k])
            dx, dy, dz, weight = towards(wall, c, resting + b, neighborhood)
            pressure = rim[PRESSURE]
            for axis, way in enumerate((dx, dy, dz)):
                pressure += (
                    rim[DENSITY] * gravity[axis] * (position[axis, resting + b] - HALF * way - rim[PLACE + axis])
                )
            force = share * weight * max(pressure, 0.0)
            add_wrench(wrench, own, wall.arm, b, force * dx, force * dy, force * dz)
            if c >= resting:
                add_wrench(
                    wrench, wall.owner[c - resting], wall.arm, c - resting, -force * dx, -force * dy, -force * dz
                )


def film_wrenches(
    walls: Walls, neighborhood: Neighborhood, contacts: Contacts, pairs: BodyPairs, liquid: RimLiquid,
    gravity: tuple[np.float32, ...], moment: np.float32,
) -> Array:  # fmt: skip
    """Return the wrenches (bodies, 6) [N, N m] of all films on the moving bodies.

    contacts and pairs are the step's; gravity (x, y, z) [m/s2]; moment: the lattice's m_0 [1].
    """
    wrench, rims, wall = walls.zero_forces(), walls.zero_forces(), walls.particles
    held = walls.held()
    if not held.all() and (walls.resting or held.any()):
        add_rims(contacts, neighborhood.walls, walls.resting, held, liquid, rims)
    if not rims.any():
        return wrench
    rims /= np.maximum(rims[:, :1], 1.0)
    films = Films(held, rims, np.zeros((walls.owner.size, 3)))
    add_liquid(pairs, liquid.position, wall, rims, neighborhood, films.slope)
    chosen = np.flatnonzero(rims[walls.owner, 0] > 0.0)
    near, support = walls.near_moving(chosen, held), neighborhood.support
    press_films(
        chosen, near, wall, films, gravity, np.float32(2.0) / (moment * support * support), neighborhood, wrench
    )
    return wrench
