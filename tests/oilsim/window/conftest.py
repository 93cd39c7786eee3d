"""Windows that meet slicks; they end with their test."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from tests.oilsim.window.meeting import Meeting


@pytest.fixture
def meet() -> Iterator[Callable[..., Meeting]]:
    """Make a meeting as `Meeting` does, which ends with the test."""
    made: list[Meeting] = []

    def make(*given: Any, **named: Any) -> Meeting:
        made.append(Meeting(*given, **named))
        return made[-1]

    yield make
    for one in made:
        one.window.fluid.close()
