"""The `oilsim` command: what it prints, its exit codes, and what it does not import."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

import recordings.pictures.picture
from recordings.frame import Event, Frame, RunDescription
from recordings.replay.recording import Replay
from recordings.sink.recorder import Recorder
from scenarios.cli import main
from scenarios.load import library_paths, load_scenario
from scenarios.text.terminal import flowing

QUICK = ["--set", "fluid.particle_spacing=0.1", "--set", "run.duration=0.02", "--threads", "1"]


def test_list_names_every_scenario_and_oil(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list"]) == 0
    text = capsys.readouterr().out
    assert all(name in text for name in library_paths())
    assert "bunker-c" in text


def test_new_copies_an_exercise_with_comments(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "mine.toml"
    assert main(["new", "u-sweep", "--to", str(path)]) == 0
    copy, original = load_scenario(path), load_scenario("u-sweep")
    assert replace(copy.scenario, name="u-sweep") == original.scenario
    assert copy.text.count("\n# ") >= 10
    assert main(["new", "u-sweep", "--to", str(path)]) == 2
    assert "which is there already" in capsys.readouterr().err


def test_compare_says_that_unrelated_runs_have_no_score_in_common(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, probe in (("one", "probes/gauge"), ("other", "probes/ball/x")):
        with Recorder(tmp_path / f"{name}.rrd", frame_rate=1.0) as recorder:
            recorder.initialized(RunDescription(name=f"{name}-scene", particle_spacing=0.1))
            recorder.step_completed(Frame(index=0, time=0.0, scalars={probe: 1.0}))
            recorder.event(Event(0.0, "leaks", "warning", f"boom {name}"))
    assert main(["compare", str(tmp_path / "one.rrd"), str(tmp_path / "other.rrd"), "--table"]) == 0
    said = capsys.readouterr().out
    assert said.startswith("one.rrd (one-scene) and other.rrd (other-scene) have no score in common\n")
    assert "boom one: leaks" in said and "boom other: leaks" in said


@pytest.mark.parametrize("name", sorted(library_paths()))
def test_check_says_what_a_scenario_costs(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", name, "--demo"]) == 0
    text = capsys.readouterr().out
    assert "memory" in text
    assert "threads" in text


@pytest.mark.parametrize(
    "arguments",
    [
        ["check", "no-such-scenario"],
        ["check", "calm-spread", "--set", "fluid.particle_spacing=-1"],
        ["run", "calm-spread", "--no-record", "--until", "-1"],
        ["run", "calm-spread", "--no-record", "--threads", "0"],
        ["run", "calm-spread", "--no-record", "--picture", "x.png"],
        ["run", "calm-spread", "--no-record", "--live"],
        ["run", "calm-spread", "--record", "no/such/folder/x.rrd"],
        ["run", "calm-spread", "--no-record", "--summary", "/proc/x.json"],
        ["run", "calm-spread", "--record", "/tmp/x.rrd", "--picture", "x.xyz"],
        ["run", "calm-spread", "--record", "/tmp/x.rrd", "--picture", "x"],
        ["run", "calm-spread", "--no-record", "--threads", "100000"],
        ["run", "--resume", "x.rrd", "--demo"],
        ["report", "x.rrd", "--csv", "x", "--tracks", "oil", "--ids", "-1"],
        ["report", "x.rrd", "--csv", "x", "--tracks", "oil", "--ids", "3,99999999999"],
        ["replay", "no-such-file.rrd"],
    ],
)
def test_bad_input_ends_with_2_and_says_what_is_allowed(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    said = capsys.readouterr().err
    assert "allowed" in said or "does not exist" in said


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ("report x.rrd --csv t --ids 5 --every 1", ("--ids is given, allowed: only with --tracks", "--every is")),
        (
            "export x.rrd --vtk v --lost-only --site 1,2 --bearing 0 --start 2026-05-01",
            ("--lost-only is given, allowed: only with --netcdf", "--site is", "--bearing is", "--start is"),
        ),
        ("export x.rrd --geojson g --lost-only", ("--lost-only is",)),
        (
            "export x.rrd --netcdf n --particles --start 2026-05-01",
            ("--particles is given, allowed: only with --geojson",),
        ),
    ],
)
def test_options_that_change_nothing_without_others_are_refused(
    arguments: str, told: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments.split()) == 2
    said = capsys.readouterr().err
    assert f"{len(told)} problem" in said and all(text in said for text in told)


def test_unknown_option_ends_with_2() -> None:
    with pytest.raises(SystemExit) as caught:
        main(["run", "calm-spread", "--recrod", "x.rrd"])
    assert caught.value.code == 2


def test_all_problems_of_a_file_are_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "bad.toml"
    file.write_text('name = "bad"\n[run]\nduration = -1\n[fluid]\nparticle_spacing = "x"\n[phases]\n[tank]\n')
    assert main(["check", str(file)]) == 2
    said = capsys.readouterr().err
    for path in ("run.duration", "fluid.particle_spacing", "tank.lower", "tank.upper", "phases"):
        assert path in said


def test_a_demo_that_a_scenario_does_not_have_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "plain.toml"
    file.write_text(library_paths()["two-layer"].read_text().partition("[demo]")[0])
    assert main(["check", str(file)]) == 0
    assert main(["check", str(file), "--demo"]) == 2
    assert (
        "demo is missing, but --demo asks for it; allowed: a table [demo], or a call without --demo"
        in capsys.readouterr().err
    )


def test_run_leaves_recording_and_summary_and_asks_for_the_picture(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The picture itself is tested where it is drawn; here, that it is drawn from a recording that is complete by then."""
    record, summary, picture = (tmp_path / f"run.{suffix}" for suffix in ("rrd", "json", "png"))
    drawn: list[tuple[str, Path]] = []
    monkeypatch.setattr(
        recordings.pictures.picture,
        "draw_picture",
        lambda source, target: drawn.append((Replay(source).end_reason, target)),
    )
    files = ["--record", str(record), "--summary", str(summary), "--picture", str(picture)]
    assert main(["run", "two-layer", *QUICK, *files]) == 0
    assert drawn == [("completed", picture)]
    result = json.loads(summary.read_text())
    assert result["ended"] == "completed"
    assert result["simulated_s"] == pytest.approx(0.02)
    assert result["overrides"] == ["fluid.particle_spacing=0.1", "run.duration=0.02", "run.threads=1"]


def test_a_summary_that_cannot_be_written_after_all_is_told_after_the_table(capsys: pytest.CaptureFixture[str]) -> None:
    """/dev/full takes no byte, and nobody knows before one is written: as a disk that fills during the run."""
    assert main(["run", "two-layer", *QUICK, "--no-record", "--summary", "/dev/full"]) == 1
    said = capsys.readouterr().err
    assert said.index("simulated") < said.index("the summary /dev/full cannot be written: No space left on device")


def test_a_picture_that_cannot_be_drawn_is_told_after_the_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(source: Path, target: Path) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(recordings.pictures.picture, "draw_picture", full)
    files = ["--record", str(tmp_path / "run.rrd"), "--picture", str(tmp_path / "run.png")]
    assert main(["run", "two-layer", *QUICK, *files]) == 1
    assert "cannot be drawn: [Errno 28] No space left on device" in " ".join(capsys.readouterr().err.split())


def test_words_of_a_scenario_are_shown_as_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Brackets and colons in titles and file names are no colours and no pictures."""
    monkeypatch.chdir(tmp_path)
    text = library_paths()["two-layer"].read_text().splitlines()
    text = ['title = "A [flume] in [/red] paint :sun:"' if line.startswith("title") else line for line in text]
    Path("words.toml").write_text("\n".join(text))
    assert main(["check", "words.toml"]) == 0
    assert "A [flume] in [/red] paint :sun:" in capsys.readouterr().out
    assert main(["signals", "words.toml"]) == 0
    record = "a[bold].rrd"
    assert main(["run", "words.toml", *QUICK, "--record", record]) == 0
    assert record in capsys.readouterr().err
    assert main(["compare", record, record, "--table"]) == 0
    assert "A: a[bold]" in capsys.readouterr().out


def test_recording_is_named_after_the_scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["run", "two-layer", *QUICK]) == 0
    assert (tmp_path / "two-layer.rrd").is_file()


def test_run_without_recording_imports_no_rerun_and_check_no_solver() -> None:
    """In a fresh interpreter: listing and checking load neither numba nor pybullet, and an unrecorded run no rerun."""
    code = f"""
import sys
from scenarios.cli import main
assert main(["check", "calm-spread"]) == 0
assert not {{"rerun", "numba", "pybullet", "trimesh", "fmpy"}} & set(sys.modules), "check loads what it does not need"
assert main(["run", "two-layer", "--no-record", *{QUICK!r}]) == 0
assert not {{"rerun", "fmpy"}} & set(sys.modules), "an unrecorded run without FMUs loads what it does not need"
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("place", ["-36.9,174.8", "-.5,-170", "-36.9,-174.8"])
def test_places_in_the_south_and_west_are_values(place: str, capsys: pytest.CaptureFixture[str]) -> None:
    """argparse takes what begins with a minus for an option, unless it is one plain number."""
    assert main(["export", "nothing.rrd", "--netcdf", "n.nc", "--site", place]) == 2
    assert "nothing.rrd: does not exist" in capsys.readouterr().err
    assert main(["export", "nothing.rrd", "--netcdf", "n.nc", "--bearing", "-1e1", "--site", place]) == 2
    assert "nothing.rrd: does not exist" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(["export", "nothing.rrd", "--netcdf", "--site", place])


def test_a_brief_flows_within_its_sentences() -> None:
    assert (
        flowing("\nTask. Hold\nthe boom.\nRules. Slow:\n0.7 kn\n\nEnd\n")
        == "Task. Hold the boom.\nRules. Slow:\n0.7 kn\n\nEnd"
    )
