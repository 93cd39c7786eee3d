"""Energy, momentum and other sums over the fluid, computed on demand."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from oilsim.core.config import FluidConfig
from oilsim.core.state import FluidState


class Energy(NamedTuple):
    """Energy of the fluid [J]; potential energy is 0 at the origin."""

    kinetic: float
    potential: float


def masses(state: FluidState, config: FluidConfig) -> NDArray[np.float64]:
    """Return the mass of each particle (N,) [kg; kg/m in two dimensions]."""
    return config.rest_volume * np.array([phase.rest_density for phase in config.phases])[state.phase]


def energy(state: FluidState, config: FluidConfig) -> Energy:
    """Return the kinetic energy sum m v^2 / 2 and the potential energy -sum m g . x [J; J/m in two dimensions]."""
    mass, velocity = masses(state, config), state.velocity
    kinetic = 0.5 * float(np.einsum("n,in,in->", mass, velocity, velocity, dtype=np.float64))
    return Energy(kinetic, -float(np.asarray(config.gravity) @ (state.position @ mass)))


def momentum(state: FluidState, config: FluidConfig) -> NDArray[np.float64]:
    """Return the linear momentum sum m v (3,) [N s]."""
    return state.velocity.astype(np.float64) @ masses(state, config)


def angular_momentum(state: FluidState, config: FluidConfig) -> NDArray[np.float64]:
    """Return the angular momentum sum m x cross v about the origin (3,) [N m s]."""
    position, velocity = state.position.astype(np.float64), state.velocity.astype(np.float64)
    return np.cross(position.T, velocity.T).T @ masses(state, config)


def largest_speed(state: FluidState) -> float:
    """Return the largest speed of a particle [m/s]; 0 without particles."""
    return float(np.sqrt(np.einsum("ij,ij->j", state.velocity, state.velocity).max(initial=0.0)))


def not_finite(state: FluidState, config: FluidConfig, time: float) -> str | None:
    """Say which positions or velocities of the state at `time` [s] are no finite numbers; None if all are."""
    for name in ("position", "velocity"):
        bad = np.flatnonzero(~np.isfinite(getattr(state, name)).all(axis=0))
        if bad.size:
            phase = config.phases[state.phase[bad[0]]].name
            return (
                f"{name} of {bad.size} particles is not finite at t = {time:.6g} s, the first has id {state.id[bad[0]]} "
                f"in phase {phase!r}"
            )
    return None


def outside(position: NDArray[np.float32], config: FluidConfig) -> NDArray[np.bool_]:
    """Return which particles (N,) have left the domain through a side that does not repeat; position (3, N) [m]."""
    result = np.zeros(position.shape[1], bool)
    for axis in range(3):
        if not config.periodic[axis]:
            result |= (position[axis] < np.float32(config.lower[axis])) | (
                position[axis] > np.float32(config.upper[axis])
            )
    return result
