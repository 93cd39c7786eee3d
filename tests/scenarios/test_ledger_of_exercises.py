"""Every shipped exercise knows the fate of every litre: at every frame, in summary, console and recording, and in every export."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest
from scipy.io import netcdf_file

from oilsim.oil.fates import FATES, Fate
from recordings.export.geojson import write_geojson
from recordings.export.netcdf import write_netcdf
from recordings.export.tables import write_tables
from recordings.model.exercise import Site
from recordings.model.frame import Frame, RunDescription
from recordings.replay.recording import Replay
from recordings.sink.recorder import Recorder
from scenarios.conduct.snapshot import state_of
from scenarios.debrief.boom_history import boom_histories
from scenarios.running.assembly import Assembly, build
from scenarios.running.summary import SummaryObserver
from scenarios.spec.load import library_paths, load_scenario
from tests.regression.runs import SCENARIOS

ROUND_OFF = 1e-12  # [1] of the oil spilled
ON_WATER = (Fate.AFLOAT, Fate.CONTAINED, Fate.STRANDED)
SITE = Site(latitude=58.9, longitude=5.6)
AT_SEA_STEPS = 40  # of the exercise's own length, without particles
SLOW = {"u-sweep", "tow-speed-ramp", "wave-flume", "harbour-1km", "drop-in-air", "sweep-200m", "anchored-containment"}


class Watch:
    """Holds every frame of a run to the ledger, and the ledger to its sum."""

    def __init__(self, assembly: Assembly, summary: SummaryObserver) -> None:
        self.assembly, self.summary = assembly, summary
        self.rows = dict[int, dict[str, float]]()  # by communication step

    def initialized(self, run: RunDescription) -> None:
        """The run begins."""

    def step_completed(self, frame: Frame) -> None:
        """The ledger adds up, and summary, console, series and shown oil say the same."""
        assembly, rows = self.assembly, self.assembly.scoring.ledger.rows
        assert abs(rows.residual) <= ROUND_OFF * rows.spilled
        row_values = self.rows[frame.index] = rows.series()
        assert min(row_values.values()) >= -ROUND_OFF * rows.spilled
        assert self.summary.summary(frame.time)["oil_m3"] == rows.summary()
        if rows.spilled:
            assert {name: frame.scalars[f"metrics/{name}"] for name in row_values} == row_values
            assert state_of(assembly, assembly.scenario, frame)["ledger"] == rows.summary()
        if oils := [frame.phases[name] for name in assembly.description.oils if len(frame.phases[name].id)]:
            alike = np.float64(assembly.fluid.config.rest_volume)
            volume = np.concatenate([np.full(len(one.id), alike) if one.volume is None else one.volume for one in oils])
            shown = np.bincount(np.concatenate([one.fate for one in oils]), volume, len(FATES))
            for fate in ON_WATER:
                assert shown[fate] == pytest.approx(row_values[f"oil/{FATES[fate]}"], rel=1e-6, abs=1e-12)

    def event(self, event: object) -> None:
        """Something happens."""

    def terminated(self, reason: str) -> None:
        """The run ends."""


def exported(replay: Replay, folder: Path) -> dict[str, list[dict[str, float]]]:
    """The volumes [m3] by fate at the recorded instants, as each export has them."""
    write_netcdf(replay, folder / "oil.nc", SITE)
    with netcdf_file(folder / "oil.nc", mmap=False) as file:
        get = {name: one[:].copy() for name, one in file.variables.items()}
        meanings = file.variables["fate"].flag_meanings.decode().split()
    volume, ends = get["mass"] / 1e3 / get["density"], np.cumsum(get["particle_count"])
    per_instant = zip(np.split(volume, ends[:-1]), np.split(get["fate"], ends[:-1]), strict=True)
    nc = [dict(zip(meanings, np.bincount(fates, one, len(meanings)), strict=True)) for one, fates in per_instant]
    assert set(np.unique(get["status_codes"][get["fate"] == meanings.index("stranded")]).tolist()) <= {3}
    write_geojson(replay, folder / "oil.geojson", SITE)
    features = [one["properties"] for one in json.loads((folder / "oil.geojson").read_text())["features"]]
    stamps = sorted({one["time_s"] for one in features if one["kind"] == "ledger"})
    maps = [
        {one["fate"]: one["volume_m3"] for one in features if one["kind"] == "slick" and one["time_s"] == stamp}
        for stamp in stamps
    ]
    write_tables(replay, folder / "tables", "parquet", tracks=replay.run.oils)
    sums: dict[float, dict[str, float]] = {stamp: {} for stamp in stamps}
    for name in replay.run.oils:
        table = pyarrow.parquet.read_table(folder / "tables" / f"particles-{name}.parquet").to_pydict()
        for stamp, fate, one in zip(table["time"], table["fate"], table["volume"], strict=True):
            sums[stamp][fate] = sums[stamp].get(fate, 0.0) + one
    series = pyarrow.parquet.read_table(folder / "tables" / "series.parquet").to_pydict()
    np.testing.assert_array_equal(series["oil/spilled"], get["oil_spilled"])
    return {"netcdf": nc, "geojson": maps, "parquet": [sums[stamp] for stamp in stamps]}


@pytest.mark.parametrize(
    "name", [pytest.param(one, marks=[pytest.mark.slow] if one in SLOW else []) for one in sorted(library_paths())]
)
def test_every_litre_has_one_fate_at_every_frame_and_in_every_export(name: str, tmp_path: Path) -> None:
    source, spacing, steps, _ = SCENARIOS[name]
    scenario = load_scenario(source).scenario
    step, settings = scenario.run.communication_step, [f"fluid.particle_spacing={spacing}", "run.threads=1"]
    steps = min(steps, 12) if "tank" in scenario.parts.boxes else AT_SEA_STEPS
    assembly = build(load_scenario(source, overrides=[*settings, f"run.duration={steps * step}"]).scenario)
    summary, path = SummaryObserver(assembly), tmp_path / "run.rrd"
    watch = Watch(assembly, summary)
    simulation = assembly.co_simulation([summary, watch, Recorder(path, frame_rate=math.ceil(0.2 / step))])
    simulation.initialize()
    for _ in range(steps):
        simulation.step()
    rows = assembly.scoring.ledger.rows
    simulation.terminate("completed")
    assert len(watch.rows) == steps + 1
    replay = Replay(path)
    if not replay.run.oils:
        assert rows.spilled == 0.0
        return
    assert rows.spilled > 0.0
    ledger = {
        key.removeprefix("oil/"): series.value for key, series in replay.scalars.items() if key.startswith("oil/")
    }
    recorded = replay.scalars["oil/spilled"].index.tolist()
    for key, value in ledger.items():
        assert value.tolist() == [watch.rows[index][f"oil/{key}"] for index in recorded], key
    for kind, instants in exported(replay, tmp_path).items():
        assert len(instants) == len(ledger["spilled"]), kind
        for place, found in enumerate(instants):
            for fate in ON_WATER:
                expected = ledger[FATES[fate]][place]
                assert found.get(FATES[fate], 0.0) == pytest.approx(expected, rel=1e-6, abs=1e-9), (kind, place)
            lost = sum(volume for fate, volume in found.items() if fate.startswith("lost_"))
            whole = sum(series[place] for key, series in ledger.items() if key.startswith("lost/"))
            gone = sum(ledger[key][place] for key in ("left_the_domain", "recovered"))
            assert lost <= whole * (1.0 + 1e-6) + 1e-9 and (gone > 0.0 or lost == pytest.approx(whole, rel=1e-6))
    for history in boom_histories(replay):
        assert history.spilled.tolist() == ledger["spilled"].tolist()
        if recorded[-1] == steps:
            score = assembly.scoring.ledger.booms[history.boom.name]
            assert (history.oil["contained"][-1], history.oil["met"][-1]) == (score.contained, score.met)
