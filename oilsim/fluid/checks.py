"""Checks of a fluid's input. They refuse bad input by its name before anything is computed with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from oilsim.backend.arrays import Array, Index, Ints, Real
from oilsim.boundaries.boundary_particles import BoundaryParticles
from oilsim.boundaries.walls import MovingBody
from oilsim.core.config import FluidConfig
from oilsim.fluid.emitter import PipeEmitter

# [1] share of an inverse mass's largest entry by which it may differ from its transpose; numerical; not on record
SKEW = 1e-6
# [d] off the plane y = 0 that is taken for a rounding, of a wall's points or a body's way in the longest step; numerical; not on record
FLAT = 1e-6
# of a twist: along y, and about x and z, out of the plane
ACROSS = [1, 3, 5]


def finite(what: str, values: ArrayLike, *shape: int | None) -> Array:
    """Return the values as float64, in their unit; ValueError unless all are finite and the array has this shape.

    shape: as (None, 3) for (N, 3); None stands for any length. `what` names the values in the message.
    """
    array = np.asarray(values, np.float64)
    fits = array.ndim == len(shape) and all(n in (None, m) for n, m in zip(shape, array.shape, strict=True))
    if not fits:
        wanted = ", ".join("N" if n is None else str(n) for n in shape)
        raise ValueError(f"{what} has shape {array.shape}, allowed: ({wanted})")
    if not np.isfinite(array).all():
        place = tuple(np.argwhere(~np.isfinite(array))[0].tolist())
        raise ValueError(f"{what} has {array[place]} at {place}, allowed: finite numbers")
    return array


def particles(config: FluidConfig, phase: str, position: ArrayLike, velocity: ArrayLike) -> tuple[Array, Array]:
    """Return the positions and velocities (N, 3) [m, m/s] of new particles; ValueError outside the domain, or off its plane.

    velocity: (N, 3), or (3,) for all of them.
    """
    points = finite(
        f"position of particles of phase {phase!r}", np.empty((0, 3)) if np.size(position) == 0 else position, None, 3
    )
    speeds = np.asarray(velocity, np.float64)
    speeds = finite(
        f"velocity of particles of phase {phase!r}", speeds, *((3,) if speeds.ndim < 2 else (len(points), 3))
    )
    _require_inside(config, f"particles of phase {phase!r}", points)
    speeds = np.broadcast_to(speeds, points.shape)
    for what, values in (("y", points), ("velocity along y", speeds)):
        if config.dimension == 2 and (values[:, 1] != 0.0).any():
            raise ValueError(f"particles of phase {phase!r} have {what} other than 0, allowed: 0 in two dimensions")
    return points, speeds


def places_of_their_own(config: FluidConfig, phase: str, points: Array, others: Real) -> None:
    """Raise ValueError where a new particle of `points` (N, 3) [m] lies exactly where another lies, new or of `others` (3, M) [m].

    Pair forces of two such particles vanish, so they would never part.
    """
    if not len(points):
        return
    new, old = (_off_seams(config, places) for places in (points.T.astype(np.float32), others))
    low, high = new.min(axis=1)[:, None], new.max(axis=1)[:, None]
    near = ((old >= low) & (old <= high)).all(axis=0)
    places = np.concatenate([new, old[:, near]], axis=1)
    places = places[:, np.lexsort(places)]
    again = (places[:, 1:] == places[:, :-1]).all(axis=0)
    if again.any():
        raise ValueError(
            f"{np.count_nonzero(again)} particles of phase {phase!r} lie where others do, the first at "
            f"{places[:, 1:][:, again][:, 0].tolist()} m, allowed: places of their own"
        )


def _off_seams(config: FluidConfig, places: Real) -> Real:
    """Return places (3, N) [m], those at the upper end of an axis that repeats moved to its lower end, which is the same place."""
    if not any(config.periodic):
        return places
    ends = [
        np.where(np.float32(high) == row, np.float32(low), row) if repeats else row
        for row, low, high, repeats in zip(places, config.lower, config.upper, config.periodic, strict=True)
    ]
    return np.stack(ends)


def pairs_of_ids(first: ArrayLike, second: ArrayLike, present: Index) -> Ints:
    """Return the ids of pairs (2, n); ValueError for unequal rows, ids that are not `present` (N,), and an id that occurs twice."""
    rows = [np.asarray(first, np.int64).ravel(), np.asarray(second, np.int64).ravel()]
    if rows[0].size != rows[1].size:
        raise ValueError(f"pairs have {rows[0].size} first and {rows[1].size} second ids, allowed: as many of both")
    return known_ids(np.stack(rows), present)


def known_ids(ids: ArrayLike, present: Index) -> Ints:
    """Return ids of any shape as integers; ValueError for ids that are not `present` (N,), and for one that occurs twice."""
    given = np.asarray(ids, np.int64)
    missing = given[~np.isin(given, present)]
    if missing.size:
        raise ValueError(f"particle {missing[0]} does not exist, allowed: ids of particles in the fluid")
    if np.unique(given).size != given.size:
        raise ValueError("ids name a particle twice, allowed: each particle once")
    return given


def velocities(config: FluidConfig, velocity: ArrayLike, count: int) -> Array:
    """Return velocities (3, count) [m/s] of all particles; ValueError for another shape, numbers not finite, and off the plane."""
    given = finite("velocity", velocity, 3, count)
    if config.dimension == 2 and given[1].any():
        raise ValueError("velocity along y is other than 0, allowed: 0 in two dimensions")
    return given


def boundary(config: FluidConfig, surface: BoundaryParticles) -> None:
    """Raise ValueError for a solid surface off the plane of a fluid in two dimensions."""
    off = np.abs(surface.position[:, 1]).max(initial=0.0)
    if config.dimension == 2 and off > FLAT * config.particle_spacing:
        raise ValueError(
            f"boundary {surface.name!r} has points at up to {off} m from y = 0, allowed: 0 in two dimensions"
        )


def motion(config: FluidConfig, handle: int, boundaries: Mapping[int, object], body: MovingBody) -> None:
    """Raise ValueError for a motion of a boundary that does not exist, with numbers that no body can have, or out of the plane."""
    if handle not in boundaries:
        raise ValueError(f"boundary {handle} does not exist, allowed: {sorted(boundaries)}")
    shapes = {"position": (3,), "orientation": (4,), "twist": (6,), "inverse_mass": (6, 6), "free_acceleration": (6,)}
    for name, shape in shapes.items():
        finite(f"{name} of boundary {handle}", getattr(body, name), *shape)
    if not body.orientation.any():
        raise ValueError(f"orientation of boundary {handle} is 0, allowed: a quaternion x y z w other than 0")
    _inverse_mass(f"inverse_mass of boundary {handle}", body.inverse_mass)
    across = float(np.abs(body.twist[ACROSS]).max())
    if config.dimension == 2 and across * config.longest_time_step > FLAT * config.particle_spacing:
        raise ValueError(
            f"twist of boundary {handle} leads out of the plane by {across} m/s or rad/s, allowed: 0 in two dimensions"
        )


def ties(handles: Sequence[int], inverse_mass: Array, moving: Sequence[int]) -> None:
    """Raise ValueError for an inverse mass (6 n, 6 n) [1/kg, 1/(kg m2)] that the moving boundaries cannot have.

    `handles` must be all the `moving` ones in any order, the numbers finite, the diagonal not negative, and the matrix symmetric.
    """
    if sorted(handles) != sorted(moving) or inverse_mass.shape != (6 * len(handles),) * 2:
        raise ValueError(
            f"inverse mass of shape {inverse_mass.shape} for boundaries {list(handles)}, "
            f"allowed: (6 n, 6 n) for all that move, {list(moving)}"
        )
    finite(f"inverse mass of boundaries {list(handles)}", inverse_mass, None, None)
    _inverse_mass(f"inverse mass of boundaries {list(handles)}", inverse_mass)


def _inverse_mass(what: str, inverse_mass: Array) -> None:
    """Raise ValueError for an inverse mass (6 n, 6 n) [1/kg, 1/(kg m2)] that is negative on its diagonal, or not symmetric."""
    if (inverse_mass.diagonal() < 0.0).any():
        lowest = float(inverse_mass.diagonal().min())
        raise ValueError(f"{what} has {lowest} on its diagonal, allowed: 0 or more")
    if (inverse_mass != inverse_mass.T).any():
        skew = float(np.abs(inverse_mass - inverse_mass.T).max())
        if skew > SKEW * np.abs(inverse_mass).max():
            raise ValueError(f"{what} differs from its transpose by {skew}, allowed: 0")


def made_of(config: FluidConfig, boundaries: Mapping[int, BoundaryParticles]) -> dict[str, Any]:
    """Return the properties that a fluid must share with a saved state: spacing [m], dimension, liquids, wall particles by boundary."""
    return {
        "particle_spacing": config.particle_spacing,
        "dimension": config.dimension,
        "phases": [[phase.name, phase.rest_density] for phase in config.phases],
        "boundaries": {str(handle): len(boundary.volume) for handle, boundary in boundaries.items()},
    }


def saved_state(
    saved: Mapping[str, Any],
    config: FluidConfig,
    boundaries: Mapping[int, BoundaryParticles],
    regions: object,
    forcings: Sequence[object],
    emitters: Sequence[object],
) -> None:
    """Raise ValueError for a saved state of a fluid with other properties, regions, forcings or emitters."""
    for what, value in made_of(config, boundaries).items():
        if saved["made_of"][what] != value:
            raise ValueError(f"saved state has {what} {saved['made_of'][what]}, allowed: {value}, as this fluid")
    if (saved["regions"] is None) != (regions is None):
        raise ValueError(
            "saved state and fluid differ in whether regions may sleep, allowed: sleep_speed 0 in both or in neither"
        )
    for what, here in (("forcings", forcings), ("emitters", emitters)):
        if len(saved[what]) != len(here):
            raise ValueError(f"saved state has {len(saved[what])} {what}, allowed: {len(here)}, those of this fluid")


def pipe(config: FluidConfig, emitter: PipeEmitter) -> None:
    """Raise ValueError for a pipe that cannot pour into this fluid."""
    config.phase_index(emitter.phase)
    if config.dimension == 2:
        raise ValueError("a pipe pours a round jet, allowed: none in two dimensions")
    if emitter.spacing != config.particle_spacing:
        raise ValueError(f"pipe: spacing is {emitter.spacing} m, allowed: the fluid's, {config.particle_spacing} m")
    if emitter.particles_left == 0:
        raise ValueError(f"pipe: volume is less than half a particle, allowed: above {0.5 * config.rest_volume:g} m3")
    _require_inside(config, f"particles of the pipe at {emitter.mouth.tolist()} m", emitter.entrance)


def _require_inside(config: FluidConfig, whose: str, points: Array) -> None:
    inside = ((points >= config.lower) & (points <= config.upper)).all(axis=1)
    if not inside.all():
        raise ValueError(
            f"{np.count_nonzero(~inside)} {whose} lie outside the domain, the first at {points[~inside][0].tolist()} m, "
            f"allowed: {config.lower} to {config.upper} m"
        )
