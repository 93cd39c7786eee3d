"""A U of boom holds water, whose stagnation pressure bears on its sides; a boom along which water slides off holds none."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from booms.held_water import Chain, held_pressure
from scenarios.spec.scenario import Scenario
from tests.validation.bodies.without_particles import bare
from tests.validation.windows import u_tension

Double = NDArray[np.float64]
DENSITY, SPEED, DRAFT = 1027.0, 0.5, 0.5
PRESSURE = 0.5 * DENSITY * SPEED**2 * DRAFT  # N/m


def chain_along(points: Double) -> tuple[Double, Chain]:
    """Poses (S, 7) of segments along a line of points (S + 1, 2) [m], and their chain."""
    way = np.diff(points, axis=0)
    yaw = np.arctan2(way[:, 1], way[:, 0])
    pose = np.zeros((len(way), 7))
    pose[:, :2], pose[:, 5], pose[:, 6] = 0.5 * (points[1:] + points[:-1]), np.sin(0.5 * yaw), np.cos(0.5 * yaw)
    length = float(np.hypot(*way.T).mean())
    return pose, Chain(rows=np.arange(len(way)), length=length, draft=DRAFT, middle=0.0)


def u_shape(width: float, side: float) -> Double:
    """A U open to -x: from its upper end along +x, across, and back."""
    x = np.arange(0.0, side, 0.5)
    y = np.arange(0.5 * width, -0.5 * width - 1e-9, -0.5)
    upper, across, lower = (
        np.column_stack([x, np.full_like(x, 0.5 * width)]), np.column_stack([np.full_like(y, side), y]),
        np.column_stack([x[::-1], np.full_like(x, -0.5 * width)]),
    )  # fmt: skip
    return np.concatenate([upper, across, lower])


def push(points: Double, flow: tuple[float, float]) -> Double:
    pose, chain = chain_along(points)
    return held_pressure(pose, chain, np.array(flow), DENSITY)


def test_sides_of_a_u_bear_the_stagnation_pressure_outwards() -> None:
    force = push(u_shape(4.0, 6.0), (SPEED, 0.0))
    upper = force[:12]
    np.testing.assert_allclose(upper[:, 1], PRESSURE * 0.5, rtol=1e-9)  # a side lies along the current: cos a = 1
    np.testing.assert_allclose(force.sum(axis=0), 0.0, atol=1e-9 * PRESSURE)


def test_reversing_the_order_of_the_segments_changes_nothing() -> None:
    forth, back = (push(points, (SPEED, 0.1)) for points in (u_shape(4.0, 6.0), u_shape(4.0, 6.0)[::-1]))
    np.testing.assert_allclose(back[::-1], forth, atol=1e-9)


@pytest.mark.parametrize(
    ("points", "flow"),
    [
        (np.column_stack([np.linspace(0, 20, 21), np.linspace(0, 8, 21)]), (SPEED, 0.0)),  # a diversion boom
        (u_shape(4.0, 6.0), (-SPEED, 0.0)),  # the water runs out of the mouth
        (np.array([[0.0, 2.0], [2.0, 2.0], [4.0, 2.0]]), (SPEED, 0.0)),  # a single side
        (u_shape(4.0, 6.0), (0.0, 0.0)),
    ],
)
def test_where_water_slides_off_none_is_held(points: Double, flow: tuple[float, float]) -> None:
    np.testing.assert_allclose(push(points, flow), 0.0, atol=1e-9)


def test_mouths_wider_than_twenty_drafts_hold_less() -> None:
    """As 20 d over the width."""
    force = push(u_shape(40.0, 30.0), (SPEED, 0.0))
    assert np.abs(force[:, 1]).max() == pytest.approx(PRESSURE * 0.5 * 20.0 * DRAFT / 40.0, rel=1e-9)


def measured() -> list[dict[str, str]]:
    with Path(u_tension.__file__).with_name("u_tension.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize(
    "gap", [u_tension.GAPS[1], *(pytest.param(gap, marks=pytest.mark.slow) for gap in u_tension.GAPS[::2])]
)
def test_a_u_pulls_as_with_particles_around_it(gap: float) -> None:
    """The mean of both drafts; single runs with particles have 0.72 to 1.30 of the formulas'. Without held water it was 0.3 to 0.55."""

    def pull(row: dict[str, str]) -> float:
        return float(row["tension"]) / (
            0.5 * DENSITY * u_tension.SPEED**2 * float(row["draft"]) * gap * u_tension.LENGTH
        )

    rows = [row for row in measured() if float(row["gap"]) == gap and row["resolution"] != "2"]
    scene: Scenario = bare(u_tension.u_in_current(gap, 0.45, 3))
    found = pull({"tension": str(u_tension.tension(scene)), "draft": "0.45"})
    assert found == pytest.approx(math.fsum(map(pull, rows)) / len(rows), rel=0.2)
