"""Scenario files as editors save them, and what a file that cannot be read is told to have."""

from __future__ import annotations

from pathlib import Path

import pytest

from scenarios.spec.load import load_scenario
from scenarios.text.problems import ScenarioError
from scenarios.text.toml import read_toml
from tests.scenarios.files.test_load import SMALL


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_file_loads_with_a_mark_and_with_the_line_ends_of_windows(encoding: str, end: str, tmp_path: Path) -> None:
    path = tmp_path / "small.toml"
    path.write_bytes(SMALL.replace("\n", end).encode(encoding))
    assert load_scenario(path).scenario.name == "small"


@pytest.mark.parametrize(
    "content", [SMALL.encode("utf-16"), SMALL.encode("utf-16-le"), b"\x00\x01", b"\x89PNG\xff\xfe"]
)
def test_a_file_in_another_encoding_is_told_how_to_be_saved(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "small.toml"
    path.write_bytes(content)
    with pytest.raises(ScenarioError, match="cannot be read: it is not text in UTF-8, allowed: save it as UTF-8"):
        load_scenario(path)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            "[run]\nduration = 1\n duration = 2 # again\n",
            "line 3 gives the key 'duration' a second time, allowed: once",
        ),
        ("[run]\na = 1\n[run]\n", "line 3 gives the table [run] a second time, allowed: once"),
        ("a = {x = 1, x = 2}", "line 1 gives the key 'x' a second time, allowed: once"),
        ('a = 1\nname = "abc\nb = 2\n', "line 2 opens a quote that is not closed"),
        ("a = 1\nname = 'abc\nb = 2\nc = 3\n", "line 2 opens a quote that is not closed"),
        ('a = 1\nname = """abc\nb = 2\nc = 3\n', "line 2 opens a quote that is not closed"),
        ("a = 1\nb = \n", "Invalid value (at line 2, column 5)"),
    ],
)
def test_a_fault_of_a_file_is_said_with_its_line(text: str, told: str) -> None:
    with pytest.raises(ValueError) as error:
        read_toml(text)
    assert str(error.value).startswith(told)
