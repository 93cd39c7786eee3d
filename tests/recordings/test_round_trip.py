"""What was recorded is what is read back."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from recordings.files.writing import RecordingError
from recordings.model.frame import Event, Frame
from recordings.model.sample import grid_within
from recordings.replay.recording import Replay
from recordings.sink.recorder import Recorder
from recordings.sink.writers import drawn_bodies

FRAMES = 35  # three blocks of ten and a rest


def test_positions_and_ids_come_back_bit_for_bit(record: Callable[..., Path], made_up: ModuleType) -> None:
    replay = Replay(record(FRAMES))
    for name in ("ocean", "oil"):
        frames = list(replay.phase_frames(name))
        assert [index for index, _, _ in frames] == list(range(FRAMES))
        for index, time, phase in frames:
            expected = made_up.make_frame(index).phases[name]
            assert phase.position.dtype == np.float32
            assert phase.position.tobytes() == expected.position.tobytes()
            np.testing.assert_array_equal(phase.id, expected.id)
            assert time == pytest.approx(index * made_up.STEP, abs=1e-9)  # the file counts nanoseconds


def test_bodies_and_scalars_come_back_bit_for_bit(record: Callable[..., Path], made_up: ModuleType) -> None:
    replay = Replay(record(FRAMES))
    assert set(replay.bodies) == set(made_up.BODIES)
    assert set(replay.scalars) == {"oil_inside", "tow_tension/port", "probes/gauge"}
    for index in range(FRAMES):
        expected = made_up.make_frame(index)
        for name, series in replay.bodies.items():
            read, written = series.frame(index), expected.bodies[name]
            for part in ("position", "orientation", "linear_velocity", "angular_velocity", "wrench"):
                assert getattr(read, part).tobytes() == getattr(written, part).tobytes()
        for name, scalar in replay.scalars.items():
            assert scalar.index[index] == index
            assert scalar.value[index] == expected.scalars[name]


def test_bodies_that_come_and_go_keep_their_own_instants(tmp_path: Path, made_up: ModuleType) -> None:
    present = [made_up.BODIES[:2], made_up.BODIES[1:], made_up.BODIES[1:], made_up.BODIES]
    with Recorder(tmp_path / "coming.rrd", frame_rate=1.0 / made_up.STEP) as recorder:
        recorder.initialized(made_up.describe())
        for index, names in enumerate(present):
            bodies = {name: made_up.make_frame(index).bodies[name] for name in names}
            recorder.step_completed(Frame(index=index, time=index * made_up.STEP, bodies=bodies))
    read = Replay(tmp_path / "coming.rrd").bodies
    assert {name: series.index.tolist() for name, series in read.items()} == {
        name: [index for index, names in enumerate(present) if name in names] for name in made_up.BODIES
    }
    for name, series in read.items():
        for row, index in enumerate(series.index.tolist()):
            assert series.frame(row).motion.tobytes() == made_up.make_frame(index).bodies[name].motion.tobytes()


def test_segments_of_a_boom_are_drawn_by_one_entity(made_up: ModuleType) -> None:
    drawn = {one.path: one.names for one in drawn_bodies(made_up.describe())}
    assert drawn == {
        "boom/segments": ("boom/segment-00", "boom/segment-01"),
        "vessels/port/hull": ("vessels/port",),
        "bodies/rock": ("rock",),
    }


def test_description_comes_back(record: Callable[..., Path], made_up: ModuleType) -> None:
    written, replay = made_up.describe(), Replay(record(2))
    read = replay.run
    for part in ("name", "text", "properties", "particle_spacing", "phases", "camera"):
        assert getattr(read, part) == getattr(written, part)
    np.testing.assert_array_equal(read.boundaries["tank"], written.boundaries["tank"])
    assert set(read.meshes) == set(written.meshes)
    for name, mesh in written.meshes.items():
        np.testing.assert_array_equal(read.meshes[name].vertices, mesh.vertices)
        np.testing.assert_array_equal(read.meshes[name].faces, mesh.faces)
        assert read.meshes[name].color == mesh.color
        if mesh.face_colors is None:
            assert read.meshes[name].face_colors is None
        else:
            np.testing.assert_array_equal(read.meshes[name].face_colors, mesh.face_colors)
    assert replay.end_reason == "completed"
    assert replay.repaired_from is None


def test_events_come_back_in_order(tmp_path: Path, made_up: ModuleType) -> None:
    events = (
        Event(0.0, "tow begins"),
        Event(0.5, "first loss", "warning", "boom/segment-01"),
        Event(1.0, "x", "error"),
    )
    with Recorder(tmp_path / "log.rrd") as recorder:
        recorder.initialized(made_up.describe())
        for event in events:
            recorder.event(event)
    assert Replay(tmp_path / "log.rrd").events == events


def test_arrays_may_be_reused_after_the_call(tmp_path: Path, made_up: ModuleType) -> None:
    """Rerun keeps references to what it is given; what a body's owner writes later must not reach the file."""
    pose = np.zeros(3)
    with Recorder(tmp_path / "reuse.rrd", frame_rate=1.0 / made_up.STEP) as recorder:
        recorder.initialized(made_up.describe())
        for index in range(20):
            pose[:] = index
            body = made_up.make_frame(index).bodies["rock"]
            moved = type(body)(position=pose, orientation=body.orientation)
            recorder.step_completed(Frame(index=index, time=index * made_up.STEP, bodies={"rock": moved}))
        pose[:] = -1.0
    np.testing.assert_array_equal(Replay(tmp_path / "reuse.rrd").bodies["rock"].pose[:, 0], np.arange(20))


def test_particles_are_not_read_unless_due(tmp_path: Path, made_up: ModuleType) -> None:
    read: list[int] = []

    def frame(index: int) -> Frame:
        def read_phases() -> dict[str, object]:
            read.append(index)
            return {}

        return Frame(index=index, time=index * 0.01, read_phases=read_phases)

    with Recorder(tmp_path / "due.rrd", frame_rate=30.0) as recorder:
        recorder.initialized(made_up.describe())
        for index in range(101):
            recorder.step_completed(frame(index))
    # One second at 30 frames a second: slot k begins at k / 30 s, so the frames are those that first reach it.
    assert read == [int(np.ceil(slot / 30.0 / 0.01 - 1e-6)) for slot in range(31)]


def test_precision_rounds_to_its_grid_and_says_so(record: Callable[..., Path], made_up: ModuleType) -> None:
    grid = 1.0 / 1024.0
    replay = Replay(record(3, precision=grid))
    assert replay.precision == grid
    for index, _, phase in replay.phase_frames("ocean"):
        expected = made_up.make_frame(index).phases["ocean"].position
        assert np.abs(phase.position - expected).max() <= 0.5 * grid
        np.testing.assert_array_equal(phase.position / grid, np.rint(phase.position / grid))


def test_a_thinned_phase_is_recorded_now_and_then(record: Callable[..., Path]) -> None:
    replay = Replay(record(10, every={"ocean": 4}))
    assert [index for index, _, _ in replay.phase_frames("ocean")] == [0, 4, 8]
    assert [index for index, _, _ in replay.phase_frames("oil")] == list(range(10))
    assert replay.thinning == {"ocean": 4}


def test_the_grid_is_the_next_power_of_two_that_is_not_coarser() -> None:
    assert [grid_within(wanted) for wanted in (0.03 / 32, 1 / 1024, 0.001, 0.5, 3.0)] == [
        1 / 2048,
        1 / 1024,
        1 / 1024,
        0.5,
        2.0,
    ]


@pytest.mark.parametrize(
    ("terms", "message"),
    [
        ({"frame_rate": 0.0}, "frame_rate is 0.0 1/s, allowed: above 0"),
        ({"precision": 0.001}, "recording's precision is 0.001 m, allowed: a power of two"),
        ({"every": {"ocean": 0}}, r"every\['ocean'\] is 0, allowed: 1 or more"),
    ],
)
def test_impossible_terms_are_refused(tmp_path: Path, terms: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Recorder(tmp_path / "x.rrd", **terms)  # type: ignore[arg-type]


def test_unwritable_path_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"missing/x.rrd: cannot be written: No such file or directory"):
        Recorder(tmp_path / "missing" / "x.rrd")
    with pytest.raises(RecordingError, match="cannot be written: is a folder"):
        Recorder(tmp_path)


def test_missing_recording_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"nothing.rrd: does not exist"):
        Replay(tmp_path / "nothing.rrd")
