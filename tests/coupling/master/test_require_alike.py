"""A saved state is held to the form of a new one: entries, types, shapes, finite numbers."""

from __future__ import annotations

import numpy as np
import pytest

from coupling.master.saved_fields import require_alike

NEW = {
    "time": 0.0,
    "count": 0,
    "is_open": True,
    "name": "pump",
    "loss": None,
    "past": [(0.0, 1.0)],
    "told": [],
    "parcels": {"volume": np.zeros(4), "place": np.zeros((4, 2)), "oil": np.zeros(4, np.int64)},
    "tension": np.zeros(3),
    "gap": np.array([np.nan, 1.0]),
    "handles": {"hull": 1},
}


def changed(**entries: object) -> dict[str, object]:
    return NEW | entries


def test_a_state_that_has_gone_on_is_alike() -> None:
    saved = changed(
        time=np.float64(3.0),
        count=7,
        loss=0.5,
        past=[(0.0, 1.0), (1.0, 2.0)],
        told=[1, 2.5, None],
        parcels={"volume": np.ones(3), "place": np.ones((3, 2)), "oil": np.zeros(3, np.int64)},
        gap=np.array([2.0, 1.0]),
        handles={"buoy": 2},
    )
    require_alike("run", saved, NEW)
    require_alike("run", NEW, NEW)


@pytest.mark.parametrize(
    ("entries", "told"),
    [
        ({"time": {}}, "run/time is a table, allowed: a number"),
        ({"time": float("nan")}, "run/time is not finite"),
        ({"count": 1.5}, "run/count is a number, allowed: a whole number"),
        ({"is_open": 1}, "run/is_open is a whole number, allowed: a truth value"),
        ({"time": None}, "run/time is a NoneType, allowed: a number"),
        ({"told": ["a", ()]}, "run/told holds a list and a text, allowed: items of one kind"),
        ({"told": [float("nan")]}, "run/told/0 is not finite"),
        ({"loss": float("inf")}, "run/loss is not finite"),
        ({"past": [(0.0, "x")]}, "run/past/0/1 is a text, allowed: a number"),
        ({"tension": np.zeros(2)}, r"run has arrays of shapes that do not fit: tension \(2,\)"),
        ({"tension": np.zeros(3, np.float32)}, "run/tension has 1 axes of float32, allowed: 1 of float64"),
        ({"tension": np.zeros((3, 1))}, "run/tension has 2 axes of float64"),
        ({"tension": np.array([0.0, np.nan, 0.0])}, "run/tension is not finite"),
        ({"parcels": NEW["parcels"] | {"oil": np.zeros(5, np.int64)}}, "run/parcels has arrays of shapes that do not fit"),
        ({"parcels": NEW["parcels"] | {"place": np.zeros((4, 3))}}, "run/parcels has arrays of shapes that do not fit"),
        ({"new": {"speed": float("nan")}}, "run/new/speed is not finite"),
    ],
)  # fmt: skip
def test_what_is_not_alike_is_named(entries: dict[str, object], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        require_alike("run", changed(**entries), NEW)


def test_a_missing_entry_is_named() -> None:
    saved = {name: value for name, value in NEW.items() if name != "tension"}
    with pytest.raises(KeyError, match="tension"):
        require_alike("run", saved, NEW)


def test_complex_numbers_are_refused_where_nothing_says_what_is_there() -> None:
    with pytest.raises(ValueError, match="made/0 is complex"):
        require_alike("made", [np.complex128(1.0)], [])
