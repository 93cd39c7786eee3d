"""Long runs end and save when they are asked to, take the tensions of the library, and keep their rows in a table."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import pytest

from booms.losses.liquids import ASSUMED_TENSION
from scenarios.oils.library import oil_named
from tests.validation.bodies.flumes import pieces, tables


@dataclass
class Row:
    oil: float
    resolution: int
    loss: float


def test_a_piece_ends_and_saves_by_the_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [100.0]
    monkeypatch.setattr(pieces.time, "monotonic", lambda: clock[-1])
    piece = pieces.Piece(seconds=10.0, interval=4.0)
    found = []
    for now in (103.0, 104.0, 107.0, 108.5, 110.0):
        clock.append(now)
        found.append((piece.asks_to_save(), piece.is_over))
    assert found == [(False, False), (True, False), (False, False), (True, False), (False, True)]
    monkeypatch.setattr(pieces.time, "process_time", lambda: piece._spent + 10.0)
    told = "2 s of processor time for each second of flow, 2.0 h of it left at most"
    assert piece.progress(5.0, 3600.0) == told
    assert piece.progress(0.0, 3600.0) == "nothing computed in this piece"


def test_a_state_that_is_being_written_does_not_spoil_the_one_before(tmp_path: Path) -> None:
    path = tmp_path / "run" / "state.pickle"
    assert pieces.saved(path) is None
    pieces.save(path, {"time": 1.0})
    with pytest.raises(Exception, match="pickle"):
        pieces.save(path, {"time": lambda: 2.0})
    assert pieces.saved(path) == {"time": 1.0}


def options(*words: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    pieces.add_options(parser, (900.0,), Path())
    return parser.parse_args(["--oil", "900", "--resolution", "10", *words])


def test_tension_is_a_number_or_that_of_an_oil_of_the_library() -> None:
    assert options().tension == 0.0
    assert options("--tension").tension == ASSUMED_TENSION
    assert options("--tension", "0.03").tension == 0.03
    measured = oil_named("brent").interfacial_tension
    assert measured and options("--tension", "brent").tension == measured


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("0", "interfacial_tension is 0"),
        ("0.2", "at most 0.1"),
        ("nan", "nan"),
        ("bunker-c", "measured"),
        ("snake oil", "snake oil"),
    ],
)
def test_a_tension_that_is_none_is_refused(text: str, words: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        options("--tension", text)
    assert words in capsys.readouterr().err


def test_rows_survive_the_table_and_replace_those_of_the_same_key(tmp_path: Path) -> None:
    path, key = tmp_path / "rows.csv", ("oil", "resolution")
    assert tables.read(path, Row) == []
    tables.keep(path, [Row(900.0, 33, 0.1), Row(840.0, 33, 0.2)], key)
    tables.keep(path, [Row(900.0, 33, 0.3), Row(900.0, 10, 0.4)], key)
    assert tables.read(path, Row) == [Row(840.0, 33, 0.2), Row(900.0, 10, 0.4), Row(900.0, 33, 0.3)]


def test_a_spacing_that_interfaces_do_not_bear_is_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for resolution, refused in (("74", False), ("200", True), ("1", True)):
        parser = argparse.ArgumentParser()
        pieces.add_options(parser, (900.0,), Path())
        words = ["flume", "--oil", "900", "--tension", "0.02", "--resolution", resolution]
        monkeypatch.setattr("sys.argv", words)
        if not refused:
            assert pieces.read_options(parser, 0.2).resolution == 74
            continue
        with pytest.raises(SystemExit):
            pieces.read_options(parser, 0.2)
        assert f"--resolution is {resolution}" in capsys.readouterr().err


def test_a_state_of_another_version_is_refused_by_name() -> None:
    path = Path("900-33-0.02.pickle")
    assert pieces.rows_of({"rows": [{"oil": 840.0, "resolution": 33, "loss": 0.2}]}, Row, path) == [Row(840.0, 33, 0.2)]
    with pytest.raises(SystemExit, match=r"900-33-0\.02\.pickle.*another version.*loss.*remove"):
        pieces.rows_of({"rows": [{"oil": 840.0, "resolution": 33}]}, Row, path)
