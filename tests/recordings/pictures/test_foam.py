"""The sea of a picture is as white as its wind makes it, where waves break; not in a calm, and not where oil lies."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pytest

from recordings.model import palette
from recordings.model.exercise import ExerciseDescription
from recordings.model.frame import Frame, RunDescription
from recordings.model.surface import SurfaceFrame
from recordings.pictures.foam import whitecaps
from recordings.pictures.raster import Canvas, fitted_projection
from recordings.replay.moments import read_moments, recorded_steps
from recordings.replay.recording import Replay
from recordings.sink.recorder import Recorder

HALF, LENGTH = 60.0, 20.0  # [m] of the seen sea to each side; of its waves
WIDE = 1000.0  # [m] of the box to each side
LINES = np.linspace(-HALF, HALF, 121)


def _drawn(wind: tuple[float, float], height: float = 0.0, image: np.ndarray | None = None) -> np.ndarray:
    """Return the picture (300, 400, 3) of a sea with waves of a height [m] that run along x, seen from above at a slant."""
    waves = np.repeat(0.5 * height * np.cos(2.0 * np.pi * LINES / LENGTH)[:, None], len(LINES), axis=1)
    surface = SurfaceFrame(x=LINES, y=LINES, height=waves.astype(np.float32), box=(-WIDE, -WIDE, WIDE, WIDE))
    corners = np.array([[x, y, 0.0] for x in (-HALF, HALF) for y in (-HALF, HALF)])
    projection = fitted_projection(np.array([0.0, -150.0, 120.0]), np.zeros(3), corners, 400, 300)
    canvas = Canvas(projection, 400, 300)
    canvas.sea(surface, image, palette.SEA, partial(whitecaps, surface, np.array(wind), 7.0))
    return canvas.image


def _white(wind: tuple[float, float], height: float = 0.0, image: np.ndarray | None = None) -> np.ndarray:
    """Return the share (300, 400) [1] of the way from the colour without wind to that of foam."""
    bare = _drawn((0.0, 0.0), height, image)
    return np.asarray(((_drawn(wind, height, image) - bare) / (0.95 - bare)).mean(axis=2))


@pytest.mark.parametrize("height", [0.0, 0.5])
@pytest.mark.parametrize(("speed", "share"), [(5.0, 0.00093), (8.0, 0.0046), (12.0, 0.0184)])
def test_the_sea_is_as_white_as_in_the_wind(speed: float, share: float, height: float) -> None:
    """Shares by hand: 3.84e-6 U^3.41."""
    assert _white((0.6 * speed, 0.8 * speed), height).mean() == pytest.approx(share, rel=0.2)


@pytest.mark.parametrize("speed", [0.0, 3.0])
def test_no_foam_in_light_winds(speed: float) -> None:
    assert not _white((speed, 0.0), 0.5).any()


def test_foam_lies_before_the_crests() -> None:
    """The quarter of a wave that begins at the crest, downwind, has most of it, and the troughs have hardly any."""
    places = np.random.default_rng(1).uniform(-HALF, HALF, (40_000, 2))
    waves = np.repeat(0.25 * np.cos(2.0 * np.pi * LINES / LENGTH)[:, None], len(LINES), axis=1)
    surface = SurfaceFrame(x=LINES, y=LINES, height=waves.astype(np.float32), box=(-WIDE, -WIDE, WIDE, WIDE))
    for sign in (1.0, -1.0):
        foam = whitecaps(surface, np.array([12.0 * sign, 0.0]), 0.0, places, np.full(len(places), 0.1))
        quarter = (sign * places[:, 0] / LENGTH % 1.0 * 4.0).astype(int)
        shares = np.bincount(quarter, weights=foam) / foam.sum()
        assert shares[0] > 0.5 and shares[2] < 0.05


def test_oil_stays_free_of_foam() -> None:
    """All foam lies on the half without oil, and that half is as white as the wind makes it."""
    image = np.full((200, 200, 3), palette.SEA[:3], np.uint8)
    image[:100] = palette.OIL[:3]
    white = _white((12.0, 0.0), 0.0, image)
    assert not white[:, :190].any()  # x grows to the right, and edges of oil are soft
    assert white[:, 230:].mean() == pytest.approx(0.0184, rel=0.2)


@pytest.mark.parametrize("is_recorded", [True, False])
def test_a_moment_has_the_wind_of_its_time_or_that_of_the_start(tmp_path: Path, is_recorded: bool) -> None:
    with Recorder(tmp_path / "veers.rrd", frame_rate=1.0) as recorder:
        recorder.initialized(
            RunDescription(name="veers", particle_spacing=0.1, exercise=ExerciseDescription(wind=(5.0, 0.0)))
        )
        for index in range(3):
            scalars = (
                {"metrics/wind/x": 5.0, "metrics/wind/y": 2.0 * index} if is_recorded else {"metrics/time_step": 1.0}
            )
            recorder.step_completed(Frame(index=index, time=float(index), bodies={}, scalars=scalars, read_phases=dict))
    replay = Replay(tmp_path / "veers.rrd")
    moments = read_moments(replay, recorded_steps(replay))
    assert [one.wind for one in moments] == [(5.0, 2.0 * index if is_recorded else 0.0) for index in range(3)]
