"""Several windows of one run as its fluid: an apex and a skimmer, or two booms, each with its own particles, steps and target.

The variables are those of one window. A body's load is the sum of the loads that the windows find, each by its own share, and the formulas
bear what all of them leave (`JointShares`). A window predicts the motion of its bodies in a step under the loads that other windows found
in the step before, smoothed, since bodies of a boom are tied to each other. Windows may not overlap: water would be there twice.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np
import numpy.typing as npt

from coupling.master.participant import Status, StepResult
from coupling.participants.fluid import FluidParticipant
from coupling.participants.window import SMOOTH, WindowParticipant
from oilsim import AdvanceReport
from oilsim.window.window import Window

Array = npt.NDArray[np.float64]


class JointShares:
    """The shares (B,) of all windows together in the loads of bodies, in the order of `names`."""

    def __init__(self, windows: Sequence[WindowParticipant]) -> None:
        self._windows, self.names = tuple(windows), windows[0].shares.names

    def at(self, time: float) -> Array:
        """Return the shares (B,) [1] at `time` [s]."""
        return np.asarray(sum(one.shares.at(time) for one in self._windows))


class WindowsParticipant(FluidParticipant):
    """Steps several windows, which have variables of the same bodies, one after the other."""

    STATE = ("_windows", "_steady", "_inputs", "_outputs", "entered", "left")

    def __init__(self, name: str, windows: Mapping[str, WindowParticipant]) -> None:
        """Take the windows by the names that messages use; ValueError for windows that know different bodies."""
        self._windows = dict(windows)
        first, *others = self._windows.values()
        if any(one.shares.names != first.shares.names for one in others):
            raise ValueError(f"{name!r}: the windows have different bodies, allowed: the same, in the same order")
        self._bodies = first.shares.names
        super().__init__(name, first.window.fluid, dict.fromkeys(self._bodies, -1))
        self.shares = JointShares(tuple(self._windows.values()))
        self._steady = np.zeros(
            (len(self._windows), len(self._bodies), 6)
        )  # loads that each found, smoothed, in the sea

    def enter_initialization_mode(self, start_time: float) -> None:
        """Start the clocks of the windows."""
        for one in self._windows.values():
            one.enter_initialization_mode(start_time)

    def do_step(self, time: float, step_size: float) -> StepResult:
        """Advance all windows to `time + step_size` [s]; the status is ERROR if one fails, or if two come to overlap."""
        reports, wrenches = [], np.zeros(self._steady.shape)
        for k, (name, one) in enumerate(self._windows.items()):
            one.take(self._inputs_under(self._steady.sum(0) - self._steady[k]), self._joint_inverse_mass)
            result = one.do_step(time, step_size)
            if result.status is not Status.OK:
                return StepResult(result.status, time, f"window {name!r}: {result.message}", cause=result.cause)
            wrenches[k] = [one.get(f"{body}.wrench") for body in self._bodies]
            reports.append(one.report)
        fault = overlap({name: one.window for name, one in self._windows.items()})
        if fault:
            return StepResult(Status.ERROR, time, fault)
        self._steady += SMOOTH * (wrenches - self._steady)
        self._take_report(joint_report([report for report in reports if report is not None]))
        self._hand_back(wrenches.sum(0))
        return StepResult(Status.OK, time + step_size)

    def _inputs_under(self, loads: Array) -> dict[str, Array]:
        """Return the inputs with free accelerations in which loads (B, 6) [N, N m] of other windows act."""
        if self._joint_inverse_mass is None or not loads.any():
            return self._inputs
        pushed = (self._joint_inverse_mass @ loads.ravel()).reshape(-1, 6)
        free = {f"{body}.free_acceleration": pushed[n] for n, body in enumerate(self._bodies)}
        return {name: value + free[name] if name in free else value for name, value in self._inputs.items()}

    def _hand_back(self, wrench: Array) -> None:
        """Sum up what the windows found; the window that has most of a body predicts its motion."""
        windows = list(self._windows.values())
        most = np.argmax([one.shares.values for one in windows], axis=0)
        for n, body in enumerate(self._bodies):
            self._outputs[f"{body}.wrench"] = wrench[n]
            self._outputs[f"{body}.predicted_twist"] = windows[most[n]].expected_twist(body)

    def added_mass(self, body: str) -> Array:
        """Return the mass (6, 6) [kg, kg m, kg m2] of the densest liquid that a fully submerged body would move, world frame."""
        first = next(iter(self._windows.values()))
        first.take(self._inputs, self._joint_inverse_mass)
        return first.added_mass(body)

    def terminate(self) -> None:
        """End the threads of all windows."""
        for one in self._windows.values():
            one.terminate()


def overlap(windows: Mapping[str, Window]) -> str:
    """Say which windows overlap where they are now; empty if none do."""
    for (first, one), (second, other) in combinations(windows.items(), 2):
        apart = np.abs(one.rim.center - other.rim.center)
        least = 0.5 * (np.array(one.rim.size) + np.array(other.rim.size))
        if (apart < least).all():
            return (
                f"windows {first!r} and {second!r} overlap: their middles are {apart[0]:.3g} m apart along x and {apart[1]:.3g} m along y,"
                f" allowed: {least[0]:.3g} m along x or {least[1]:.3g} m along y, or more"
            )
    return ""


def joint_report(reports: Sequence[AdvanceReport]) -> AdvanceReport:
    """Return one report of several fluids: numbers of particles and times are summed, steps and errors are those of the worst."""
    return AdvanceReport(
        sub_steps=max(one.sub_steps for one in reports),
        time_step=min(one.time_step for one in reports),
        iterations={kind: max(one.iterations[kind] for one in reports) for kind in reports[0].iterations},
        density_error=max(one.density_error for one in reports),
        divergence_error=max(one.divergence_error for one in reports),
        viscosity_error=max(one.viscosity_error for one in reports),
        crowding=max((one.crowding for one in reports), key=abs),
        density_error_max=max(one.density_error_max for one in reports),
        stage_seconds=_summed([one.stage_seconds for one in reports]),
        asleep=sum(one.asleep for one in reports),
        removed={name: round(count) for name, count in _summed([one.removed for one in reports]).items()},
        emitted={name: round(count) for name, count in _summed([one.emitted for one in reports]).items()},
    )


def _summed(parts: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Return the sums of numbers by name."""
    names = dict.fromkeys(name for part in parts for name in part)
    return {name: sum(part.get(name, 0) for part in parts) for name in names}
