"""Without the packages of an extra oilsim runs what needs none of them, and names the extra for the rest."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from scenarios.cli import EXTRAS

ROOT = Path(__file__).parents[2]
WITHOUT = """
import sys


class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {packages}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)


sys.meta_path.insert(0, Missing())
from scenarios.cli import main

sys.exit(main(sys.argv[1:]))
"""


def without(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a command in a Python that has none of the packages."""
    text = WITHOUT.format(packages=repr(set(EXTRAS) | {"pythonfmu", "pythonfmu3"}))
    return subprocess.run(
        [sys.executable, "-c", text, *arguments], cwd=ROOT, capture_output=True, text=True, check=False
    )


def test_a_scenario_without_fmus_needs_no_extra() -> None:
    ran = without("check", "floating-box")
    assert ran.returncode == 0, ran.stderr


@pytest.mark.parametrize(
    "command",
    [
        ("check", "docs/fmus/winch-tow.toml"), ("signals", "docs/fmus/winch-tow.toml"),
        ("build-fmu", "docs/fmus/tow_winch.py", "-o", "{}/winch.fmu"),
        ("export-fmu", "floating-box", "-o", "{}/box.fmu"),
    ],
)  # fmt: skip
def test_fmus_name_the_extra_that_they_need(command: tuple[str, ...], tmp_path: Path) -> None:
    ran = without(*(word.format(tmp_path) for word in command))
    assert (ran.returncode, ran.stderr) == (
        2,
        "oilsim: fmpy is not installed, needed for FMUs: pip install 'oilsim[fmu]'\n",
    )
    assert list(tmp_path.iterdir()) == []
