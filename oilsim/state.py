"""What changes from step to step: the arrays of all fluid particles, kept in cell order."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.parallel import Team
from oilsim.smoothing_kernels import FAST

Real = NDArray[np.float32]


def _rows() -> Real:
    return np.empty((3, 0), np.float32)


def _row() -> Real:
    return np.empty(0, np.float32)


@njit(**FAST)
def take(begin, end, chosen, before, after):
    """Fill `after` with the chosen of `before`: position, velocity, shift (3, N), phase, id, pressure_impulse (N,)."""
    for n in range(begin, end):
        i = chosen[n]
        for axis in range(3):
            after[0][axis, n] = before[0][axis, i]
            after[1][axis, n] = before[1][axis, i]
            after[2][axis, n] = before[2][axis, i]
        after[3][n], after[4][n], after[5][n] = before[3][i], before[4][i], before[5][i]


@dataclass
class FluidState:
    """Structure of arrays over N particles, float32.

    position (3, N) [m], velocity (3, N) [m/s], shift (3, N) by which relaxation moves particles in the next step [m], phase (N,) index into
    the phases, id (N,) never reused,
    pressure_impulse (N,) kappa / rho_ref = p dt / rho_ref [m2/s], the warm start of the pressure solve, for dt = time_step [s];
    viscous_time [s]: time for which viscosity is still owed (`Workspace.resist`); noise_age: the integral of dt / tau since the filter of
    noise last ran (`relaxation`).
    """

    position: Real = field(default_factory=_rows)
    velocity: Real = field(default_factory=_rows)
    shift: Real = field(default_factory=_rows)
    phase: NDArray[np.uint8] = field(default_factory=lambda: np.empty(0, np.uint8))
    id: NDArray[np.uint32] = field(default_factory=lambda: np.empty(0, np.uint32))
    pressure_impulse: Real = field(default_factory=_row)
    next_id: int = 0
    time_step: float = 0.0
    viscous_time: float = 0.0
    noise_age: float = 0.0

    @property
    def count(self) -> int:
        """Number of particles N."""
        return int(self.phase.size)

    def append(self, position: NDArray[Any], velocity: NDArray[Any], phase: int) -> None:
        """Add particles at `position` (n, 3) with `velocity` (n, 3)."""
        count = len(position)
        self.position = np.concatenate([self.position, position.T.astype(np.float32)], axis=1)
        self.velocity = np.concatenate([self.velocity, velocity.T.astype(np.float32)], axis=1)
        self.shift = np.concatenate([self.shift, np.zeros((3, count), np.float32)], axis=1)
        self.phase = np.concatenate([self.phase, np.full(count, phase, np.uint8)])
        self.id = np.concatenate([self.id, np.arange(self.next_id, self.next_id + count, dtype=np.uint32)])
        self.pressure_impulse = np.concatenate([self.pressure_impulse, np.zeros(count, np.float32)])
        self.next_id += count

    def take(self, chosen: NDArray[Any], team: Team) -> None:
        """Keep the particles of the indices `chosen`, in that order."""
        before = self.position, self.velocity, self.shift, self.phase, self.id, self.pressure_impulse
        after = [np.empty((*values.shape[:-1], chosen.size), values.dtype) for values in before]
        team.run(take, chosen.size, chosen, before, tuple(after))
        self.position, self.velocity, self.shift, self.phase, self.id, self.pressure_impulse = after

    def save(self) -> dict[str, Any]:
        """A copy of everything, by name."""
        values = {entry.name: getattr(self, entry.name) for entry in fields(self)}
        return {name: value.copy() if isinstance(value, np.ndarray) else value for name, value in values.items()}

    def restore(self, saved: dict[str, Any]) -> None:
        """Back to what `save` returned."""
        for name, value in saved.items():
            setattr(self, name, value.copy() if isinstance(value, np.ndarray) else value)
