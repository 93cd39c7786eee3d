"""No command writes over what it reads or else writes, however the paths are spelled, and no run over another."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest
import trimesh

from recordings.files.writing import held
from scenarios.cli import main
from scenarios.running.output_paths import checkpoint_folder
from scenarios.running.summary import SummaryObserver

QUICK = ["--set", "fluid.particle_spacing=0.1", "--threads", "1"]
SCENARIO = """
name = "mine"
[run]
duration = 0.02
[fluid]
particle_spacing = 0.1
[phases.water]
density = 1000.0
dynamic_viscosity = 1e-3
[tank]
lower = [0.0, 0.0, 0.0]
upper = [0.8, 0.8, 0.8]
[fill.pool]
shape = "slab"
phase = "water"
bottom = 0.0
top = 0.3
[bodies.rock]
shape = "mesh"
file = "rock.stl"
position = [0.4, 0.4, 0.6]
density = 500.0
"""

REFUSALS = "the same as .* allowed|recording to repair itself, allowed|allowed: a name that ends with .rrd|not a run to continue, allowed"


@pytest.fixture(scope="module")
def begun(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a scenario, its mesh, the recording ``me.rrd`` of a run, and its checkpoints."""
    folder = tmp_path_factory.mktemp("begun")
    trimesh.creation.box((0.3, 0.3, 0.3)).export(folder / "rock.stl")
    (folder / "mine.toml").write_text(SCENARIO)
    assert main(["run", str(folder / "mine.toml"), *QUICK, "--record", str(folder / "me.rrd")]) == 0
    (folder / "cut.rrd").write_bytes((folder / "me.rrd").read_bytes()[:-4000])
    (folder / "link.rrd").symlink_to("me.rrd")
    (folder / "twin.rrd").hardlink_to(folder / "me.rrd")
    (folder / "sub").mkdir()
    return folder


def contents(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


@pytest.mark.parametrize(
    "arguments",
    [
        "compare me.rrd me.rrd --to {here}/me.rrd",
        "compare me.rrd link.rrd --to sub/../link.rrd",
        "repair cut.rrd --to sub/../cut.rrd",
        "export me.rrd --netcdf twin.rrd --site 0,0",
        "run mine.toml --record mine.toml",
        "run mine.toml --record new.rrd --summary new.rrd",
        "run mine.toml --record new.rrd --summary rock.stl",
        "run mine.toml --no-record --summary mine.toml",
        "run mine.toml --record new.rrd --summary sub/../new.png --picture new.png",
        "run mine.toml --record me.v2",
        "run --resume me.rrd --until 1 --record {here}/me.rrd",
        "run --resume me.rrd --until 1 --record link.rrd",
        "run --resume me.rrd --until 1 --record twin.rrd",
        "run --resume me.checkpoints --until 1 --record me.rrd",
        "run --resume me.checkpoints --until 1 --record me.rrd --checkpoints sub",
        "run --resume me.checkpoints/step-000000000.npz --until 1 --record me.rrd",
        "run --resume me.rrd --until 1 --record new.rrd --checkpoints me.checkpoints",
        "run --resume me.rrd --until 1 --no-record --checkpoints sub/../me.checkpoints",
        "run --resume me.rrd mine.toml --until 1 --record new.rrd --summary mine.toml",
        "run --resume me.v2",
        "export-fmu mine.toml -o mine.toml",
        "export-fmu mine.toml -o rock.stl",
        "build-fmu model.py -o model.py",
    ],
)
def test_what_would_be_written_over_is_refused_and_stays(
    begun: Path, arguments: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(begun)
    (begun / "model.py").touch()
    before = contents(begun)
    assert main(arguments.format(here=begun).split()) == 2
    assert re.search(REFUSALS, capsys.readouterr().err)
    assert contents(begun) == before


def test_a_recording_that_another_run_writes_is_refused_by_name(
    begun: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Checkpoints of the run under way stay too, even if the new run may replace files."""
    monkeypatch.chdir(begun)
    before = contents(begun)
    for name in ("me.rrd", "other.rrd"):
        with held(Path(name)):
            assert main(["run", "mine.toml", *QUICK, "--record", name]) == 2
            assert f"recording {name}: is being written by another run" in capsys.readouterr().err
    with held(Path("me.checkpoints")):
        assert main(["run", "mine.toml", *QUICK, "--no-record", "--overwrite", "--checkpoints", "me.checkpoints"]) == 2
        assert "me.checkpoints: is being written by another run" in capsys.readouterr().err
    assert contents(begun) == before


def test_the_recording_is_held_while_a_run_writes_it(
    begun: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A second run that begins in the middle of the first one is refused; and after the first one it is not."""
    record, codes = str(tmp_path / "run.rrd"), []
    step_completed = SummaryObserver.step_completed

    def intrude(self: SummaryObserver, frame: object) -> None:
        monkeypatch.setattr(SummaryObserver, "step_completed", step_completed)
        codes.append(main(["run", str(begun / "mine.toml"), "--record", record]))
        step_completed(self, frame)  # type: ignore[arg-type]

    monkeypatch.setattr(SummaryObserver, "step_completed", intrude)
    assert main(["run", str(begun / "mine.toml"), "--record", record]) == 0
    assert codes == [2]
    assert main(["run", str(begun / "mine.toml"), "--record", record, "--overwrite"]) == 0


def test_a_branch_takes_no_name_whose_checkpoints_are_there(begun: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(begun)
    kept = begun / "me-from-0.02s.checkpoints"
    kept.mkdir()
    assert main(["run", "--resume", "me.rrd", "--until", "0.04"]) == 0
    assert (begun / "me-from-0.02s-2.rrd").is_file()
    assert checkpoint_folder(begun / "me-from-0.02s-2.rrd").is_dir()
    assert not list(kept.iterdir())


def test_a_comparison_writes_over_no_file(
    begun: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Neither over another recording, nor over an earlier comparison; without a name it takes a free one."""
    monkeypatch.chdir(tmp_path)
    for screen in ("DISPLAY", "WAYLAND_DISPLAY"):  # no viewer opens
        monkeypatch.delenv(screen, raising=False)
    for name in ("a.rrd", "other.rrd", "a-and-a.rrd"):
        shutil.copy(begun / "me.rrd", name)
    before = contents(tmp_path)
    assert main(["compare", "a.rrd", "a.rrd", "--to", "other.rrd"]) == 2
    assert "--to is 'other.rrd', which is there already; allowed: another name" in capsys.readouterr().err
    assert main(["compare", "a.rrd", "a.rrd", "--overwrite"]) == 2
    assert "--overwrite is given, allowed: only with --to" in capsys.readouterr().err
    assert contents(tmp_path) == before
    assert main(["compare", "a.rrd", "a.rrd", "--to", "other.rrd", "--overwrite"]) == 0
    assert Path("other.rrd").read_bytes() != before[tmp_path / "other.rrd"]
    main(["compare", "a.rrd", "a.rrd"])
    assert Path("a-and-a.rrd").read_bytes() == before[tmp_path / "a-and-a.rrd"]
    assert Path("a-and-a-2.rrd").is_file()


def test_a_second_run_writes_over_no_earlier_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    short = ["run", "still-column", "--set", "fluid.particle_spacing=0.1", "--until", "0.02", "--threads", "1"]
    assert main(short) == 0
    kept = Path("still-column.rrd").read_bytes()
    assert main([*short, "--summary", "one.json"]) == 0
    assert Path("still-column-2.rrd").is_file() and Path("still-column.rrd").read_bytes() == kept
    assert main([*short, "--record", "still-column.rrd"]) == 2
    assert main([*short, "--summary", "one.json"]) == 2
    assert main([*short, "--record", "new.rrd", "--checkpoints", "still-column.checkpoints"]) == 2
    assert Path("still-column.rrd").read_bytes() == kept and not Path("new.rrd").exists()
    assert main([*short, "--record", "still-column.rrd", "--overwrite"]) == 0
    assert Path("still-column.rrd").read_bytes() != kept
