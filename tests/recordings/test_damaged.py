"""Recordings damaged anywhere end every command in order: repaired as far as it goes, or one clear error; no traceback, no stray file."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

from recordings.files.messages import damage
from recordings.files.writing import RecordingError
from recordings.replay.recording import Replay
from recordings.replay.repair import is_whole, repair
from recordings.sink.recorder import Recorder
from scenarios.cli import main

COMMANDS = (
    "debrief {}", "report {} --csv tables --tracks water --tracks oil", "report {} --parquet tables", "verify {}",
    "export {} --vtk film", "export {} --netcdf oil.nc --geojson oil.json --site 0,0", "compare {} {} --table",
)  # fmt: skip


def zeroed(data: bytearray, at: int, count: int) -> bytes:
    data[at : at + count] = bytes(count)
    return bytes(data)


def scrambled(data: bytearray, at: int, count: int) -> bytes:
    data[at : at + count] = random.Random(at).randbytes(len(data[at : at + count]))
    return bytes(data)


def missing(data: bytearray, at: int, count: int) -> bytes:
    del data[at : at + count]
    return bytes(data)


def doubled(data: bytearray, at: int, count: int) -> bytes:
    data[at:at] = data[at : at + count]
    return bytes(data)


@pytest.fixture(autouse=True)
def _in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    monkeypatch.setattr("scenarios.debrief.key_moments._WIDTH", 240)  # large scenes take most of the time of a debrief


@pytest.mark.parametrize("harm", [zeroed, scrambled, missing, doubled])
@pytest.mark.parametrize("at", [0.0, 0.3, 0.999])
def test_damage_of_any_kind_anywhere_ends_in_order(
    harm: Callable[[bytearray, int, int], bytes],
    at: float,
    record: Callable[..., Path],
    capsys: pytest.CaptureFixture[str],
) -> None:
    data = record(12).read_bytes()
    bad = Path("bad.rrd")
    bad.write_bytes(harm(bytearray(data), int(at * len(data)), 600))
    for command in ("repair {}", *(COMMANDS if at == 0.3 else COMMANDS[1:2])):
        code = main(command.format(*["bad.rrd"] * command.count("{}")).split())
        said = capsys.readouterr()
        assert code in (0, 1, 2), command
        assert "Traceback" not in said.out + said.err
        if code == 2:
            assert "bad" in said.err, command
    left = {path.name for path in Path().iterdir()}
    allowed = {
        "bad.rrd",
        "bad.repaired.rrd",
        "bad-debrief",
        "bad.repaired-debrief",
        "tables",
        "film",
        "oil.nc",
        "oil.json",
    }
    assert left <= allowed
    if not is_whole(bad):
        repaired = Path("bad.repaired.rrd")
        assert not repaired.exists() or is_whole(repaired)


def test_all_that_is_sound_of_a_file_damaged_in_its_middle_is_saved(
    record: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    """A disk loses 4 KiB: what lies before and behind is there, bit for bit."""
    path = record(200)
    data = bytearray(path.read_bytes())
    bad = Path("bad.rrd")
    bad.write_bytes(scrambled(data, len(data) // 2, 4096))
    found = damage(bad)
    assert found.broken + found.lost_bytes and not found.cut and found.is_ended
    assert main(["repair", "bad.rrd"]) == 0
    assert "is damaged" in capsys.readouterr().out
    whole, saved = Replay(path), Replay("bad.repaired.rrd", mend=False)
    kept = 0
    for phase in whole.run.phases:
        expected = {index: frame.position.tobytes() for index, _, frame in whole.phase_frames(phase.name)}
        for index, _, frame in saved.phase_frames(phase.name):
            assert frame.position.tobytes() == expected[index]
            kept += 1
    assert kept > 100


def test_a_file_cut_off_at_any_byte_is_repaired_or_holds_no_run(record: Callable[..., Path]) -> None:
    data = record(12).read_bytes()
    chance = random.Random(2)
    saved = 0
    for _ in range(15):
        bad = Path("bad.rrd")
        bad.write_bytes(data[: chance.randrange(len(data))])
        Path("bad.repaired.rrd").unlink(missing_ok=True)
        try:
            Replay(bad)
            saved += 1
        except RecordingError:
            assert not Path("bad.repaired.rrd").exists()
        assert {path.name for path in Path().iterdir()} <= {"bad.rrd", "bad.repaired.rrd"}
    assert saved


def test_a_whole_file_has_no_damage(record: Callable[..., Path], capsys: pytest.CaptureFixture[str]) -> None:
    path = record(12)
    found = damage(path)
    assert not str(found) and found.is_ended and found.sound > 10
    assert main(["repair", str(path)]) == 0
    assert "is complete; there is nothing to repair" in capsys.readouterr().out


def test_what_cannot_be_written_is_said(record: Callable[..., Path], capsys: pytest.CaptureFixture[str]) -> None:
    data = record(12).read_bytes()
    Path("cut.rrd").write_bytes(data[: len(data) // 2])
    with pytest.raises(RecordingError, match="cannot be repaired"):
        repair("cut.rrd", Path("no") / "folder" / "copy.rrd")
    assert {path.name for path in Path().iterdir()} == {"cut.rrd"}


def test_values_that_a_disk_has_lost_are_noticed_where_they_decode(record: Callable[..., Path]) -> None:
    """Zeros in the middle of positions are positions too; the checksums tell, and whoever reads gets the other frames."""
    path = record(200)
    data = path.read_bytes()
    for at in range(10):
        bad = Path("bad.rrd")
        bad.write_bytes(zeroed(bytearray(data), (2 * at + 1) * len(data) // 20, 64))
        assert not is_whole(bad) or data == bad.read_bytes()


@pytest.mark.parametrize("loss", ["deleted", "replaced", "folder"])
def test_a_file_that_is_lost_while_it_is_written_is_an_error(loss: str, made_up: ModuleType, tmp_path: Path) -> None:
    """Rerun goes on writing to a file without a name."""
    folder = tmp_path / "disk"
    folder.mkdir()
    recorder = Recorder(folder / "lost.rrd", frame_rate=1.0 / made_up.STEP)
    recorder.initialized(made_up.describe())
    recorder.step_completed(made_up.make_frame(0))
    (folder / "lost.rrd").unlink()
    if loss == "replaced":
        (folder / "lost.rrd").write_bytes(b"")
    elif loss == "folder":
        folder.rmdir()
    with pytest.raises(RecordingError, match=r"lost\.rrd: (is no longer there|was replaced by another file)"):
        recorder.terminated("completed")
