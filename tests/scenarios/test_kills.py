"""Real runs, killed without warning at random moments: every frame but those of the last second is there."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from tests.scenarios.kills import killed_run


@pytest.mark.parametrize("seed", [1, 2])
def test_killed_run_keeps_all_but_the_last_second_and_can_go_on(seed: int, tmp_path: Path) -> None:
    """The clock is the killed program's own, so that a slow machine changes nothing."""
    kill = killed_run(tmp_path, random.Random(seed).uniform(1.2, 2.2))
    assert kill.said > 0.0
    assert kill.lost == 0.0
    assert kill.checkpoint <= kill.kept + 1.0
