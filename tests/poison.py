"""A forcing that makes a fluid's state unusable, for tests of what happens then."""

from __future__ import annotations

from typing import Any

import numpy as np

from oilsim.forcing import ForcingView


class Poison:
    """Gives the first particle a velocity that is no number."""

    def apply(self, view: ForcingView) -> None:
        """See `oilsim.forcing.Forcing`."""
        view.velocity[:, 0] = np.nan

    def save(self) -> dict[str, Any]:
        """Nothing is remembered."""
        return {}

    def restore(self, saved: dict[str, Any]) -> None:
        """Nothing is remembered."""
