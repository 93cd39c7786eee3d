"""The measures behind the paper's figures, on shapes that are known; the figures and conclusions themselves are `make paper`."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
import trimesh

from tests.paper.__main__ import write
from tests.paper.conclusions import Verdict, costs
from tests.paper.shapes import coating, footprint
from tests.paper.timing import Timing, schemes


def grid(width: float, height: float, step: float = 0.01) -> np.ndarray:
    """Points (N, 2) of a rectangle around (3, 2)."""
    x, y = np.meshgrid(np.arange(-width / 2, width / 2, step), np.arange(-height / 2, height / 2, step))
    return np.column_stack([x.ravel() + 3.0, y.ravel() + 2.0])


def turned(places: np.ndarray, degrees: float) -> np.ndarray:
    angle = math.radians(degrees)
    rotation = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    return (places - [3.0, 2.0]) @ rotation.T + [3.0, 2.0]


def test_an_ellipse_has_its_axes_and_its_angle() -> None:
    square = grid(2.0, 2.0)
    inside = np.hypot((square[:, 0] - 3.0), (square[:, 1] - 2.0) / 0.5) < 1.0
    found = footprint(turned(square[inside], 25.0), 0.04)
    assert found.axis_ratio == pytest.approx(2.0, rel=0.03)
    assert found.angle == pytest.approx(25.0, abs=1.0)
    edge = 4.844 * 0.04 / 2.0  # the perimeter's cells are covered half on average, and count whole
    assert found.area == pytest.approx(math.pi * 0.5 + edge, rel=0.02)
    assert found.center == pytest.approx((3.0, 2.0), abs=0.01)
    assert found.patches == 1


@pytest.mark.parametrize(("radius", "corners"), [(0.8, 1.0), (9.0, 1.2)])
def test_a_circle_and_a_square_differ_in_their_corners(radius: float, corners: float) -> None:
    square = grid(1.6, 1.6)
    inside = square[np.hypot(*(square - [3.0, 2.0]).T) < radius]
    found = footprint(inside, 0.04)
    assert found.axis_ratio == pytest.approx(1.0, abs=0.01)
    assert found.corner_ratio == pytest.approx(corners, abs=0.05)


def test_pieces_are_counted_and_drops_are_not() -> None:
    other, drop = grid(0.5, 0.5) + np.array([2.0, 0.0]), np.array([[9.0, 9.0]])
    found = footprint(np.concatenate([grid(1.0, 1.0), other, drop]), 0.05)
    assert found.patches == 2


def test_no_oil_is_refused() -> None:
    with pytest.raises(ValueError, match="there is no oil"):
        footprint(np.zeros((0, 2)), 0.1)


def test_half_a_ball_is_coated() -> None:
    spacing, ball = 0.02, trimesh.creation.icosphere(subdivisions=5, radius=0.5)
    ball.apply_translation([0.0, 0.0, 0.5])
    surface = np.array(ball.vertices)
    above = surface[surface[:, 0] > 0.0]
    film = np.array([0.0, 0.0, 0.5]) + (above - [0.0, 0.0, 0.5]) * (1.0 + spacing)  # half a spacing off the surface
    falling = np.array([[2.0, 0.0, 0.5]])
    found = coating(np.concatenate([film, falling]), surface, spacing, 0.0)
    assert found.covered == pytest.approx(0.5, abs=0.03)
    assert found.volume == pytest.approx(np.count_nonzero(film[:, 2] > 0.0) * spacing**3)
    assert coating(falling, surface, spacing, 0.0).covered == 0.0
    assert coating(film, surface, spacing, 2.0).covered == 0.0  # all lies in the pool


@pytest.mark.parametrize(("change", "holds"), [(1.0, False), (-0.2, False), (-1.5, True)])
def test_a_relaxation_that_saves_time_is_told(change: float, holds: bool) -> None:
    names, oils = list(schemes()), (2.6e-3, 9.0e-3)
    timings = [
        Timing(name=name, viscosity=oil, milliseconds=(10.0 + place * change,) * 2, simulated=0.02, particles=1)
        for oil in oils
        for place, name in enumerate(names)
    ]
    assert [one.holds for one in costs(timings)] == [holds, None, None]


def test_a_report_takes_verdicts_of_measured_numbers(tmp_path: Path) -> None:
    held = np.float64(0.3) > 0.1  # a bool of numpy, as measurements give
    write([Verdict(figure=4, statement="oil drifts", setting="SI", measured="0.3 m", holds=held)], [], 60.0, tmp_path)
    assert json.loads((tmp_path / "paper.json").read_text())["conclusions"][0]["holds"] is True
    assert "| holds |" in (tmp_path / "paper.md").read_text()
