"""Numbers in the place of words: a scenario whose windows have a `detail` is settled before it is run; others as they are."""

from __future__ import annotations

from scenarios.scenario import Scenario
from scenarios.schema.window import WindowTable


def settled(scenario: Scenario) -> Scenario:
    """Return the scenario with the spacings and sizes that its windows' details come to; ScenarioError where nothing tells them."""
    if scenario.run.detail != "window" or all(_is_settled(one) for one in scenario.window.values()):
        return scenario
    from scenarios.setup.at_sea.window_choice import chosen  # only such a run pays for particles

    return chosen(scenario)


def _is_settled(window: WindowTable) -> bool:
    return window.size is not None and window.depth is not None and not isinstance(window.detail, str)
