"""Particles that rise or sink as the drops that they stand for: the drift flux of drops finer than the flow of particles.

A particle among particles of another liquid is a drop. The water has to flow around it, and the particles around it cannot carry that
flow: the lattice holds it at a tenth of a drop's terminal speed w. What is missing of w is added as a drift flux (Ishii and Zuber 1979;
Manninen, Taivassalo and Kallio 1996): the drop moves by w relative to the liquid around, and as much volume moves the other way. In
particles: the drop and the particle that lies s ahead of it change places, at a rate of w / s. That keeps all volumes, the masses and the
pair's momentum; it frees the energy drho g s V of a volume V, which becomes heat as by the drag on a drop at its terminal speed.

    e = -+ grad p / |grad p|                  the way: against the pressure's gradient for a lighter drop, along it for a heavier one
    S_i = sum_like w_ij / sum w_ij,  w_ij = (1 - r^2 / H^2)^2        share of the own liquid around a particle, over the support H
    S'_i = (S_i + sum_like w_ij S_j) / (1 + sum_like w_ij)           that of its drop: 0.3 of a block of 4 in a plane, 0.6 of a disc
    w_missing = f(S') max(0, w(1 + m) (1 - c)^n - (v - u) . e) (|grad p| / (rho g))^(1/2)
    chance of a step dt: w_missing dt / s, s = (x_j - x_i) . e

m counts the like particles within 1.6 d: the drop has the volume of 1 + m particles. c is the share of other drops, which hinder it
(Richardson and Zaki 1954): that of like particles beyond 2.2 d, less half of what is more of them within 1.6 d, as these are its own. They
count by f(S_j), since a body of liquid hinders no drop on its way to it. v is the mean velocity of the particle and of these, u that of the
other liquid within the support, so a cluster that the particles' own flow carries up is not carried up twice. f falls from 1 to 0 as the
drop grows, and is 0 at the surface of a body of liquid, rough as it may be.
The partner j is the particle of the other liquid nearest to the place d ahead; if a like particle is there, the one nearest to 2 d ahead:
the last of a file passes to its front. Draws come from the particle's id and the number of the step, so threads, cell order and restarts
change nothing. *Modelled.*

The terminal speed w of a single drop of diameter D in still liquid: a small drop is a sphere, its Reynolds number Re follows from the Best
number N = 4 rho drho g D^3 / (3 mu^2) (Clift, Grace and Weber 1978, table 5.3), and w = Re mu / (rho D). A large drop is flattened by its
own rise, and w = sqrt(2) (sigma g drho / rho^2)^(1/4) whatever its size (Ishii and Zuber 1979). The smaller of the two holds. A drop larger
than the largest stable one would break into drops that rise at the same speed. rho, mu: density and viscosity of the liquid around.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
from numba import njit

from oilsim.backend.arrays import Index, Ints, Real
from oilsim.backend.jit import EXACT, FAST, ONE, ZERO, exactly_inlined, inlined
from oilsim.backend.simd import LANES, above_zero, below, gather, load, only, positive, spread, summed
from oilsim.core.phases import Phase
from oilsim.neighborhood.neighbor_search import nearest_images, separations

# [1] limits of N, and factors of the powers of log10 N that give log10 Re; theory; Clift, Grace and Weber 1978, table 5.3
_LOGARITHMIC = (
    (73.0, 580.0, (-1.7095, 1.33438, -0.11591)),
    (580.0, 1.55e7, (-1.81391, 1.34671, -0.12427, 0.006344)),
    (1.55e7, 5e10, (5.33283, -1.21728, 0.19007, -0.007005)),
)
# [1] factors of the powers of N that give Re below the first of these limits; theory; the same table
_SMALL = (0.0, 1.0 / 24.0, -1.7569e-4, 6.9252e-7, -2.3027e-10)

# [Pa s] as which no viscosity counts; numerical; any drop of a millimetre then feels a constant drag coefficient
IDEAL = 1e-9


def sphere_reynolds(best: float) -> float:
    """Compute the Reynolds number [1] of a rigid sphere at its terminal speed from its Best number N [1], 0 or more.

    Beyond the range of the fit its drag coefficient stays.
    """
    if best < _LOGARITHMIC[0][0]:
        return float(np.polyval(_SMALL[::-1], best))
    covered = min(best, _LOGARITHMIC[-1][1])
    _, _, factors = next(row for row in _LOGARITHMIC if covered <= row[1])
    return 10.0 ** float(np.polyval(factors[::-1], math.log10(covered))) * math.sqrt(best / covered)


def terminal_speed(
    diameter: float, density: float, viscosity: float, difference: float, tension: float, gravity: float
) -> float:
    """Compute the terminal speed [m/s] of a drop.

    diameter [m] of the sphere of its volume; density [kg/m3] and viscosity [Pa s] of the liquid around, 0 if it is ideal; difference
    [kg/m3] of the densities, without sign; tension [N/m] between both; gravity [m/s2].
    """
    if difference <= 0.0 or gravity <= 0.0:
        return 0.0
    flattened = math.sqrt(2.0) * (tension * gravity * difference / density**2) ** 0.25
    viscosity = max(viscosity, IDEAL)
    best = 4.0 * density * difference * gravity * diameter**3 / (3.0 * viscosity**2)
    return min(sphere_reynolds(best) * viscosity / (density * diameter), flattened)


def hindered_exponent(reynolds: float) -> float:
    """Compute n of w (1 - c)^n [1], at which drops of a volume share c rise (Richardson and Zaki 1954); reynolds [1] of a single drop."""
    if reynolds < 1.0:
        return 4.65 if reynolds < 0.2 else 4.35 * reynolds**-0.03
    return max(4.45 * reynolds**-0.1, 2.39)


# [d] within which particles of a liquid are one drop; numerical; between the third and the fourth shell of a lattice
CLOSE = 1.6
# [d] beyond which like particles are other drops; numerical; clusters of 27 end there
APART = 2.2
# [1] like particles within CLOSE in the tables; layout; a drop with more is resolved
LARGEST = 18
# [1] S' up to which a drop is modelled wholly, and from which on it is resolved; numerical; blocks of 8 have 0.22, of 27 0.43, the rims of
# discs and balls of three spacings of radius 0.56 and more
FADING = (0.42, 0.56)
# [1] S from which on a particle is amid its own liquid, and S' is not looked at; numerical; the face of a body of liquid has 0.68 at most
AMID = 0.8
# [d] that a partner must lie ahead; numerical; beside the drop it would not rise
LEAST_AHEAD = 0.5
# [N/m] between liquids without a tension in the configuration; measured; crude oils on sea water have 0.01 to 0.03
ASSUMED_TENSION = 0.02
# [index] in place of a partner; layout; a particle that is no drop on its way, and a drop whose turn has not come
RESTS, WAITS = -1, -2


def drop_speeds(phases: tuple[Phase, ...], spacing: float, dimension: int, gravity: float) -> tuple[Real, Real]:
    """Return w(1 + m), (phases, phases, LARGEST + 1) [m/s], of a drop of the first in the second by m, and n (phases, phases) [1].

    spacing d [m]; gravity [m/s2], 0 or more.
    """
    speeds = np.zeros((len(phases), len(phases), LARGEST + 1), np.float32)
    exponents = np.zeros(speeds.shape[:2], np.float32)
    for (i, drop), (j, around) in itertools.permutations(enumerate(phases), 2):
        tension = abs(drop.interfacial_tension - around.interfacial_tension) or ASSUMED_TENSION
        difference = abs(drop.rest_density - around.rest_density)
        for m in range(LARGEST + 1):
            size = (6.0 / math.pi * (1 + m)) ** (1.0 / 3.0) if dimension == 3 else math.sqrt(4.0 / math.pi * (1 + m))
            speeds[i, j, m] = terminal_speed(
                size * spacing, around.rest_density, around.dynamic_viscosity, difference, tension, gravity
            )
        thin = max(around.dynamic_viscosity, IDEAL)
        exponents[i, j] = hindered_exponent(float(speeds[i, j, 0]) * spacing * around.rest_density / thin)
    return speeds, exponents


@exactly_inlined
def draw(number, step):
    """Return a random number [0, 1) that hangs on an id and on the number of a step alone (splitmix64, Steele and others 2014)."""
    z = np.uint64(number) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(step) * np.uint64(0xD1B54A32D192ED03)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z ^= z >> np.uint64(31)
    return np.float64(z >> np.uint64(11)) * (1.0 / 9007199254740992.0)


@exactly_inlined
def nearest_to(i, fluid, points, period, ahead, distance):
    """Return the neighbour of particle i nearest to the place `distance` [m] along the unit vector `ahead`, and how far ahead it lies [m].

    -1 without neighbours; fluid: lists of neighbours; points (N, 4) [m]; period as for `nearest_images`.
    """
    found, least, length = np.int64(-1), np.float64(np.inf), 0.0
    first = fluid.start[i]
    for k in range(first, first + np.int64(fluid.number[i])):
        j = fluid.neighbor[k]
        dx, dy, dz = nearest_images(
            points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2], period
        )
        off = (dx - distance * ahead[0]) ** 2 + (dy - distance * ahead[1]) ** 2 + (dz - distance * ahead[2]) ** 2
        if off < least:
            found, least = np.int64(j), off
            length = dx * ahead[0] + dy * ahead[1] + dz * ahead[2]
    return found, length


@inlined
def weights_and_others(i, neighborhood, k, last):
    """Return w of the module's docstring [1] of the neighbours of particle i in the places k to k + LANES, below `last`, as lanes.

    0 in lanes beyond; also which neighbours are of another liquid (of another density), and their indices.
    """
    present = below(last, k)
    j = load(neighborhood.fluid.neighbor, k, present)
    dx, dy, dz, density = separations(i, neighborhood.points, neighborhood.points, j, neighborhood.period)
    inverse_support = ONE / neighborhood.support
    inside = positive(ONE - (dx * dx + dy * dy + dz * dz) * (inverse_support * inverse_support))
    other = density - neighborhood.points[i, 3]
    return only(present, inside * inside, ZERO), above_zero(other * other), j


@njit(**FAST)
def fill_shares(begin, end, chosen, neighborhood, share):
    """Fill share (N,) with S of the module's docstring [1] for the `chosen` (K,) particles; neighborhood: the `Neighborhood`."""
    fluid = neighborhood.fluid
    for n in range(begin, end):
        i = chosen[n]
        whole = unlike = spread(ZERO)
        last = fluid.start[i] + np.int64(fluid.number[i])
        for k in range(fluid.start[i], last, LANES):
            weight, others, _ = weights_and_others(i, neighborhood, k, last)
            whole += weight
            unlike += only(others, weight, ZERO)
        all_weights = summed(whole)
        share[i] = ONE - summed(unlike) / all_weights if all_weights > ZERO else ZERO


@njit(**FAST)
def fill_drop_shares(begin, end, chosen, neighborhood, share, drop):
    """Fill drop (K,) with S' of the module's docstring [1] for the `chosen` (K,) particles, from S of all in share (N,) [1].

    neighborhood: the `Neighborhood`.
    """
    fluid = neighborhood.fluid
    for n in range(begin, end):
        i = chosen[n]
        shares = weights = spread(ZERO)
        last = fluid.start[i] + np.int64(fluid.number[i])
        for k in range(fluid.start[i], last, LANES):
            weight, others, j = weights_and_others(i, neighborhood, k, last)
            like = only(others, ZERO, weight)
            weights += like
            shares += like * gather(share, j)
        drop[n] = (share[i] + summed(shares)) / (ONE + summed(weights))


@njit(**EXACT)
def choose_partners(begin, end, chosen, shares, neighborhood, liquid, velocity, kappa, rises, scales, partner):
    """Fill partner (K,) with the index of the particle with which each of the `chosen` (K,) changes place in this step.

    It is `RESTS` for a particle that is no drop on its way, and `WAITS` for one whose turn has not come.
    shares: S (N,) of all and S' (K,) of the chosen [1]; neighborhood: the `Neighborhood`; liquid: phase (N,) and id (N,) of the particles,
    densities of the phases [kg/m3]; velocity (3, N) [m/s]; kappa (N,) pressure impulse [m2/s]; rises: see `drop_speeds`; scales: spacing
    [m], length of the step [s], slope of kappa in liquid at rest [m/s], dimension, number of the step.
    """
    points, period, fluid = neighborhood.points, neighborhood.period, neighborhood.fluid
    phase, identity, densities = liquid
    speeds, exponents = rises
    share, drop = shares
    spacing, time_step, at_rest, dimension, number = scales
    near, beyond = (CLOSE * spacing) ** 2, (APART * spacing) ** 2
    for n in range(begin, end):
        i = chosen[n]
        partner[n] = RESTS
        first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
        alike, unlike, beside, outside = 0, 0, 1, 1
        apart = 0.0
        gx = gy = gz = ux = uy = uz = around = 0.0
        vx, vy, vz = np.float64(velocity[0, i]), np.float64(velocity[1, i]), np.float64(velocity[2, i])
        for k in range(first, last):
            j = fluid.neighbor[k]
            dx, dy, dz = nearest_images(
                points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2], period
            )
            square = np.float64(dx * dx + dy * dy + dz * dz)
            far = square > beyond
            beside += square < near
            rise = (kappa[j] - kappa[i]) / (square + 1e-12)
            gx, gy, gz = gx + rise * dx, gy + rise * dy, gz + rise * dz
            outside += far
            if phase[j] != phase[i]:
                unlike += 1
                around += densities[phase[j]]
                ux, uy, uz = ux + velocity[0, j], uy + velocity[1, j], uz + velocity[2, j]
                continue
            if far:  # a body of liquid hinders no drop on its way to it
                apart += min(1.0, max(0.0, (FADING[1] - share[j]) / (FADING[1] - FADING[0])))
            if square < near:
                alike += 1
                vx, vy, vz = vx + velocity[0, j], vy + velocity[1, j], vz + velocity[2, j]
        steep = math.sqrt(gx * gx + gy * gy + gz * gz)
        if unlike == 0 or alike > LARGEST or steep == 0.0:
            continue
        way = -1.0 / steep if densities[phase[i]] * unlike < around else 1.0 / steep
        ahead = way * gx, way * gy, way * gz
        j, length = nearest_to(i, fluid, points, period, ahead, spacing)
        if phase[j] == phase[i]:
            j, length = nearest_to(i, fluid, points, period, ahead, 2.0 * spacing)
        if phase[j] == phase[i] or length < LEAST_AHEAD * spacing:
            continue
        slip = (
            ahead[0] * (vx / (1 + alike) - ux / unlike)
            + ahead[1] * (vy / (1 + alike) - uy / unlike)
            + ahead[2] * (vz / (1 + alike) - uz / unlike)
        )
        fade = min(1.0, (FADING[1] - drop[n]) / (FADING[1] - FADING[0]))
        steepness = dimension * steep / (at_rest * np.int64(fluid.number[i]))
        others, own = apart / outside, alike / beside
        hindered = (1.0 - max(0.0, others - 0.5 * max(0.0, own - others))) ** exponents[phase[i], phase[j]]
        missing = fade * (speeds[phase[i], phase[j], alike] * hindered * math.sqrt(steepness) - max(0.0, slip))
        if missing > 0.0:
            partner[n] = j if draw(identity[i], number) * length < missing * time_step else WAITS


def pairs_of(chosen: Index, partner: Ints, identity: Index) -> Ints:
    """Return the pairs (2, n) of indices that change places: of particles that are in several pairs, that with the lowest id first."""
    drawn = np.flatnonzero(partner >= 0)
    first, second = chosen[drawn].astype(np.int64), partner[drawn]
    order = np.argsort(identity[first], kind="stable")
    taken, kept = set[int](), []
    for one, other in zip(first[order].tolist(), second[order].tolist(), strict=True):
        if one not in taken and other not in taken:
            taken |= {one, other}
            kept.append((one, other))
    return np.array(kept, np.int64).reshape(-1, 2).T
