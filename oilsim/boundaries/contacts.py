"""Pairs of fluid particles and points of moving bodies, listed once a step, and the Jacobians of the contacts that they make.

A fluid particle i that presses with kappa_i [m2/s] on wall particles b receives the impulse -V rho_ref kappa_i V_b grad W_ib, and
the body receives the opposite (after Akinci et al. 2012):

    P = V rho_ref sum_i kappa_i J_i,    J_i = sum_b V_b (grad W_ib, r_b x grad W_ib),

r_b being the arm from the body's centre of mass to b. A contact is a particle together with one body within its reach.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.arrays import Index, Ints, Real
from oilsim.backend.jit import FAST, inlined
from oilsim.boundaries.walls import WallParticles
from oilsim.neighborhood.neighbor_search import Pairs, indices


class BodyPairs(NamedTuple):
    """Every pair of a fluid particle and a moving wall particle within its reach, by fluid particle, then by place in its list.

    particle  (P,) uint32, the fluid particle
    pair      (P,) int64, the pair's place in the list of wall neighbours, as in `Pairs.neighbor` and pair vectors
    point     (P,) uint32, the wall particle, counted from the first one at rest
    body      (P,) uint16, the slot of the moving body to which the point belongs
    arm       (3, P) from the body's centre of mass to the point [m]
    """

    particle: Index
    pair: Ints
    point: Index
    body: NDArray[np.uint16]
    arm: Real


class Contacts(NamedTuple):
    """Fluid particles that touch moving bodies, one entry for each body that a particle touches.

    particle  (K,) uint32, the fluid particle; equal ones follow each other
    body      (K,) uint16, the slot of the body
    jacobian  (K, 6) J of the module's docstring, force and torque [1/m, 1]
    reach     (K, 6, 3) part of the wrench that comes by the pressure of the particle's neighbours (see `rigid_response`), or (0, 6, 3)
    of_pair   (P,) uint32, the contact to which each of the step's `BodyPairs` belongs
    """

    particle: Index
    body: NDArray[np.uint16]
    jacobian: Real
    reach: Real
    of_pair: Index


NO_BODY_PAIRS = BodyPairs(
    np.empty(0, np.uint32), np.empty(0, np.int64), np.empty(0, np.uint32), np.empty(0, np.uint16), np.empty((3, 0), np.float32)
)  # fmt: skip
NO_REACH: Real = np.empty((0, 6, 3), np.float32)
NO_CONTACTS = Contacts(
    np.empty(0, np.uint32), np.empty(0, np.uint16), np.empty((0, 6), np.float32), NO_REACH, np.empty(0, np.uint32)
)


@inlined
def add_wrench(wrench, row, arm, b, fx, fy, fz):
    """Add a force (fx, fy, fz) [N] that acts at arm[:, b] [m], and its torque [N m], to a row of `wrench` (bodies, 6)."""
    wrench[row, 0] += fx
    wrench[row, 1] += fy
    wrench[row, 2] += fz
    wrench[row, 3] += arm[1, b] * fz - arm[2, b] * fy
    wrench[row, 4] += arm[2, b] * fx - arm[0, b] * fz
    wrench[row, 5] += arm[0, b] * fy - arm[1, b] * fx


@njit(**FAST)
def count_body_pairs(walls, resting, number):
    """Fill `number` (N,) uint32 with the moving wall particles within reach of the first N particles.

    walls: lists of wall neighbours, as indices of wall particles. The `resting` ones come first in a list, so that only its end is read.
    """
    for i in range(number.size):
        first = walls.start[i]
        last = first + np.int64(walls.number[i])
        k = last
        while k > first and walls.neighbor[k - 1] >= resting:
            k -= 1
        number[i] = last - k


@njit(**FAST)
def fill_body_pairs(touching, number, walls, wall, pairs):
    """Fill `pairs` (see `BodyPairs`) with those of the particles `touching` (T,); number (N,) as from `count_body_pairs`.

    walls: lists of wall neighbours, as indices of the particles in `wall`, the `WallParticles`.
    """
    n = 0
    for i in touching:
        last = walls.start[i] + np.int64(walls.number[i])
        for k in range(last - np.int64(number[i]), last):
            b = walls.neighbor[k]
            pairs.particle[n], pairs.pair[n], pairs.point[n] = i, k, b
            pairs.body[n] = wall.owner[b - wall.resting]
            for axis in range(3):
                pairs.arm[axis, n] = wall.arm[axis, b - wall.resting]
            n += 1


def list_body_pairs(wall: WallParticles, walls: Pairs, count: int) -> tuple[BodyPairs, Index]:
    """List the pairs of the first `count` fluid particles with moving bodies, and the particles (T,) that have any.

    walls: lists of wall neighbours. The lists are empty where no body moves.
    """
    if not wall.owner.size:
        return NO_BODY_PAIRS, np.empty(0, np.uint32)
    number = np.empty(count, np.uint32)
    count_body_pairs(walls, wall.resting, number)
    touching = indices(number > 0)
    total = int(number[touching].sum())
    pairs = BodyPairs(
        np.empty(total, np.uint32), np.empty(total, np.int64), np.empty(total, np.uint32), np.empty(total, np.uint16),
        np.empty((3, total), np.float32),
    )  # fmt: skip
    fill_body_pairs(touching, number, walls, wall, pairs)
    return pairs, touching


@njit(**FAST)
def find_contacts(pairs, wall_gradient, contacts):
    """Sum J_i over the `pairs` (see `BodyPairs`) of each particle and body, and return the number of contacts.

    wall_gradient (3, Q): pair vectors of wall neighbours [1/m]; `contacts` has room for one contact a pair.
    """
    first = found = 0
    for n in range(pairs.particle.size):
        if n == 0 or pairs.particle[n] != pairs.particle[n - 1]:
            first = found
        c = first
        while c < found and contacts.body[c] != pairs.body[n]:
            c += 1
        if c == found:
            contacts.particle[c] = pairs.particle[n]
            contacts.body[c] = pairs.body[n]
            contacts.jacobian[c] = 0.0
            found += 1
        contacts.of_pair[n] = c
        k = pairs.pair[n]
        add_wrench(contacts.jacobian, c, pairs.arm, n, wall_gradient[0, k], wall_gradient[1, k], wall_gradient[2, k])
    return found


def gather_contacts(pairs: BodyPairs, wall_gradient: Real) -> Contacts:
    """Gather the contacts of fluid particles with moving bodies, by the pair vectors (3, Q) of wall neighbours [1/m]."""
    room = pairs.particle.size
    if not room:
        return NO_CONTACTS
    contacts = Contacts(
        np.empty(room, np.uint32), np.empty(room, np.uint16), np.empty((room, 6), np.float32), NO_REACH,
        np.empty(room, np.uint32),
    )  # fmt: skip
    found = find_contacts(pairs, wall_gradient, contacts)
    return contacts._replace(
        particle=contacts.particle[:found], body=contacts.body[:found], jacobian=contacts.jacobian[:found]
    )
