"""State by declared fields: what is saved comes back, is a copy, and is refused where it cannot be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pytest

from coupling.master.saved_fields import SavedFields


@dataclass
class Account:
    oil: float = 0.0
    ids: tuple[int, ...] = ()


class Pull(NamedTuple):
    along: float
    up: float


class Drum(SavedFields):
    STATE = ("length", "_turns")

    def __init__(self) -> None:
        self.length, self._turns = 2.0, 3


class Winch(SavedFields):
    STATE = ("drums", "place", "_ids", "account", "pull", "until")
    LOOSE = ("_ids",)

    def __init__(self) -> None:
        self.drums = {"port": Drum(), "starboard": Drum()}
        self.place, self._ids = np.zeros(3), np.zeros(2, np.int64)
        self.account, self.pull = Account(), Pull(1.0, 2.0)
        self.until: float | None = None


def worked() -> Winch:
    winch = Winch()
    winch.drums["port"].length, winch.place, winch._ids = 1.5, np.array([1.0, 2.0, 3.0]), np.arange(5)
    winch.account, winch.pull, winch.until = Account(4.0, (1, 2)), Pull(3.0, 4.0), 7.0
    return winch


def test_a_state_comes_back_with_its_kinds_and_is_a_copy() -> None:
    winch, other = worked(), Winch()
    saved = winch.save_state()
    winch.place[0] = 99.0
    other.restore_state(saved)
    assert other.place.tolist() == [1.0, 2.0, 3.0]
    assert (other.account, other.pull, other.until) == (Account(4.0, (1, 2)), Pull(3.0, 4.0), 7.0)
    assert [drum.length for drum in other.drums.values()] == [1.5, 2.0]
    assert other._ids.tolist() == list(range(5))
    other.place[0] = 98.0
    assert saved["place"][0] == 1.0
    assert set(saved) == {"drums", "place", "ids", "account", "pull", "until"}
    assert set(saved["drums"]["port"]) == {"length", "turns"}


@pytest.mark.parametrize(
    ("change", "error", "told"),
    [
        ({"place": np.zeros(2)}, ValueError, r"'place' has shape \(2,\), allowed: \(3,\)"),
        ({"place": np.array([0.0, np.nan, 0.0])}, ValueError, "'place' is not finite"),
        ({"place": np.zeros(3, np.float32)}, ValueError, "'place' is of type float32, allowed: an array of float64"),
        ({"drums": {"port": {"length": 1.0, "turns": 1}}}, ValueError, "'drums' has 1 parts, allowed: 2"),
        ({"drums": {"port": {"length": 1.0, "turns": 1}, "aft": {}}}, KeyError, "starboard"),
    ],
)
def test_a_state_that_does_not_fit_is_refused(change: dict[str, Any], error: type[Exception], told: str) -> None:
    with pytest.raises(error, match=told):
        Winch().restore_state(worked().save_state() | change)


def test_what_is_no_state_is_refused_and_a_missing_field_named() -> None:
    with pytest.raises(TypeError, match="restore_state got a list, allowed: a state that save_state returned"):
        Winch().restore_state([])
    saved = worked().save_state()
    del saved["account"]
    winch = Winch()
    with pytest.raises(KeyError, match="account"):
        winch.restore_state(saved)
    assert winch.place.tolist() == [0.0, 0.0, 0.0], "nothing has changed"
