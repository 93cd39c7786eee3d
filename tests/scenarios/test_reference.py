"""The page on the scenario format says what the program does: it is the generated one, and its examples run."""

from __future__ import annotations

import re
import tomllib
from dataclasses import fields
from pathlib import Path

from docs.scenario_keys import CHAPTERS, reference
from scenarios.running.assembly import build
from scenarios.schema.parsing.quantity_fields import Section
from scenarios.spec.load import scenario_from
from scenarios.spec.scenario import Scenario

PAGE = Path(__file__).parents[2] / "docs" / "scenarios.md"


def example(language: str) -> str:
    found = re.search(rf"```{language}\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert found is not None
    return found[1]


def test_page_is_up_to_date() -> None:
    assert PAGE.read_text(encoding="utf-8") == reference() + "\n", (
        "run python docs/scenario_keys.py > docs/scenarios.md"
    )


def test_page_describes_every_section() -> None:
    def kinds(section: type[Section]) -> set[type[Section]]:
        return {section} | {kind for child in section.__subclasses__() for kind in kinds(child)}

    leaves = {kind for kind in kinds(Section) if not kind.__subclasses__()}
    described = {section for _, sections in CHAPTERS for section in sections}
    assert {kind.__name__ for kind in leaves - described} == {"Scenario", "SeaSpec"}
    assert {item.name for item in fields(Scenario)} >= {table.split(".")[0] for table, _ in CHAPTERS}


def test_examples_say_the_same_and_run() -> None:
    """One step of the scenario, coarser; the ball starts to fall."""
    names: dict[str, object] = {"__name__": "example"}
    exec(compile(example("python"), str(PAGE), "exec"), names)
    data = tomllib.loads(example("toml"))
    assert scenario_from(data) == names["scenario"]
    coarse = data | {"fluid": {"particle_spacing": 0.1}, "run": {"duration": 0.01, "threads": 1}}
    assembly = build(scenario_from(coarse))
    simulation = assembly.co_simulation()
    simulation.initialize()
    simulation.step()
    assert assembly.world is not None
    assert assembly.world.twist("ball")[2] < 0.0
