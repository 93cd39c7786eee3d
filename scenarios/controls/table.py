"""Controls: all that may be changed while a run goes on, what a helmsman, the weather, a valve or the instructor could do.

Orders, injects, the console, FMUs in a run and masters of an exported one set the same keys, which are those of the scenario file. A key
has the unit and limits of its section. Whoever sets it, the scenario changes first, and then the same setter of
`scenarios.running.run_controls` brings the parts of the run to it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, is_dataclass, replace
from fnmatch import fnmatch
from typing import Any

from scenarios.schema.parsing.relations import entries_at, entries_of
from scenarios.schema.parsing.structuring import spellings
from scenarios.schema.tables import Parts
from scenarios.text.problems import Problem


@dataclass(frozen=True)
class Control:
    """An entry that a run may change: its key in the file, with ``*`` for a name or a number, and the setter that puts it into effect.

    driven: whether a signal may set it at every communication point, if it is a number there.
    by_crews: whether the crew of the vessel that works with it may order it on its page.
    """

    key: str
    setter: str
    driven: bool = False
    by_crews: bool = False


CONTROLS = (
    Control("tow.speed", "steer", driven=True),
    Control("tow.heading", "steer", driven=True),
    Control("vessels.*.legs", "steer"),
    Control("vessels.*.legs.*.speed", "steer", driven=True),
    Control("vessels.*.legs.*.heading", "steer", driven=True),
    Control("vessels.*.thrust_order", "push", driven=True),
    Control("vessels.*.side_thrust_order", "push", driven=True),
    Control("vessels.*.yaw_moment_order", "push", driven=True),
    Control("vessels.*.engine", "run_engines"),
    Control("vessels.*.hauled", "haul", driven=True),
    Control("booms.*.parted", "part"),
    Control("booms.*.tow_line", "haul", driven=True),
    Control("booms.*.reel.paid_out", "haul", driven=True),
    Control("moorings.*.parted", "moor"),
    Control("moorings.*.hauled", "haul", driven=True),
    Control("moorings.*.holding", "moor"),
    Control("ties.*.parted", "moor"),
    Control("ties.*.made_fast", "make_fast"),
    Control("ties.*.hauled", "haul", driven=True),
    Control("skimmers.*.running", "skim", by_crews=True),
    Control("skimmers.*.place", "skim", by_crews=True),
    Control("skimmers.*.nameplate", "skim", driven=True, by_crews=True),
    Control("skimmers.*.storage", "skim"),
    Control("skimmers.*.throughput_efficiency", "skim", driven=True),
    Control("skimmers.*.recovery_efficiency", "skim", driven=True),
    Control("injects.*.given", ""),
    Control("sea.current.speed", "change_sea", driven=True),
    Control("sea.current.direction", "change_sea", driven=True),
    Control("sea.wind.speed", "change_sea", driven=True),
    Control("sea.wind.direction", "change_sea", driven=True),
    Control("sea.wind.gust_intensity", "change_sea"),
    Control("sea.waves.height", "change_sea"),
    Control("sea.waves.significant_height", "change_sea"),
    Control("sea.waves.period", "change_sea"),
    Control("sea.waves.peak_period", "change_sea"),
    Control("sea.visibility", ""),
    Control("sea.within", ""),
    Control("emitters.*.speed", "pour", driven=True),
)
KEYS = tuple(control.key for control in CONTROLS)
KEYS_OF_CREWS = tuple(control.key for control in CONTROLS if control.by_crews)
SETTERS = tuple(dict.fromkeys(control.setter for control in CONTROLS if control.setter))
# Tables that an order may add to a run that began without them.
NEW_TABLES = ("sea.current", "sea.wind", "sea.waves", "emitters.*")


def matches(path: str, patterns: Sequence[str]) -> bool:
    """Return whether a path is one of these, which may have ``*`` for a name."""
    return any(fnmatch(path, pattern) for pattern in patterns)


def plain_path(keys: Sequence[str]) -> str:
    """Return the path of a key without the marks of its units: ``tow.speed`` of ``tow.speed_kn``."""
    return ".".join(spellings(key)[0] for key in keys)


def contradictions(paths: Sequence[Sequence[str]]) -> Iterator[Problem]:
    """Yield keys, given together, that set one entry several times, which a scenario file refuses too; joints that part add up."""
    first: dict[str, str] = {}
    for keys in paths:
        path, plain = ".".join(keys), plain_path(keys)
        other = first.get(plain)
        if other == path and not matches(plain, ["booms.*.parted"]):
            yield Problem(path, "is given twice, allowed: once")
        elif other not in (None, path):
            yield Problem(path, f"is given beside {other}, allowed: one of the two")
        first[plain] = path


def why_unfelt(keys: Sequence[str], parts: Parts) -> str:
    """Say why nothing in a run of this scenario feels an entry; empty if something does."""
    table, boxes, what = keys[0], parts.boxes, keys[2] if len(keys) > 2 else ""
    boom = parts.booms.get(keys[1]) if table == "booms" and what == "tow_line" else None
    if boom is not None and boom.line_stiffness is None:
        return "cannot be ordered: the tow lines are rigid links; allowed: in runs with line_stiffness"
    if table == "tow" and parts.tow is None:
        return "changes tow, but the run was started without it; allowed: tables that the run has"
    if table == "emitters" and "tank" not in boxes and not any(phase.is_oil for phase in parts.phases.values()):
        return "cannot be ordered: the run has no tank, and no phase is oil; allowed: in runs with oil"
    if table == "sea" and "window" in boxes and keys[1] != "visibility":
        return (
            "cannot be ordered: the particles of a window move with the sea that they began in; allowed: tow, vessels"
        )
    return ""


def driven_entries(parts: Parts) -> Iterator[tuple[str, Any, float]]:
    """Yield the path, the section and the present value of each number that signals may set, where something feels it."""
    for control in CONTROLS:
        for path, section, value in entries_at(control.key, parts) if control.driven else ():
            keys = path.split(".")
            if isinstance(value, float | int) and not why_unfelt(keys, parts) and _is_taken(control, keys, parts):
                yield path, section, float(value)


def _is_taken(control: Control, keys: Sequence[str], parts: Parts) -> bool:
    """Tell whether a vessel takes thrust without a helmsman, has a winch, or follows the tow; true for all but such controls."""
    if control.setter == "push":
        return parts.vessels[keys[1]].control == "manual"
    if control.key == "vessels.*.hauled":
        return any(one.line_stiffness is not None and keys[1] in one.ends for one in parts.booms.values())
    return keys[0] != "tow" or any(one.follows_tow for one in parts.vessels.values())


def with_entry(section: Any, keys: Sequence[str], value: float) -> Any:
    """Return a section with another value of the entry that keys lead to; ScenarioError for one that is not allowed."""
    key, rest = keys[0], keys[1:]
    (_, old), *_ = entries_of(section, key)
    entry = with_entry(old, rest, value) if rest else value
    if is_dataclass(section) and not isinstance(section, type):
        return replace(section, **{key: entry})
    if isinstance(section, Mapping):
        return {**section, key: entry}
    return (*section[: int(key)], entry, *section[int(key) + 1 :])
