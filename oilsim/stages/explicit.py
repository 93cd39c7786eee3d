"""The explicit stages of a step: advection, gravity, films, forcings, adhesion, interfacial tension.

Each changes positions or velocities in place; forces on moving bodies are returned, and their opposites act on the liquid.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from oilsim.backend.arrays import Array, Real
from oilsim.backend.jit import ZERO
from oilsim.boundaries.adhesion import adhesion_acceleration, adhesion_reaction
from oilsim.boundaries.contact_film import RimLiquid, film_wrenches
from oilsim.boundaries.contacts import Contacts
from oilsim.core.state import FluidState
from oilsim.forcing import Forcing, ForcingView
from oilsim.step.arrays import Neighbors
from oilsim.step.context import StepContext
from oilsim.tension.interface_stress import fill_slopes, pull_along_interfaces, pull_on_bodies, smooth_tensions

Phases = NDArray[np.uint8]
Drive = Callable[[float], None]  # adds to the velocities what drives the liquid in a step of so many seconds


def advect(position: Real, velocity: Real, time_step: float) -> None:
    """Move particles at `position` (3, N) [m], in place, by their `velocity` (3, N) [m/s]."""
    position += np.float32(time_step) * velocity


def wrap_periodic(position: Real, lower: Sequence[float], period: Sequence[np.float32] | None) -> None:
    """Bring particles at `position` (3, N) [m], in place, that crossed a periodic side back in at the other.

    lower (3,): corner of the domain [m]; period (3,): lengths of the axes that repeat [m], 0 of the others; None if none does.
    """
    for axis, length in enumerate(period or ()):
        if length > 0.0:
            position[axis] -= length * np.floor((position[axis] - np.float32(lower[axis])) / length)


def add_gravity(velocity: Real, gravity: Sequence[float], time_step: float) -> None:
    """Add dt g to `velocity` (3, N) [m/s]; gravity (3,) [m/s2], time_step dt [s]."""
    for axis, g in enumerate(gravity):
        if g != 0.0:
            velocity[axis] += np.float32(time_step * g)


def press_films(
    context: StepContext, neighbors: Neighbors, contacts: Contacts, state: FluidState
) -> Array:  # fmt: skip
    """Return the forces (bodies, 6) [N, N m] of the films under bodies that lie on something held (see `contact_film`).

    contacts: particles that touch bodies; state: with the pressure of the last step. Where that is the reduced pressure, the pressure at
    rest lifts bodies as wholes, films included.
    """
    constants, walls = context.constants, context.walls
    per_kappa = constants.reference_density / state.time_step
    liquid = RimLiquid(state.position, neighbors.rest_density, state.pressure_impulse, per_kappa)
    gravity = (ZERO, ZERO, ZERO) if state.is_reduced else constants.gravity
    return film_wrenches(
        walls, neighbors.neighborhood, contacts, neighbors.body_pairs, liquid, gravity, constants.moment
    )


def apply_forcings(forcings: Sequence[Forcing], view: ForcingView, plane: bool) -> None:
    """Let currents, waves and wind change the velocities of the `view`; plane: y is absent.

    ValueError for a forcing that moves a plane's liquid along y.
    """
    for forcing in forcings:
        forcing.apply(view)
        if plane and view.velocity[1].any():
            raise ValueError(f"{type(forcing).__name__} moves liquid along y, allowed: x and z in two dimensions")


def apply_adhesion(
    context: StepContext, neighbors: Neighbors, position: Real, phase: Phases, velocity: Real, time_step: float
) -> Array | None:
    """Draw liquid to walls and bodies (see `adhesion`); returns the force (bodies, 6) [N, N m], None where no liquid touches one.

    position, velocity (3, N) [m, m/s]; phase (N,) uint8; time_step [s]. Some liquid must stick.
    """
    constants, wall, neighborhood = context.constants, context.walls.particles, neighbors.neighborhood
    pull, strength = np.zeros_like(velocity), constants.adhesion
    context.team.run(adhesion_acceleration, neighbors.awake, position, phase, strength, wall, neighborhood, pull)
    velocity += np.float32(time_step) * pull
    if not neighbors.touching.size:
        return None
    force = context.walls.zero_forces()
    adhesion_reaction(
        neighbors.body_pairs, position, phase, strength, neighbors.rest_density, wall, neighborhood, force
    )
    return force


def apply_tension(
    context: StepContext, neighbors: Neighbors, phase: Phases, velocity: Real, time_step: float
) -> Array | None:
    """Pull along interfaces (see `interface_stress`); returns the force (bodies, 6) [N, N m], None where no liquid touches one.

    phase (N,) uint8; velocity (3, N) [m/s]; time_step [s]. Some liquid must have a tension.
    """
    constants, run, neighborhood = context.constants, context.team.run, neighbors.neighborhood
    wetting, count = context.walls.wetting, len(neighbors.points)
    assert constants.tensions is not None
    smoothed, slopes = np.empty(count, np.float32), np.empty((count, 8), np.float32)
    run(smooth_tensions, count, neighborhood, constants.tensions.take(phase[:count]), smoothed)
    run(fill_slopes, count, neighborhood, constants.plane, smoothed, slopes)
    scale = np.float32(time_step / (constants.moment * constants.reference_density))
    run(pull_along_interfaces, neighbors.awake, neighborhood, wetting, slopes, scale, velocity)
    if not neighbors.touching.size:
        return None
    force = context.walls.zero_forces()
    pull_on_bodies(neighbors.body_pairs, neighborhood, wetting, slopes, constants.moment, force)
    return force
