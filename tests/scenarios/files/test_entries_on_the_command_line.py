"""Entries that the command line changes: named as they were written, once each."""

from __future__ import annotations

import subprocess
import sys

import pytest

from scenarios.cli import main


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (
            ["--set", "vessels.prot.engine=stopped", "--set", "vessels.prot.hauled=1"],
            "--set vessels.prot.engine names 'prot', which is no entry of vessels, did you mean 'port'? allowed: port, starboard",
        ),
        (
            ["--set", "moorings.bow.holding=1"],
            "--set moorings.bow.holding names 'bow', which is no entry of moorings, allowed: none is defined",
        ),
        (["--until", "-3"], "--until is -3.0, allowed: 1e-06 or more and at most 1e+08 s"),
        (["--threads", "0"], "--threads is 0, allowed: 1 or more and at most 1024"),
        (["--seed", "-1"], "--seed is -1, allowed: 0 or more"),
    ],
)
@pytest.mark.parametrize("command", ["check", "run"])
def test_a_change_that_cannot_be_is_said_once_at_its_option(
    command: str, arguments: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([command, "u-sweep", *arguments]) == 2
    head, *problems = capsys.readouterr().err.splitlines()
    assert head.endswith(": 1 problem") and [problem.strip() for problem in problems] == [told]


def test_a_reader_that_has_seen_enough_ends_the_command_in_order() -> None:
    command = f"{sys.executable} -m scenarios.cli list 2>&1 | head -1; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True)
    assert done.returncode == 0 and len(done.stdout.splitlines()) == 1


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--set", "tow.speed=1", "--set", "tow.speed=2"], "tow.speed is given twice, the last counts"),
        (["--set", "tow.speed=1", "--set", "tow.speed_kn=2"], "tow.speed_kn counts, not tow.speed"),
        (["--until", "2", "--set", "run.duration=1"], "--until counts, not run.duration"),
        (["--until", "1", "--until", "2"], "--until is given twice, the last counts"),
        (["--level", "easy", "--level=hard"], "--level is given twice, the last counts"),
    ],
)
def test_what_is_given_twice_is_told(arguments: list[str], told: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "u-sweep", *arguments]) == 0
    assert capsys.readouterr().err == f"oilsim: {told}\n"
