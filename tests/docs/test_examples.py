"""Every script of `examples/` runs by itself, prints what it learnt beside its formula, and leaves its picture."""

from __future__ import annotations

import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

from tests.docs.guide import DOCS, ROOT

SCRIPTS = {path.stem: path for path in sorted((ROOT / "examples").glob("*.py"))}
SLOW = (
    "arm_that_pours",
    "boat_with_thrusters",
    "boom_in_current",
    "fault_test",
    "fmu_in",
    "fmu_out",
    "moored_buoy",
    "water_in_pybullet",
)  # over 5 s
LEARNT = re.compile(r": ([-\d.]+)[^;]*; [^:]+: ([-\d.]+).* within ([\d.]+)")
LONGEST = 75  # lines of a script
LARGEST = 60_000  # bytes of a picture in the documentation


def test_there_are_ten() -> None:
    assert len(SCRIPTS) == 10


@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.slow if n in SLOW else ()) for n in SCRIPTS])
def test_example_runs_and_is_right(name: str, tmp_path: Path) -> None:
    paths = {"PYTHONPATH": str(ROOT), "MPLBACKEND": "Agg"}
    done = subprocess.run(
        [sys.executable, str(SCRIPTS[name])], cwd=tmp_path, env=os.environ | paths, capture_output=True, text=True, check=False
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    learnt = [tuple(map(float, found)) for found in LEARNT.findall(done.stdout)]
    assert learnt, f"{name} prints no number beside its formula: {done.stdout}"
    assert all(abs(measured - expected) <= within for measured, expected, within in learnt)
    with Image.open(tmp_path / f"{name}.png") as picture:
        shades = picture.convert("L").getextrema()
    assert shades[1] - shades[0] > 100, f"the picture of {name} is empty"


@pytest.mark.parametrize("name", SCRIPTS)
def test_example_is_short_and_uses_public_names_only(name: str) -> None:
    text = SCRIPTS[name].read_text(encoding="utf-8")
    assert len(text.splitlines()) <= LONGEST
    own = re.findall(
        r"^ *from ((?:oilsim|coupling|booms|vessels|recordings|scenarios)[\w.]*) import", text, re.MULTILINE
    )
    assert set(own) <= {"oilsim", "coupling", "coupling.testkit", "recordings", "scenarios"}


def test_page_of_examples_is_up_to_date() -> None:
    written = runpy.run_path(str(DOCS / "examples.py"), run_name="examples")["examples_page"]()
    assert (DOCS / "examples.md").read_text(encoding="utf-8") == written, "run python docs/examples.py"


@pytest.mark.parametrize("name", SCRIPTS)
def test_page_has_a_small_picture(name: str) -> None:
    assert 3_000 < (DOCS / "pictures" / "examples" / f"{name}.jpg").stat().st_size < LARGEST
