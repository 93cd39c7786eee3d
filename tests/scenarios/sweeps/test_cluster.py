"""A sweep on a Dask cluster of two workers, one of which is killed in the middle: every run is there in the end."""

from __future__ import annotations

import csv
import os
import signal
import threading
import time
from pathlib import Path

import pytest
from distributed import Client, LocalCluster

from scenarios.cli import main

SHORT = ["--set", "fluid.particle_spacing=0.1", "--until", "0.02", "--threads", "1"]
ASKED = ["sweep", "two-layer", *SHORT, "--range", "phases.oil.density=850:950", "--runs", "3"]


def rows(folder: Path) -> list[dict[str, str]]:
    with (folder / "sweep.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def kill_a_worker(address: str, folder: Path, killed: list[int]) -> None:
    """Kill a worker's process once the first run is there."""
    while not list(folder.glob("*.json")):
        time.sleep(0.05)
    with Client(address, set_as_default=False) as client:
        killed.append(next(iter(client.run(os.getpid).values())))
        os.kill(killed[0], signal.SIGKILL)


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_a_lost_worker_does_not_stop_the_rest(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    killed: list[int] = []
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        address = cluster.scheduler_address
        killer = threading.Thread(target=kill_a_worker, args=(address, tmp_path, killed))
        killer.start()
        asked = [*ASKED, "--scheduler", address, "--to", str(tmp_path)]
        assert main(asked) == 0
        killer.join()
        assert killed
        assert len(list(tmp_path.glob("*.json"))) == 3
        assert all(row["ended"] == "completed" for row in rows(tmp_path))
        capsys.readouterr()
        assert main(asked) == 0
        assert "3 of 3 already complete" in capsys.readouterr().err


def test_a_scheduler_that_does_not_answer_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("scenarios.sweeps.sweep.TIMEOUT", 0.2)
    assert main([*ASKED, "--scheduler", "tcp://127.0.0.1:1", "--to", str(tmp_path)]) == 2
    assert "--scheduler is 'tcp://127.0.0.1:1', which does not answer" in capsys.readouterr().err
