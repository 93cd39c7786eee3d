"""Adaptive time step: Eq. 30 and 31 of Qiu et al. 2021, and longer steps where liquid moves without deforming.

Eq. 30 bounds every displacement, dt <= lambda d / v_max, though a block in free fall or a stream loses nothing in a longer step. A step
must resolve the motion relative to the neighbourhood,

    u_i^2 = sum_j w_ij |v_i - v_j|^2 / sum_j w_ij,   w = (1 - r / H)+,   for particles with enough neighbours,

and the approach to walls, -n_i . (v_i - v_b) with the normal n_i by the same weights. The split scheme takes

    dt = max(lambda d / v_max,  min(lambda d / u_most,  REACH d / v_max)),

u_most being the number below which u_i lies for all but OUTLIERS of the particles: torn off drops collide at speeds far above those of the
rest. A sample stands for a large number of particles.

However calm, particles swing about their places under the pressure that presses them together, at omega^2 = c p / (rho d^2) or less
(`lattice_stiffness`). Positions and velocities are stepped in turn, which is stable up to omega dt = 2:

    dt <= STABLE 2 d / sqrt(c p / rho)

with the p / rho below which all but OUTLIERS of the particles lie. Beyond this limit particles in calm water jump about, and the pressure
solve needs more iterations: a pool of ten layers costs twice as much a second at twice this step.

Interfacial tension bounds the step by the shortest ripples, and by the swings of the lightest liquid under the pressure that keeps
interfaces whole (`FluidConfig.capillary_time_step`). So the first step, before any pressure is known, is short enough too.

Bodies take part in a fluid's steps, so with moving bodies a whole number of equal steps fills each advance. Without moving bodies nothing
has to happen at its end: a step goes on into the next advance, and particles are seen on their way. Otherwise the 30 frames a second of
`calm-spread` would cause a fifth of all its steps.

No particle goes further than REACH d in a step; a run whose shortest step would take one further ends. A particle that had no neighbour
within the support then meets the next one at d or more, and crosses no wall unseen (see `wall_contact`).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.jit import FAST, inlined
from oilsim.backend.simd import LANES, below, gather, load, only, positive, root, spread, summed
from oilsim.core.config import swing_time_step
from oilsim.core.state import FluidState
from oilsim.neighborhood.neighbor_search import Neighborhood, nearest_images, rows
from oilsim.neighborhood.smoothing_kernels import SUPPORT
from oilsim.pressure.rest_pressure import RestLaw
from oilsim.step.context import StepContext

# [1] share of the particles whose relative speed is ignored; numerical; torn off drops collide at speeds far above the rest
OUTLIERS = 5e-3
# [particles] at least that stand for a larger number; theory; their outliers are known within a sixth
SAMPLE = 10_000
# [d] that a particle may go in a step; theory; unseen before, it meets others at d or more
REACH = SUPPORT - 1.0
# [1] neighbours below which a particle is a drop that moves by itself; numerical; not on record
SPRAY = 8
# [m2; 1] keeps divisors from being 0; numerical; far below any square
TINY, ZERO, ONE = np.float32(1e-20), np.float32(0.0), np.float32(1.0)


@inlined
def squared_deformation(i, position, velocity, neighborhood, inverse_range):
    """Return u_i^2 of the module's docstring [m2/s2]; 0 for spray.

    position, velocity (3, N) [m, m/s]; inverse_range 1 / H [1/m].
    """
    fluid = neighborhood.fluid
    xi, yi, zi = position[0, i], position[1, i], position[2, i]
    ui, vi, wi = velocity[0, i], velocity[1, i], velocity[2, i]
    points, velocities = rows(position), rows(velocity)
    weights = squares = spread(ZERO)
    first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
    for k in range(first, last, LANES):
        present = below(last, k)
        j = load(fluid.neighbor, k, present)
        dx, dy, dz = nearest_images(
            xi - gather(points[0], j), yi - gather(points[1], j), zi - gather(points[2], j), neighborhood.period
        )
        du, dv, dw = ui - gather(velocities[0], j), vi - gather(velocities[1], j), wi - gather(velocities[2], j)
        weight = only(present, positive(ONE - root(dx * dx + dy * dy + dz * dz) * inverse_range), ZERO)
        weights += weight
        squares += weight * (du * du + dv * dv + dw * dw)
    return summed(squares) / (summed(weights) + TINY) if fluid.number[i] >= SPRAY else ZERO


@inlined
def point_velocity(c, wall, twist):
    """Return the velocity [m/s] of moving wall particle c (counted from the first that moves) as three; twist (bodies, 6)."""
    o, arm = wall.owner[c], wall.arm
    return (
        twist[o, 0] + twist[o, 4] * arm[2, c] - twist[o, 5] * arm[1, c],
        twist[o, 1] + twist[o, 5] * arm[0, c] - twist[o, 3] * arm[2, c],
        twist[o, 2] + twist[o, 3] * arm[1, c] - twist[o, 4] * arm[0, c],
    )


@inlined
def squared_approach(i, position, velocity, wall, twist, neighborhood, inverse_range):
    """Return (n_i . (v_i - v_b))^2 [m2/s2] by weighted means of the walls' normal and velocity; 0 where the particle moves away.

    position, velocity (3, N) [m, m/s]; wall: the `WallParticles`; twist (bodies, 6) [m/s, rad/s]; inverse_range 1 / H [1/m].
    """
    walls, places = neighborhood.walls, wall.position
    xi, yi, zi = position[0, i], position[1, i], position[2, i]
    weights = nx = ny = nz = ub = vb = wb = np.float32(0.0)
    for k in range(walls.start[i], walls.start[i] + np.int64(walls.number[i])):
        b = np.int64(walls.neighbor[k])
        dx, dy, dz = nearest_images(xi - places[0, b], yi - places[1, b], zi - places[2, b], neighborhood.period)
        r = math.sqrt(dx * dx + dy * dy + dz * dz + TINY)
        weight = max(np.float32(1.0) - r * inverse_range, np.float32(0.0))
        weights += weight
        nx += weight * dx / r
        ny += weight * dy / r
        nz += weight * dz / r
        if b >= wall.resting:
            u, v, w = point_velocity(b - wall.resting, wall, twist)
            ub += weight * u
            vb += weight * v
            wb += weight * w
    share = np.float32(1.0) / (weights + TINY)
    along = nx * (velocity[0, i] - ub * share) + ny * (velocity[1, i] - vb * share) + nz * (velocity[2, i] - wb * share)
    along = min(along, np.float32(0.0))
    return along * along / (nx * nx + ny * ny + nz * nz + TINY)


@njit(**FAST)
def relative_speeds(begin, end, position, velocity, wall, twist, neighborhood, slow, stride, square):
    """Fill `square` (samples,) with u_i^2 or the squared approach to a wall [m2/s2], whichever is larger, of each stride-th particle.

    position, velocity (3, N) of the particles [m, m/s]
    wall                the `WallParticles`
    twist               (bodies, 6) of the moving bodies [m/s, rad/s]
    neighborhood        lists and constants of the step
    slow                [m/s], particles no faster than which are passed over where no body moves
    """
    inverse_range = np.float32(1.0) / neighborhood.support
    for sample in range(begin, end):
        i, greatest = sample * stride, ZERO
        ui, vi, wi = velocity[0, i], velocity[1, i], velocity[2, i]
        fast = ui * ui + vi * vi + wi * wi > slow * slow
        if fast:
            greatest = squared_deformation(i, position, velocity, neighborhood, inverse_range)
        if fast or twist.shape[0] > 0:
            greatest = max(greatest, squared_approach(i, position, velocity, wall, twist, neighborhood, inverse_range))
        square[sample] = greatest


def sampling_stride(count: int) -> int:
    """Return n such that every n-th of `count` particles, in cell order, makes a sample of SAMPLE or more."""
    return max(1, count // SAMPLE)


def most(values: NDArray[np.float32]) -> float:
    """Return the number, in their unit, below which all but OUTLIERS of the `values` (N,) lie; 0 for no values. None is negative."""
    if values.size == 0:
        return 0.0
    rank = values.size - 1 - math.floor(OUTLIERS * values.size)
    return float(np.partition(values, rank)[rank])


def stable_time_step(spacing: float, dimension: int, head: NDArray[np.float32]) -> float:
    """Return the longest stable step [s] under pressures over densities `head` (N,) [m2/s2]; spacing d [m]."""
    return swing_time_step(spacing, dimension, most(np.maximum(head, np.float32(0.0))))


def cfl_time_step(spacing: float, largest_speed: float, cfl: float, minimum: float, maximum: float) -> float:
    """Return max(t_min, min(cfl d / v_max, t_max)) [s] (Qiu et al. 2021, Eq. 30 and 31).

    spacing d [m]; largest_speed v_max [m/s]; cfl the lambda of Eq. 30 [1]; minimum and maximum t_min and t_max [s].
    """
    limit = math.inf if largest_speed == 0.0 else cfl * spacing / largest_speed
    return max(minimum, min(limit, maximum))


def relative_time_step(
    spacing: float, largest_speed: float, relative_speed: float, cfl: float, minimum: float, maximum: float
) -> float:
    """Return the split scheme's step [s] (see the module's docstring); relative_speed u_most [m/s], the rest as for `cfl_time_step`."""
    longest = math.inf if largest_speed == 0.0 else REACH * spacing / largest_speed
    deforming = math.inf if relative_speed == 0.0 else cfl * spacing / relative_speed
    shortest = cfl_time_step(spacing, largest_speed, cfl, minimum, maximum)
    return max(shortest, min(longest, deforming, maximum))


def too_fast(spacing: float, largest_speed: float, time_step: float) -> str:
    """Say that something would cross walls unseen in the shortest step [s] at its speed [m/s]; empty if nothing would. spacing d [m]."""
    way = largest_speed * time_step / spacing
    if way <= REACH * (1.0 + 1e-6) or not math.isfinite(way):  # of what is not finite the advance names the particle
        return ""
    return (
        f"a particle or body moves at {largest_speed:.4g} m/s, {way:.3g} spacings in the shortest step of {time_step:g} s, allowed: "
        f"{REACH:g} spacings, or a shorter minimum_time_step"
    )


def equal_steps(remaining: float, time_step: float) -> float:
    """Return the longest step [s], at most `time_step` [s], of which a whole number fills `remaining` [s]."""
    return remaining / max(1, math.ceil(remaining / time_step * (1.0 - 1e-9)))


def next_time_step(context: StepContext, state: FluidState, fastest: float, relative_speed: float | None) -> float:
    """Return the length [s] of the next step (see the module's docstring).

    fastest: largest speed of all [m/s]; relative_speed: as from `largest_relative_speed` [m/s], None where it is not known.
    """
    config, spacing = context.config, context.config.particle_spacing
    limits = config.cfl, config.minimum_time_step, config.longest_time_step
    wanted = cfl_time_step(spacing, fastest, *limits)
    if config.scheme == "paper":
        return wanted
    if relative_speed is not None:
        wanted = relative_time_step(spacing, fastest, relative_speed, *limits)
    stable = stable_time_step(spacing, config.dimension, pressure_head(context, state))
    return max(config.minimum_time_step, min(wanted, stable, config.capillary_time_step))


def largest_relative_speed(
    context: StepContext, neighborhood: Neighborhood, state: FluidState, fastest: float
) -> float:
    """Return the speed u_most [m/s] relative to the neighbourhood that all but OUTLIERS keep below, 0 where it cannot shorten a step.

    fastest: largest speed of all [m/s]. Slow particles are passed over: of two that part at some speed, one is faster than half of it.
    """
    config, walls, spacing = context.config, context.walls, context.config.particle_spacing
    if fastest * config.longest_time_step <= config.cfl * spacing:
        return 0.0
    slow = 0.5 * config.cfl * max(fastest, spacing / config.longest_time_step)
    twist = walls.twists().astype(np.float32)
    stride = sampling_stride(state.awake)
    square = np.empty(-(-state.awake // stride), np.float32)
    context.team.run(
        relative_speeds, square.size, state.position, state.velocity, walls.particles, twist, neighborhood, np.float32(slow), stride, square
    )  # fmt: skip
    return math.sqrt(most(square))


def pressure_head(context: StepContext, state: FluidState) -> NDArray[np.float32]:
    """Return p / rho (samples,) [m2/s2] of the last pressure solve in a sample of the particles; 0 before the first.

    It is what the sums over particles saw: the pressure of water at rest, which acts by its slope, swings none of them.
    """
    if state.time_step == 0.0:
        return np.zeros(1, np.float32)
    chosen = slice(0, state.awake, sampling_stride(state.awake))
    weight = context.constants.weights[state.phase[chosen]]
    impulse = state.pressure_impulse[chosen]
    if state.rest_top > -math.inf:
        kick = -context.config.gravity[2] * state.time_step
        spacing = context.config.particle_spacing
        impulse = impulse - RestLaw(state.rest_top, spacing, kick).of(state.position[2, chosen]).impulse
    head: NDArray[np.float32] = impulse * (weight / np.float32(state.time_step))
    return head
