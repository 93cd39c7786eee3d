"""Skimmers in series, summaries and the log of a run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from scenarios.scenario import Scenario
from scenarios.watch.boom_score import Notice

if TYPE_CHECKING:
    from booms.recovery.skimming import SkimmingParticipant


class SkimmerAccounts:
    """Reads the skimmers of a run."""

    def __init__(self, scenario: Scenario, skimmers: Sequence[SkimmingParticipant]) -> None:
        """Read these skimmers; what the scenario leaves to be assumed is told once."""
        self.skimmers = tuple(skimmers)
        self._assumed = [_assumption(name, scenario) for name in scenario.skimmers if scenario.skimmers[name].assumed]

    def series(self) -> dict[str, float]:
        """Return the sums [m3], rates [m3/s] and places of each skimmer, as ``skimmers/NAME/oil``."""
        sums = {
            f"{skimmer.name}/{name}": float(skimmer.get(name))
            for skimmer in self.skimmers
            for name, variable in skimmer.variables.items()
            if variable.shape == ()
        }
        off_oil = {f"{skimmer.name}/off_oil": skimmer.distance_to_pool() for skimmer in self.skimmers}
        return sums | {name: distance for name, distance in off_oil.items() if distance is not None}

    def take_notices(self) -> list[Notice]:
        """Return what has happened since the last call, and at first what is assumed."""
        assumed, self._assumed = self._assumed, []
        told = [
            Notice(text, level="info", source=f"skimmer {skimmer.name.removeprefix('skimmers/')}")
            for skimmer in self.skimmers
            for text in skimmer.take_notices()
        ]
        return [*(Notice(text, level="info", source="oilsim") for text in assumed if self.skimmers), *told]

    def summary(self) -> dict[str, Any]:
        """Return the account [m3] and the figures of each skimmer."""
        return {
            skimmer.name.removeprefix("skimmers/"): {f"{name}_m3": float(skimmer.get(name)) for name in _VOLUMES}
            | skimmer.skimmer.figures()
            for skimmer in self.skimmers
        }


_VOLUMES = ("encountered", "oil", "water", "decanted", "offloaded", "aboard")


def _assumption(name: str, scenario: Scenario) -> str:
    values: Mapping[str, float] = scenario.skimmers[name].assumed
    listed: Iterable[str] = (f"{key.replace('_', ' ')} of {value:g}" for key, value in values.items())
    return f"skimmer {name!r}: a {' and a '.join(listed)} is assumed for a {scenario.skimmers[name].kind}"
