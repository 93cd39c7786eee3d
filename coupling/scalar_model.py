"""The class that a model of one's own derives from, to become an FMU by `oilsim build-fmu` (see `coupling.fmu.scalar_model`)."""

from __future__ import annotations

from coupling.fmu.scalar_model import ScalarModel, given

__all__ = ["ScalarModel", "given"]
