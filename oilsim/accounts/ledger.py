"""What a budget comes to: where the liquid's energy and momentum went, cause by cause, and how viscous the scheme acted.

The cause of every change is a stage of the time step:

emitters   liquid that pipes pour in, and hold at their speed
gravity    kick and fall; see below
periodic   change of m g . x where particles come back in at the other side
positions  position corrections; in the paper's scheme the velocities too that they become: numerical
filter     velocity filter, and the flow's velocity where position corrections put particles: numerical
forcing    current, waves, wind
adhesion   pull of walls
viscosity  minus what is dissipated, plus what moving no-slip walls do
pressure   the projection: minus its loss and minus the work on moving bodies
contact    of single particles with walls
rotation   of free liquid, which gives back the angular momentum that other causes took: numerical
sleep      regions that fall asleep: minus the motion that they still had
outflow    liquid that leaves the domain

Gravity turns potential into kinetic energy, so its potential part is minus its work, and the sum of both parts, round-off in the
continuum, is the error of time stepping: dt g . change of momentum / 2, which does not grow by itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import reduce
from operator import add
from typing import Any

import numpy as np
from numpy.typing import NDArray

from oilsim.accounts.diagnostics import Energy

Double = NDArray[np.float64]

CAUSES = (
    "emitters", "gravity", "periodic", "positions", "filter", "forcing", "adhesion", "viscosity", "pressure", "contact",
    "rotation", "sleep", "outflow",
)  # fmt: skip
TOUCHING = ("adhesion", "viscosity", "pressure", "contact")  # causes by which walls and bodies act on the liquid


def _nothing() -> Double:
    return np.zeros(6)


@dataclass(frozen=True, kw_only=True, eq=False)
class Part:
    """What the liquid gained by one cause, and what moving bodies gained from the liquid by it.

    kinetic, potential, work_on_bodies [J]; momentum, impulse_on_bodies (6,): linear [N s], angular about the origin [N m s].
    """

    kinetic: float = 0.0
    potential: float = 0.0
    work_on_bodies: float = 0.0
    momentum: Double = field(default_factory=_nothing)
    impulse_on_bodies: Double = field(default_factory=_nothing)

    @property
    def energy(self) -> float:
        """What the liquid gained [J]."""
        return self.kinetic + self.potential

    def __add__(self, other: Part) -> Part:
        return Part(**{name: value + getattr(other, name) for name, value in vars(self).items()})

    def __sub__(self, other: Part) -> Part:
        return Part(**{name: value - getattr(other, name) for name, value in vars(self).items()})


@dataclass(frozen=True, kw_only=True)
class Compression:
    """How far the liquid is from its rest density: rho / rho_0 - 1 as the last density stage saw it.

    near_surface: particles within reach of a free surface; None in the paper's scheme, which does not ask.
    """

    mean: float
    least: float
    largest: float
    near_surface: int | None


@dataclass(frozen=True, kw_only=True, eq=False)
class Ledger:
    """Energy [J] and momentum [N s, N m s] of the liquid over `duration` [s] (per metre in two dimensions).

    energy, momentum   at the end; momentum (6,) with the angular one about the origin, which means nothing in a periodic domain
    change             of both over the duration, `Part` without bodies
    parts              by cause, those that took part
    strain             rho V 2 S:S, S = (G + G^T) / 2, summed over particles and time [J s / m2]; 0 in the paper's scheme
    compression        at the end
    """

    duration: float
    energy: Energy
    momentum: Double
    change: Part
    parts: Mapping[str, Part]
    strain: float
    compression: Compression

    def part(self, *causes: str) -> Part:
        """The sum of some causes; 0 for those that took no part."""
        return _sum(self.parts[cause] for cause in causes if cause in self.parts)

    @property
    def rest(self) -> Part:
        """What no cause explains: round-off, or a stage that was forgotten."""
        explained = self.part(*self.parts)
        return Part(
            kinetic=self.change.kinetic - explained.kinetic,
            potential=self.change.potential - explained.potential,
            momentum=self.change.momentum - explained.momentum,
        )

    @property
    def energy_residual(self) -> float:
        """|rest| over the sum of |parts|, of kinetic and potential energy; 0 where nothing happened."""
        turnover = sum(abs(part.kinetic) + abs(part.potential) for part in self.parts.values())
        rest = self.rest
        return (abs(rest.kinetic) + abs(rest.potential)) / turnover if turnover else 0.0

    @property
    def momentum_residual(self) -> float:
        """|rest| over the sum of |parts|, of linear momentum; 0 where nothing happened."""
        turnover = sum(float(np.abs(part.momentum[:3]).sum()) for part in self.parts.values())
        return float(np.abs(self.rest.momentum[:3]).sum()) / turnover if turnover else 0.0

    @property
    def gravity_work(self) -> float:
        """Work of gravity on the liquid [J]: the potential energy it fell through, sum m g . dt v."""
        return -self.part("gravity").potential

    @property
    def wall_impulse(self) -> Double:
        """Impulse of walls at rest on the liquid (6,) [N s, N m s]: what liquid and bodies did not give each other.

        In the paper's scheme without the walls' part in its density constraint, which comes under positions.
        """
        touched = self.part(*TOUCHING)
        return touched.momentum + touched.impulse_on_bodies

    @property
    def viscous_dissipation(self) -> float:
        """Heat made by viscosity [J]: kinetic energy lost less the work done on moving no-slip walls."""
        viscous = self.part("viscosity")
        return -viscous.kinetic - viscous.work_on_bodies

    @property
    def numerical_dissipation(self) -> float:
        """Kinetic energy [J] lost to the velocity filter and in the projection, less the work on moving bodies."""
        pressure = self.part("pressure")
        return -self.part("filter").kinetic - pressure.kinetic - pressure.work_on_bodies

    @property
    def numerical_viscosity(self) -> float | None:
        """nu_num [m2/s] = numerical dissipation / sum over time of rho V 2 S:S; None where nothing was strained.

        Limits: an estimate for flows that are resolved. S holds the particles' noise, which makes nu_num too small where noise
        outweighs the strain; inelastic impacts on walls and of liquid on itself count as numerical, as does what swells or settles
        under the pressure's return to rest density, and may give a large or negative figure for splashing or resting liquid. The
        potential energy that position corrections add is not taken off.
        """
        return self.numerical_dissipation / self.strain if self.strain > 0.0 else None

    def __add__(self, later: Ledger) -> Ledger:
        """Both, one after the other."""
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
    """The ledger of which `dataclasses.asdict` made `saved`."""
    values = dict(saved)
    values["energy"] = Energy(*saved["energy"])
    values["change"] = Part(**saved["change"])
    values["parts"] = {cause: Part(**part) for cause, part in saved["parts"].items()}
    values["compression"] = Compression(**saved["compression"])
    return Ledger(**values)


def _sum(parts: Iterable[Part]) -> Part:
    return reduce(add, parts, Part())
