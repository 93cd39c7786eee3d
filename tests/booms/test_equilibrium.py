"""Tied booms in a stream: closed forms of the catenary, balance of forces, and ties that cannot hold."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from booms.deployment import stream_chain
from booms.equilibrium import HangingBoom, Tie, tied_lines

Array = NDArray[np.float64]
DOWN = math.pi  # [rad] the stream runs to -x


def hung(first: tuple[float, float], second: tuple[float, float], length: float, segments: int) -> Array:
    """A boom's own catenary in that stream, from north to south."""
    way = (np.array(second) - np.array(first)) / length
    chain = length * stream_chain(segments, -float(way[1]), -float(way[0]))
    return np.array(first) + np.stack([-chain[:, 1], -chain[:, 0]], axis=1)


def open_apex(width: float) -> tuple[Array, Array]:
    booms = {
        "port": HangingBoom(line=hung((0.0, 15.0), (-34.0, 2.0), 40.0, 20), load=0.5, held=(True, False)),
        "starboard": HangingBoom(line=hung((-34.0, -2.0), (0.0, -15.0), 40.0, 20), load=0.5, held=(False, True)),
    }
    found = tied_lines(booms, [Tie(name="apex", ends=(("port", 20), ("starboard", 0)), length=width)], DOWN)
    return found["port"], found["starboard"]


def test_an_open_apex_hangs_as_a_catenary_from_the_line_across_it() -> None:
    """The tension is the same all along, so tan(psi) = s / a from where the tie is fast, with the same a on both sides."""
    port, starboard = open_apex(6.0)
    assert port[-1] - starboard[0] == pytest.approx([0.0, 6.0], abs=1e-5)
    assert port * (1.0, -1.0) == pytest.approx(starboard[::-1], abs=1e-5)
    links = np.diff(port[::-1], axis=0)
    slope = np.abs(links[:, 0] / links[:, 1])
    place = 2.0 * (np.arange(20) + 0.5)
    parameter = place / slope
    assert parameter == pytest.approx(
        np.full(20, parameter.mean()), rel=0.04
    )  # the chords of the bend are coarse there
    assert parameter[2:] == pytest.approx(np.full(18, parameter[2:].mean()), rel=0.01)
    assert np.hypot(*links.T) == pytest.approx(np.full(20, 2.0), abs=1e-9)


def test_a_boom_without_a_tight_tie_keeps_its_catenary() -> None:
    """A tie as long as the distance that it finds bears almost nothing, and changes almost nothing."""
    line = hung((0.0, 14.0), (0.0, -14.0), 80.0, 32)
    distance = float(np.linalg.norm(line[8] - line[24]))
    tie = Tie(name="cross", ends=(("main", 8), ("main", 24)), length=distance - 0.05)
    found = tied_lines({"main": HangingBoom(line=line, load=0.5, held=(True, True))}, [tie], DOWN)["main"]
    assert np.abs(found - line).max() < 0.1


def test_cross_bridles_make_a_v_of_a_u() -> None:
    """The legs come together evenly to the apex, all lengths are kept, and the shape does not depend on the load."""
    line = hung((0.0, 14.0), (0.0, -14.0), 80.0, 32)
    ties = [
        Tie(name=f"cross-{joint}", ends=(("main", joint), ("main", 32 - joint)), length=28.0 * (16 - joint) / 16)
        for joint in (4, 8, 12)
    ]
    shapes = [
        tied_lines({"main": HangingBoom(line=line, load=load, held=(True, True))}, ties, DOWN)["main"]
        for load in (0.3, 3.0)
    ]
    assert shapes[0] == pytest.approx(shapes[1], abs=1e-5)
    found = shapes[0]
    width = found[:17, 1] - found[:15:-1, 1]
    assert width[[0, 4, 8, 12]] == pytest.approx([28.0, 21.0, 14.0, 7.0], abs=1e-5)
    assert all(later < earlier for earlier, later in pairwise(width))
    assert np.hypot(*np.diff(found, axis=0).T) == pytest.approx(np.full(32, 2.5), abs=1e-9)
    assert found[16, 0] < line[16, 0] - 1.0  # a V is deeper than the U of the same boom


def test_a_tie_that_would_hang_slack_is_refused() -> None:
    line = hung((0.0, 14.0), (0.0, -14.0), 80.0, 32)
    distance = float(np.linalg.norm(line[8] - line[24]))
    tie = Tie(name="cross", ends=(("main", 8), ("main", 24)), length=distance + 1.0)
    with pytest.raises(ValueError, match=r"tie 'cross' would be slack, allowed: one shorter"):
        tied_lines({"main": HangingBoom(line=line, load=0.5, held=(True, True))}, [tie], DOWN)


def test_ties_that_do_not_reach_are_refused() -> None:
    with pytest.raises(
        ValueError,
        match=r"hang in no shape, least of all (boom|tie) '|boom '.*' would be pushed together|tie '.*' would be slack",
    ):
        open_apex(120.0)
