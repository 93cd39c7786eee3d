"""A scenario run is made again by the claims about numerics: on more threads, and from a saved state."""

from __future__ import annotations

import gc

import pybullet
import pytest

from coupling.testkit import CheckFailed, assert_restarts_exactly, assert_same_on_threads
from scenarios.bench.scenario_run import ScenarioRun


def column(spacing: float = 0.1, threads: int = 1) -> ScenarioRun:
    return ScenarioRun("still-column", f"fluid.particle_spacing={spacing}", threads=threads)


def test_run_is_the_same_on_two_threads_and_from_a_saved_state() -> None:
    assert_same_on_threads(lambda threads: column(threads=threads), steps=2)
    assert_restarts_exactly(column, at=1, steps=2)
    with pytest.raises(CheckFailed, match="depends on the number of threads"):
        assert_same_on_threads(lambda threads: column(spacing=0.1 * threads), steps=1)


def test_state_is_restored_before_the_run_begins(scenario_run: type[ScenarioRun]) -> None:
    run = scenario_run("still-column", "fluid.particle_spacing=0.1")
    saved = run.save_state()
    with pytest.raises(ValueError, match="restored after the run has begun, or with injects"):
        run.restore_state(saved)


def worlds() -> list[int]:
    """The pybullet clients of this process."""
    return [client for client in range(64) if pybullet.isConnected(client)]


def test_a_run_that_was_only_built_leaves_no_world_behind() -> None:
    gc.collect()  # worlds that earlier tests have let go
    before = worlds()
    with ScenarioRun("floating-box", demo=True) as run:
        assert run.assembly.world is not None
        assert len(worlds()) == len(before) + 1
    assert worlds() == before
