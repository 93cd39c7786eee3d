"""What a debrief needs of an exercise comes back from the file: booms, site, tensions, and oil by the cause of its loss."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from recordings.model import entity_paths, palette
from recordings.model.exercise import BoomDescription, Equipment, ExerciseDescription, Site
from recordings.model.frame import BodyFrame, Frame, PhaseFrame
from recordings.replay.moments import read_moments
from recordings.replay.recording import Replay
from recordings.replay.series import read_rows
from recordings.sink.blueprint import following_views
from recordings.sink.recorder import Recorder

BOOM = BoomDescription(
    name="main",
    segments=("boom/segment-00", "boom/segment-01"),
    ends=("port", "end-1"),
    length=2.0,
    skirt_depth=0.3,
    freeboard=0.2,
    waterline=0.05,
    joint_points=((-0.5, 0.0, 0.0), (0.5, 0.0, 0.0)),
    full_tension=100.0,
)
EXERCISE = ExerciseDescription(booms=(BOOM,), current=(-0.2, 0.1), water_level=0.6)
SITE = Site(latitude=58.9, longitude=5.6, bearing=45.0, start="2026-05-01T08:00:00+00:00")
FATES = ("afloat", "lost_drainage", "lost_planing")
LOST = {0: {}, 1: {"drainage": [3, 4]}, 2: {"drainage": [4], "planing": [7]}, 3: {"planing": [7]}, 4: {}}


@pytest.fixture
def recording(made_up: ModuleType, tmp_path: Path) -> Path:
    """Five frames of ten oil particles, some of them lost, and a boom of two segments under tension."""
    path = tmp_path / "exercise.rrd"
    with Recorder(path, frame_rate=10.0) as recorder:
        recorder.initialized(replace(made_up.describe(), exercise=EXERCISE, site=SITE, fates=FATES))
        for index in range(5):
            recorder.step_completed(_frame(index))
    return path


def _positions(index: int) -> np.ndarray:
    return np.random.default_rng(index).random((10, 3)).astype(np.float32)


def _frame(index: int) -> Frame:
    ids, fate = np.arange(10, dtype=np.uint32), np.zeros(10, np.uint8)
    for cause, lost in LOST[index].items():
        fate[lost] = FATES.index(f"lost_{cause}")
    bodies = {
        name: BodyFrame(
            position=np.zeros(3),
            orientation=np.array([0.0, 0.0, 0.0, 1.0]),
            tension=10.0 * index + place,
            held_speed=0.1 * place,
        )
        for place, name in enumerate(BOOM.segments)
    }
    bodies["rock"] = BodyFrame(position=np.zeros(3), orientation=np.array([0.0, 0.0, 0.0, 1.0]))
    return Frame(
        index=index,
        time=0.1 * index,
        bodies=bodies,
        read_phases=lambda: {"oil": PhaseFrame(_positions(index), ids, fate=fate)},
    )


def test_booms_and_site_come_back(recording: Path) -> None:
    run = Replay(recording).run
    assert run.exercise == EXERCISE
    assert run.site == SITE


def test_lost_oil_comes_back_by_cause_frame_by_frame(recording: Path) -> None:
    replay = Replay(recording)
    assert replay.lost_causes == ("drainage", "planing")
    for cause in replay.lost_causes:
        for index, _, frame in replay.particles(entity_paths.lost(cause)):
            assert frame.id.tolist() == LOST[index].get(cause, [])
            np.testing.assert_array_equal(frame.position, _positions(index)[frame.id])


def test_a_moment_shows_only_oil_that_is_lost_then(recording: Path) -> None:
    moments = read_moments(Replay(recording), [(0, 0.0), (2, 0.2), (4, 0.4)])
    counts = [{cause: len(found) for cause, found in moment.lost.items() if len(found)} for moment in moments]
    assert counts == [{}, {"drainage": 1, "planing": 1}, {}]


def test_lost_parcels_are_spots_of_their_volumes_in_pictures_and_in_the_viewer(
    made_up: ModuleType, tmp_path: Path
) -> None:
    """Ten parcels of 1 to 10 litres; each spot is as large as if its oil were 10 mm thick, however wide its film is."""
    path, volume = tmp_path / "parcels.rrd", 1e-3 * np.arange(1.0, 11.0, dtype=np.float32)
    with Recorder(path, frame_rate=10.0) as recorder:
        recorder.initialized(replace(made_up.describe(), exercise=EXERCISE, fates=FATES))
        for index in range(5):
            oil = _frame(index).phases["oil"]
            parcels = PhaseFrame(oil.position, oil.id, volume, np.full(10, 30.0, np.float32), oil.fate)
            recorder.step_completed(Frame(index=index, time=0.1 * index, read_phases=lambda one=parcels: {"oil": one}))
    replay = Replay(path)
    (moment,) = read_moments(replay, [(2, 0.2)])
    for cause, lost in LOST[2].items():
        area = np.pi * moment.radius[cause] ** 2
        np.testing.assert_allclose(palette.SPOT_THICKNESS * area, volume[lost], rtol=1e-5)
        rows = [
            rows
            for _, chunk in replay.chunks(f"/{entity_paths.lost(cause)}")
            if (rows := read_rows(chunk, "Points3D:radii"))
        ]
        radii = {int(index): row for part in rows for index, row in zip(part.index, part.split(), strict=True)}
        np.testing.assert_allclose(radii[2], moment.radius[cause])


def test_tension_comes_back_for_booms_and_is_unknown_elsewhere(recording: Path) -> None:
    bodies = Replay(recording).bodies
    np.testing.assert_array_equal(bodies["boom/segment-01"].tension, 10.0 * np.arange(5) + 1.0)
    np.testing.assert_array_equal(bodies["boom/segment-01"].held_speed, np.full(5, 0.1))
    assert np.isnan(bodies["rock"].held_speed).all()
    assert np.isnan(bodies["rock"].tension).all()


def test_boom_colours_run_from_pale_to_dark_with_tension() -> None:
    colors = palette.tension_color([0.0, 25.0, 50.0, 100.0, 300.0], 100.0).astype(int)
    brightness = colors[:, :3].sum(axis=1)
    assert (np.diff(brightness)[:3] < 0).all()
    assert (colors[3] == colors[4]).all()
    pale, orange, dark_red = (255, 236, 150, 255), (246, 112, 20, 255), (110, 0, 40, 255)
    assert [tuple(color) for color in colors[[0, 2, 3]]] == [pale, orange, dark_red]  # none shows what is behind it


def test_a_body_has_its_own_colour_or_that_of_its_group(made_up: ModuleType) -> None:
    mesh = made_up.describe().meshes["rock"]
    own = replace(mesh, color=(1, 2, 3, 255))
    assert palette.body_color("vessels/port", own) == (1, 2, 3, 255)
    of_group = palette.body_color("vessels/port", None)
    assert palette.body_color("vessels/port", replace(mesh, color=None)) == of_group
    assert of_group != palette.body_color("boom/segment-00", None)


def test_cameras_follow_the_apex_from_outside_and_the_vessel_from_ahead(made_up: ModuleType) -> None:
    run = replace(made_up.describe(), exercise=EXERCISE)
    places = {  # an apex at x = 0 that opens to +x, where the vessel is
        "boom/segment-00": np.array([1.0, 1.0, 0.5]),
        "boom/segment-01": np.array([0.0, 0.0, 0.5]),
        "vessels/port": np.array([2.0, 1.0, 0.6]),
    }
    apex, vessel = following_views(run, places)
    assert (apex.follows, apex.camera.target) == (entity_paths.boom_label(BOOM.name), (0.0, 0.0, 0.5))
    assert apex.camera.eye[0] < 0.0 and apex.camera.eye[2] > 0.5
    assert (vessel.follows, vessel.camera.target) == ("vessels/port/hull", (2.0, 1.0, 0.6))
    assert vessel.camera.eye[0] > 2.0 and vessel.camera.eye[2] > 0.6
    assert following_views(replace(run, exercise=None), places) == []
    assert following_views(run, {}) == []


@pytest.mark.parametrize("change", [{"latitude": 95.0}, {"longitude": 400.0}, {"start": "tomorrow"}])
def test_an_impossible_site_is_refused(change: dict[str, object]) -> None:
    with pytest.raises(ValueError, match="allowed"):
        replace(SITE, **change)


def test_a_line_is_seen_while_it_pulls_and_at_the_start_unless_it_waits_for_its_crew() -> None:
    fast, waits = (
        Equipment(name=name, kind="tie", ends=(("", (0.0, 0.0, 0.0)),) * 2, series=f"ties/{name}/tension")
        for name in ("bridle", "connect")
    )
    exercise = replace(EXERCISE, booms=(replace(BOOM, waiting_ties=("connect",)),), equipment=(fast, waits))
    for time, tension, seen in ((0.0, 0.0, (True, False)), (1.0, 0.0, (False, False)), (1.0, 5.0, (True, True))):
        assert tuple(exercise.is_seen(one, time, {one.series: tension}) for one in (fast, waits)) == seen
