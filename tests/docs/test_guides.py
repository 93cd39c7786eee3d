"""Each guide is followed: its commands and its code run as they stand, with coarser particles and shorter times."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from recordings.pictures import picture
from scenarios.cli import command_parser, main
from scenarios.debrief import key_moments
from tests.docs.guide import DOCS, ROOT, blocks, commands, shortened, write_files

OPEN_A_WINDOW = ("replay", "--live")
COARSE = ["--set", "fluid.maximum_time_step=0.02", "--threads", "1"]
SCENE_WIDTH = 240  # [pixels]: pictures of large particles take most of the time of a debrief
TRAINER = {
    "8": "0.06",
    "u-sweep-from-8s.rrd": "u-sweep-from-0.06s.rrd",
    "30": "0.14",
    "tow.speed_kn=0.3,0.5,0.7": "tow.speed_kn=0.3,0.5",
    "tests/benchmarks/small-sweep.toml": str(ROOT / "tests/benchmarks/small-sweep.toml"),
    "tow.speed_kn=0.6,0.8,1.0,1.2": "tow.speed_kn=0.6,1.2",
    "phases.oil.density=860,920,980": "phases.oil.density=860,980",
    "12": "4",
}


def follow(calls: list[list[str]]) -> None:
    """Run the commands in this process; those that need a screen are only parsed."""
    for arguments in calls:
        command_parser().parse_args(arguments)
        if not any(word in OPEN_A_WINDOW for word in arguments):
            assert main(arguments) == 0, f"oilsim {' '.join(arguments)}"


def made_small(arguments: list[str], spacing: str = "0.16") -> list[str]:
    """A run, a sweep or an exported exercise of `u-sweep`, coarse and short; a comparison without a screen."""
    if arguments[0] in ("run", "sweep", "export-fmu") and arguments[1] == "u-sweep":
        coarse = [*arguments, "--set", f"fluid.particle_spacing={spacing}", *COARSE]
        return coarse if arguments[0] == "export-fmu" else [*coarse, "--demo", "--until", "0.1"]
    if arguments[0] == "compare":
        return [*arguments, "--table"]  # without the viewer
    return arguments


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_trainers_guide(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    guide = DOCS / "guides" / "trainer.md"
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(key_moments, "_WIDTH", SCENE_WIDTH)
    monkeypatch.setattr(picture, "_SCENE_WIDTH", SCENE_WIDTH)
    write_files(guide, tmp_path)
    calls = [made_small(call, "0.2") for call in shortened(commands(guide), TRAINER)]
    cut = next(number for number, call in enumerate(calls) if call[0] == "repair")
    follow(calls[:cut])
    whole = Path("u-sweep.rrd").read_bytes()
    Path("cut.rrd").write_bytes(whole[: len(whole) * 3 // 4])
    follow(calls[cut:])
    left = {
        "u-sweep.json", "u-sweep.png", "u-sweep-debrief/debrief.html", "strict/debrief.html", "tables", "oil.nc", "slick.geojson", "film",
        "u-sweep-from-0.06s.rrd", "cut.repaired.rrd", "u-sweep-sweep/sweep.csv", "crate.rrd",
    }  # fmt: skip
    assert {name for name in left if not Path(name).exists()} == set()


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_fmu_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = DOCS / "fmus" / "README.md"
    shutil.copytree(page.parent, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    follow([[*made_small(call), *(["--until", "0.1"] if call[0] == "run" else [])] for call in commands(page)])
    assert {"tow-winch.fmu", "autopilot.fmu", "squall.fmu", "u-sweep.fmu"} <= {path.name for path in tmp_path.iterdir()}
    for arguments in shortened(commands(page, "fmpy"), {"1": "0.04"}):
        host = _ended([sys.executable, "-m", "fmpy", *arguments])
        assert host.returncode == 0, host.stderr


def _ended(command: list[str], tries: int = 3) -> subprocess.CompletedProcess[str]:
    """A program that has ended; one that glibc ended after its work (known-errors.md, "Numbers and processes") starts again."""
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=500)
    again = done.returncode == -signal.SIGABRT and "corrupted double-linked list" in done.stderr and tries > 1
    return _ended(command, tries - 1) if again else done


def test_code_of_the_engineers_guide() -> None:
    """In a process of its own: the guide's pybullet client is the first one."""
    examples = blocks(DOCS / "guides" / "engineer.md", "python")
    assert len(examples) >= 3, "the guide has its examples: each runs, or this test fails with its error"
    code = "\n".join(block.text for block in examples)
    subprocess.run([sys.executable, "-W", "ignore::UserWarning", "-c", code], cwd=ROOT, check=True, timeout=250)


def test_testers_commands() -> None:
    lines = [line for block in blocks(DOCS / "guides" / "tester.md", "sh") for line in block.text.splitlines()]
    own = [line for line in lines if line.startswith("python ")]
    assert own
    for line in own:
        _, *arguments = line.split("#")[0].split()
        subprocess.run([sys.executable, *arguments], cwd=ROOT, check=True, timeout=250)
