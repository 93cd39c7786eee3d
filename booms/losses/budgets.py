"""The budgets of a boom's closures: the oil that each segment owes on each way out, after what the particles lost there by themselves.

There are two ways out, under the foot and over the top. A segment's budget grows by the loss that the closures of that way give, and
falls by the oil that particles carried out there (top up, never add). Which cause a particle's loss has is told by rules of thumb, so a
loss by one cause also counts against the closures of the other causes on the same way; nothing counts twice. An overdrawn budget
forgets its debt with the time constant `WINDOW`: a burst of resolved loss counts against the closures for that window only.

A way out is due when its budget reaches one particle's volume, by the cause that has the largest claim; what particles lost by themselves
is taken off the claims of its way. Each budget begins with a part of a particle's volume, drawn from a seed. So the expected loss of all
segments is that of the closures from the beginning, though a segment can only lose whole particles.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from booms.losses.rates import WAYS
from coupling.master.saved_fields import SavedFields
from oilsim.oil.fates import LossCause

Array = NDArray[np.float64]

# [s] for which a resolved loss in excess of the closures' counts against them; assumed: the time that an observer takes for one loss
WINDOW = 5.0


class LossBudgets(SavedFields):
    """Volumes owed [m3] by way out and segment (ways, S)."""

    STATE = ("owed", "_claims")

    def __init__(self, segments: int, particle_volume: float, seed: int) -> None:
        """Begin with shares of `particle_volume` [m3] drawn from `seed`."""
        self._volume = particle_volume
        self.owed: Array = particle_volume * np.random.default_rng(seed).random((len(WAYS), segments))
        self._claims = np.zeros((len(LossCause), segments))  # [m3] by the closures, less what was paid, by cause

    def add(self, closure: Array, resolved: Array, duration: float) -> None:
        """Add the closures' losses (causes, S) [m3] of `duration` [s], and the particles' own losses there in that time."""
        self.owed[self.owed < 0.0] *= np.exp(-duration / WINDOW)
        for row, way in enumerate(WAYS):
            causes = list(way)
            paid = resolved[causes].sum(axis=0)
            self.owed[row] += closure[causes].sum(axis=0) - paid
            claims = self._claims[causes] + closure[causes]
            whole = np.maximum(claims, 0.0).sum(axis=0)
            left = 1.0 - np.minimum(np.divide(paid, whole, out=np.zeros_like(whole), where=whole > 0.0), 1.0)
            self._claims[causes] = np.where(claims > 0.0, left * claims, claims)

    def due(self, segment: int, way: int) -> LossCause | None:
        """Return the cause by which a particle of a segment is due on a way out; None where less than a particle is owed."""
        if self.owed[way, segment] < self._volume:
            return None
        causes = WAYS[way]
        return causes[int(np.argmax(self._claims[list(causes), segment]))]

    def pay(self, segment: int, way: int, cause: LossCause) -> None:
        """Take one particle off what a segment owes."""
        self.owed[way, segment] -= self._volume
        self._claims[cause, segment] -= self._volume
