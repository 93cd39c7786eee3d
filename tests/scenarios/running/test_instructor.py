"""The instructor of a run: single steps belong to the pause in which they were asked for."""

from __future__ import annotations

import signal
import threading
import time
import tomllib
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import pytest

from scenarios.orders.client import Answer, ask
from scenarios.orders.desk import OrderDesk, open_desk
from scenarios.orders.protocol import Kind
from scenarios.running.assembly import build
from scenarios.running.instructor import Instructor
from scenarios.running.plan import Plan
from scenarios.running.run_loop import RunLoop
from scenarios.running.run_requests import RunRequests
from scenarios.spec.load import scenario_from
from tests.scenarios.small_tow import small_tow


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[OrderDesk]:
    (tmp_path / "user").mkdir(mode=0o700)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "user"))
    with open_desk("tow", tmp_path / "tow.rrd") as one:
        yield one


def test_a_step_that_was_not_waited_for_is_not_owed_at_the_next_pause(desk: OrderDesk, tmp_path: Path) -> None:
    """A step and the order to go on come while the run is busy; the pause after them holds at once."""
    plan = Plan(scenario=scenario_from(tomllib.loads(small_tow(duration=9.0, communication_step=0.1, frame_rate=10))))
    assembly, requests, instructor = build(plan.scenario), RunRequests(), Instructor(desk, None)
    loop = RunLoop(
        plan,
        assembly,
        assembly.co_simulation([]),
        requests=requests,
        keepers={},
        checkpoints=None,
        instructor=instructor,
    )
    loop.begin()
    with ThreadPoolExecutor() as senders:

        def sent(*kinds: Kind) -> list[Future[Answer]]:
            """Send requests one after the other, so that all of them wait at the desk."""
            answers = []
            for count, kind in enumerate(kinds, start=1):
                answers.append(senders.submit(ask, tmp_path / "tow.rrd", kind, ()))
                while desk._waiting.qsize() < count:
                    time.sleep(0.01)
            return answers

        stepped = sent("step", "go-on")
        instructor.attend(loop)
        assert [answer.result(10.0).text for answer in stepped] == ["makes a step", "goes on"]
        (paused,) = sent("pause")
        attending = threading.Thread(target=instructor.attend, args=(loop,))
        attending.start()
        try:
            assert paused.result(10.0).text == "paused"
            attending.join(0.5)
            assert attending.is_alive(), "the run has gone on, by a step that nobody asked for any more"
        finally:
            requests.ask(signal.SIGTERM)
            attending.join(10.0)
            loop.simulation.terminate("the test is over")
