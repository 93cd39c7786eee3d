"""Adhesion: liquid particles are drawn to walls with a force whose work is the work of adhesion [J/m2].

A particle of volume V at distance r of a wall particle that stands for the area a_b has the energy

    e(r) = -w a_b V s(r),    s(r) = A (1 - r / H)^2 (1 + 2 r / H),   0 from r = H on,

so that the force on the particle is -de/dr. A follows from one demand: to tear a half space of liquid off a plane costs w per area.
With the liquid's edge at d/2 from the wall particles (see `boundary`),

    integral over z > d/2 of  integral over the plane of s  = 1.

The opposite force goes to the wall. Akinci et al. 2013 use a similar pair force with a free coefficient without units.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numba import njit

from oilsim.backend.jit import FAST
from oilsim.boundaries.walls import add_wrench
from oilsim.neighborhood.neighbor_search import nearest_images
from oilsim.neighborhood.smoothing_kernels import SUPPORT


@lru_cache
def adhesion_scale(dimension: int) -> float:
    """A for spacing 1; divide by d^dimension for other spacings."""
    heights = np.linspace(0.5, SUPPORT, 601)
    across = np.linspace(0.0, SUPPORT, 601)
    z, r = np.meshgrid(heights, across, indexing="ij")
    q = np.minimum(np.hypot(z, r) / SUPPORT, 1.0)
    shape = (1.0 - q) ** 2 * (1.0 + 2.0 * q)
    around = 2.0 * math.pi * r if dimension == 3 else np.full_like(r, 2.0)
    return 1.0 / float(np.trapezoid(np.trapezoid(shape * around, across, axis=1), heights))


@njit(**FAST)
def adhesion_acceleration(begin, end, position, wall, wall_area, phase, strength, period, walls, support, pull):
    """Add the acceleration [m/s2] of adhesion to `pull` (3, N).

    wall_area (M,) [m2]; strength (phases,): w A d^-dimension / rho_0 [N m / kg m... = m4/s2 per m2 of wall].
    """
    inverse_support = np.float32(1.0) / support
    for i in range(begin, end):
        w = strength[phase[i]]
        if w == np.float32(0.0):
            continue
        xi, yi, zi = position[0, i], position[1, i], position[2, i]
        for k in range(walls.start[i], walls.start[i] + np.int64(walls.number[i])):
            b = walls.neighbor[k]
            dx, dy, dz = nearest_images(xi - wall[0, b], yi - wall[1, b], zi - wall[2, b], period)
            q = math.sqrt(dx * dx + dy * dy + dz * dz) * inverse_support
            if q < np.float32(1.0):
                # ds/dr / r = -6 A (1 - q) / H^2
                factor = -np.float32(6.0) * w * wall_area[b] * (np.float32(1.0) - q) * inverse_support * inverse_support
                pull[0, i] += factor * dx
                pull[1, i] += factor * dy
                pull[2, i] += factor * dz


@njit(**FAST)
def adhesion_reaction(
    particles,
    position,
    wall,
    wall_area,
    phase,
    strength,
    rest_density,
    period,
    walls,
    support,
    volume,
    resting,
    owner,
    arm,
    force,
):
    """Add to `force` (bodies, 6) what `particles` that touch moving bodies pull on them by adhesion [N, N m]."""
    inverse_support = np.float32(1.0) / support
    for i in particles:
        w = strength[phase[i]]
        for k in range(walls.start[i], walls.start[i] + np.int64(walls.number[i])):
            b = walls.neighbor[k]
            if b < resting or w == np.float32(0.0):
                continue
            dx, dy, dz = nearest_images(
                position[0, i] - wall[0, b], position[1, i] - wall[1, b], position[2, i] - wall[2, b], period
            )
            q = math.sqrt(dx * dx + dy * dy + dz * dz) * inverse_support
            factor = np.float32(6.0) * w * wall_area[b] * max(np.float32(1.0) - q, np.float32(0.0))
            factor *= inverse_support * inverse_support * volume * rest_density[i]
            add_wrench(force, owner[b - resting], arm, b - resting, factor * dx, factor * dy, factor * dz)
