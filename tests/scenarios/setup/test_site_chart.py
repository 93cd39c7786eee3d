"""The chart of a site: where its points put it, what is refused, and what is told."""

from __future__ import annotations

import importlib.util
import math
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.path import Path as Polygon
from PIL import Image

from recordings.model.exercise import ChartImage, site_from_json, to_json
from recordings.model.frame import RunDescription
from recordings.pictures.chart import draw_land
from recordings.replay.moments import Moment
from scenarios.cli import main
from scenarios.schema.run_settings import ChartSettings, SiteSettings
from scenarios.setup.site_chart import SiteChart, read_chart
from scenarios.spec.load import load_scenario
from scenarios.text.problems import Problem
from tests.scenarios.setup.chart_images import BLACK, SCALE, SIZE, TURN, draw_chart, fixed_points, place_of

SITE = SiteSettings(latitude=57.66, longitude=11.7, bearing=math.radians(250.0))
TWO = ((0, 0), (300, 200))
SCRIPT = Path(__file__).parents[3] / "docs" / "harbour_chart.py"


def laid(file: Path, points: list[list[float]]) -> tuple[SiteChart, list[Problem]]:
    """The chart of the site with these points, and the problems."""
    problems: list[Problem] = []
    given = ChartSettings(file=str(file), points=tuple(map(tuple, points)))  # type: ignore[misc]
    return read_chart(replace(SITE, chart=given), problems), problems


@pytest.fixture
def file(tmp_path: Path) -> Path:
    draw_chart(tmp_path / "chart.png")
    return tmp_path / "chart.png"


def places(chart: ChartImage, pixels: np.ndarray) -> np.ndarray:
    """Where pixels (N, 2) lie [m]."""
    (x, y), (east, north) = chart.origin, chart.along
    return np.array([x, y]) + pixels @ np.array([[east, north], [north, -east]])


@pytest.mark.parametrize("pixels", [TWO, ((30, 180), (250, 20), (120, 100)), ((0, 0), (300, 0), (300, 200), (0, 200))])
def test_points_put_the_chart_where_it_lies(file: Path, pixels: tuple[tuple[int, int], ...]) -> None:
    chart, problems = laid(file, fixed_points(SITE.recorded, pixels))
    assert problems == [] and chart.image is not None and chart.notes == ()
    corners = np.array([(0, 0), (300, 0), (300, 200), *BLACK], float)
    assert places(chart.image, corners) == pytest.approx(place_of(corners), abs=1e-6)
    up = round(250.0 - math.degrees(TURN) - 90.0) % 360
    assert chart.facts[0] == f"chart chart.png: a pixel is 0.25 m wide, up is {up:03d}°"


def test_a_point_that_is_read_wrongly_is_told_with_what_it_misses(file: Path) -> None:
    """One of four corners of a square is d off along a side: the least squares leave d / 4 at each, turned."""
    rows = fixed_points(SITE.recorded, ((50, 0), (250, 0), (250, 200), (50, 200)))
    for slip, warned in ((3.0, False), (30.0, True)):
        wrong = [[rows[0][0] + slip, *rows[0][1:]], *rows[1:]]
        chart, problems = laid(file, wrong)
        assert problems == [] and chart.image is not None
        pixels, there = np.array(wrong)[:, :2], place_of(np.array(rows)[:, :2])
        worst = np.linalg.norm(places(chart.image, pixels) - there, axis=1).max()
        assert SCALE * slip / 4.0 <= worst <= SCALE * slip
        words = " ".join(chart.notes if warned else chart.facts)
        assert f"the worst is {worst:.3g} m" in words
        assert bool(chart.notes) == warned


def rows_of(change: str) -> list[list[float]]:
    """Points of the test's chart with one fault."""
    rows = fixed_points(SITE.recorded, ((0, 0), (300, 0), (150, 200)))
    if change == "outside":
        rows[1][0] = 3000.0
    elif change == "swapped":
        rows = [[*one[:2], one[3], one[2]] for one in rows]
    elif change == "one place":
        rows = [[*one[:2], *rows[0][2:]] for one in rows]
    elif change == "one pixel":
        rows = [[10.0, 10.0 + index, *one[2:]] for index, one in enumerate(rows)]
    elif change == "mirrored":
        rows = [[one[0], 200.0 - one[1], *one[2:]] for one in rows]
    return rows


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ("outside", "point 2 is pixel 3000, 0, allowed: within the image of 300 by 200 pixels"),
        ("swapped", "km from the site, allowed: up to 100 km, as pixel x, pixel y, longitude, latitude"),
        ("one place", "makes a pixel 0 m wide, allowed: 0.01 to 100 m"),
        ("one pixel", "has points at most 2 pixels apart, allowed: 18 pixels, a twentieth of the diagonal, or more"),
        ("mirrored", "fits a mirrored chart, allowed: pixels right of and below the image's upper left corner"),
    ],
)
def test_points_that_cannot_be_right_are_refused(file: Path, change: str, told: str) -> None:
    chart, problems = laid(file, rows_of(change))
    assert chart.image is None
    assert [problem.path for problem in problems] == ["site.chart.points"]
    assert problems[0].text.startswith("chart.png: ") and problems[0].text.endswith(told)


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (None, "No such file or directory"),
        (b"no image", "cannot be read as an image, allowed: PNG or JPEG"),
        ("cut", "cannot be read as an image, allowed: PNG or JPEG"),
        (b"\0" * 4_000_001, "holds 4 MB, allowed: up to 4 MB"),
    ],
)
def test_a_file_that_is_no_image_is_refused(file: Path, content: bytes | str | None, told: str) -> None:
    points = fixed_points(SITE.recorded, TWO)
    if content is None:
        file.unlink()
    else:
        file.write_bytes(file.read_bytes()[:-60] if isinstance(content, str) else content)
    chart, problems = laid(file, points)
    assert chart.image is None
    assert [problem.path for problem in problems] == ["site.chart.file"]
    assert problems[0].text.endswith(told)


def test_a_photograph_counts_its_pixels_as_it_is_shown(tmp_path: Path) -> None:
    """A camera held upright stores 200 by 300 pixels, and that they are to be turned."""
    turned = Image.new("RGB", SIZE[::-1], "white")
    exif = turned.getexif()
    exif[0x0112] = 6  # orientation
    turned.save(tmp_path / "photo.jpg", exif=exif)
    chart, problems = laid(tmp_path / "photo.jpg", fixed_points(SITE.recorded, ((0, 0), SIZE)))
    assert problems == [] and chart.image is not None
    assert chart.image.image.startswith("data:image/jpeg;base64,")


def test_the_debrief_draws_the_chart_in_its_place(file: Path) -> None:
    """The black rectangle of a chart that a recording's text has kept is dark on the map, to within a pixel of its edges."""
    chart, _ = laid(file, fixed_points(SITE.recorded, TWO))
    site = site_from_json(to_json(replace(SITE.recorded, chart=chart.image)))
    assert site is not None and site.chart == chart.image
    figure = Figure(figsize=(4.0, 4.0), dpi=100)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(-60.0, 80.0), ylim=(-90.0, 50.0))
    limits = axes.get_xlim(), axes.get_ylim()
    draw_land(
        axes,
        RunDescription(name="one", particle_spacing=1.0, site=site),
        Moment(time=0.0, bodies={}, positions={}, lost={}),
    )
    axes.axis("off")
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    dark = np.asarray(canvas.buffer_rgba())[..., 0] < 150
    assert (axes.get_xlim(), axes.get_ylim()) == limits
    rows, columns = np.mgrid[0:400, 0:400] + 0.5
    points = np.stack([columns * 0.35 - 60.0, 50.0 - rows * 0.35], axis=-1).reshape(-1, 2)
    for margin, inside in ((1.5 * 0.35, True), (-1.5 * 0.35, False)):
        outline = Polygon(shrunk(margin))
        covered = outline.contains_points(points).reshape(400, 400)
        assert dark[covered].all() if inside else not dark[~covered].any()


def shrunk(margin: float) -> np.ndarray:
    """The corners [m] of the black rectangle, its sides moved inwards by a margin [m]."""
    step = margin / SCALE
    signs = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)])
    return place_of(np.array(BLACK) + step * signs)


def script() -> ModuleType:
    """The program that draws the chart of harbour-1km."""
    spec = importlib.util.spec_from_file_location("harbour_chart", SCRIPT)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_chart_of_the_harbour_lies_where_it_was_drawn(tmp_path: Path) -> None:
    drawer, scenario = script(), load_scenario("harbour-1km").scenario
    problems: list[Problem] = []
    chart = read_chart(scenario.site, problems)
    assert problems == [] and chart.image is not None
    back = drawer.chart_points(drawer.site(), places(chart.image, np.array([(0, 0), (1400, 0), (700, 1100)], float)))
    assert back == pytest.approx(np.array([(0, 0), (1400, 0), (700, 1100)], float), abs=0.5)


def test_a_new_copy_takes_its_chart_along(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    copy = tmp_path / "mine.toml"
    assert main(["new", "harbour-1km", "--to", str(copy)]) == 0
    assert "harbour-1km.png" in capsys.readouterr().out
    problems: list[Problem] = []
    assert read_chart(load_scenario(copy).scenario.site, problems).image is not None
    copy.unlink()
    assert main(["new", "harbour-1km", "--to", str(copy)]) == 2
    assert "harbour-1km.png', which is there already" in "".join(capsys.readouterr().err.split("\n"))
    (tmp_path / "harbour-1km.png").unlink()
    assert main(["new", "harbour-1km", "--to", str(copy)]) == 0
