"""FMUs under test: built from a model's source, stepped alone, or joined to a scene."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

if TYPE_CHECKING:
    from coupling.fmu.isolated_fmu import IsolatedFmu

PATIENCE = 10.0  # [s] of wall time that a step of an FMU under test may take; chosen: far more than a model's, and soon enough for a test


class FmuRunner:
    """Builds and loads FMUs; they end with the test. Needs `pip install 'oilsim[fmu]'` to build them."""

    def __init__(self, folder: Path, at_end: Callable[..., object]) -> None:
        self._folder, self._at_end = folder, at_end

    def build(self, source: str | Path, *, version: Literal[2, 3] = 3) -> Path:
        """Build an FMU of FMI `version` 2 or 3 from the source of a `ScalarModel`; return its path.

        Raises ScenarioError for a model that cannot be built.
        """
        from scenarios.commands.fmu import build_fmu

        path = self._folder / f"{Path(source).stem}.fmu"
        build_fmu(str(source), path, version)
        return path

    def load(
        self, path: str | Path, *, name: str = "fmu", start: Mapping[str, float | bool] | None = None,
        patience: float = PATIENCE,
    ) -> IsolatedFmu:  # fmt: skip
        """Return the FMU as a participant in a process of its own; `start` has parameters and initial inputs by name.

        patience [s]: wall time that one step may take. Raises the errors of `coupling.fmu.fmu_participant.FmuParticipant`.
        """
        from coupling.fmu.isolated_fmu import IsolatedFmu

        fmu = IsolatedFmu(name, path, start, step_patience=patience)
        self._at_end(_end, fmu)
        return fmu

    def run(
        self, fmu: IsolatedFmu, inputs: Callable[[float], Mapping[str, float]], *, step_size: float, steps: int
    ) -> dict[str, np.ndarray]:
        """Step an FMU alone, and return "time" [s] after each step and each scalar output, (N,) in its unit, by name.

        inputs: by name, as a function of time [s]. RuntimeError for an FMU that fails.
        """
        fmu.enter_initialization_mode(0.0)
        fmu.exit_initialization_mode()
        rows: dict[str, list[float]] = {"time": []}
        for index in range(steps):
            for name, value in inputs(index * step_size).items():
                fmu.set(name, np.full(fmu.variables[name].shape, value))
            result = fmu.do_step(index * step_size, step_size)
            if result.status.value != "ok":
                raise RuntimeError(
                    f"{fmu.name!r} ended its step at {index * step_size:g} s with {result.status}: {result.message}"
                )
            rows["time"].append((index + 1) * step_size)
            for name, variable in fmu.variables.items():
                if variable.causality.value == "output" and variable.shape in ((), (1,)):
                    rows.setdefault(name, []).append(float(fmu.get(name).ravel()[0]))
        fmu.terminate()
        return {name: np.array(values) for name, values in rows.items()}


def _end(fmu: IsolatedFmu) -> None:
    """End an FMU that a test has left running."""
    if fmu.process_id is not None:
        fmu.terminate()
