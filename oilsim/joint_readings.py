"""Readings of all fluids of a run together: of one, or of the windows of a sea, each of which is a fluid of its own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from oilsim.accounts.diagnostics import Energy
from oilsim.views import FluidView


class JointReadings:
    """Sums and lists over fluids that have the same phases, and ids of their own, increasing from fluid to fluid."""

    def __init__(self, fluids: Sequence[FluidView]) -> None:
        self._fluids = tuple(fluids)

    def energy(self) -> Energy:
        """Return the kinetic and potential energy of the liquid [J]."""
        kinetic, potential = zip(*(one.energy() for one in self._fluids), strict=True)
        return Energy(sum(kinetic), sum(potential))

    def momentum(self) -> NDArray[np.float64]:
        """Return the linear momentum of the liquid (3,) [kg m/s]."""
        return np.sum([one.momentum() for one in self._fluids], axis=0)

    def phase_ids(self, phase: str) -> NDArray[np.uint32]:
        """Return the particle ids of a phase (n,), ascending; ValueError for a phase that does not exist."""
        return np.concatenate([one.phase_ids(phase) for one in self._fluids])

    @property
    def may_sleep(self) -> bool:
        """True if water at rest falls asleep."""
        return any(one.config.sleep_speed > 0.0 for one in self._fluids)

    @property
    def boundary_count(self) -> int:
        """Number of wall particles."""
        return sum(one.boundary_count for one in self._fluids)
