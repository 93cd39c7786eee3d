"""Orders to a run that goes on: the keys that they may change, and where nothing would feel them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fnmatch import fnmatch
from typing import Protocol

from scenarios.schema.exercise import BoomSettings, TowSettings
from scenarios.schema.liquid import PhaseSettings

# Orders that can be given while a run goes on: what a helmsman, the weather, a valve or the instructor could do.
ORDER_KEYS = (
    "tow.speed",
    "tow.heading",
    "vessels.*.legs",
    "vessels.*.engine",
    "vessels.*.hauled",
    "booms.*.parted",
    "booms.*.tow_line",
    "booms.*.reel.paid_out",
    "moorings.*.parted",
    "moorings.*.hauled",
    "moorings.*.holding",
    "ties.*.parted",
    "ties.*.hauled",
    "ties.*.made_fast",
    "skimmers.*.running",
    "skimmers.*.nameplate",
    "skimmers.*.storage",
    "skimmers.*.throughput_efficiency",
    "skimmers.*.recovery_efficiency",
    "injects.*.given",
    "sea.current.speed",
    "sea.current.direction",
    "sea.wind.speed",
    "sea.wind.direction",
    "sea.wind.gust_intensity",
    "sea.waves.height",
    "sea.waves.significant_height",
    "emitters.*.speed",
)
# Tables that an order may add to a run that began without them.
NEW_TABLES = (
    "sea.current",
    "sea.wind",
    "sea.waves",
    "emitters.*",
)


class Felt(Protocol):
    """The tables of a scenario that decide what its run feels; None for one that is missing, or could not be read."""

    @property
    def boxes(self) -> frozenset[str]:
        """The kind of box that the run has particles in."""

    @property
    def tow(self) -> TowSettings | None:
        """Orders to all vessels."""

    @property
    def booms(self) -> Mapping[str, BoomSettings]:
        """Booms by name."""

    @property
    def phases(self) -> Mapping[str, PhaseSettings]:
        """Liquids by name."""


def matches(path: str, patterns: Sequence[str]) -> bool:
    """Return whether a path is one of these, which may have ``*`` for a name."""
    return any(fnmatch(path, pattern) for pattern in patterns)


def why_unfelt(keys: Sequence[str], scenario: Felt) -> str:
    """Say why nothing in a run of this scenario feels an entry; empty if something does."""
    boom = scenario.booms.get(keys[1]) if keys[0] == "booms" and len(keys) > 2 and keys[2] == "tow_line" else None
    if boom is not None and boom.line_stiffness is None:
        return "cannot be ordered: the tow lines are rigid links; allowed: in runs with line_stiffness"
    table, boxes = keys[0], scenario.boxes
    if table == "tow" and scenario.tow is None:
        return "changes tow, but the run was started without it; allowed: tables that the run has"
    if table == "emitters" and "tank" not in boxes and not any(phase.is_oil for phase in scenario.phases.values()):
        return "cannot be ordered: the run has no tank, and no phase is oil; allowed: in runs with oil"
    if table == "sea" and "window" in boxes:
        return (
            "cannot be ordered: the particles of a window move with the sea that they began in; allowed: tow, vessels"
        )
    return ""
