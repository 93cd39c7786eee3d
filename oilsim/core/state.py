"""The state of a fluid: the arrays of all its particles, which change from step to step and are kept in cell order."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from enum import IntEnum
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.arrays import Array, Flags, Index, Ints, Real
from oilsim.backend.jit import FAST
from oilsim.backend.thread_team import Team


class Confinement(IntEnum):
    """The confinement of the liquid: a free surface gives its pressure a level, a box that it fills gives it a volume."""

    OPEN = 0  # it has a free surface
    PARTED = 1  # it fills its box, but a few particles have parted
    FILLED = 2  # it fills its box, and no particle is within reach of a free surface


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


def places_of(ids: NDArray[np.integer], among: NDArray[np.integer]) -> Ints:
    """Return where each of `ids`, of any shape, stands in `among` (N,), which has all of them, each once."""
    sorter = np.argsort(among, kind="stable")
    return sorter[np.searchsorted(among, ids, sorter=sorter)]


@dataclass
class FluidState:
    """Structure of arrays over N particles, float32.

    position (3, N) [m], velocity (3, N) [m/s], shift (3, N) by which relaxation moves particles in the next step [m], phase (N,) index into
    the phases, id (N,) never reused,
    pressure_impulse (N,) kappa / rho_ref = p dt / rho_ref [m2/s], the warm start of the pressure solve, for dt = time_step [s];
    step [s]: length of the step that has begun, of which `time_left` [s] is still to pass; 0 between steps.
    viscous_time (phases,) [s]: time by which the viscosity of each liquid lags (`step.stages.viscosity`).
    The last `asleep` particles do not move (`sleeping_regions`); the first `bordering` of them may have others that do within reach.
    confinement: as in the last step (`step.stages.relaxation`).
    steps: number of steps that were made, by which draws of chance go on.
    rest_top [m]: height below which the pressure of water at rest acted by its slope in the last step (`rest_pressure`).
    rest_potential [m2/s2]: g . x of the uppermost particle, where pressure_impulse is the reduced pressure, without that of liquid at rest
    (see `rest_pressure`); -inf where it is the whole pressure.
    """

    position: Real = field(default_factory=_rows)
    velocity: Real = field(default_factory=_rows)
    shift: Real = field(default_factory=_rows)
    phase: NDArray[np.uint8] = field(default_factory=lambda: np.empty(0, np.uint8))
    id: Index = field(default_factory=lambda: np.empty(0, np.uint32))
    pressure_impulse: Real = field(default_factory=_row)
    next_id: int = 0
    time_step: float = 0.0
    step: float = 0.0
    time_left: float = 0.0
    viscous_time: Array = field(default_factory=lambda: np.zeros(0))
    asleep: int = 0
    bordering: int = 0
    confinement: Confinement = Confinement.OPEN
    rest_top: float = -math.inf
    rest_potential: float = -math.inf
    steps: int = 0

    @property
    def count(self) -> int:
        """Number of particles N."""
        return int(self.phase.size)

    @property
    def awake(self) -> int:
        """Number of particles that move, the first ones."""
        return self.count - self.asleep

    @property
    def listed(self) -> int:
        """Number of particles that move or may be within reach of one that does, the first ones."""
        return self.awake + self.bordering

    @property
    def is_reduced(self) -> bool:
        """Tell whether pressure_impulse is the reduced pressure."""
        return self.rest_potential > -math.inf

    def append(self, position: NDArray[Any], velocity: NDArray[Any], phase: int) -> None:
        """Add particles at `position` (n, 3) with `velocity` (n, 3), behind those that are awake."""
        count, at = len(position), self.awake

        def insert(values: NDArray[Any], new: NDArray[Any]) -> NDArray[Any]:
            return np.concatenate([values[..., :at], new.astype(values.dtype), values[..., at:]], axis=-1)

        self.position, self.velocity = insert(self.position, position.T), insert(self.velocity, velocity.T)
        self.shift = insert(self.shift, np.zeros((3, count)))
        self.phase = insert(self.phase, np.full(count, phase))
        self.id = insert(self.id, np.arange(self.next_id, self.next_id + count))
        self.pressure_impulse = insert(self.pressure_impulse, np.zeros(count))
        self.next_id += count

    def take(self, chosen: NDArray[Any], team: Team) -> None:
        """Keep the particles of the indices `chosen`, in that order."""
        before = self.position, self.velocity, self.shift, self.phase, self.id, self.pressure_impulse
        after = [np.empty((*values.shape[:-1], chosen.size), values.dtype) for values in before]
        team.run(take, chosen.size, chosen, before, tuple(after))
        self.position, self.velocity, self.shift, self.phase, self.id, self.pressure_impulse = after

    def swap(self, first: Ints, second: Ints, mass: Array) -> None:
        """Let the particles of the indices `first` and `second` (n,), all different, change places; mass (phases,) of a particle [kg].

        A place keeps its velocity but for a change that both places of a pair share, dv = (m - M) / (m + M) (v - V). So the pair's
        momentum stays: m v + M V = M (v + dv) + m (V + dv).
        """
        m, other = mass[self.phase[first]], mass[self.phase[second]]
        before, after = self.velocity[:, first].astype(np.float64), self.velocity[:, second].astype(np.float64)
        common = (m - other) / (m + other) * (before - after)
        self.velocity[:, first], self.velocity[:, second] = before + common, after + common
        for values in (self.phase, self.id):
            values[first], values[second] = values[second], values[first].copy()

    def remove(self, leaving: Flags, team: Team) -> bool:
        """Take out the particles `leaving` (N,); whether one of those that sleep was among them."""
        asleep, bordering = (int(np.count_nonzero(leaving[self.awake : end])) for end in (self.count, self.listed))
        self.asleep, self.bordering = self.asleep - asleep, self.bordering - bordering
        self.take(np.flatnonzero(~leaving), team)
        return asleep > 0

    def save(self) -> dict[str, Any]:
        """Return a copy of all fields, by name."""
        values = {entry.name: getattr(self, entry.name) for entry in fields(self)}
        return {name: value.copy() if isinstance(value, np.ndarray) else value for name, value in values.items()}

    def restore(self, saved: dict[str, Any]) -> None:
        """Restore the fields that `save` returned; ValueError for arrays that do not fit each other, which no kernel looks for."""
        count = np.size(saved["phase"])
        for name, value in self.save().items():
            if isinstance(value, np.ndarray):
                shape = value.shape if name == "viscous_time" else (*value.shape[:-1], count)
                given = saved[name]
                if not (isinstance(given, np.ndarray) and given.dtype == value.dtype and given.shape == shape):
                    raise ValueError(
                        f"saved state has {name} of shape {np.shape(given)}, allowed: {shape}, {value.dtype}"
                    )
                if not np.isfinite(given).all():
                    raise ValueError(f"saved state has {name} that is not finite, allowed: finite numbers")
        if (saved["phase"] >= self.viscous_time.size).any():
            raise ValueError(f"saved state has phase {saved['phase'].max()}, allowed: below {self.viscous_time.size}")
        if np.unique(saved["id"]).size < count or (saved["id"] >= saved["next_id"]).any():
            raise ValueError(
                f"saved state has ids up to {saved['id'].max()}, allowed: each once, below {saved['next_id']}"
            )
        if not 0 <= saved["bordering"] <= saved["asleep"] <= count:
            told = f"{saved['asleep']} particles asleep, {saved['bordering']} of them at a border"
            raise ValueError(f"saved state has {told}, allowed: up to {count}")
        for name, value in saved.items():
            setattr(self, name, value.copy() if isinstance(value, np.ndarray) else value)
        self.confinement = Confinement(self.confinement)
