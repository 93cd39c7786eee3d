"""The surface of the sea is recorded at its own rate, read back as it was, and drawn with the oil on it."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from recordings.model import palette
from recordings.model.frame import Frame
from recordings.model.surface import FilmFrame, SurfaceFrame
from recordings.pictures.foam import whitecaps
from recordings.pictures.raster import Canvas, fitted_projection
from recordings.replay.moments import seas_at
from recordings.replay.recording import Replay
from recordings.sink.recorder import Recorder

BOX = (-10.0, -10.0, 10.0, 10.0)
LINES = np.linspace(-12.0, 12.0, 25)


def surface_at(time: float) -> SurfaceFrame:
    height = 0.25 * np.cos(0.5 * LINES[:, None] - time) * np.ones(25)
    return SurfaceFrame(x=LINES, y=LINES, height=height.astype(np.float32), box=BOX)


def film(_: SurfaceFrame) -> FilmFrame:
    thickness = np.zeros((16, 16), np.float32)
    thickness[8:, :] = 2e-3  # on the side of +x
    return FilmFrame(thickness=thickness, box=BOX)


@pytest.fixture
def recording(tmp_path: Path, made_up: ModuleType) -> Path:
    path = tmp_path / "sea.rrd"
    with Recorder(path, frame_rate=10.0, surface_rate=2.5) as recorder:
        recorder.initialized(made_up.describe())
        for index in range(21):
            time = 0.1 * index
            recorder.step_completed(
                Frame(index=index, time=time, read_surface=lambda t=time: surface_at(t), read_film=film)
            )
    return path


def test_the_surface_is_read_back_at_its_rate(recording: Path) -> None:
    seas = seas_at(Replay(recording), range(21))
    for index in range(21):
        recorded = 0.4 * (index // 4)
        np.testing.assert_allclose(seas[index].surface.height, surface_at(recorded).height, atol=0.5 / 256 + 1e-6)
        image = seas[index].image
        assert image is not None
        assert (image[0, 0] == palette.SEA[:3]).all()
        assert (image[-1, 0] == palette.film_colors(np.array(2e-3))).all()


def test_a_recording_that_goes_on_takes_the_surfaces_that_were_to_come(tmp_path: Path, made_up: ModuleType) -> None:
    """Surfaces are due at steps 0, 4 and 8: a recorder that goes on after step 5 has none of step 6 or 7."""

    def take(recorder: Recorder, steps: range) -> None:
        for index in steps:
            time = 0.1 * index
            recorder.step_completed(Frame(index=index, time=time, read_surface=lambda t=time: surface_at(t)))

    terms = {"frame_rate": 10.0, "surface_rate": 2.5}
    with Recorder(tmp_path / "first.rrd", **terms) as first, Recorder(tmp_path / "second.rrd", **terms) as second:
        for recorder in (first, second):
            recorder.initialized(made_up.describe())
        take(first, range(6))
        second.restore_state(first.save_state())
        for recorder in (first, second):
            take(recorder, range(6, 10))
    whole, goes_on = (seas_at(Replay(tmp_path / name), range(6, 10)) for name in ("first.rrd", "second.rrd"))
    assert set(goes_on) == {8, 9}
    for index in (8, 9):
        assert (goes_on[index].surface.height == whole[index].surface.height).all()


def test_the_sea_is_drawn_with_the_oil_where_it_lies(recording: Path) -> None:
    sea = seas_at(Replay(recording), [20])[20]
    corners = np.array([[x, y, 0.0] for x in (-9.0, 9.0) for y in (-9.0, 9.0)])
    projection = fitted_projection(np.array([0.0, -1e-3, 60.0]), np.zeros(3), corners, 90, 90)
    canvas = Canvas(projection, 90, 90)
    canvas.sea(sea.surface, sea.image, palette.SEA, partial(whitecaps, sea.surface, np.zeros(2), 0.0))
    assert np.isfinite(canvas.depth).all()
    brown = canvas.image[..., 0] > canvas.image[..., 2]
    assert not brown[:, :39].any()  # colours run into each other within a cell of the film, six pixels
    assert brown[:, 51:].all()


def test_films_have_the_colours_of_their_thickness() -> None:
    thickness = np.array([0.0, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 5e-4, 5e-3, 2e-2, 0.1])
    colors = palette.film_colors(thickness)
    assert (colors[:2] == palette.SEA[:3]).all()  # too thin to be seen
    assert len({tuple(color) for color in colors[1:].tolist()}) == 9


def test_a_recorder_without_a_rate_records_no_surface(tmp_path: Path, made_up: ModuleType) -> None:
    with Recorder(tmp_path / "none.rrd", surface_rate=0.0) as recorder:
        recorder.initialized(made_up.describe())
        recorder.step_completed(Frame(index=0, time=0.0, scalars={"depth": 1.0}, read_surface=lambda: surface_at(0.0)))
    assert seas_at(Replay(tmp_path / "none.rrd"), [0]) == {}
    with pytest.raises(ValueError, match="surface_rate is -1"):
        Recorder(tmp_path / "none.rrd", surface_rate=-1.0)


def test_films_change_their_colour_where_the_bonn_agreement_and_their_own_words_say() -> None:
    limits = [0.04e-6, 0.3e-6, 5e-6, 50e-6, 200e-6]  # [m] Bonn Agreement Oil Appearance Code
    limits += [1e-3 * float(words.removesuffix(" mm")) for _, words, *_ in palette.FILM if words.endswith(" mm")]
    colors = {tuple(palette.film_colors(np.array([[0.0]]))[0, 0])}
    for limit in sorted(set(np.round(limits, 9))):
        (below, above) = palette.film_colors(np.array([0.99, 1.01])[:, None] * limit)[:, 0]
        assert tuple(below) in colors
        assert tuple(above) not in colors, limit
        colors.add(tuple(above))
    assert len(colors) == 1 + len(palette.FILM)
