"""The `oilsim` command: what it prints, its exit codes, and what it does not import."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

import recordings.pictures.picture
from recordings.model.frame import Event, Frame, RunDescription
from recordings.replay.recording import Replay
from recordings.sink.recorder import Recorder
from scenarios.cli import main
from scenarios.spec.load import library_paths, load_scenario
from scenarios.text.terminal import flowing

QUICK = ["--set", "fluid.particle_spacing=0.1", "--set", "run.duration=0.02", "--threads", "1"]


def test_list_names_every_scenario(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list"]) == 0
    text = capsys.readouterr().out
    assert all(name in text for name in library_paths())


def test_list_shows_the_brief_of_an_exercise_and_its_notes_only_if_asked(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A trainee who lists an exercise does not see what the instructor knows of it."""
    monkeypatch.setenv("COLUMNS", "1000")
    exercise = load_scenario("u-sweep").scenario.exercise
    assert exercise is not None and exercise.notes
    for arguments, shown in ((["list", "u-sweep"], False), (["list", "u-sweep", "--notes"], True)):
        assert main(arguments) == 0
        text = capsys.readouterr().out
        assert text.startswith("u-sweep: Two vessels sweep a slick") and exercise.goal in text
        assert " ".join(exercise.brief.split()) in " ".join(text.split())
        assert (" ".join(exercise.notes.split()) in " ".join(text.split())) is shown
        assert ("Instructor's notes" in text) is shown
    assert main(["list", "two-layer"]) == 0  # which is no exercise
    assert "9.81 (840 x 0.2 + 1027 x 0.3) = 4671 Pa" in capsys.readouterr().out


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
    ("arguments", "told"),
    [
        ("check no-such-scenario", "'no-such-scenario' is neither a file nor a shipped scenario, allowed: a .toml file, "),
        ("list no-such-scenario", "'no-such-scenario' is neither a file nor a shipped scenario, allowed: a .toml file, "),
        ("check calm-spread --set fluid.particle_spacing=-1", "fluid.particle_spacing is -1.0, allowed: above 0 m"),
        ("run calm-spread --no-record --until -1", "--until is -1.0, allowed: 1e-06 or more"),
        ("run calm-spread --no-record --threads 0", "--threads is 0, allowed: 1 or more and at most 1024"),
        ("run calm-spread --no-record --threads 100000", "--threads is 100000, allowed: 1 or more and at most 1024"),
        ("run calm-spread --no-record --picture x.png", "--picture needs a recording, allowed: only without --no-record"),
        ("run calm-spread --no-record --live", "--live needs a recording, allowed: only without --no-record"),
        ("run calm-spread --record no/folder/x.rrd", "--record is 'no/folder/x.rrd', which cannot be written: No such file"),
        ("run calm-spread --no-record --summary no/x.json", "--summary is 'no/x.json', which cannot be written: No such file"),
        ("run calm-spread --record new.rrd --picture x.xyz", "--picture is 'x.xyz', allowed: a name that ends with .png or"),
        ("run calm-spread --record new.rrd --picture x", "--picture is 'x', allowed: a name that ends with .png or"),
        ("run --resume here.rrd --demo", "--demo needs a scenario, allowed: with --resume FILE only if the scenario is named"),
        ("report here.rrd --csv x --tracks oil --ids -1", "--ids has -1, allowed: 0 to 4294967295"),
        ("report here.rrd --csv x --tracks oil --ids 3,99999999999", "--ids has 99999999999, allowed: 0 to 4294967295"),
        ("replay no-such-file.rrd", "oilsim: recording no-such-file.rrd: does not exist"),
        ("oils maya --evaporated 2", "--evaporated is 2.0, allowed: 0 or more and at most 0.75"),
        ("order here.rrd tow.speed=1 --patience 0", "--patience is 0.0 s, allowed: above 0 s"),
        ("order here.rrd tow.speed=1 --patience -1", "--patience is -1.0 s, allowed: above 0 s"),
        ("order here.rrd tow.speed=1 --patience nan", "--patience is nan s, allowed: above 0 s"),
    ],
)  # fmt: skip
def test_bad_input_ends_with_2_and_says_what_is_allowed(
    arguments: str, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It leaves nothing, and a recording that is there as it is."""
    monkeypatch.chdir(tmp_path)
    with Recorder(Path("here.rrd"), frame_rate=1.0) as recorder:
        recorder.initialized(RunDescription(name="here", particle_spacing=0.1))
        recorder.step_completed(Frame(index=0, time=0.0, scalars={"probes/gauge": 1.0}))
    content = Path("here.rrd").read_bytes()
    assert main(arguments.split()) == 2
    assert told in " ".join(capsys.readouterr().err.split())
    assert [file.name for file in tmp_path.iterdir()] == ["here.rrd"] and Path("here.rrd").read_bytes() == content


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
needless = {{
    "rerun", "fmpy", "matplotlib", "jinja2", "starlette", "uvicorn", "distributed", "vtkmodules", "xarray",
    "scipy.interpolate", "scipy.io", "scipy.stats", "recordings.pictures", "scenarios.debrief", "scenarios.conduct.server",
}}
assert not needless & set(sys.modules), f"an unrecorded run in a tank loads {{needless & set(sys.modules)}}"
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_sweep_on_this_machine_needs_no_cluster() -> None:
    code = "import sys, scenarios.sweeps.sweep\nassert 'distributed' not in sys.modules"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


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


def test_a_command_leaves_the_environment_of_its_caller(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    assert main(["list"]) == 0
    assert "PYTHONSAFEPATH" not in os.environ
