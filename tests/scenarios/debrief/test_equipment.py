"""Skimmers, anchors, ties and land are on the maps and pictures of a recorded run, where they were; what has parted is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from numpy.typing import NDArray

from recordings.model import palette
from recordings.pictures.chart import draw_equipment, draw_land
from recordings.pictures.scenes import SceneView
from recordings.replay.joined import JoinedReplay
from recordings.replay.moments import Moment, key_steps, read_moments, recorded_steps
from scenarios.running.run import RunOptions, run_scenario
from scenarios.spec.load import load_scenario


def recorded(folder: Path, name: str, *overrides: str) -> tuple[JoinedReplay, Moment]:
    """Run a shipped exercise for a second; return its recording, and the last moment of it."""
    loaded = load_scenario(name, overrides=["run.duration=1.0", *overrides])
    record = folder / f"{name}.rrd"
    assert run_scenario(loaded.scenario, text=loaded.text, options=RunOptions(record=record)) == 0
    replay = JoinedReplay(record)
    return replay, read_moments(replay, key_steps(recorded_steps(replay), 2))[-1]


def strips(moment: Moment) -> dict[str, NDArray[np.float64]]:
    """Return the lines that show skimmers, legs and ties, by name."""
    return {one.name: strip for one, strip in moment.equipment}


def test_bridles_and_skimmer_of_a_v_sweep(tmp_path: Path) -> None:
    replay, moment = recorded(tmp_path, "v-sweep", "ties.aft.parted=true")
    found, settings = strips(moment), load_scenario("v-sweep").scenario
    assert set(found) == {"brush", "fore", "middle"}
    for name in ("fore", "middle"):
        long = np.linalg.norm(found[name][1] - found[name][0])
        assert long == pytest.approx(settings.ties[name].length, rel=0.05)
    ring = found["brush"]
    assert np.ptp(ring[:, 0]) == pytest.approx(settings.skimmers["brush"].swath, rel=0.01)
    apex = moment.bodies[replay.run.exercise.booms[0].apex].position
    assert np.linalg.norm(ring.mean(axis=0)[:2] - apex[:2]) < 5.0
    figure = Figure()
    axes = figure.subplots()
    draw_equipment(axes, moment)
    assert {line.get_gid() for line in axes.lines} == {"brush", "fore", "middle"}
    drawn = {path.rpartition("/")[2] for path, _ in replay.chunks("/equipment/**")}  # in three dimensions
    assert drawn == {"brush", "fore", "middle", "aft"}
    image = SceneView(replay.run, [moment], 400).draw(moment)
    tint = np.array(palette.EQUIPMENT[:3]) / 255.0
    hue = image / np.maximum(image.sum(axis=2, keepdims=True), 1e-6)
    assert (np.abs(hue - tint / tint.sum()).max(axis=2) < 0.05).sum() > 50  # pixels of ring and bridles


def test_an_anchor_that_drags_and_a_skimmer_that_is_moved_are_where_they_are(tmp_path: Path) -> None:
    """The map has the way of the anchor from where it was laid, and says how long it is."""
    orders = "['moorings.north.holding=1.0', 'skimmers.weir.place=[0.0, 1.6]']"
    inject = f"injects.drags={{at=0.0, orders={orders}, text='It drags'}}"
    replay, moment = recorded(tmp_path, "anchored-containment", inject)
    found, series = strips(moment), replay.scalars
    laid = next(one for one in replay.run.exercise.equipment if one.name == "north").ends[-1][1]
    dragged = float(np.linalg.norm(found["north"][-1, :2] - laid[:2]))
    assert dragged == pytest.approx(series["moorings/north/dragged"].value[-1])
    assert dragged > 0.5
    ring = found["weir"][:-1].mean(axis=0)
    assert ring[:2] == pytest.approx([series[f"skimmers/weir/{axis}"].value[-1] for axis in "xy"], abs=1e-6)
    axes = Figure().subplots()
    draw_equipment(axes, moment)
    assert any(text.get_text().startswith("north, dragged") for text in axes.texts)
    assert any(line.get_linestyle() == ":" for line in axes.lines)


def test_an_anchor_is_where_it_was_laid_and_a_beach_is_land(tmp_path: Path) -> None:
    replay, moment = recorded(tmp_path, "shore-seal")
    leg, boom = strips(moment)["out"], replay.run.exercise.booms[0]
    assert leg[-1, :2] == pytest.approx([-12.0, -60.0], abs=0.05)
    assert np.linalg.norm(leg[0, :2] - moment.bodies[boom.segments[-1]].position[:2]) < 3.0
    axes = Figure().subplots()
    axes.plot([0.0, 1.0], [0.0, 1.0])
    before = axes.get_xlim()
    draw_land(axes, replay.run, moment)
    assert axes.get_xlim() == before
    (land,) = axes.patches + [one for one in axes.artists if one.get_gid() == "shore"]
    shore = load_scenario("shore-seal").scenario.shore
    inland = -(np.asarray(land.get_xy()) - shore.waterline) @ [np.cos(shore.seaward), np.sin(shore.seaward)]
    assert inland.min() > -2.0
