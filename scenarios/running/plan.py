"""The plan of a run: a scenario, and the orders given on the way. It is enough to run it again, or to go on with it, bit for bit.

Orders that a recorded run was given while it went on are in its log: they are added to the plan to make the run again.
"""

from __future__ import annotations

import hashlib
import json
import math
import shlex
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from recordings.model.frame import INSTRUCTOR
from scenarios.controls.order_checks import PARTED, entries_of, leaves, order_problems, with_order
from scenarios.controls.table import contradictions, matches, plain_path
from scenarios.schema.bodies import MeshBody
from scenarios.schema.parsing.overrides import ORDERED, parse_override, settings_of
from scenarios.schema.parsing.structuring import as_data
from scenarios.spec.load import changed_scenario, scenario_from
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import Problem, ScenarioError

if TYPE_CHECKING:
    from recordings.replay.recording import Replay

# Terms of a run that its course does not depend on.
TERM_KEYS = (
    "run.duration", "run.threads", "recording.*", "camera.*", "criteria.*", "prices", "prices.*", "title", "text", "demo", "demo.*",
    "levels", "levels.*", "exercise", "exercise.*",
)  # fmt: skip
# scenarios after some actions that a plan keeps, so that an order costs the same after many; numerical; those of the last orders
KEPT = 8


@dataclass(frozen=True, kw_only=True)
class Action:
    """Orders at the communication point `index`, written as for ``--set``; they hold from the step that begins there.

    by: the source of its event; replayed: whether another run was given them there, so that one that cannot be obeyed here is passed over.
    """

    index: int
    settings: tuple[str, ...]
    replayed: bool = False
    by: str = INSTRUCTOR

    @property
    def text(self) -> str:
        """The text of the order's event; `settings_of` reads it back."""
        return f"{ORDERED}{shlex.join(self.settings)}"


@dataclass(frozen=True, kw_only=True)
class Plan:
    """A scenario as it begins, and the actions on the way, in order of time.

    text: the scenario's file; overrides: the ``--set`` texts that changed it. Both are for the record only.
    """

    scenario: Scenario
    actions: tuple[Action, ...] = ()
    text: str = ""
    overrides: tuple[str, ...] = ()
    # first and present scenario, by the actions between them; shared with the plans that orders make of this one
    _after: dict[tuple[Action, ...], tuple[Scenario, Scenario]] = field(default_factory=dict, compare=False, repr=False)

    @property
    def changes(self) -> tuple[str, ...]:
        """All differences of the run from the scenario's file: overrides, and the orders on the way."""
        return (*self.overrides, *(setting for action in self.actions for setting in action.settings))

    def scenario_at(self, index: int) -> Scenario:
        """Return the scenario with all changes up to and at the communication point `index`."""
        return self.scenario_after(sum(action.index <= index for action in self.actions))

    def scenario_after(self, count: int) -> Scenario:
        """Return the scenario with the changes of the first `count` actions."""
        actions = self.actions[:count]
        nothing = (None, self.scenario)
        for known in range(len(actions), -1, -1):
            first, scenario = self._after.get(actions[:known], nothing)
            if first is self.scenario or not known:
                break
        for done in range(known, len(actions)):
            scenario = _with_settings(scenario, actions[done].settings)
            self._after[actions[: done + 1]] = self.scenario, scenario
        while len(self._after) > KEPT:
            self._after.pop(next(iter(self._after)))
        return scenario

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

    def without(self, place: int) -> Plan:
        """Return the plan without its action at a place, counted from 0."""
        return replace(self, actions=(*self.actions[:place], *self.actions[place + 1 :]))

    def ordered(self, settings: Sequence[str], index: int, *, replayed: bool = False, by: str = INSTRUCTOR) -> Plan:
        """Return the plan with these orders at the communication point `index`, after those that it has there; later ones stay.

        Raises ScenarioError, which names every setting that cannot be ordered, and what a scenario may not be.
        """
        before = self.scenario_at(index)
        _require_apart(settings)
        orders = tuple(_last_of_each(_with_injects(settings, before)))
        problems = order_problems(orders, before.parts)
        if problems:
            raise ScenarioError(problems, "oilsim")
        place = sum(action.index <= index for action in self.actions)
        action = Action(index=index, settings=orders, replayed=replayed, by=by)
        plan = replace(self, actions=(*self.actions[:place], action, *self.actions[place:]))
        plan.scenario_after(len(plan.actions))  # orders that contradict each other are found here
        return plan

    def as_data(self) -> dict[str, Any]:
        """Return plain data, from which `plan_from` makes the same plan."""
        actions = [
            {"index": action.index, "set": list(action.settings)}
            | ({"replayed": True} if action.replayed else {})
            | ({"by": action.by} if action.by != INSTRUCTOR else {})
            for action in self.actions
        ]
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
        course = {path: value for path, value in leaves(data) if not matches(path, TERM_KEYS)}
        actions = [[action.index, action.settings] for action in self.actions if action.index < index]
        digests = [_digest(file) for file in self.files.values()]
        return hashlib.sha256(json.dumps([course, actions, digests], sort_keys=True).encode()).hexdigest()


def plan_from(data: Mapping[str, Any]) -> Plan:
    """Create the plan that `Plan.as_data` described; ScenarioError if this program does not know such a scenario.

    Raises TypeError for settings that are no texts, or given at no step.
    """
    actions = tuple(
        Action(
            index=entry["index"],
            settings=tuple(entry["set"]),
            replayed=entry.get("replayed", False),
            by=entry.get("by", INSTRUCTOR),
        )
        for entry in data["actions"]
    )
    text = data.get("text", "")  # which recordings of old do not have in their plan
    overrides = tuple(data.get("overrides", ()))
    settings = (setting for action in actions for setting in (*action.settings, action.by))
    for entry in (text, *overrides, *settings):
        if not isinstance(entry, str):
            raise TypeError(f"a setting or its text is {entry!r}, allowed: texts")
    for action in actions:
        if type(action.index) is not int:
            raise TypeError(f"an order is given at the step {action.index!r}, allowed: a whole number")
    return Plan(scenario=scenario_from(data["scenario"]), actions=actions, text=text, overrides=overrides)


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
    kept = {place for place, keys in enumerate(paths) if matches(".".join(keys), PARTED)}
    return [settings[place] for place in sorted(kept.union(last.values()))]


def _is_term(scenario: Scenario, setting: str) -> bool:
    """Return whether a setting is one of the terms of a run, which its course does not depend on, rather than an order."""
    keys, _ = parse_override(setting)
    return all(matches(path, TERM_KEYS) for path in entries_of(keys, as_data(scenario)))


def _with_settings(scenario: Scenario, settings: Sequence[str]) -> Scenario:
    """Return the scenario with all settings, given together; ScenarioError if that is none."""
    data = as_data(scenario)
    for setting in settings:
        data = with_order(data, *parse_override(setting))
    return changed_scenario(data)


def _digest(path: Path) -> str:
    """Return a digest of a file; empty if it is gone, which building the scenario will say better."""
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""


def given_orders(plan: Plan, replay: Replay) -> Iterator[Action]:
    """Yield the orders of instructor and crews that are not in a run's plan, in order; injects come by themselves."""
    step = plan.scenario.run.communication_step
    planned = Counter((action.index, action.text) for action in plan.actions)
    for event in replay.events:
        if not event.is_by_people:
            continue
        index = round(event.time / step)
        if planned[index, event.text] > 0:
            planned[index, event.text] -= 1
        elif settings := settings_of(event.text):
            yield Action(index=index, settings=settings, by=event.source)


def with_given_orders(plan: Plan, replay: Replay, first: int = 0, last: float = math.inf) -> Plan:
    """Add the orders of a recorded run from the communication point `first` up to `last` to the plan of that run."""
    for action in given_orders(plan, replay):
        if first <= action.index <= last:
            plan = plan.ordered(action.settings, action.index, by=action.by)
    return plan


def replayed_after(plan: Plan, replay: Replay, index: int) -> tuple[Plan, list[str]]:
    """Add the orders of a recorded run after the communication point `index` to a plan that had others there.

    Returns the plan, and what cannot be ordered any more, in words.
    """
    left_out = []
    for action in given_orders(plan, replay):
        if action.index > index:
            try:
                plan = plan.ordered(action.settings, action.index, replayed=True, by=action.by)
            except ScenarioError as error:
                left_out.append(f"{action.text}: cannot be given any more: {'; '.join(map(str, error.problems))}")
    return plan, left_out
