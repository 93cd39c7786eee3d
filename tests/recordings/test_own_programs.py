"""No program that is started beside a run takes its modules from the folder that is current."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from coupling.fmu.export import FmuContent, export_fmu
from coupling.fmu.fmu_participant import FmuParticipant
from coupling.fmu.scalar_model import MODEL_FILE
from recordings.files.writing import module_command, module_environment

ROOT = Path(__file__).parents[2]
PACKAGES = ("oilsim", "coupling", "recordings", "booms", "vessels", "scenarios")
STARTERS = {"os.system", "os.popen", "os.execv", "os.spawnv"}
TRAP = 'from pathlib import Path\nPath(__file__).with_name("HIJACKED").touch()\nraise ImportError("from the current folder")\n'


@pytest.fixture
def trap(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with modules by names that helpers import, made the current one."""
    folder = tmp_path / "current"
    folder.mkdir()
    for name in ("numpy", "fmpy", "pythonfmu", "pythonfmu3", "rerun", "recordings", "coupling", "json", "uuid"):
        (folder / f"{name}.py").write_text(TRAP)
    monkeypatch.chdir(folder)
    return folder


def test_a_module_is_found_where_this_program_found_it(trap: Path) -> None:
    command = module_command("recordings.sink.live_feed")
    done = subprocess.run(command, env=module_environment(["", *sys.path]), capture_output=True, text=True)
    assert "IndexError" in done.stderr  # it began, and misses its arguments
    assert not (trap / "HIJACKED").exists()


@pytest.mark.parametrize("version", [2, 3])
def test_fmus_are_built_and_rehearsed_with_nothing_from_the_current_folder(version: int, trap: Path) -> None:
    fmu = trap.parent / "squall.fmu"
    content = FmuContent(
        identifier="Squall",
        factory="coupling.fmu.scalar_model:model_in_folder",
        description="a squall",
        step_size=0.02,
        stop_time=1.0,
        files={MODEL_FILE: ROOT / "docs" / "fmus" / "squall.py"},
    )
    export_fmu(content, fmu, version)  # type: ignore[arg-type]
    FmuParticipant("squall", fmu).rehearse()
    assert not (trap / "HIJACKED").exists()


def test_every_python_program_is_started_by_one_function() -> None:
    """Whoever started Python otherwise would have to think of the current folder again."""
    others = []
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
            calls = {ast.unparse(node) for node in nodes if isinstance(node, ast.Attribute)}
            options = {node.value for node in nodes if isinstance(node, ast.Constant)} & {"-m", "-c"}
            if path.name != "writing.py" and (options or calls & STARTERS):
                others.append(path)
    assert others == []
