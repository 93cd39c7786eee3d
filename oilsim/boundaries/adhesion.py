"""Adhesion: walls attract liquid particles with a force whose work is the work of adhesion w [J/m2].

A particle of volume V at a distance r from a wall particle of area a_b has the energy

    e(r) = -w a_b V s(r),    s(r) = A (1 - r / H)^2 (1 + 2 r / H),   0 from r = H on,

and feels the force -de/dr; the wall feels the opposite. The factor A follows from the work of tearing a half space of liquid off a plane,
which is w an area. The liquid's edge lies d/2 from the wall particles (see `boundary_particles`), so that

    integral over z > d/2 of  integral over the plane of s  = 1.

Akinci et al. 2013 use a similar pair force, with a free coefficient without units.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numba import njit

from oilsim.backend.jit import FAST
from oilsim.boundaries.contacts import add_wrench
from oilsim.neighborhood.neighbor_search import nearest_images
from oilsim.neighborhood.smoothing_kernels import SUPPORT


@lru_cache
def adhesion_scale(dimension: int) -> float:
    """Return A of the module's docstring for spacing 1; divide by d^dimension for other spacings."""
    heights = np.linspace(0.5, SUPPORT, 601)
    across = np.linspace(0.0, SUPPORT, 601)
    z, r = np.meshgrid(heights, across, indexing="ij")
    q = np.minimum(np.hypot(z, r) / SUPPORT, 1.0)
    shape = (1.0 - q) ** 2 * (1.0 + 2.0 * q)
    around = 2.0 * math.pi * r if dimension == 3 else np.full_like(r, 2.0)
    return 1.0 / float(np.trapezoid(np.trapezoid(shape * around, across, axis=1), heights))


@njit(**FAST)
def adhesion_acceleration(begin, end, position, phase, strength, wall, neighborhood, pull):
    """Add the acceleration of adhesion, -de/dr / (rho_0 V) of the module's docstring, to `pull` (3, N) [m/s2].

    position      (3, N) of the particles [m]
    phase         (N,) uint8, index of each particle's liquid
    strength      (phases,) w A d^-dimension / rho_0 [m2/s2], 0 of a liquid that does not stick
    wall          the `WallParticles`
    neighborhood  lists and constants of the step (see `Neighborhood`)
    """
    period, walls = neighborhood.period, neighborhood.walls
    inverse_support = np.float32(1.0) / neighborhood.support
    for i in range(begin, end):
        w = strength[phase[i]]
        if w == np.float32(0.0):
            continue
        xi, yi, zi = position[0, i], position[1, i], position[2, i]
        for k in range(walls.start[i], walls.start[i] + np.int64(walls.number[i])):
            b = walls.neighbor[k]
            dx, dy, dz = nearest_images(
                xi - wall.position[0, b], yi - wall.position[1, b], zi - wall.position[2, b], period
            )
            q = math.sqrt(dx * dx + dy * dy + dz * dz) * inverse_support
            if q < np.float32(1.0):
                # ds/dr / r = -6 A (1 - q) / H^2
                factor = -np.float32(6.0) * w * wall.area[b] * (np.float32(1.0) - q) * inverse_support * inverse_support
                pull[0, i] += factor * dx
                pull[1, i] += factor * dy
                pull[2, i] += factor * dz


@njit(**FAST)
def adhesion_reaction(pairs, position, phase, strength, rest_density, wall, neighborhood, force):
    """Add to `force` (bodies, 6) the pull of adhesion on moving bodies, opposite to that on the liquid [N, N m].

    pairs         the step's `BodyPairs`
    rest_density  (N,) rho_0 of each particle [kg/m3]
    position, phase, strength, wall, neighborhood  as for `adhesion_acceleration`
    """
    inverse_support, volume = np.float32(1.0) / neighborhood.support, neighborhood.volume
    for n in range(pairs.particle.size):
        i, b = pairs.particle[n], pairs.point[n]
        w = strength[phase[i]]
        if w == np.float32(0.0):
            continue
        dx, dy, dz = nearest_images(
            position[0, i] - wall.position[0, b], position[1, i] - wall.position[1, b],
            position[2, i] - wall.position[2, b], neighborhood.period,
        )  # fmt: skip
        q = math.sqrt(dx * dx + dy * dy + dz * dz) * inverse_support
        factor = np.float32(6.0) * w * wall.area[b] * max(np.float32(1.0) - q, np.float32(0.0))
        factor *= inverse_support * inverse_support * volume * rest_density[i]
        add_wrench(force, pairs.body[n], pairs.arm, n, factor * dx, factor * dy, factor * dz)
