"""Numbers in the place of words: a scenario whose window has a `detail` is settled before it is run; others as they are."""

from __future__ import annotations

from scenarios.scenario import Scenario


def settled(scenario: Scenario) -> Scenario:
    """Return the scenario with the spacing and size that its window's detail comes to; ScenarioError where nothing tells them."""
    if scenario.window is None or scenario.window.detail is None or scenario.run.detail != "window":
        return scenario
    from scenarios.setup.at_sea.window_choice import chosen  # only such a run pays for particles

    return chosen(scenario, scenario.window)
