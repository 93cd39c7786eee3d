"""Frames, names and colours: what is refused, and what comes back."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from recordings.model import entity_paths
from recordings.model.frame import BodyFrame, Event, Frame, MeshDescription, PhaseFrame, PhasesOnRequest, RunDescription
from recordings.model.sample import Block, Sample, id_ranges, ids_of_ranges
from recordings.sink.writers import GRAVITY, ForceArrows, enclosed_volume

BOX_SIZE = np.array([2.0, 3.0, 5.0])


def _box() -> MeshDescription:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * BOX_SIZE
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6]]
    return MeshDescription(vertices=corners, faces=np.array([*faces, [0, 6, 4], [1, 5, 7], [1, 7, 3]]))


def test_phases_are_read_once_and_only_when_asked_for() -> None:
    calls = []
    frame = Frame(index=0, time=0.0, read_phases=lambda: calls.append(1) or {})  # type: ignore[func-returns-value]
    assert calls == []
    assert frame.phases is frame.phases
    assert calls == [1]


def test_a_phase_is_read_only_when_it_is_asked_for() -> None:
    calls = []

    def read(name: str) -> PhaseFrame:
        calls.append(name)
        return PhaseFrame(np.zeros((1, 3), np.float32), np.ones(1, np.uint32))

    phases = PhasesOnRequest({name: partial(read, name) for name in ("water", "oil")})
    assert list(phases) == ["water", "oil"] and len(phases) == 2 and "oil" in phases
    assert calls == []
    assert phases["oil"] is phases["oil"]
    assert calls == ["oil"]
    with pytest.raises(KeyError):
        phases["air"]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: PhaseFrame(np.zeros((2, 2), np.float32), np.zeros(2, np.uint32)),
            r"phase position has shape \(2, 2\)",
        ),
        (lambda: PhaseFrame(np.zeros((2, 3), np.float32), np.zeros(3, np.uint32)), r"phase id has shape \(3,\)"),
        (
            lambda: BodyFrame(position=np.zeros(3), orientation=np.zeros(3)),
            r"orientation has shape \(3,\), allowed: \(4,\)",
        ),
        (lambda: MeshDescription(vertices=np.zeros((3, 3)), faces=np.array([[0, 1, 3]])), "face has the vertex 3"),
        (lambda: RunDescription(name="x", particle_spacing=0.0), "particle_spacing is 0.0 m, allowed: above 0"),
        (lambda: Event(0.0, "x", "fatal"), "event level is 'fatal', allowed: info, warning, error"),  # type: ignore[arg-type]
    ],
)
def test_impossible_descriptions_are_refused(make: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()  # type: ignore[operator]


@pytest.mark.parametrize(
    ("name", "path"),
    [
        ("boom/segment-03", "boom/segment-03"),
        ("vessels/port", "vessels/port/hull"),
        ("rock", "bodies/rock"),
        ("pier/north", "bodies/pier/north"),
    ],
)
def test_paths_of_bodies(name: str, path: str) -> None:
    assert entity_paths.body(name) == path


@pytest.mark.parametrize("name", ["oil_inside", "tow_tension/port", "probes/gauge/height"])
def test_scalar_names_and_paths(name: str) -> None:
    assert entity_paths.scalar_name(f"/{entity_paths.scalar(name)}") == name


def test_a_name_with_an_empty_part_is_refused() -> None:
    with pytest.raises(ValueError, match="has an empty part"):
        entity_paths.body("boom//segment")


@given(st.sets(st.integers(0, 2**32 - 1), max_size=60))
def test_id_ranges_hold_any_set_of_ids(ids: set[int]) -> None:
    increasing = np.array(sorted(ids), dtype=np.uint32)
    np.testing.assert_array_equal(ids_of_ranges(id_ranges(increasing)), increasing)


def test_id_ranges_of_a_block_are_two_numbers() -> None:
    np.testing.assert_array_equal(id_ranges(np.arange(7, 1_000_007, dtype=np.uint32)), [7, 1_000_000])


def test_enclosed_volume_of_a_box_anywhere() -> None:
    box = _box()
    moved = MeshDescription(vertices=box.vertices + np.float32(11.0), faces=box.faces)
    assert enclosed_volume(box) == pytest.approx(BOX_SIZE.prod(), rel=1e-6)
    assert enclosed_volume(moved) == pytest.approx(BOX_SIZE.prod(), rel=1e-5)  # float32 coordinates


def test_an_arrow_is_three_times_as_long_as_the_body_at_full_displacement() -> None:
    density = 1027.0
    lift = np.array([[0.0, 0.0, density * GRAVITY * BOX_SIZE.prod()]])
    arrow = ForceArrows({"box": _box()}, density).vectors("box", lift)
    assert arrow is not None
    np.testing.assert_allclose(arrow, [[0.0, 0.0, 3.0 * np.linalg.norm(BOX_SIZE)]], rtol=1e-6)


def _fill(monkeypatch: pytest.MonkeyPatch, moments: list[float], count: int = 1) -> list[int]:
    """Sizes of the blocks that samples of ``count`` particles make when they arrive at ``moments`` [s]."""
    block, sizes = Block(), []
    for index, moment in enumerate(moments):
        monkeypatch.setattr("recordings.model.sample.time.monotonic", lambda now=moment: now)
        phase = PhaseFrame(np.zeros((count, 3), np.float32), np.arange(count, dtype=np.uint32))
        block.add(
            Sample(
                index=index,
                time=0.0,
                phases={"oil": phase},
                bodies={},
                tensions={},
                held_speeds={},
                lost={},
                scalars={},
            )
        )
        if block.full:
            sizes.append(len(block.take()))
    return sizes


def test_blocks_are_bounded_by_time_and_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    fast = [0.01 * index for index in range(103)]
    assert _fill(monkeypatch, fast) == [1, 51, 51]  # the first is written at once
    assert _fill(monkeypatch, [0.2 * index for index in range(9)]) == [1, 4, 4]  # the fourth waits 0.6 s
    assert _fill(monkeypatch, [0.6 * index for index in range(4)]) == [1, 1, 1, 1]
    assert _fill(monkeypatch, fast[:5], count=400_000) == [1, 2, 2]  # 4.8 MB each


def test_body_of_a_motion_has_its_parts():
    motion = np.arange(19.0)
    body = BodyFrame.of(motion, 3.0, 0.5)
    assert body.position.tolist() == [0, 1, 2] and body.wrench.tolist() == [13, 14, 15, 16, 17, 18]
    assert body.motion is motion and (body.tension, body.held_speed) == (3.0, 0.5)
    with pytest.raises(ValueError, match="motion has shape"):
        BodyFrame.of(motion[:-1], 3.0, 0.5)
