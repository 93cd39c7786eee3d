"""What is read of a run that was continued covers all its pieces, each up to the branch, with the orders given there."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pyarrow.csv
import pytest
import xarray

from recordings.replay.joined import JoinedReplay, branch_of
from recordings.replay.recording import Replay
from recordings.replay.repair import open_reader
from recordings.replay.series import read_rows
from scenarios.cli import main
from scenarios.debrief.boom_history import boom_histories
from scenarios.debrief.page import write_debrief

SMALL = ["--set", "fluid.particle_spacing=0.125", "--set", "run.communication_step=0.02", "--threads", "1"]
OFTEN = ["--set", "recording.checkpoint_interval=0.04", "--set", "recording.frame_rate=50", "--set", "tow.start=0"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of 0.16 s, gone on with from 0.08 s under other orders, and that again from 0.12 s."""
    there = tmp_path_factory.mktemp("pieces")
    first, second, third = (str(there / f"{name}.rrd") for name in ("first", "second", "third"))
    assert main(["run", "u-sweep", *SMALL, *OFTEN, "--until", "0.16", "--record", first]) == 0
    assert main(["run", "--resume", first, "--at", "0.08", "--set", "tow.speed=0.5", "--record", second]) == 0
    assert main(["run", "--resume", second, "--at", "0.12", "--set", "tow.speed=0.1", "--record", third]) == 0
    return there


@pytest.mark.slow
def test_all_pieces_are_joined_at_their_branches(folder: Path) -> None:
    joined = JoinedReplay(folder / "third.rrd")
    assert [branch.time for branch in joined.branches] == pytest.approx([0.08, 0.12])
    assert joined.missing == ""
    for series in joined.scalars.values():
        assert (np.diff(series.index) > 0).all()
    held = joined.scalars["oil_contained"]
    assert held.time == pytest.approx(np.arange(9) * 0.02)
    parts = [Replay(folder / f"{name}.rrd") for name in ("first", "second", "third")]
    speeds = [part.scalars["tow_speed"] for part in parts]
    expected = np.concatenate(
        [speeds[0].value[speeds[0].index <= 4], speeds[1].value[(speeds[1].index > 4) & (speeds[1].index <= 6)],
         speeds[2].value[speeds[2].index > 6]]
    )  # fmt: skip
    np.testing.assert_array_equal(joined.scalars["tow_speed"].value, expected)
    (history,) = boom_histories(joined)
    assert len(history.states) == 9
    oil = [index for index, _, frame in joined.phase_frames("oil") if len(frame.position)]
    assert oil == list(range(9)) == joined.phase_times("oil").index.tolist()


@pytest.mark.slow
def test_the_page_tells_the_branches_and_all_orders(folder: Path, tmp_path: Path) -> None:
    page = write_debrief(folder / "third.rrd", tmp_path).read_text(encoding="utf-8")
    assert "At 0.1 s the run was continued from first.rrd, with the orders: tow at 0.97 kn" in page
    assert "continued from second.rrd, with the orders: tow at 0.19 kn" in page
    assert "does not begin at the start of the run" not in page
    orders = [event.text for event in JoinedReplay(folder / "third.rrd").events if event.source == "instructor"]
    assert orders == ["orders tow.speed=0.5", "orders tow.speed=0.1"]


@pytest.mark.slow
def test_tables_exports_and_comparisons_cover_all_pieces(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    third = str(folder / "third.rrd")
    assert main(["report", third, "--csv", str(tmp_path), "--tracks", "oil"]) == 0
    series = pyarrow.csv.read_csv(tmp_path / "series.csv")
    assert series.column("step").to_pylist() == list(range(9))
    tow = JoinedReplay(folder / "third.rrd").scalars["tow_speed"].value
    np.testing.assert_allclose(series.column("tow_speed").to_numpy(), tow, rtol=1e-12)
    tracked = pyarrow.csv.read_csv(tmp_path / "particles-oil.csv")
    assert sorted(set(tracked.column("step").to_pylist())) == list(range(9))
    assert main(["export", third, "--netcdf", str(tmp_path / "oil.nc"), "--site", "54,8"]) == 0
    with xarray.open_dataset(tmp_path / "oil.nc") as data:
        assert data.sizes["time"] == 9
    both = tmp_path / "both.rrd"
    capsys.readouterr()
    assert main(["compare", str(folder / "first.rrd"), third, "--to", str(both)]) == 0
    told = capsys.readouterr()
    assert "from 0 s to 0.16 s" in told.out
    assert told.err == ""
    for side in "AB":
        steps = [
            index
            for chunk in open_reader(both).stream().filter(content=[f"/{side}/metrics/tow_speed"])
            if (rows := read_rows(chunk.to_record_batch(), "Scalars:scalars")) is not None
            for index in rows.index.tolist()
        ]
        assert sorted(steps) == list(range(9))


@pytest.mark.slow
def test_a_piece_that_is_gone_or_another_run_by_now_is_told(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    alone = tmp_path / "third.rrd"
    shutil.copy(folder / "third.rrd", alone)
    joined = JoinedReplay(alone)
    assert joined.missing == "second.rrd does not exist"
    assert main(["report", str(alone), "--csv", str(tmp_path / "tables")]) == 0
    assert "third.rrd does not begin at the start of its run: second.rrd does not exist" in capsys.readouterr().err
    assert joined.scalars["oil_contained"].index.tolist() == Replay(alone).scalars["oil_contained"].index.tolist()
    assert main(["run", "still-column", "--set", "fluid.particle_spacing=0.1", "--until", "0.04", "--threads", "1",
                 "--record", str(tmp_path / "second.rrd")]) == 0  # fmt: skip
    assert JoinedReplay(alone).missing == "second.rrd holds another run by now"
    assert branch_of(Replay(tmp_path / "second.rrd")) is None
    shutil.copy(folder / "third.rrd", tmp_path / "second.rrd")
    assert JoinedReplay(tmp_path / "second.rrd").missing == "second.rrd goes on from itself"
