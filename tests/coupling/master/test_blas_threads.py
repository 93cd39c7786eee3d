"""The fluid's cores are its own: a BLAS of several threads has one during steps, and gets the others back."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from threadpoolctl import ThreadpoolController, threadpool_limits

from coupling.bullet.plugin import attach_fluid
from coupling.master.blas_threads import one_blas_thread
from coupling.master.co_simulation import CoSimulation
from coupling.master.participant import StepResult
from tests.coupling.accumulator import Accumulator
from tests.coupling.pools import pool


def threads() -> list[int]:
    """Of each BLAS of the process."""
    return [library.num_threads for library in ThreadpoolController().select(user_api="blas").lib_controllers]


@pytest.fixture
def two_threads() -> Iterator[None]:
    with threadpool_limits(2, user_api="blas"):
        assert threads() and set(threads()) == {2}
        yield
        assert set(threads()) == {2}


@pytest.mark.usefixtures("two_threads")
def test_threads_come_back_after_a_failure() -> None:
    with pytest.raises(ZeroDivisionError), one_blas_thread():
        assert set(threads()) == {1}
        raise ZeroDivisionError


@pytest.mark.usefixtures("two_threads")
def test_steps_of_the_master_take_one_thread() -> None:
    class Looking(Accumulator):
        def do_step(self, time: float, step_size: float) -> StepResult:
            seen.extend(threads())
            return super().do_step(time, step_size)

    seen: list[int] = []
    run = CoSimulation([Looking("looking", [])], [], 0.1)
    run.initialize()
    run.step()
    run.terminate()
    assert seen and set(seen) == {1}


@pytest.mark.usefixtures("two_threads")
def test_steps_of_the_plugin_take_one_thread(pybullet_client: int, monkeypatch: pytest.MonkeyPatch) -> None:
    fluid = pool(0.1, 0.6, 0.3)
    world = attach_fluid(pybullet_client, fluid, [])
    advance, seen = fluid.advance, []

    def looking(duration: float) -> object:
        seen.extend(threads())
        return advance(duration)

    monkeypatch.setattr(fluid, "advance", looking)
    world.step()
    assert seen and set(seen) == {1}
