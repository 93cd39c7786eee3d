"""A pybullet client of each test's own."""

from __future__ import annotations

from collections.abc import Iterator

import pybullet
import pybullet_data
import pytest


@pytest.fixture
def client() -> Iterator[int]:
    identifier = pybullet.connect(pybullet.DIRECT)
    pybullet.setAdditionalSearchPath(pybullet_data.getDataPath(), physicsClientId=identifier)
    yield identifier
    pybullet.disconnect(identifier)
