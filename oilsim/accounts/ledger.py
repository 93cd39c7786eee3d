"""The result of a budget: changes of the liquid's energy and momentum cause by cause, and how viscous the scheme acted.

The cause of every change is a stage of the time step:

emitters   liquid that pipes pour in, and hold at their speed
gravity    kick and fall; see below
periodic   change of m g . x where particles come back in at the other side
positions  position corrections; in the paper's scheme also the velocities that they become: numerical
filter     velocity filter, and the flow's velocity where position corrections put particles: numerical
forcing    currents, waves, wind
adhesion   attraction of walls
tension    pull of interfaces: minus the change of their energy, sigma times area
viscosity  minus the dissipation, plus the work of moving no-slip walls on the liquid
pressure   the projection: minus its dissipation and minus the work on moving bodies
contact    of single particles with walls
rotation   of free liquid, which gets back the momentum that other causes took: numerical
sleep      regions that fall asleep: minus the motion that they still had
outflow    liquid that leaves the domain
swaps      particles that change places (`Fluid.swap_particles`) or their liquid (`Fluid.change_phase`)

Gravity turns potential into kinetic energy, so its potential change is minus its work. The sum of both changes, round-off in the
continuum, is the error of time stepping: dt g . change of momentum / 2, which does not grow by itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import reduce
from operator import add
from typing import Any

import numpy as np

from oilsim.accounts.diagnostics import Energy
from oilsim.backend.arrays import Array

CAUSES = (
    "emitters", "gravity", "periodic", "positions", "smoothing", "forcing", "adhesion", "tension", "viscosity", "pressure",
    "contact", "rotation", "sleep", "outflow", "swaps",
)  # fmt: skip
# causes by which walls and bodies act on the liquid
TOUCHING = ("adhesion", "tension", "viscosity", "pressure", "contact")


def _nothing() -> Array:
    return np.zeros(6)


@dataclass(frozen=True, kw_only=True, eq=False)
class Change:
    """Change of the liquid by one cause, and work and impulse that moving bodies received from the liquid by it.

    kinetic, potential   change of the liquid's energy [J]
    momentum             (6,) change of the liquid's momentum: linear [N s], angular about the origin [N m s]
    work_on_bodies       [J]
    impulse_on_bodies    (6,) linear [N s], angular about the origin [N m s]
    """

    kinetic: float = 0.0
    potential: float = 0.0
    work_on_bodies: float = 0.0
    momentum: Array = field(default_factory=_nothing)
    impulse_on_bodies: Array = field(default_factory=_nothing)

    @property
    def energy(self) -> float:
        """Return the change of the liquid's energy [J]."""
        return self.kinetic + self.potential

    def __add__(self, other: Change) -> Change:
        return Change(**{name: value + getattr(other, name) for name, value in vars(self).items()})

    def __sub__(self, other: Change) -> Change:
        return Change(**{name: value - getattr(other, name) for name, value in vars(self).items()})


@dataclass(frozen=True, kw_only=True)
class Compression:
    """Deviation of the liquid from its rest density, rho / rho_0 - 1 [1], as the last density stage saw it.

    near_surface: number of particles within reach of a free surface; None in the paper's scheme, which does not compute it.
    """

    mean: float
    least: float
    largest: float
    near_surface: int | None


@dataclass(frozen=True, kw_only=True, eq=False)
class Ledger:
    """Energy [J] and momentum [N s, N m s] of the liquid over `duration` [s] (per metre in two dimensions).

    energy, momentum   at the end; momentum (6,) with the angular one about the origin, which has no meaning in a periodic domain
    change             of both over the duration, without bodies
    parts              changes by cause, of the causes that took part
    strain             rho V 2 S:S, S = (G + G^T) / 2, summed over particles and time [J s / m2]; 0 in the paper's scheme
    compression        at the end
    """

    duration: float
    energy: Energy
    momentum: Array
    change: Change
    parts: Mapping[str, Change]
    strain: float
    compression: Compression

    def part(self, *causes: str) -> Change:
        """Return the sum of the changes by some causes; 0 for causes that took no part."""
        return _sum(self.parts[cause] for cause in causes if cause in self.parts)

    @property
    def unexplained(self) -> Change:
        """Return the change for which no cause accounts: round-off, or a stage that was forgotten."""
        explained = self.part(*self.parts)
        return Change(
            kinetic=self.change.kinetic - explained.kinetic,
            potential=self.change.potential - explained.potential,
            momentum=self.change.momentum - explained.momentum,
        )

    @property
    def energy_residual(self) -> float:
        """Return |unexplained| over the turnover of kinetic and potential energy [1]; 0 where nothing happened."""
        turnover = sum(abs(part.kinetic) + abs(part.potential) for part in self.parts.values())
        unexplained = self.unexplained
        return (abs(unexplained.kinetic) + abs(unexplained.potential)) / turnover if turnover else 0.0

    @property
    def momentum_residual(self) -> float:
        """Return |unexplained| over the turnover of linear momentum [1]; 0 where nothing happened."""
        turnover = sum(float(np.abs(part.momentum[:3]).sum()) for part in self.parts.values())
        return float(np.abs(self.unexplained.momentum[:3]).sum()) / turnover if turnover else 0.0

    @property
    def gravity_work(self) -> float:
        """Return the work of gravity on the liquid [J]: the potential energy through which it fell, sum m g . dt v."""
        return -self.part("gravity").potential

    @property
    def wall_impulse(self) -> Array:
        """Return the impulse of walls at rest on the liquid (6,) [N s, N m s]: its change by TOUCHING that bodies did not cause.

        In the paper's scheme the walls' part in the density constraint is missing; it counts as a change by positions.
        """
        touched = self.part(*TOUCHING)
        return touched.momentum + touched.impulse_on_bodies

    @property
    def viscous_dissipation(self) -> float:
        """Return the dissipation by viscosity [J]: the loss of kinetic energy less the work on moving no-slip walls."""
        viscous = self.part("viscosity")
        return -viscous.kinetic - viscous.work_on_bodies

    @property
    def numerical_dissipation(self) -> float:
        """Return the dissipation by the scheme [J]: loss of kinetic energy in filter and projection, less the work on moving bodies."""
        pressure = self.part("pressure")
        return -self.part("smoothing").kinetic - pressure.kinetic - pressure.work_on_bodies

    @property
    def numerical_viscosity(self) -> float | None:
        """Return nu_num [m2/s] = numerical dissipation / sum over time of rho V 2 S:S; None where nothing was strained.

        This is an estimate for resolved flows. S contains the particles' noise, which makes nu_num too small where noise outweighs the
        strain. Inelastic impacts on walls and of liquid on itself count as numerical, and so does liquid that swells or settles on its
        return to rest density; so splashing or resting liquid may have a large or negative figure. The potential energy that position
        corrections add is not subtracted.
        """
        return self.numerical_dissipation / self.strain if self.strain > 0.0 else None

    def __add__(self, later: Ledger) -> Ledger:
        """Return the ledger of both durations, one after the other."""
        causes = [cause for cause in CAUSES if cause in self.parts or cause in later.parts]
        return Ledger(
            duration=self.duration + later.duration,
            energy=later.energy,
            momentum=later.momentum,
            change=self.change + later.change,
            parts={cause: self.part(cause) + later.part(cause) for cause in causes},
            strain=self.strain + later.strain,
            compression=later.compression,
        )


def ledger_from(saved: Mapping[str, Any]) -> Ledger:
    """Return the ledger of which `dataclasses.asdict` made `saved`."""
    values = dict(saved)
    values["energy"] = Energy(*saved["energy"])
    values["change"] = Change(**saved["change"])
    values["parts"] = {cause: Change(**part) for cause, part in saved["parts"].items()}
    values["compression"] = Compression(**saved["compression"])
    return Ledger(**values)


def _sum(parts: Iterable[Change]) -> Change:
    return reduce(add, parts, Change())
