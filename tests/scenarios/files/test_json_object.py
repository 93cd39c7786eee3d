"""JSON from strangers: what is read, and what is refused before it can harm."""

from __future__ import annotations

import json

import pytest

from scenarios.text.toml import MOST_OPEN, read_object


@pytest.mark.parametrize(
    "data", [{}, {"kind": "order", "settings": ["a=[[1,2],[3,4]]" * 50, 'b="{[\\"{["']}, {"a": {"b": [1, {"c": None}]}}]
)
def test_objects_are_read_whatever_their_texts_hold(data: dict) -> None:
    assert read_object(json.dumps(data).encode()) == data


@pytest.mark.parametrize("raw", [b"", b"[1, 2]", b"7", b'{"a": ', b"\xff\xfe{", b'"text"', b'{"a": 1} x', b'{"a": "b'])
def test_what_is_no_object_is_none(raw: bytes) -> None:
    assert read_object(raw) is None


@pytest.mark.parametrize("opening", [b"[", b'{"a":', b'[{"a":"]",'])
def test_deep_nesting_is_refused_before_it_is_read(opening: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(json, "loads", lambda raw: pytest.fail("it was read"))
    assert read_object(opening * 50_000) is None
    assert read_object(opening * (MOST_OPEN + 1)) is None
