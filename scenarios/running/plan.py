"""The plan of a run: a scenario, and the orders given on the way. It is enough to run it again, or to go on with it, bit for bit."""

from __future__ import annotations

import hashlib
import json
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from scenarios.controls.table import KEYS, NEW_TABLES, contradictions, matches, plain_path, why_unfelt
from scenarios.schema.bodies import MeshBody
from scenarios.schema.parsing.overrides import parse_override, with_override
from scenarios.schema.parsing.structuring import as_data, spellings
from scenarios.spec.load import scenario_from
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import Problem, ScenarioError, moved

# Terms of a run that its course does not depend on.
TERM_KEYS = (
    "run.duration", "run.threads", "recording.*", "camera.*", "criteria.*", "title", "text", "demo", "demo.*", "levels", "levels.*",
    "exercise", "exercise.*",
)  # fmt: skip
_ORDERED = "orders "  # how the text of an order's event begins


@dataclass(frozen=True, kw_only=True)
class Action:
    """Orders at the communication point `index`, written as for ``--set``; they hold from the step that begins there."""

    index: int
    settings: tuple[str, ...]

    @property
    def text(self) -> str:
        """The text of the order's event; `settings_of` reads it back."""
        return f"{_ORDERED}{shlex.join(self.settings)}"

    @property
    def texts(self) -> set[str]:
        """The texts that its event may have: older recordings have the settings without quotes."""
        return {self.text, f"{_ORDERED}{' '.join(self.settings)}"}


def settings_of(text: str) -> tuple[str, ...]:
    """Return the settings that the text of an event orders; none if it is no order's text. ScenarioError for one that is damaged."""
    if not text.startswith(_ORDERED):
        return ()
    try:
        return tuple(shlex.split(text.removeprefix(_ORDERED)))
    except ValueError as error:
        raise ScenarioError([Problem("the event", f"{text!r} cannot be read: {error}")], "oilsim") from error


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
        return self.scenario_after(sum(action.index <= index for action in self.actions))

    def scenario_after(self, count: int) -> Scenario:
        """Return the scenario with the changes of the first `count` actions."""
        scenario = self.scenario
        for action in self.actions[:count]:
            scenario = _with_settings(scenario, action.settings)
        return scenario

    def settings_due(self, index: int) -> tuple[str, ...]:
        """List the orders to give at the communication point `index`."""
        return tuple(setting for action in self.actions if action.index == index for setting in action.settings)

    def changed(self, settings: Sequence[str], index: int) -> Plan:
        """Return the plan with these settings: terms hold for the whole run, orders from the communication point `index`.

        Later actions are dropped, because the run now differs. Raises ScenarioError, which names every setting that is neither.
        """
        plan = replace(self, actions=tuple(action for action in self.actions if action.index <= index))
        orders: list[str] = []
        problems: list[Problem] = []
        for setting in _last_of_each(settings):
            try:
                if _is_term(plan.scenario_at(index), setting):
                    overrides = tuple(_last_of_each((*plan.overrides, setting)))
                    plan = replace(plan, scenario=_with_settings(plan.scenario, [setting]), overrides=overrides)
                else:
                    orders.append(setting)
            except ScenarioError as error:
                problems.extend(error.problems)
        try:
            plan = plan.ordered(orders, index) if orders else plan
        except ScenarioError as error:
            problems.extend(error.problems)
        if problems:
            raise ScenarioError(problems, "oilsim")
        return plan

    def ordered(self, settings: Sequence[str], index: int) -> Plan:
        """Return the plan with these orders at the communication point `index`, after those that it has there; later ones stay.

        Raises ScenarioError, which names every setting that cannot be ordered, and what a scenario may not be.
        """
        before = self.scenario_at(index)
        _require_apart(settings)
        orders = tuple(_last_of_each(_with_injects(settings, before)))
        _require_orders(before, orders)
        place = sum(action.index <= index for action in self.actions)
        action = Action(index=index, settings=orders)
        plan = replace(self, actions=(*self.actions[:place], action, *self.actions[place:]))
        plan.scenario_after(len(plan.actions))  # orders that contradict each other are found here
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
        course = {path: value for path, value in _leaves(data) if not matches(path, TERM_KEYS)}
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


def _with_injects(settings: Sequence[str], scenario: Scenario) -> list[str]:
    """Put the orders of an inject before the setting that gives it."""
    found = list[str]()
    for setting in settings:
        keys, value = parse_override(setting) if "=" in setting else ((), None)
        if len(keys) == 3 and keys[0] == "injects" and keys[2] == "given" and value is True:
            found += scenario.injects[keys[1]].orders if keys[1] in scenario.injects else ()
        found.append(setting)
    return found


def _require_apart(settings: Sequence[str]) -> None:
    """Raise ScenarioError for settings that give one entry in several ways."""
    problems = list(contradictions([setting.partition("=")[0].split(".") for setting in settings]))
    if problems:
        raise ScenarioError([Problem(f"--set {problem.path}", problem.text) for problem in problems], "oilsim")


def _last_of_each(settings: Sequence[str]) -> list[str]:
    """Keep only the last of several settings of one entry: it rules; but joints that part add up."""
    paths = [setting.partition("=")[0].split(".") for setting in settings]
    last = {plain_path(keys): place for place, keys in enumerate(paths)}
    kept = {place for place, keys in enumerate(paths) if _parts_joints(keys)}
    return [settings[place] for place in sorted(kept.union(last.values()))]


def _parts_joints(keys: Sequence[str]) -> bool:
    """Return whether a key names the joints of a boom that part."""
    return matches(".".join(keys), ["booms.*.parted"])


def _is_term(scenario: Scenario, setting: str) -> bool:
    """Return whether a setting is one of the terms of a run, which its course does not depend on, rather than an order."""
    keys, _ = parse_override(setting)
    return all(matches(path, TERM_KEYS) for path in _entries_of(keys, as_data(scenario)))


def _require_orders(scenario: Scenario, settings: Sequence[str]) -> None:
    """Raise ScenarioError unless all settings, given together, are orders to a run of this scenario.

    A setting that changes nothing is judged by its key: an order is given, and logged, even if it already holds.
    """
    before = as_data(scenario)
    problems: list[Problem] = []
    readable: dict[str, tuple[str, ...]] = {}
    for setting in settings:
        try:
            _with_setting(before, setting)
            keys, value = parse_override(setting)
            if text := moved(".".join(keys)):
                problems.append(Problem(f"--set {'.'.join(keys)}", text))
                continue
            readable[setting] = keys
            if matches(".".join(keys), ["injects.*.given"]) and _was_given(scenario, keys[1]):
                problems.append(Problem(f"--set {'.'.join(keys)}", "has been given already, allowed: once"))
            if _parts_joints(readable[setting]) and value == []:
                text = "is [], allowed: numbers of joints that part; one that has parted stays so"
                problems.append(Problem(f"--set {'.'.join(readable[setting])}", text))
        except ScenarioError as error:
            problems.extend(error.problems)
    felt = [setting for setting, keys in readable.items() if not why_unfelt(keys, scenario)]
    try:
        after = as_data(_with_settings(scenario, felt))
    except ScenarioError as error:
        problems.extend(error.problems)
        after = before
    for setting, keys in readable.items():
        if setting in felt:
            problems.extend(_not_orders(keys, before, after))
        else:
            problems.append(Problem(f"--set {'.'.join(keys)}", why_unfelt(keys, scenario)))
    problems.extend(_mended(before, after))
    if problems:
        raise ScenarioError(problems, "oilsim")


def _was_given(scenario: Scenario, inject: str) -> bool:
    return inject in scenario.injects and scenario.injects[inject].given


def _mended(before: Mapping[str, Any], after: Mapping[str, Any]) -> Iterator[Problem]:
    """Yield the mooring legs and ties that would hold again but have parted, and ties that would be loose again."""
    for name, tie in before.get("ties", {}).items():
        if tie["made_fast"] and not after["ties"][name]["made_fast"]:
            text = f"is false, allowed: true, because the tie has been made fast; ties.{name}.parted=true casts it off"
            yield Problem(f"--set ties.{name}.made_fast", text)
        if tie["parted"] and after["ties"][name]["made_fast"] and not tie["made_fast"]:
            yield Problem(f"--set ties.{name}.made_fast", "is true, allowed: false, because the tie has parted")
    for table, what in (("moorings", "leg"), ("ties", "tie")):
        for name, line in before.get(table, {}).items():
            if line["parted"] and not after[table][name]["parted"]:
                yield Problem(f"--set {table}.{name}.parted", f"is false, allowed: true, because the {what} has parted")


def _not_orders(keys: tuple[str, ...], before: Mapping[str, Any], after: Mapping[str, Any]) -> Iterator[Problem]:
    """Yield a problem for every entry under a key, among all that changed, that can only be set before a run."""
    old, new = dict(_leaves(before)), dict(_leaves(after))
    changed = sorted(path for path in old.keys() | new.keys() if old.get(path) != new.get(path))
    for path in [path for path in changed if _overlap(path, keys)] or _entries_of(keys, before):
        if not matches(path, KEYS) and not _is_new(path, before):
            added = f"what a run began without: {', '.join(NEW_TABLES)}; with --resume: {', '.join(TERM_KEYS[:2])}"
            yield Problem(f"--set {path}", f"cannot be changed during a run, allowed: {', '.join(KEYS)}; {added}")


def _is_new(path: str, before: Mapping[str, Any]) -> bool:
    """Return whether a path lies in a table that an order may add, and that is not there before."""
    outer, _, rest = path.partition(".")
    name = rest.partition(".")[0]
    return matches(f"{outer}.{name}", NEW_TABLES) and name not in before.get(outer, {})


def _with_settings(scenario: Scenario, settings: Sequence[str]) -> Scenario:
    """Return the scenario with all settings, given together; ScenarioError if that is none."""
    data = as_data(scenario)
    for setting in settings:
        data = _with_setting(data, setting)
    return scenario_from(data)


def _with_setting(data: Mapping[str, Any], setting: str) -> dict[str, Any]:
    """Return plain data with a setting; joints of a boom that part do so beside those that have."""
    keys, value = parse_override(setting)
    if _parts_joints(keys) and isinstance(value, list):
        parted = data.get("booms", {}).get(keys[1], {}).get("parted", [])
        value = [*parted, *(number for number in value if number not in parted)]
    return with_override(data, keys, value)


def _overlap(path: str, keys: Sequence[str]) -> bool:
    """Return whether a path, in any spelling, is what a key names, contains it, or lies in it."""
    return all(part in spellings(key) for part, key in zip(path.split("."), keys, strict=False))


def _entries_of(keys: Sequence[str], data: Mapping[str, Any]) -> list[str]:
    """List the paths of all entries that a key, in any spelling, names, contains or lies in; the key itself if there is none."""
    return [path for path, _ in _leaves(data) if _overlap(path, keys)] or [".".join(keys)]


def _leaves(data: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield every entry that is not a table, with its path; lists are entries."""
    for key, value in data.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{path}{key}.")
        else:
            yield f"{path}{key}", value


def _digest(path: Path) -> str:
    """Return a digest of a file; empty if it is gone, which building the scenario will say better."""
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""
