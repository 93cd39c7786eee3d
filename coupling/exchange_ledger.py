"""What passed between fluid and bodies in a step: impulse and energy, as each side counts them.

The fluid gives a body the impulse H F, F its mean wrench, and foresees the twist V_f that the body will have at the end of the
step; the body is fed the wrench F_s and ends at V_b, both having begun at V_0. Then

    momentum  H (F - F_s)                    has been lost on the way,
    energy    H F_s . (V_b - V_f) / 2        has been made by the exchange: what the body received less what the fluid gave,

the work of an impulse being its product with the mean of the twists before and after. A monolithic exchange leaves rounding of
the first, and of the second what joints and contacts do that the fluid does not foresee; a lagged one that diverges makes energy
without bound. Both are summed over the run, and compared with what was turned over: sum |H F|, and sum |H F . V| + F d with d the
particle spacing, the work of moving the force by a particle.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from coupling.algorithms import Steppers
from coupling.errors import CoSimulationError

Array = npt.NDArray[np.float64]

MOMENTUM_LIMIT = 1e-6
ENERGY_LIMIT = 0.5


@dataclass(frozen=True)
class BodyBond:
    """A body by the names of its variables and of the two participants that exchange them."""

    body: str
    fluid: str
    solver: str


class ExchangeLedger:
    """Accounts over all `bonds`; `length` is the particle spacing [m].

    `holds_back` tells of a body whether its scheme passes impulses on late by construction; its momentum is recorded, but has
    no limit. Attributes are those of the last step: impulse [N s], work [J] on the bodies, lost [N s], made [J].
    """

    def __init__(
        self,
        bonds: Sequence[BodyBond],
        length: float,
        *,
        momentum_limit: float = MOMENTUM_LIMIT,
        energy_limit: float = ENERGY_LIMIT,
        holds_back: Callable[[str], bool] = lambda body: False,
    ) -> None:
        self._bonds = tuple(bonds)
        self._length = length
        self._limits = momentum_limit, energy_limit
        self._holds_back = holds_back
        self._begin: dict[str, Array] = {}
        self._made = dict.fromkeys((bond.body for bond in bonds), 0.0)
        self._turnover = dict.fromkeys((bond.body for bond in bonds), 0.0)
        self._lost_sum = self._impulse_sum = 0.0
        self.impulse, self.work, self.lost, self.made = np.zeros(3), 0.0, np.zeros(6), 0.0

    @property
    def momentum_residual(self) -> float:
        """Part of all impulses that was lost on the way, over the run."""
        return self._lost_sum / self._impulse_sum if self._impulse_sum > 0.0 else 0.0

    @property
    def energy_residual(self) -> float:
        """Energy made by the exchange over the run, as a part of what was turned over."""
        turnover = sum(self._turnover.values())
        return sum(self._made.values()) / turnover if turnover > 0.0 else 0.0

    @property
    def figures(self) -> dict[str, float]:
        """For the record: the last step's and the run's."""
        return {
            "exchange/impulse": float(np.linalg.norm(self.impulse)),
            "exchange/work": self.work,
            "exchange/energy_made": self.made,
            "exchange/momentum_residual": self.momentum_residual,
            "exchange/energy_residual": self.energy_residual,
        }

    def open(self, steppers: Steppers) -> None:
        """A step begins."""
        self._begin = {bond.body: steppers[bond.solver].outputs[f"{bond.body}.twist"] for bond in self._bonds}

    def close(self, steppers: Steppers, begin: float, end: float) -> None:
        """The step has been made; CoSimulationError, naming body and participant, beyond a limit."""
        self.impulse, self.work, self.lost, self.made = np.zeros(3), 0.0, np.zeros(6), 0.0
        for bond in self._bonds:
            self._enter(bond, steppers, end - begin, end)

    def _enter(self, bond: BodyBond, steppers: Steppers, duration: float, time: float) -> None:
        body, fluid, solver = bond.body, steppers[bond.fluid], steppers[bond.solver]
        given = duration * fluid.outputs[f"{body}.wrench"]
        taken = duration * solver.inputs.get(f"{body}.wrench", np.zeros(6))
        first, last = self._begin[body], solver.outputs[f"{body}.twist"]
        work = 0.5 * float(taken @ (first + last))
        made = 0.5 * float(taken @ (last - fluid.outputs[f"{body}.foreseen_twist"]))
        lost, passed = float(np.linalg.norm((given - taken)[:3])), float(np.linalg.norm(given[:3]))
        self.impulse += given[:3]
        self.work += work
        self.lost += given - taken
        self.made += made
        self._lost_sum += lost
        self._impulse_sum += passed
        self._made[body] += made
        self._turnover[body] += abs(work)
        if lost > self._limits[0] * passed and not self._holds_back(body):
            raise CoSimulationError(
                bond.solver,
                time,
                f"body {body!r} took an impulse of {taken[:3].tolist()} N s, the fluid gave {given[:3].tolist()} N s",
            )
        scale = self._turnover[body] + passed / duration * self._length
        if self._made[body] > self._limits[1] * scale:
            raise CoSimulationError(
                bond.solver,
                time,
                f"body {body!r}: the exchange has made {self._made[body]:.3g} J of {scale:.3g} J turned over, "
                f"allowed: {self._limits[1]:g} of it; its coupling is unstable",
            )
