"""Accounts of a step between fluid and bodies: impulse and energy, as each side counts them.

The fluid gives a body the impulse H F, F its mean wrench, and predicts the twist V_f that the body will have at the end of the
step; the body receives the wrench F_s and ends at V_b, both having begun at V_0. Then

    momentum  H (F - F_s), H (T - T_s)       are lost on the way, T the torque of F,
    energy    H F_s . (V_b - V_f) / 2        no cause explains: what the body received less what the fluid gave,

the work of an impulse being its product with the mean of the twists before and after. A monolithic exchange leaves rounding of
the first, and of the second what joints and contacts do that the fluid does not predict; a lagged one that diverges makes energy
without bound. Each step's momentum is compared with |H F|, and |H T| + |H F| d with d the particle spacing, the torque and the work of
moving the force by a particle; energy is summed over the run, and compared with what was turned over: sum |H F . V| + |F| d.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from coupling.master.algorithms import Algorithm, GaussSeidel, Steppers
from coupling.master.errors import CoSimulationError
from coupling.master.observer_dispatch import CommunicationPoint
from coupling.master.saved_fields import SavedFields
from oilsim.backend.arrays import Array

MOMENTUM_LIMIT = 1e-6
ENERGY_LIMIT = 0.5


@dataclass(frozen=True)
class BodyBond:
    """A body, by the names of its variables and of the two participants that exchange them."""

    body: str
    fluid: str
    solver: str


class ExchangeLedger(SavedFields):
    """The accounts of all `bonds`; `length` is the particle spacing [m].

    `disturbed` returns the bodies that ran into something in the last step. Attributes are those of the last step: impulse [N s] and work
    [J] on the bodies, lost [N s], unexplained [J]; arrays have a row for each body, (B, 6). Raises CoSimulationError for an error
    beyond a limit.
    """

    STATE = ("_unexplained", "_turnover", "_lost_sum", "_impulse_sum")

    def __init__(
        self,
        bonds: Sequence[BodyBond],
        length: float,
        *,
        energy_limit: float = ENERGY_LIMIT,
        disturbed: Callable[[], Collection[str]] = tuple,
    ) -> None:
        self._bonds = tuple(bonds)
        self._length = length
        self._energy_limit = energy_limit
        self._disturbed = disturbed
        self._begin = np.zeros((len(self._bonds), 6))
        self._unexplained, self._turnover = np.zeros((2, len(self._bonds)))
        self._lost_sum = self._impulse_sum = 0.0
        self.impulse, self.work, self.lost, self.unexplained = np.zeros(3), 0.0, np.zeros(6), 0.0

    @property
    def momentum_residual(self) -> float:
        """Share of all linear impulses that was lost in the exchange, over the run."""
        return self._lost_sum / self._impulse_sum if self._impulse_sum > 0.0 else 0.0

    @property
    def energy_residual(self) -> float:
        """Energy that the exchange created over the run, relative to the exchanged energy."""
        turnover = float(self._turnover.sum())
        return float(self._unexplained.sum()) / turnover if turnover > 0.0 else 0.0

    @property
    def figures(self) -> dict[str, float]:
        """Numbers for the record: those of the last step and of the run."""
        return {
            "energy_unexplained": self.unexplained,
            "momentum_residual": self.momentum_residual,
            "energy_residual": self.energy_residual,
        }

    def open(self, steppers: Steppers) -> None:
        """Note the state at the beginning of a step."""
        self._begin = self._read(steppers, "solver", "twist")

    def close(self, steppers: Steppers, begin: float, end: float) -> None:
        """Account for the step; CoSimulationError, with body and participant, beyond a limit."""
        if not self._bonds:
            return
        wrench, last = self._read(steppers, "fluid", "wrench"), self._read(steppers, "solver", "twist")
        passed_on = [steppers[bond.solver].inputs.get(f"{bond.body}.wrench", np.zeros(6)) for bond in self._bonds]
        given, received = (end - begin) * wrench, (end - begin) * np.array(passed_on)
        work = 0.5 * (received * (self._begin + last)).sum(axis=1)
        unexplained = 0.5 * (received * (last - self._read(steppers, "fluid", "predicted_twist"))).sum(axis=1)
        self.impulse, self.lost = given[:, :3].sum(axis=0), (given - received).sum(axis=0)
        self.work, self.unexplained = float(work.sum()), float(unexplained.sum())
        disturbed = self._disturbed()
        self._unexplained += unexplained * [bond.body not in disturbed for bond in self._bonds]
        self._turnover += np.abs(work)
        self._check_momentum(given, received, end)
        self._check_energy(np.linalg.norm(wrench[:, :3], axis=1), end, end - begin)

    def _read(self, steppers: Steppers, side: str, what: str) -> Array:
        """Read an output (B, 6) of all bodies, from their `fluid` or their `solver`."""
        values = [steppers[getattr(bond, side)].outputs[f"{bond.body}.{what}"] for bond in self._bonds]
        return np.array(values).reshape(-1, 6)

    def _check_momentum(self, given: Array, received: Array, time: float) -> None:
        """Compare impulses (B, 6): forces with forces, torques with torques and with what moving the force by a particle makes."""
        lost, passed = (np.linalg.norm(part.reshape(-1, 2, 3), axis=2) for part in (given - received, given))
        self._lost_sum += float(lost[:, 0].sum())
        self._impulse_sum += float(passed[:, 0].sum())
        passed[:, 1] += passed[:, 0] * self._length
        for index in np.flatnonzero(~(lost <= MOMENTUM_LIMIT * passed).all(axis=1)):
            bond = self._bonds[index]
            raise CoSimulationError(
                bond.solver,
                time,
                f"body {bond.body!r} took an impulse of {received[index].tolist()} N s, N m s, but the fluid gave "
                f"{given[index].tolist()} N s, N m s, allowed: a relative difference of {MOMENTUM_LIMIT:g}",
            )

    def _check_energy(self, force: Array, time: float, step: float) -> None:
        scale = self._turnover + force * self._length
        beyond = np.flatnonzero(~(self._unexplained / self._energy_limit <= scale))
        if len(beyond):
            bond, unexplained, turned = self._bonds[beyond[0]], self._unexplained[beyond[0]], scale[beyond[0]]
            raise CoSimulationError(
                bond.solver,
                time,
                f"body {bond.body!r}: the exchange has created {unexplained:.3g} J of {turned:.3g} J exchanged, "
                f"allowed: {self._energy_limit:g} of it; its coupling is unstable, or steps of {step:.3g} s are too long for its motion",
            )


Account = Callable[[CommunicationPoint], None]


class Exchange(NamedTuple):
    """The order of steps and exchanges in a run, and the accounts that are kept of them.

    ledger: accounts of the exchange between fluid and bodies, which may end the run; None keeps none. accounts: called once at each
    communication point, the initial one included, with or without observers; in a restored run, at each point after the restored one.
    """

    algorithm: Algorithm
    ledger: ExchangeLedger | None = None
    accounts: Sequence[Account] = ()


GAUSS_SEIDEL = Exchange(GaussSeidel())  # which remembers nothing, so that all runs may share it
