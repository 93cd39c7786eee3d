"""Numbers in the place of words: a scenario whose windows have a `detail` is settled before it is run; others as they are.

Windows end at the bottom of their sea, and water too shallow for their particles is refused here, so that a check says what a run does.
"""

from __future__ import annotations

from dataclasses import replace

from scenarios.problems import Problem, ScenarioError
from scenarios.scenario import Scenario
from scenarios.schema.window import WindowTable, window_place
from scenarios.setup.at_sea.particle_free import sea_of

# [1] layers of water that a window needs; numerical; as its own depth
LEAST_LAYERS = 4


def settled(scenario: Scenario) -> Scenario:
    """Return the scenario with the spacings and sizes that its windows' details come to; ScenarioError where nothing tells them.

    Also ScenarioError for a sea that is too shallow for the particles of a window.
    """
    if scenario.run.detail != "window":
        return scenario
    if not all(_is_settled(one) for one in scenario.window.values()):
        from scenarios.setup.at_sea.window_choice import chosen  # only such a run pays for particles

        scenario = chosen(scenario)
    return _above_the_bottom(scenario, sea_of(scenario).depth or 0.0)


def _is_settled(window: WindowTable) -> bool:
    return window.size is not None and window.depth is not None and not isinstance(window.detail, str)


def _above_the_bottom(scenario: Scenario, depth: float) -> Scenario:
    """Return the scenario with windows no deeper than the sea [m]; ScenarioError with each window whose particles find too few layers."""
    problems = []
    for name, table in scenario.window.items():
        spacing = table.spacing(scenario.fluid)
        if depth < LEAST_LAYERS * spacing:
            key = "fluid.particle_spacing" if table.detail is None else f"{window_place(name, scenario.window)}.detail"
            text = f"is {spacing:g} m, allowed in a window on water {depth:g} m deep: up to a quarter of that"
            problems.append(Problem(key, text))
    if problems:
        raise ScenarioError(problems, scenario.name)
    deep = {name: one for name, one in scenario.window.items() if one.depth is not None and one.depth > depth}
    ended = {name: replace(one, depth=depth) for name, one in deep.items()}
    return replace(scenario, window=dict(scenario.window) | ended) if ended else scenario
