"""Nothing that is computed has changed: short runs end in the state on record, bit for bit on the machine it was made on."""

from __future__ import annotations

import pytest

from scenarios.spec.load import library_paths
from tests.regression.record import differences, recorded
from tests.regression.runs import CASES, SCENARIOS


@pytest.mark.parametrize("name", CASES)
def test_run_is_as_recorded(name: str) -> None:
    assert not differences(name, CASES[name](), recorded())


def test_every_shipped_scenario_is_on_record() -> None:
    assert set(library_paths()) <= {source for source, *_ in SCENARIOS.values()}
    assert set(CASES) == set(recorded()["runs"])
