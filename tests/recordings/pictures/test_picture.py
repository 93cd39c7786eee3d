"""The picture shows what is there: areas, hiding and clearness by formula, and the whole page by its colours."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import ModuleType

import matplotlib.image
import numpy as np
import pytest

from recordings.model.exercise import BoomDescription, ExerciseDescription
from recordings.model.frame import BodyFrame, CameraView, Frame, PhaseFrame
from recordings.model.surface import SurfaceFrame
from recordings.pictures.picture import draw_picture
from recordings.pictures.raster import Canvas, Projection, fitted_projection
from recordings.pictures.scenes import SceneView
from recordings.replay.moments import DrawnSea, Moment, key_steps, placed_vertices
from recordings.sink.plots import plots_with_series
from recordings.sink.recorder import Recorder

SIZE = 200  # pixels
FOCAL = 400.0
RED, BLUE = (255, 0, 0, 255), (0, 0, 255, 255)


def _canvas(fineness: int = 1) -> Canvas:
    """A camera in the origin that looks along +y, x to the right."""
    axes = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    center = np.array([0.5 * SIZE, 0.5 * SIZE])
    projection = Projection(eye=np.zeros(3), axes=axes, focal=FOCAL, center=center)
    canvas = Canvas(projection, SIZE, SIZE, fineness=fineness)
    canvas.image[:] = 1.0
    return canvas


def _square(distance: float, half: float) -> tuple[np.ndarray, np.ndarray]:
    corners = np.array([[x, distance, z] for x in (-half, half) for z in (-half, half)])
    return corners, np.array([[0, 1, 3], [0, 3, 2]])


def test_a_ball_covers_a_disc() -> None:
    distance, radius = 4.0, 0.3
    canvas = _canvas()
    canvas.spheres(np.array([[0.0, distance, 0.0]]), radius, RED)
    covered = np.isfinite(canvas.depth).sum()
    disc = np.pi * (radius * FOCAL / distance) ** 2
    assert covered == pytest.approx(disc, rel=0.03)  # pixels on the rim, about one in 2 pi r of pi r^2
    assert canvas.depth.min() == pytest.approx(distance - radius, abs=2e-3)


def test_a_square_covers_its_projection_and_lies_at_its_depth() -> None:
    distance, half = 5.0, 0.7
    canvas = _canvas()
    canvas.triangles(*_square(distance, half), RED)
    shown = np.isfinite(canvas.depth)
    assert shown.sum() == (2 * half * FOCAL / distance) ** 2  # its edges lie between pixels
    np.testing.assert_allclose(canvas.depth[shown], distance)


@pytest.mark.parametrize("distance", [3.0, 30.0])
@pytest.mark.parametrize("fineness", [1, 2])
def test_a_line_is_as_wide_near_as_far_and_lies_on_what_it_touches(distance: float, fineness: int) -> None:
    half, width = 0.2 * distance, 4.0
    canvas = _canvas(fineness)
    canvas.triangles(*_square(distance, 3.0 * half), BLUE)
    canvas.lines(np.array([[[-half, distance, 0.0], [half, distance, 0.0]]]), width, np.array([RED]))
    length = 2.0 * half * FOCAL / distance
    assert (canvas.image[..., 0] == 1.0).sum() == pytest.approx(width * length * fineness**2, rel=1e-9)
    assert canvas.shown.shape == (SIZE, SIZE, 3)


def test_a_boom_too_thin_to_be_seen_is_widened_and_the_picture_says_so(made_up: ModuleType) -> None:
    boom = BoomDescription(
        name="main", segments=("boom/a",), ends=("b", "c"), length=1.0, skirt_depth=0.5, freeboard=0.25, waterline=0.0,
        joint_points=((-0.5, 0.0, 0.0), (0.5, 0.0, 0.0)), full_tension=1.0,
    )  # fmt: skip
    run = replace(made_up.describe(), meshes={}, exercise=ExerciseDescription(booms=(boom,)))
    notes = {}
    for way in (2.0, 1000.0):  # [m] from the boom to a rock, both in the picture
        bodies = {name: BodyFrame(position=np.array([x, 0.0, 0.0]), orientation=np.array([0.0, 0.0, 0.0, 1.0]))
                  for name, x in (("boom/a", 0.0), ("rock", way))}  # fmt: skip
        run = replace(run, camera=CameraView((0.0, -2.0 * way, way), (0.0, 0.0, 0.0)))
        notes[way] = SceneView(run, [Moment(time=0.0, positions={}, bodies=bodies)], 300).note
    assert notes[2.0] == ""
    times = float(notes[1000.0].removeprefix("boom drawn ").partition(" ")[0])
    shown = 0.25 * (1.0 - 2.0 * 0.04) * 300 / 1000.0  # [pixels] of the freeboard, beside margins of 0.04
    assert times == pytest.approx(2.0 / shown, rel=0.05)


@pytest.mark.parametrize("near_first", [True, False])
def test_what_is_nearer_hides_what_is_farther(near_first: bool) -> None:
    squares = [(_square(3.0, 0.2), RED), (_square(6.0, 0.9), BLUE)]
    canvas = _canvas()
    for (vertices, faces), color in squares if near_first else reversed(squares):
        canvas.triangles(vertices, faces, color)
    red_in_the_middle, _, blue = canvas.image[SIZE // 2, SIZE // 2]
    assert red_in_the_middle > 0.3 and blue == 0.0
    assert canvas.image[SIZE // 2, SIZE // 2 + 40][2] > 0.3


def test_water_takes_light_by_its_thickness() -> None:
    """A slab of thickness s lets exp(-s / a) of a white ground through; black water adds nothing of its own."""
    spacing, clearness = 0.05, 0.8
    lattice = ((-0.8, 32), (3.0, 12), (-0.8, 32))  # twelve layers: 0.6 m thick
    x, y, z = np.meshgrid(*(start + spacing * (np.arange(count) + 0.5) for start, count in lattice))
    points = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    canvas = _canvas()
    canvas.water(points, spacing, (0, 0, 0, 255), clearness)
    middle = canvas.image[SIZE // 2 - 30 : SIZE // 2 + 30, SIZE // 2 - 30 : SIZE // 2 + 30]
    # The balls overlap in the picture as the slab is seen in perspective, hence 5 %.
    assert np.median(middle) == pytest.approx(np.exp(-0.6 / clearness), rel=0.05)


def test_oil_shows_through_water_in_front_and_not_behind() -> None:
    water = np.random.default_rng(1).uniform([-0.5, 2.0, -0.5], [0.5, 2.5, 0.5], (4000, 3))
    hidden, open_ = _canvas(), _canvas()
    hidden.spheres(np.array([[0.0, 3.0, 0.0]]), 0.2, RED)
    open_.spheres(np.array([[0.0, 1.5, 0.0]]), 0.2, RED)
    for canvas in (hidden, open_):
        canvas.water(water, 0.06, BLUE, 0.5)
    behind, before = hidden.image[SIZE // 2, SIZE // 2], open_.image[SIZE // 2, SIZE // 2]
    assert 0.05 < behind[0] < before[0]
    assert behind[2] > before[2] + 0.2


def test_a_fitted_camera_sees_every_point() -> None:
    points = np.random.default_rng(2).normal(size=(500, 3))
    projection = fitted_projection(np.array([6.0, -9.0, 5.0]), np.zeros(3), points, 300, 150)
    pixels, depth = projection(points)
    assert (pixels > -1e-6).all() and (pixels < np.array([300, 150]) + 1e-6).all()
    assert (depth > 0.0).all()
    touching = [pixels[:, 0].min() < 1e-6, pixels[:, 1].min() < 1e-6]
    assert any(touching)


def test_water_alone_below_a_drawn_surface_is_framed_by_itself(made_up: ModuleType) -> None:
    """Without bodies and oil the camera once zoomed in on a point, and a ball took billions of pixels."""
    run = replace(made_up.describe(), meshes={}, camera=None)
    lines = np.array([0.0, 4.0])
    surface = SurfaceFrame(x=lines, y=lines, height=np.zeros((2, 2), np.float32), box=(0, 4, 0, 4), is_clear=True)
    water = np.random.default_rng(1).uniform(0.0, [4.0, 4.0, 0.5], (400, 3)).astype(np.float32)
    moment = Moment(time=0.0, positions={"ocean": water}, bodies={}, sea=DrawnSea(surface=surface, image=None))
    image = SceneView(run, [moment], 300).draw(moment)
    blue = image[..., 2] > image[..., 0] + 0.1
    assert 0.7 < blue.any(axis=0).mean() < 1.0  # nearly as wide as the picture, and with a margin
    assert blue.mean() < 0.5


def test_placed_vertices_turn_by_the_quaternion() -> None:
    quarter = np.array([0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)])  # 90 degrees about z: x goes to y
    body = BodyFrame(position=np.array([1.0, 2.0, 3.0]), orientation=quarter)
    np.testing.assert_allclose(placed_vertices(np.array([[2.0, 0.0, 0.5]]), body), [[1.0, 4.0, 3.5]], atol=1e-12)


def test_key_steps_begin_and_end_with_the_run() -> None:
    steps = [(index, 0.1 * index) for index in range(11)]
    assert [index for index, _ in key_steps(steps, 3)] == [0, 5, 10]
    assert [index for index, _ in key_steps(steps[:1], 3)] == [0]


def test_plots_show_only_what_was_recorded() -> None:
    names = [
        "tow_tension/port",
        "probes/gauge",
        "probes/box/x",
        "probes/box/force_x",
        "probes/box/roll_deg",
        "oil_lost",
        "other",
    ]
    assert plots_with_series({}, names) == {
        "Oil held and lost [m³]": ["oil_lost"],
        "Probe gauge": ["probes/gauge"],
        "Probe box: position [m]": ["probes/box/x"],
        "Probe box: force [N]": ["probes/box/force_x"],
        "Probe box: angles [deg]": ["probes/box/roll_deg"],
        "Tow tension [N]": ["tow_tension/port"],
    }
    own = plots_with_series({"Gauge [m]": ("probes/gauge",), "Nothing": ("probes/none",)}, names)
    assert own["Gauge [m]"] == ["probes/gauge"]
    assert {"Nothing", "Probe gauge"} & set(own) == set()
    assert "Probe box: position [m]" in own


def test_picture_of_a_recording_shows_oil_water_and_bodies(made_up: ModuleType, tmp_path: Path) -> None:
    spacing = made_up.describe().particle_spacing
    x, y, z = np.meshgrid(*(spacing * np.arange(count) for count in (24, 16, 5)), indexing="ij")
    water = np.column_stack([x.ravel(), y.ravel(), z.ravel()]).astype(np.float32)
    oil = water[:200] * np.float32(0.5) + np.float32([0.5, 0.5, 0.5])
    ids = np.arange(len(water), dtype=np.uint32)
    body = BodyFrame(position=np.array([2.0, 0.0, 0.4]), orientation=np.array([0.0, 0.0, 0.0, 1.0]))
    with Recorder(tmp_path / "scene.rrd") as recorder:
        recorder.initialized(made_up.describe())
        for index in range(3):
            phases = {"ocean": PhaseFrame(water, ids), "oil": PhaseFrame(oil, ids[:200])}
            frame = Frame(
                index=index, time=0.1 * index, bodies={"boom/segment-00": body}, read_phases=lambda p=phases: p
            )
            recorder.step_completed(frame)
    draw_picture(tmp_path / "scene.rrd", tmp_path / "picture.png")
    image = matplotlib.image.imread(tmp_path / "picture.png")[..., :3]
    assert image.shape == (1200, 1920, 3)
    red, green, blue = np.moveaxis(image[140:550, 80:1880], -1, 0)
    dark_oil = (red < 0.35) & (green < 0.25) & (blue < 0.2) & (red > blue)
    water_blue = (blue > red + 0.1) & (blue > 0.4)
    assert dark_oil.mean() > 1e-3
    assert water_blue.mean() > 0.1
