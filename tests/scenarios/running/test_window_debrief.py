"""A run with a window is debriefed as one scene: maps and page show window, parcels and sea, and say what was modelled."""

from __future__ import annotations

import html
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from recordings.pictures.chart import WINDOW, draw_map
from recordings.replay.joined import JoinedReplay
from recordings.replay.moments import read_moments, recorded_steps
from scenarios.cli import main
from scenarios.debrief.accuracy_notes import accuracy_notes
from scenarios.debrief.boom_history import boom_histories
from scenarios.debrief.key_moments import key_moments
from scenarios.debrief.slick_map import slick_map

STEP, STEPS, SPACING = 0.05, 8, 0.14
SIZE = (24 * SPACING, 24 * SPACING)
WINDOW_SETTINGS = (
    f"fluid.particle_spacing={SPACING}", "window.target=main", "window.size=[3.4, 3.4]",
    "window.depth=0.6", "window.rim=0.6",
)  # fmt: skip
SETTINGS = (
    f"run.communication_step={STEP}", f"run.duration={STEPS * STEP}", "run.threads=1", "recording.frame_rate=20",
    "fill.slick.lower=[1.35, 2.2, 0.5]", "fill.slick.upper=[1.95, 2.8, 0.75]",
)  # fmt: skip


def recorded(folder: Path, *settings: str) -> JoinedReplay:
    path = folder / "run.rrd"
    changes = [part for one in (*settings, *SETTINGS) for part in ("--set", one)]
    assert main(["run", "u-sweep", *changes, "--record", str(path), "--picture", str(folder / "run.png")]) == 0
    return JoinedReplay(path)


@pytest.fixture(scope="module")
def replay(tmp_path_factory: pytest.TempPathFactory) -> JoinedReplay:
    return recorded(tmp_path_factory.mktemp("window"), *WINDOW_SETTINGS)


@pytest.fixture(autouse=True)
def _small_scenes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scenarios.debrief.key_moments._WIDTH", 240)  # large ones take most of the time of a debrief


def outlines(figure: Figure) -> list[Rectangle]:
    return [one for one in figure.axes[0].patches if isinstance(one, Rectangle) and one.get_gid() == WINDOW]


def test_the_recording_tells_where_the_window_is(replay: JoinedReplay) -> None:
    """The box drifts with the current through a step, which it begins around the boom's middle."""
    (window,) = replay.run.windows
    assert (window.name, window.target) == ("window", "the middle of boom main")
    assert (window.size, window.spacing) == (pytest.approx(SIZE), SPACING)
    assert replay.run.exercise is not None
    segments = replay.run.exercise.booms[0].segments
    beside = {segments[(len(segments) - 1) // 2], segments[len(segments) // 2]}
    middle = np.mean([replay.bodies[name].pose for name in beside], axis=0)
    for axis, name in enumerate(window.middle_series):
        drifted = middle[:-1, axis] + STEP * replay.run.exercise.current[axis]
        np.testing.assert_allclose(replay.scalars[name].value[1:], drifted, atol=1e-6)
    assert replay.run.exercise.period == (0.0, 0.0), "the sea does not repeat as the basin does"


def test_plan_views_show_window_boom_and_all_oil(replay: JoinedReplay) -> None:
    moments = read_moments(replay, [recorded_steps(replay)[at] for at in (0, -1)])
    maps = [slick_map(replay, key_moments(replay, boom_histories(replay)))]
    maps.append(Figure())
    draw_map(maps[1].subplots(), replay, moments)
    middle = [replay.scalars[name].value[-1] for name in replay.run.windows[0].middle_series]
    for figure in maps:
        (outline,) = outlines(figure)
        np.testing.assert_allclose(np.add(outline.get_xy(), 0.5 * np.array(SIZE)), middle, atol=1e-6)
        assert (outline.get_width(), outline.get_height()) == pytest.approx(SIZE)
        legend = figure.axes[0].get_legend()
        assert legend is not None
        assert "window: particles 140 mm apart" in [text.get_text() for text in legend.get_texts()]
    oil, water = (moments[-1].positions[name] for name in ("oil", "water"))
    inside = np.abs(oil[:, :2] - middle).max(1) < 0.5 * SIZE[0]
    below = oil[:, 2] < 0.6 - 0.25 * SPACING
    assert below.sum() > 3, "particles lie in the water, parcels on it"
    assert inside[below].all()
    assert (np.abs(water[:, :2] - middle).max(0) < 0.5 * SIZE[0] + 0.05).all()
    assert len(moments[-1].bodies) >= 22, "all of the boom, in the window or not"


def test_the_debrief_names_the_window_and_what_was_modelled(replay: JoinedReplay, tmp_path: Path) -> None:
    assert main(["debrief", str(replay.path), "--out", str(tmp_path)]) == 0
    page = html.unescape((tmp_path / "debrief.html").read_text(encoding="utf-8"))
    assert "The window of particles is around the middle of boom main, 3.36 by 3.36 m wide and 0.56 m deep." in page
    assert "Its particles are 140 mm apart." in page
    assert "Outside the window formulas give the sea" in page
    assert "Modelled: by closures, all losses of oil that is parcels" in page
    assert "closures were off" not in page
    assert "of the water's section" not in page, "a sea has no sides"


def test_a_debrief_without_particles_does_not_speak_of_particles(tmp_path: Path) -> None:
    notes = accuracy_notes(recorded(tmp_path, "fidelity=none"))
    assert notes[0].startswith("The run has no particles: formulas give the sea")
    assert "Modelled: all losses, by closures." in notes
    assert not [note for note in notes if "particles deep" in note or "apart" in note]


def test_a_debrief_tells_a_window_from_its_outer_one(tmp_path: Path) -> None:
    nested = recorded(tmp_path, *WINDOW_SETTINGS, "window.outer={spacing=0.14, size=[7.0, 7.0]}")
    notes = "\n".join(accuracy_notes(nested))
    assert "The inner window of particles is around the middle of boom main, 3.36 by 3.36 m wide" in notes
    assert "flow around what is in it, and oil as thick as a particle, but nothing finer" in notes
    assert "The outer window of particles is around the middle of boom main, 7 by 7 m wide" in notes
    assert "flow around what is in it, but nothing finer" in notes
    assert "Oil that is outside the inner window" in notes
