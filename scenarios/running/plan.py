"""The plan of a run: a scenario, and the orders given on the way. It is enough to run it again, or to go on with it, bit for bit."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

from scenarios.load import scenario_from
from scenarios.problems import Problem, ScenarioError
from scenarios.scenario import Scenario
from scenarios.schema.bodies import MeshBody
from scenarios.schema.overrides import parse_override, with_override
from scenarios.schema.structuring import as_data, spellings

# Terms of a run that its course does not depend on.
TERM_KEYS = ("run.duration", "run.threads", "recording.*", "camera.*", "criteria.*", "title", "text", "demo", "demo.*")
# Orders that can be given while a run goes on: what a helmsman, the weather or a valve could do.
ORDER_KEYS = (
    "tow.speed",
    "tow.heading",
    "vessels.*.legs",
    "forcing.current.speed",
    "forcing.current.direction",
    "forcing.wind.speed",
    "forcing.wind.direction",
    "forcing.wind.gustiness",
    "forcing.waves.height",
    "emitters.*.speed",
)


@dataclass(frozen=True, kw_only=True)
class Action:
    """Orders at the communication point `index`, written as for ``--set``; they hold from the step that begins there."""

    index: int
    settings: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Plan:
    """A scenario as it begins, and the actions on the way, in order of time.

    text: the scenario's file; overrides: the ``--set`` texts that changed it. Both are for the record only.
    """

    scenario: Scenario
    actions: tuple[Action, ...] = ()
    text: str = ""
    overrides: tuple[str, ...] = ()

    @property
    def changes(self) -> tuple[str, ...]:
        """All differences of the run from the scenario's file: overrides, and the orders on the way."""
        return (*self.overrides, *(setting for action in self.actions for setting in action.settings))

    def scenario_at(self, index: int) -> Scenario:
        """Return the scenario with all changes up to and at the communication point `index`."""
        scenario = self.scenario
        for action in self.actions:
            if action.index <= index:
                for setting in action.settings:
                    scenario = _with_setting(scenario, setting)[0]
        return scenario

    def settings_due(self, index: int) -> tuple[str, ...]:
        """List the orders to give at the communication point `index`."""
        return tuple(setting for action in self.actions if action.index == index for setting in action.settings)

    def changed(self, settings: Sequence[str], index: int) -> Plan:
        """Return the plan with these settings: terms hold for the whole run, orders from the communication point `index`.

        Later actions are dropped, because the run now differs. Raises ScenarioError, which names every setting that is neither.
        """
        plan = replace(self, actions=tuple(action for action in self.actions if action.index <= index))
        now = plan.scenario_at(index)
        orders: list[str] = []
        problems: list[Problem] = []
        for setting in _last_of_each(settings):
            try:
                if _kind(now, setting) == "term":
                    overrides = tuple(_last_of_each((*plan.overrides, setting)))
                    plan = replace(plan, scenario=_with_setting(plan.scenario, setting)[0], overrides=overrides)
                else:
                    now = _with_setting(now, setting)[0]
                    orders.append(setting)
            except ScenarioError as error:
                problems.extend(error.problems)
        if problems:
            raise ScenarioError(problems, "oilsim")
        if orders:
            plan = replace(plan, actions=(*plan.actions, Action(index=index, settings=tuple(orders))))
        plan.scenario_at(index)  # orders that contradict each other are found here
        return plan

    def as_data(self) -> dict[str, Any]:
        """Return plain data, from which `plan_from` makes the same plan."""
        actions = [{"index": action.index, "set": list(action.settings)} for action in self.actions]
        record = {"text": self.text, "overrides": list(self.overrides)}
        return {"scenario": as_data(self.scenario), "actions": actions} | record

    @property
    def files(self) -> dict[str, Path]:
        """Files of meshes and FMUs, by their places in the scenario."""
        files = {
            f"bodies.{n}.file": body.file for n, body in self.scenario.bodies.items() if isinstance(body, MeshBody)
        }
        files |= {f"fmus.{name}.file": fmu.file for name, fmu in self.scenario.fmus.items()}
        return {place: Path(file) for place, file in files.items()}

    def fingerprint(self, index: int) -> str:
        """Return a digest of all that this run depends on up to the communication point `index`; terms are left out, files are read."""
        data = as_data(self.scenario)
        course = {path: value for path, value in _leaves(data) if not _matches(path, TERM_KEYS)}
        actions = [[action.index, action.settings] for action in self.actions if action.index < index]
        digests = [_digest(file) for file in self.files.values()]
        return hashlib.sha256(json.dumps([course, actions, digests], sort_keys=True).encode()).hexdigest()


def plan_from(data: Mapping[str, Any]) -> Plan:
    """Create the plan that `Plan.as_data` described; ScenarioError if this program does not know such a scenario."""
    actions = tuple(Action(index=entry["index"], settings=tuple(entry["set"])) for entry in data["actions"])
    return Plan(
        scenario=scenario_from(data["scenario"]),
        actions=actions,
        text=data.get("text", ""),  # which recordings of old do not have in their plan
        overrides=tuple(data.get("overrides", ())),
    )


def _last_of_each(settings: Sequence[str]) -> list[str]:
    """Keep only the last of several settings of one key: it rules."""
    last = {setting.partition("=")[0]: place for place, setting in enumerate(settings)}
    return [settings[place] for place in sorted(last.values())]


def _kind(scenario: Scenario, setting: str) -> str:
    """Tell whether a setting is a "term" or an "order"; ScenarioError if it can only be changed before a run.

    A setting that changes nothing is classified by its key: an order is given, and logged, even if it already holds.
    """
    keys, _ = parse_override(setting)
    missing = _missing_part(scenario, keys)
    if missing:
        raise ScenarioError(
            [
                Problem(
                    f"--set {'.'.join(keys)}",
                    f"changes {missing}, but the run was started without it; allowed: tables that the run has",
                )
            ]
        )
    paths = _with_setting(scenario, setting)[1] or _entries_of(keys, scenario)
    if all(_matches(path, TERM_KEYS) for path in paths):
        return "term"
    for path in paths:
        if not _matches(path, ORDER_KEYS):
            allowed = ", ".join(path for path in (*ORDER_KEYS, *TERM_KEYS[:2]))
            raise ScenarioError([Problem(f"--set {path}", f"cannot be changed during a run, allowed: {allowed}")])
    return "order"


def _with_setting(scenario: Scenario, setting: str) -> tuple[Scenario, list[str]]:
    """Apply one setting to the scenario; return the scenario, and the paths of all entries that differ."""
    before = as_data(scenario)
    changed = scenario_from(with_override(before, *parse_override(setting)))
    old, new = dict(_leaves(before)), dict(_leaves(as_data(changed)))
    return changed, sorted(path for path in old.keys() | new.keys() if old.get(path) != new.get(path))


def _entries_of(keys: Sequence[str], scenario: Scenario) -> list[str]:
    """List the paths of all entries that a key, in any spelling, names, contains or lies in; the key itself if there is none."""
    found = [
        path
        for path, _ in _leaves(as_data(scenario))
        if all(part in spellings(key) for part, key in zip(path.split("."), keys, strict=False))
    ]
    return found or [".".join(keys)]


def _missing_part(scenario: Scenario, keys: Sequence[str]) -> str:
    """Return the optional table that a setting concerns, if the run does not have it."""
    if keys[0] == "tow" and scenario.tow is None:
        return "tow"
    part = keys[1] if keys[0] == "forcing" and len(keys) > 1 else ""
    return f"forcing.{part}" if part and getattr(scenario.forcing, part, "") is None else ""


def _leaves(data: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield every entry that is not a table, with its path; lists are entries."""
    for key, value in data.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{path}{key}.")
        else:
            yield f"{path}{key}", value


def _matches(path: str, patterns: Sequence[str]) -> bool:
    return any(fnmatch(path, pattern) for pattern in patterns)


def _digest(path: Path) -> str:
    """Return a digest of a file; empty if it is gone, which building the scenario will say better."""
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""
