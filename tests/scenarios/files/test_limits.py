"""What is nested, large, damaged or cannot be written is refused in words, before any work and by every command alike."""

from __future__ import annotations

from pathlib import Path

import pytest

from coupling.solids.bodies import box
from scenarios.cli import main
from scenarios.running.output_paths import require_writable
from scenarios.sweeps.variants import MANY_RUNS, MOST_RUNS
from scenarios.text.toml import DEEPEST, read_toml

ROOT = Path(__file__).parents[3]
NOWHERE = "/proc/self/nowhere"  # in which nobody can make a file or folder, not even root
DEEP = ".".join(["a"] * 3000)


@pytest.mark.parametrize(
    ("command", "told"),
    [
        (["check", "floating-box", "--set", f"probes.{DEEP}=1"], "has a key of 3001 parts"),
        (["check", "floating-box", "--set", f"probes.a={'[' * 3000}"], "probes.a"),
        (["sweep", "floating-box", "--vary", f"{DEEP}=1,2"], "has a key of 3000 parts"),
        (
            ["sweep", "floating-box", "--range", "bodies.box.density=100:200", "--runs", "10000000000"],
            f"the sweep has 10,000,000,000 runs, allowed: up to {MOST_RUNS:,}",
        ),
        (["oils", "maya", "--temperature", "nan", "--refused"], "--temperature is nan"),
        (["new", "j-sweep-skimmer", "--to", f"{NOWHERE}.toml"], f"--to is '{NOWHERE}.toml', which cannot be written"),
        (["export-fmu", "floating-box", "-o", f"{NOWHERE}.fmu"], "--output is"),
        (["build-fmu", str(ROOT / "docs/fmus/autopilot.py"), "-o", f"{NOWHERE}.fmu"], "--output is"),
        (["debrief", "run.rrd", "--out", NOWHERE], "--out is"),
        (["report", "run.rrd", "--csv", NOWHERE], "--csv is"),
        (["export", "run.rrd", "--vtk", NOWHERE], "--vtk is"),
        (["export", "run.rrd", "--netcdf", f"{NOWHERE}.nc", "--site", "60,5"], "--netcdf is"),
        (["compare", "run.rrd", "other.rrd", "--to", f"{NOWHERE}.rrd"], "--to is"),
        (["sweep", "floating-box", "--vary", "bodies.box.density=400", "--to", NOWHERE], "--to is"),
        (["run", "floating-box", "--record", f"{NOWHERE}.rrd"], "--record is"),
        (["run", "floating-box", "--no-record", "--summary", f"{NOWHERE}.json"], "--summary is"),
        (["conduct", "sweep-200m", "--record", f"{NOWHERE}.rrd"], "--record is"),
    ],
)  # fmt: skip
def test_refused_before_any_work(
    command: list[str], told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(command) == 2
    assert told in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_large_sweep_is_refused_at_its_first_fault(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    few, many = range(-3, 0), range(-3, MANY_RUNS)
    for densities, faults in ((few, 3), (many, 1)):
        assert main(["sweep", "floating-box", "--vary", f"bodies.box.density={','.join(map(str, densities))}"]) == 2
        assert capsys.readouterr().err.count("bodies.box.density is -") == faults


def test_a_folder_that_is_tried_leaves_no_trace(tmp_path: Path) -> None:
    require_writable({"--file": tmp_path / "a.csv"}, {"--to": tmp_path / "one" / "two"})
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("opening", ["a = " + "[" * DEEPEST + "]" * DEEPEST, f"{DEEP} = 1", f"[{DEEP}]\nb = 1"])
def test_texts_that_are_nested_too_deeply_are_refused(opening: str) -> None:
    with pytest.raises(ValueError, match="nested too deeply"):
        read_toml(opening)


def test_words_of_foreign_libraries_stay_away(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """A text STL with a normal that is no number: its triangles are read by another way, and nobody sees how."""
    lines = ["solid cube"]
    for number, corners in enumerate(box((0.4, 0.4, 0.4)).triangles):
        lines += [f"facet normal {'0 0 x' if number == 3 else '0 0 1'}", "outer loop"]
        lines += [f"vertex {' '.join(map(str, corner))}" for corner in corners]
        lines += ["endloop", "endfacet"]
    mesh = tmp_path / "cube.stl"
    mesh.write_text("\n".join([*lines, "endsolid"]))
    body = f"bodies.box={{shape='mesh', file='{mesh}', density=400.0, position=[0.45, 0.45, 0.45]}}"
    assert main(["check", "floating-box", "--set", body]) == 0
    said = capfd.readouterr()
    assert "Traceback" not in said.out + said.err
