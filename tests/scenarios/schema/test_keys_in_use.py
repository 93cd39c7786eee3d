"""Each key of scenario files is needed by a shipped exercise or by an example of the guides, and these examples are right."""

from __future__ import annotations

import tomllib
from itertools import pairwise
from pathlib import Path

import pytest

from scenarios.schema.parsing.quantity_fields import field_kinds
from scenarios.schema.parsing.structuring import structure
from scenarios.spec.load import library_paths, load_scenario
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import ScenarioError
from tests.docs.guide import DOCS, blocks, commands
from tests.scenarios.schema.keys_in_use import documented, keys_of_schema, keys_used_by, shipped

PAGES = sorted(page for page in DOCS.rglob("*.md"))


def test_no_key_is_without_a_use() -> None:
    assert keys_of_schema() - shipped() - documented() == set()


def test_most_keys_are_in_a_shipped_exercise() -> None:
    assert len(keys_of_schema() - shipped()) <= 27


def test_a_key_in_a_level_or_an_order_or_under_another_unit_is_used() -> None:
    found = keys_used_by("[levels.hard]\nsea.wind.speed_kn = 9.0\n", "oilsim order RUN ties.one.made_fast=true")
    assert ("SteadyFlow", "speed") in found and ("TieSettings", "made_fast") in found
    assert ("SteadyFlow", "direction") not in found


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_tables_of_a_page_are_right(page: Path) -> None:
    """Each table by itself: what it lacks or refers to may stand elsewhere in the reader's file."""
    kinds = field_kinds(Scenario)
    for block in blocks(page, "toml"):
        data = tomllib.loads(block.text)
        for table in data.keys() & kinds.keys():
            try:
                structure(data[table], kinds[table])
            except ScenarioError as error:
                assert all(problem.text.startswith("is missing") for problem in error.problems), str(error)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_changes_of_the_commands_of_a_page_are_right(page: Path) -> None:
    for name, *arguments in commands(page):
        if name == "run" and arguments[0] in library_paths():
            changes = [value for option, value in pairwise(arguments) if option == "--set"]
            load_scenario(arguments[0], overrides=changes, demo="--demo" in arguments)
