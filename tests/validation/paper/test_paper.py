"""The measures behind the paper's figures, on shapes that are known, and each case in miniature."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import trimesh

from tests.validation.case import Bench, Case, Outcome
from tests.validation.paper import rock, spreading, timing
from tests.validation.paper.runs import OILS, Scene, follow, over
from tests.validation.paper.shapes import Footprint, covered, footprint, thickness


def grid(width: float, height: float, step: float = 0.01) -> np.ndarray:
    """Points (N, 2) of a rectangle around (3, 2)."""
    x, y = np.meshgrid(np.arange(-width / 2, width / 2, step), np.arange(-height / 2, height / 2, step))
    return np.column_stack([x.ravel() + 3.0, y.ravel() + 2.0])


def turned(places: np.ndarray, degrees: float) -> np.ndarray:
    angle = math.radians(degrees)
    rotation = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    return (places - [3.0, 2.0]) @ rotation.T + [3.0, 2.0]


@pytest.mark.parametrize("angle", [0.0, 25.0, 90.0])
def test_an_ellipse_has_its_axes_and_lies_along_x_or_not(angle: float) -> None:
    square = grid(2.0, 2.0)
    inside = np.hypot((square[:, 0] - 3.0), (square[:, 1] - 2.0) / 0.5) < 1.0
    found = footprint(turned(square[inside], angle), 0.04)
    assert found.axis_ratio == pytest.approx(2.0, rel=0.03)
    # moments of the axes 2 and 1, turned: (4 sin² + cos²) / (4 cos² + sin²)
    sine, cosine = math.sin(math.radians(angle)) ** 2, math.cos(math.radians(angle)) ** 2
    assert found.width_over_length**2 == pytest.approx((4.0 * sine + cosine) / (4.0 * cosine + sine), rel=0.06)
    edge = 4.844 * 0.04 / 2.0  # the perimeter's cells are covered half on average, and count whole
    assert found.area == pytest.approx(math.pi * 0.5 + edge, rel=0.02)
    assert found.center == pytest.approx((3.0, 2.0), abs=0.01)


@pytest.mark.parametrize(("radius", "corners"), [(0.8, 1.0), (9.0, 1.2)])
def test_a_circle_and_a_square_differ_in_their_corners(radius: float, corners: float) -> None:
    square = grid(1.6, 1.6)
    inside = square[np.hypot(*(square - [3.0, 2.0]).T) < radius]
    found = footprint(inside, 0.04)
    assert found.axis_ratio == pytest.approx(1.0, abs=0.01)
    assert found.corner_ratio == pytest.approx(corners, abs=0.05)


def test_no_oil_is_refused() -> None:
    with pytest.raises(ValueError, match="there is no oil"):
        footprint(np.zeros((0, 2)), 0.1)


def test_a_map_keeps_all_oil_and_has_its_thickness_inside() -> None:
    """A rectangle of 2 x 1 m in the corner of a tank, whose particles of 8 cm3 stand 2 cm apart."""
    places = grid(2.0, 1.0, 0.02) + np.array([-1.99, -1.49])
    found = thickness(places, 0.02**3, (0.0, 4.0, 0.0, 2.0), 0.1)
    assert found.shape == (20, 40)
    assert found.sum() * 0.1**2 == pytest.approx(len(places) * 0.02**3, rel=1e-12)
    assert found[:5, :15] == pytest.approx(0.02, rel=1e-3)
    assert found[15:].max() == 0.0


def test_half_a_ball_is_coated() -> None:
    ball = trimesh.creation.icosphere(subdivisions=5, radius=0.5)
    ball.apply_translation([0.0, 0.0, 0.5])
    surface = np.array(ball.vertices)
    above = surface[surface[:, 0] > 0.0]
    film = np.array([0.0, 0.0, 0.5]) + (above - [0.0, 0.0, 0.5]) * 1.02
    falling = np.array([[2.0, 0.0, 0.5]])
    assert covered(np.concatenate([film, falling]), surface, 0.03, 0.0) == pytest.approx(0.5, abs=0.03)
    assert covered(falling, surface, 0.03, 0.0) == 0.0
    assert covered(film, surface, 0.03, 2.0) == 0.0  # all lies in the pool


@pytest.mark.parametrize(("whole", "ratio"), [(2.0, 0.5), (0.0, math.inf), (-2.0, math.inf)])
def test_no_drift_with_the_wind_is_below_no_bound(whole: float, ratio: float) -> None:
    assert over(1.0, whole) == ratio


def slick(x: float, area: float = 1.0, near_side: bool = False) -> spreading.Slick:
    """Oil around `x`, half as wide as long."""
    shape = Footprint(area=area, axis_ratio=2.0, width_over_length=0.5, corner_ratio=1.0, center=(x, 1.0))
    return spreading.Slick(shape, near_side, np.zeros((2, 4)), (0.0, 4.0, 0.0, 2.0))


def test_drift_is_the_way_along_the_wind() -> None:
    """Three oils go 0.4, 0.3 and 0.2 m towards -x, and the thinnest 0.05 m in a calm."""
    ways = iter([0.4, 0.3, 0.2, 0.05] * 2)
    runs = {scene: [slick(2.0), slick(2.0 - next(ways))] for scene in spreading.wind_scenes(20)}
    found = spreading.wind_outcome(runs).values
    assert found["drift of the thinnest oil, split scheme"] == pytest.approx(0.4)
    assert found["drift in a calm over that in wind, split scheme"] == pytest.approx(0.05 / 0.2)
    assert found["drift of the thickest oil over the thinnest, split scheme"] == pytest.approx(0.2 / 0.4)
    assert found["width over length along the wind, split scheme"] == 0.5


def test_areas_are_compared_before_the_first_oil_comes_near_a_side() -> None:
    """Oils grow by 0.3, 0.2 and 0.1 m2 a sample, and the thinnest is near a side in the sixth."""
    growth = iter([0.3, 0.2, 0.1] * 3)
    runs = {
        scene: [slick(2.0, 1.0 + k * more, near_side=more == 0.3 and k >= 5) for k in range(9)]
        for scene, more in zip(spreading.calm_scenes(20), growth, strict=True)
    }
    found = spreading.calm_outcome(runs).values
    assert found["time until the sides, paper's scheme"] == pytest.approx(4 * 0.05)
    assert found["area of a thicker oil over a thinner one's, paper's scheme"] == pytest.approx(1.8 / 2.2)


@pytest.mark.parametrize(("change", "passes"), [(1.0, False), (-0.2, False), (-1.5, True)])
def test_a_relaxation_that_saves_time_is_told(change: float, passes: bool) -> None:
    found = timing.outcome(
        {(one, oil): [10.0 + k * change] * 2 for oil in OILS[:2] for k, one in enumerate(timing.SETTINGS)}
    )
    first = timing.PAPER_TIMING.quantities[0]
    assert first.passes([found.values[first.name]]) is passes


def whole(case: Case, outcome: Outcome) -> None:
    """Assert that an outcome has a value for each quantity, and a curve for each panel."""
    assert set(outcome.values) == {one.name for one in case.quantities}
    assert {one.panel for one in outcome.traces} == {one.name for one in case.panels}


@pytest.mark.parametrize(
    ("case", "scenes", "look", "outcome", "shape"),
    [
        (spreading.PAPER_CALM, spreading.calm_scenes(20), spreading.look, spreading.calm_outcome, (3, 6)),
        (spreading.PAPER_WIND, spreading.wind_scenes(20), spreading.look, spreading.wind_outcome, (3, 6)),
        (rock.PAPER_ROCK, rock.scenes(6), rock.look, rock.outcome, (3, 4)),
    ],
    ids=["calm", "wind", "rock"],
)
def test_a_figure_in_miniature(
    case: Case, scenes: list[Scene], look: Callable[..., Any], outcome: Callable[..., Outcome], shape: tuple[int, int]
) -> None:
    shares: list[float] = []
    bench = Bench(threads=1, progress=shares.append)
    found = outcome(follow([replace(scene, duration=0.1) for scene in scenes], bench, look))
    whole(case, found)
    assert (len(found.maps), len(found.maps[0])) == shape
    assert shares[-1] == pytest.approx(1.0)
    assert bench.particle_steps > 0


def test_steps_in_miniature(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(timing, "DURATION", 0.05)
    found = timing.paper_timing(20, Bench(threads=1))
    whole(timing.PAPER_TIMING, found)
    assert all(value > 0.0 for value in found.values.values())
