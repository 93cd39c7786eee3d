"""Contact of particles with walls, which pressure does not make, since it knows the beginning of a step only.

A splash drop has no density with which to resist when it meets a wall, and a particle that goes further in one step than its distance from
a wall would cross it. The wall's own coverage of the kernel, sum_b V_b W_ib, tells the distance h_i: that from a flat wall of the same
coverage. The coverage's gradient s_i tells the direction. An inelastic contact keeps particles from crossing in the coming step, and drops
NEAREST from the wall (h_c is NEAREST for a drop, else 0):

    (v_i - v_b) . n_i <= (h_i - h_c)+ d / dt,     n_i = s_i / |s_i|,  s_i = sum_b V_b grad W_ib,     by  v_i -= beta_i s_i,

and bodies receive m_i beta_i of their part of s_i. A drop that is nearer all the same is moved out along -n. Drops are particles whose
kernel holds hardly any liquid beside their own. Others have pressure to keep them off, and rightly lie nearer where two walls meet.

Between walls that face each other, as a hull and the floor, s_i cancels: there is no side on which to stop, and 1 / |s_i| would make a
small excess a huge kick. So a contact takes at least OPPOSED of the slope that a flat wall of the same coverage has. All contacts of a
splash in a tank had 0.78 to 1.09 of it, and near walls and skirts all particles but a thousandth have more than 0.56.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.jit import FAST, inlined
from oilsim.backend.simd import LANES, below, load, spread, store
from oilsim.gradients.particle_sums import coverage_and_slope
from oilsim.neighborhood.smoothing_kernels import SUPPORT

# [d] distance from the wall at which a drop's contact begins; numerical; not on record
NEAREST = np.float32(0.25)
# [d] by which one step moves a particle out; numerical; not on record
LARGEST_PUSH = np.float32(0.1)
# [1] share of a drop's kernel, beside its own part, that liquid may fill; numerical; not on record
ALONE = 0.15
# [d] distances from a wall between which its coverage is tabulated; theory; from the wall's first layer to the end of its reach
DISTANCES = (np.float32(-0.5), np.float32(SUPPORT - 0.5))
# [1] entries of that table; theory; a twentieth of a spacing apart, for distances within 0.003 d
PLACES = 66
# [1] of a flat wall's slope, below which walls face each other across the particle; measured; see the module's docstring
OPPOSED = np.float32(0.5)
# [1/m] keeps a slope from being 0; numerical; far below any slope
TINY, ZERO = np.float32(1e-12), np.float32(0.0)


class WallSums(NamedTuple):
    """Sums over the neighbours of N particles.

    coverage     (N,) sum_b V_b W_ib, the walls' share of the kernel [1]
    slope        (3, N) s_i = sum_b V_b grad W_ib [1/m]
    compression  (N,) sum V W - 1 over liquid and walls [1]
    """

    coverage: NDArray[np.float32]
    slope: NDArray[np.float32]
    compression: NDArray[np.float32]


class ContactRule(NamedTuple):
    """Constants of contact with walls.

    drop       share of its kernel up to which liquid makes a drop [1]
    coverages  (PLACES,) coverage of the kernel at even DISTANCES from a flat wall, falling [1]
    nearest    that at NEAREST [1]
    spacing    d [m]
    """

    drop: np.float32
    coverages: NDArray[np.float32]
    nearest: np.float32
    spacing: np.float32


def drop_share(own: float) -> np.float32:
    """Return the share of its kernel up to which liquid makes a drop; `own` is the part V W(0) of a single particle."""
    return np.float32(own + ALONE * (1.0 - own))


@njit(**FAST)
def wall_approach(begin, end, slope, velocity, rate):
    """Fill `rate` (N,) with v_i . s_i [1/s], as if all walls were at rest.

    slope (3, N): s_i [1/m]; velocity (3, N) [m/s].
    """
    for k in range(begin, end, LANES):
        present, along = below(end, k), spread(ZERO)
        for axis in range(3):
            along += load(slope[axis], k, present) * load(velocity[axis], k, present)
        store(rate, k, present, along)


@inlined
def flat_wall(coverage, coverages):
    """Return the distance [d] from a flat wall that covers `coverage` of the kernel, and how fast coverage falls with distance [1/d].

    coverages (n,) at even DISTANCES, falling [1].
    """
    last = coverages.size - 1
    n = 0
    while n < last - 1 and coverages[n + 1] >= coverage:
        n += 1
    fall = coverages[n] - coverages[n + 1]
    part = (coverages[n] - coverage) / fall
    step = (DISTANCES[1] - DISTANCES[0]) / np.float32(last)
    return DISTANCES[0] + step * (np.float32(n) + max(min(part, np.float32(1.0)), np.float32(0.0))), fall / step


@njit(**FAST)
def wall_contact(begin, end, sums, rule, rate, reach, velocity, strength):
    """Stop particles that would cross a wall, and drops NEAREST to it; change `velocity` (3, N) [m/s] and fill `strength` (N,).

    sums      the `WallSums` of the particles
    rule      the `ContactRule`
    rate      (N,) v_i . s_i less the walls' motion [1/s]
    reach     spacing over time step [m/s]
    strength  beta_i of the module's docstring [m2/s], 0 without contact
    """
    for i in range(begin, end):
        strength[i] = np.float32(0.0)
        if rate[i] <= np.float32(0.0):
            continue
        hx, hy, hz = sums.slope[0, i], sums.slope[1, i], sums.slope[2, i]
        size = math.sqrt(hx * hx + hy * hy + hz * hz) + TINY
        gap, steepness = flat_wall(sums.coverage[i], rule.coverages)
        if size * rule.spacing < OPPOSED * steepness:
            continue
        approach = rate[i] / size
        if np.float32(1.0) + sums.compression[i] - sums.coverage[i] < rule.drop:
            gap -= NEAREST
        excess = approach - max(gap, np.float32(0.0)) * reach
        if excess > np.float32(0.0):
            beta = excess / size
            velocity[0, i] -= beta * hx
            velocity[1, i] -= beta * hy
            velocity[2, i] -= beta * hz
            strength[i] = beta


@njit(**FAST)
def sum_walls(begin, end, neighborhood, coverage, slope):
    """Fill coverage (N,) [1] and slope (3, N) [1/m] of `WallSums` at the particles' present positions; neighborhood: `Neighborhood`."""
    for i in range(begin, end):
        coverage[i] = slope[0, i] = slope[1, i] = slope[2, i] = ZERO
        if neighborhood.walls.number[i] > 0:
            coverage[i], (slope[0, i], slope[1, i], slope[2, i]) = coverage_and_slope(i, neighborhood)


@njit(**FAST)
def wall_push(begin, end, sums, rule, position):
    """Move drops that are nearer to a wall than NEAREST out along -s_i, by at most LARGEST_PUSH; change `position` (3, N) [m].

    sums: the `WallSums` of the particles; rule: the `ContactRule`.
    """
    for i in range(begin, end):
        excess = sums.coverage[i] - rule.nearest
        if excess > np.float32(0.0) and np.float32(1.0) + sums.compression[i] - sums.coverage[i] < rule.drop:
            hx, hy, hz = sums.slope[0, i], sums.slope[1, i], sums.slope[2, i]
            size = math.sqrt(hx * hx + hy * hy + hz * hz) + TINY
            if size * rule.spacing < OPPOSED * flat_wall(sums.coverage[i], rule.coverages)[1]:
                continue
            length = min(excess / size, LARGEST_PUSH * rule.spacing) / size
            position[0, i] -= length * hx
            position[1, i] -= length * hy
            position[2, i] -= length * hz
