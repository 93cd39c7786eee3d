"""The account of the exchange between fluid and bodies: work done, disagreement left, and the ledger of both.

Series, all under ``metrics``:

coupling/sub_steps                steps of the fluid in the communication step
coupling/wall_seconds/<name>      wall time each participant took [s]
coupling/residual/linear|angular  largest difference between the twist the fluid expects of a body after its wrench, and the body's
                                  own after joints and contacts [m/s, rad/s]
ledger/fluid|bodies/momentum_x|y|z         linear momentum [N s]
ledger/fluid/kinetic|potential_energy      [J]; of the bodies together: ledger/bodies/energy
ledger/exchange/impulse_x|y|z, work        what the bodies received from the fluid since the run began [N s, J]; work by the
                                           trapezoidal rule over twists
ledger/exchange/energy_unexplained         in the last step, and
ledger/exchange/momentum_residual, energy_residual  of the run, as `coupling.master.exchange_ledger` has them
ledger/cause/<cause>                       what the liquid gained by one cause in the step [J], of a run with run.budget, and
ledger/energy_residual, momentum_residual  the shares that no cause explains

In two dimensions all of the fluid's are per metre.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.master.exchange_ledger import ExchangeLedger
from coupling.participants.fluid import FluidParticipant
from oilsim import Fluid
from oilsim.backend.arrays import Array

WallSeconds = Callable[[], Mapping[str, float]]


class CouplingAccount:
    """Sums up what passes between fluid and bodies, from communication point to communication point.

    Only `advance` changes the account; `series` reads it.
    """

    def __init__(
        self,
        fluid: Fluid,
        participant: FluidParticipant,
        world: RigidBodyWorld | None,
        coupled: Sequence[str],
        ledger: ExchangeLedger,
    ) -> None:
        """`coupled` names the bodies that exchange motion and wrench with the fluid, `ledger` checks what passes between them."""
        self._ledger = ledger
        self._fluid, self._participant, self._world = fluid, participant, world
        self._coupled = tuple(coupled) if world is not None else ()
        self._wall_seconds: WallSeconds = dict
        self._spent: Mapping[str, float] = {}  # [s] of wall time so far, by participant
        self._spent_in_step: dict[str, float] = {}
        self._time: float | None = None
        self._has_stepped = False  # since the beginning, or since the state that was restored
        self._twists = np.zeros((len(self._coupled), 6))
        self._impulse, self._work = np.zeros(3), 0.0

    def follow(self, wall_seconds: WallSeconds) -> None:
        """Take the participants' wall time so far [s], by name, from `wall_seconds`."""
        self._wall_seconds = wall_seconds

    def save_state(self) -> dict[str, Any]:
        """Return the account as it stands, as plain data."""
        return {"time": self._time, "twists": self._twists.copy(), "impulse": self._impulse.copy(), "work": self._work}

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Go back to what `save_state` returned."""
        self._time, self._twists = saved["time"], saved["twists"].copy()
        self._impulse, self._work = saved["impulse"].copy(), float(saved["work"])
        self._has_stepped = False

    def advance(self, time: float) -> None:
        """Add the communication step that ends at simulated `time` [s]; the first call only notes where the run begins.

        The impulse is the sum of H F, the work that of H F . (v_begin + v_end) / 2 (trapezoidal rule), over all coupled bodies.
        """
        before, self._spent = self._spent, dict(self._wall_seconds())
        self._spent_in_step = {name: spent - before[name] for name, spent in self._spent.items() if name in before}
        if self._world is None or not self._coupled:
            return
        twists = np.array([self._world.twist(name) for name in self._coupled])
        step = 0.0 if self._time is None else time - self._time
        self._has_stepped = step > 0.0
        if self._has_stepped:
            wrenches = np.array([self._world.wrench(name) for name in self._coupled])
            self._impulse = self._impulse + step * wrenches[:, :3].sum(axis=0)
            self._work += step * float((wrenches * 0.5 * (self._twists + twists)).sum())
        self._time, self._twists = time, twists

    def series(self) -> dict[str, float]:
        """Return the series at the last communication point, by name; see the module."""
        figures = self._fluid_figures()
        figures |= {f"coupling/wall_seconds/{name}": spent for name, spent in self._spent_in_step.items()}
        if self._world is not None and self._coupled:
            figures |= self._body_figures(self._world)
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

    def _body_figures(self, world: RigidBodyWorld) -> dict[str, float]:
        figures = {
            "ledger/bodies/energy": world.energy(),
            **_components("ledger/bodies/momentum", world.momentum()[:3]),
            **_components("ledger/exchange/impulse", self._impulse),
            "ledger/exchange/work": self._work,
            **{f"ledger/exchange/{name}": value for name, value in self._ledger.figures.items()},
        }
        return figures | (self._residuals() if self._has_stepped else {})

    def _residuals(self) -> dict[str, float]:
        """Return the largest disagreement about the bodies' motion."""
        apart = np.array([self._participant.expected_twist(name) for name in self._coupled]) - self._twists
        return {
            "coupling/residual/linear": float(np.linalg.norm(apart[:, :3], axis=1).max()),
            "coupling/residual/angular": float(np.linalg.norm(apart[:, 3:], axis=1).max()),
        }


def _components(name: str, vector: Array) -> dict[str, float]:
    return {f"{name}_{axis}": float(value) for axis, value in zip("xyz", vector, strict=True)}
