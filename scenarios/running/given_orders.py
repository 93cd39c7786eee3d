"""The orders that a recorded run was given while it went on, as its log tells them: to make the run again, or with others among them."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING

from scenarios.running.plan import Action, Plan, settings_of
from scenarios.text.problems import ScenarioError

if TYPE_CHECKING:
    from recordings.replay.recording import Replay


def given_orders(plan: Plan, replay: Replay) -> Iterator[Action]:
    """Yield the orders of instructor and crews that are not in a run's plan, in order; injects come by themselves."""
    step = plan.scenario.run.communication_step
    planned = Counter((action.index, text) for action in plan.actions for text in action.texts)
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
