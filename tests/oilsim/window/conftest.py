"""Windows that meet slicks; they end with their test."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.oilsim.window.meeting import Meeting


@pytest.fixture
def meet() -> Iterator[type[Meeting]]:
    made: list[Meeting] = []

    class Kept(Meeting):
        def __init__(self, *given: object, **named: object) -> None:
            super().__init__(*given, **named)  # type: ignore[arg-type]
            made.append(self)

    yield Kept
    for one in made:
        one.window.fluid.close()
