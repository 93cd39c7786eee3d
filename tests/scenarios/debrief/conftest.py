"""Debriefs of the tests have small pictures."""

from __future__ import annotations

import pytest

from scenarios.debrief import key_moments

SCENE_WIDTH = 240  # [pixels]; what is drawn is the same, and tests of pictures have them in full size


@pytest.fixture(scope="module", autouse=True)
def small_scenes() -> object:
    """Scenes of key moments, which take most of the time of a debrief, are small."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(key_moments, "_WIDTH", SCENE_WIDTH)
        yield
