"""What a console hears of a run: orders of an instructor, and those that the scenario gives itself."""

from __future__ import annotations

import json
import threading
import tomllib
from multiprocessing import Pipe
from typing import Any

from scenarios.bench.scenario_run import ScenarioRun
from scenarios.conduct.conducted_run import ConsoleFeed, LatestSender
from scenarios.running.instructor import Pace
from scenarios.running.plan import Plan
from scenarios.spec.load import scenario_from
from tests.scenarios.small_tow import small_tow

INJECTS = """
[injects.quits]
at = 0.2
orders = ["vessels.port.engine=stopped"]
text = "The port engine quits"

[injects.parts]
at = 0.2
orders = ["booms.main.parted=[4]", "sea.wind={kind='steady', speed=7.0, direction=0.0}", "sea.visibility=150"]
"""


def heard(run: ScenarioRun, seconds: float, *, paused: bool = False) -> list[dict[str, Any]]:
    """Run, and return what its console hears until it knows the state at the end; a run that pauses tells it before it ends."""
    reader, writer = Pipe(duplex=False)
    sender, messages = LatestSender(writer), list[dict[str, Any]]()

    def read() -> None:
        while not messages or messages[-1]["kind"] != "state" or messages[-1]["time"] < seconds - 1e-6:
            messages.append(json.loads(reader.recv_bytes()))

    reading = threading.Thread(target=read)
    reading.start()
    run.watch(ConsoleFeed(run.assembly, Plan(scenario=run.scenario), Pace(float("inf")), sender, paused=paused))
    run.run(seconds)
    if paused:
        reading.join(10.0)
        assert not reading.is_alive()
    run.close()  # the last state is shown at the end
    sender.close(10.0)
    reading.join(10.0)
    return messages


def test_what_injects_order_is_shown(scenario_run: type[ScenarioRun]) -> None:
    text = small_tow(duration=9.0, communication_step=0.1, frame_rate=10) + INJECTS
    messages = heard(scenario_run(scenario_from(tomllib.loads(text))), 0.4)
    state = messages[-1]
    assert state["vessels"]["port"]["engine"] == "stopped"
    assert state["vessels"]["starboard"]["engine"] == "running"
    assert state["booms"]["main"]["parted"] == [4]
    assert state["weather"]["wind"] == {"speed": 7.0, "direction": 0.0}
    assert state["weather"]["visibility"] == 150.0
    assert state["given"] == ["quits", "parts"]


def test_each_step_of_a_run_that_pauses_is_shown(scenario_run: type[ScenarioRun]) -> None:
    """However soon after the last one: nothing comes after it that would show it."""
    text = small_tow(duration=9.0, communication_step=0.1, frame_rate=10)
    messages = heard(scenario_run(scenario_from(tomllib.loads(text))), 0.3, paused=True)
    assert messages[-1]["time"] > 0.3 - 1e-6 and messages[-1]["paused"]
