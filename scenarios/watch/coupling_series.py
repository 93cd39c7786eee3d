"""Series of the coupling of fluid and bodies in the last step: work, residuals, and the ledger of both.

Series, all under ``metrics``:

coupling/sub_steps                steps of the fluid in the communication step
coupling/wall_seconds/<name>      wall time [s] of each participant
coupling/residual/linear|angular  largest difference between the twist that the fluid expects of a body after its wrench, and the body's
                                  twist after joints and contacts [m/s, rad/s]
ledger/fluid|bodies/momentum_x|y|z         linear momentum [N s]
ledger/fluid/kinetic|potential_energy      [J]; for all bodies: ledger/bodies/energy
ledger/exchange/impulse_x|y|z, work        sums of what the bodies received from the fluid since the run began [N s, J]; work by the
                                           trapezoidal rule over twists
ledger/exchange/energy_made                in the last step, and
ledger/exchange/momentum_residual, energy_residual  of the run, as in `coupling.master.exchange_ledger`
ledger/cause/<cause>                       energy [J] that the liquid gained by one cause in the step, with run.budget, and
ledger/energy_residual, momentum_residual  the shares without a cause

In two dimensions all values of the fluid are per metre.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from coupling.master.exchange_ledger import ExchangeLedger
from coupling.participants.fluid import FluidParticipant
from coupling.rigid.rigid_body_world import RigidBodyWorld
from oilsim.solver import Fluid

Array = NDArray[np.float64]
WallSeconds = Callable[[], Mapping[str, float]]


class CouplingFigures:
    """The account of the exchange, updated at each communication point."""

    def __init__(
        self,
        fluid: Fluid,
        participant: FluidParticipant,
        world: RigidBodyWorld | None,
        coupled: Sequence[str],
        ledger: ExchangeLedger,
    ) -> None:
        """Prepare the account; `coupled` names the bodies that exchange motion and wrench with the fluid, `ledger` checks the exchange."""
        self._ledger = ledger
        self._fluid, self._participant, self._world = fluid, participant, world
        self._coupled = tuple(coupled) if world is not None else ()
        self._wall_seconds: WallSeconds = dict
        self._spent: Mapping[str, float] = {}
        self._time: float | None = None
        self._twists = np.zeros((len(self._coupled), 6))
        self._impulse, self._work = np.zeros(3), 0.0

    def follow(self, wall_seconds: WallSeconds) -> None:
        """Take the participants' wall time so far from `wall_seconds`."""
        self._wall_seconds = wall_seconds

    def save_state(self) -> dict[str, Any]:
        """Return the account so far."""
        return {"time": self._time, "twists": self._twists.copy(), "impulse": self._impulse.copy(), "work": self._work}

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Go back to a state that `save_state` returned."""
        self._time, self._twists = saved["time"], saved["twists"].copy()
        self._impulse, self._work = saved["impulse"].copy(), float(saved["work"])

    def __call__(self, time: float) -> dict[str, float]:
        """Return the series at simulated `time` [s], by name."""
        figures = self._fluid_figures() | self._wall_figures()
        if self._coupled:
            figures |= self._body_figures(time)
        return {f"metrics/{name}": value for name, value in figures.items()}

    def _fluid_figures(self) -> dict[str, float]:
        energy = self._fluid.energy()
        figures = {
            "ledger/fluid/kinetic_energy": float(energy.kinetic),
            "ledger/fluid/potential_energy": float(energy.potential),
            **_components("ledger/fluid/momentum", self._fluid.momentum()),
        }
        report = self._participant.report
        if report is None:
            return figures
        figures["coupling/sub_steps"] = float(report.sub_steps)
        if report.budget is not None:
            figures |= {f"ledger/cause/{cause}": float(part.energy) for cause, part in report.budget.parts.items()}
            figures["ledger/energy_residual"] = report.budget.energy_residual
            figures["ledger/momentum_residual"] = report.budget.momentum_residual
        return figures

    def _wall_figures(self) -> dict[str, float]:
        """Return wall times of the last step alone; nothing before the first."""
        before, self._spent = self._spent, dict(self._wall_seconds())
        return {
            f"coupling/wall_seconds/{name}": spent - before[name]
            for name, spent in self._spent.items()
            if name in before
        }

    def _body_figures(self, time: float) -> dict[str, float]:
        assert self._world is not None
        twists = np.array([self._world.twist(name) for name in self._coupled])
        step = 0.0 if self._time is None else time - self._time
        if step > 0.0:
            wrenches = np.array([self._world.wrench(name) for name in self._coupled])
            self._impulse = self._impulse + step * wrenches[:, :3].sum(axis=0)
            self._work += step * float((wrenches * 0.5 * (self._twists + twists)).sum())
        self._time, self._twists = time, twists
        figures = {
            "ledger/bodies/energy": self._world.energy(),
            **_components("ledger/bodies/momentum", self._world.momentum()[:3]),
            **_components("ledger/exchange/impulse", self._impulse),
            "ledger/exchange/work": self._work,
            **{f"ledger/exchange/{name}": value for name, value in self._ledger.figures.items()},
        }
        return figures | (self._residuals(twists) if step > 0.0 else {})

    def _residuals(self, twists: Array) -> dict[str, float]:
        """Return the largest residuals of the bodies' motion."""
        apart = np.array([self._participant.expected_twist(name) for name in self._coupled]) - twists
        return {
            "coupling/residual/linear": float(np.linalg.norm(apart[:, :3], axis=1).max()),
            "coupling/residual/angular": float(np.linalg.norm(apart[:, 3:], axis=1).max()),
        }


def _components(name: str, vector: Array) -> dict[str, float]:
    return {f"{name}_{axis}": float(value) for axis, value in zip("xyz", vector, strict=True)}
