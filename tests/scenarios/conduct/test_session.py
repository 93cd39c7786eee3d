"""A console's session, with real runs: it goes back to marks in whichever run they were set, and to one moment at a time."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from scenarios.conduct.access import Role
from scenarios.conduct.commands import Command
from scenarios.conduct.conducted_run import BETWEEN, Errand
from scenarios.conduct.server import running
from scenarios.conduct.session import Session
from scenarios.text.problems import ScenarioError
from tests.scenarios.small_tow import small_tow

STEP = 0.25
PATIENCE = 120.0  # [s]; the first run in a fresh cache compiles


class Conductor:
    """An instructor who gives commands to a session and waits for what they bring."""

    def __init__(self, session: Session, changed: asyncio.Event) -> None:
        self.session, self._changed = session, changed

    @property
    def times(self) -> list[float]:
        """The times [s] of the rows of the run's past."""
        return [row["time"] for row in self.session.history.rows]

    async def give(self, verb: str, **entries: Any) -> str:
        """Give a command; return what is told."""
        return await self.session.do(Command(1, verb, entries), Role("instructor"))

    async def until(self, done: Callable[[Session], bool]) -> None:
        """Wait until the session has come to what is wanted."""
        async with asyncio.timeout(PATIENCE):
            while not done(self.session):
                assert self.session.phase != "failed", self.session.reason
                self._changed.clear()
                await self._changed.wait()

    async def step_to(self, time: float) -> None:
        """Make single steps to a time [s]."""
        for index in range(round(self.session.state["time"] / STEP), round(time / STEP)):
            await asyncio.sleep(2.0 * BETWEEN)  # else the state of this step may not be shown
            await self.give("step")
            await self.until(lambda session, wanted=index + 1: session.state["index"] == wanted)

    async def mark(self, name: str) -> dict[str, Any]:
        """Set a mark; return it."""
        await self.give("mark", name=name)
        await self.until(lambda session: bool(session.marks) and session.marks[-1]["name"] == name)
        return self.session.marks[-1]

    async def go_back(self, time: float, recording: str | None = None, *settings: str) -> None:
        """Go back, and wait until the new run has come to its first moment."""
        run = self.session.run_number
        await self.give("branch", time=time, recording=recording, settings=list(settings))
        await self.until(
            lambda session: session.run_number == run + 1 and session.phase == "running" and self._is_at(time)
        )

    def _is_at(self, time: float) -> bool:
        return abs(self.session.state["time"] - time) < 1e-9 and self.session.state["paused"]


def conduct(
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    act: Callable[[Conductor], Awaitable[None]],
    interval: float = STEP,
) -> None:
    """Conduct a small tow, which begins paused, in a folder."""
    (folder / "user").mkdir(mode=0o700)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(folder / "user"))
    file = folder / "tow.toml"
    file.write_text(small_tow(duration=100.0, communication_step=STEP, frame_rate=4))

    async def run() -> None:
        changed = asyncio.Event()
        often = (f"recording.checkpoint_interval={interval}",)
        errand = Errand(scenario=str(file), record=folder / "whole.rrd", overrides=often, pace=float("inf"))
        session = Session(errand, changed.set)
        async with running(session):
            conductor = Conductor(session, changed)
            await conductor.until(lambda one: one.state is not None)
            await act(conductor)

    asyncio.run(run())


@pytest.mark.slow
def test_a_mark_is_gone_back_to_in_the_run_that_set_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From a branch that has not come so far, too; and the past that is shown is that run's."""

    async def act(one: Conductor) -> None:
        await one.step_to(1.5)
        first = await one.mark("A")
        at_mark = one.session.state
        await one.go_back(0.5, None, "tow.speed=0.1", "vessels.port.engine=stopped")
        await one.step_to(1.0)
        second = await one.mark("B")
        await one.go_back(first["time"], first["recording"])
        assert one.session.state["vessels"] == at_mark["vessels"]
        assert one.session.state["tow"] == at_mark["tow"]
        assert one.times == [0.0, 0.5, 1.5]  # the branch's second one is not this run's
        await one.go_back(second["time"], second["recording"])
        assert one.session.state["tow"]["speed"] == 0.1
        assert one.times == [0.0, 0.5, 1.0]
        assert one.session.state["vessels"]["port"]["engine"] == "stopped"
        for time, recording in ((1.25, first["recording"]), (1.5, second["recording"]), (1.5, "other.rrd")):
            with pytest.raises(ScenarioError, match=r"allowed: 1\.5 s in whole\.rrd, 1 s in whole-from-0\.5s\.rrd"):
                await one.give("branch", time=time, recording=recording, settings=[])
        assert one.session.phase == "running"

    conduct(tmp_path, monkeypatch, act)


@pytest.mark.slow
def test_of_two_who_go_back_at_once_one_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where a debrief is wanted at the same time: one run at most writes a recording."""

    async def act(one: Conductor) -> None:
        await one.step_to(0.5)
        back = {"time": 0.0, "recording": None, "settings": []}
        answers = await asyncio.gather(
            one.give("branch", **back), one.give("branch", **back), one.give("debrief"), return_exceptions=True
        )
        assert answers[0] == "goes back to 0.0 s"
        for answer in answers[1:]:
            assert isinstance(answer, ScenarioError)
            assert "cannot be done: the run is building" in str(answer)
        assert one.session.run_number == 2
        await one.until(lambda session: session.phase == "running")
        await one.step_to(0.25)

    conduct(tmp_path, monkeypatch, act)


@pytest.mark.slow
def test_what_if_gives_all_other_orders_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A crew steers at 1 s, between two checkpoints; a calm run gets wind at 0.5 s, and its crew still steers at 1 s.

    An order of the tow alone changes nothing once both vessels have orders of their own, and is said to. Each is compared with the run
    that people conducted, not with the one before; an order that is not allowed makes no run.
    """

    async def act(one: Conductor) -> None:
        await one.step_to(1.0)
        for vessel in ("port", "starboard"):
            await one.give("order", settings=[f"vessels.{vessel}.legs=[{{speed=0.2,heading=0.1}}]"])
        await one.step_to(2.0)
        windy = await one.give("what-if", time=0.5, settings=["sea.wind={kind='steady',speed=12.0,direction=1.5}"])
        assert windy == "whole-what-if-0.5s"
        found = one.session.what_ifs[windy]
        assert (found["first"], found["second"], found["end"]) == ("whole", windy, 2.0)
        assert 0.5 <= found["apart"] <= 0.75
        assert len(found["orders"]) == 1 and found["orders"][0].endswith(", at 0.5 s")
        assert len(found["curves"]) == 2 and found["rows"]
        assert one.session.state["vessels"]["port"]["ordered"]["heading"] == 0.1
        assert {"whole", windy} <= set(one.session.debriefs)
        towed = await one.give("what-if", time=1.5, settings=["tow.speed=0.1"])
        assert one.session.what_ifs[towed]["apart"] is None
        assert one.session.what_ifs[towed]["rows"] == []
        with pytest.raises(ScenarioError, match=r"boms"):
            await one.give("what-if", time=1.5, settings=["boms.main.parted=[3]"])
        with pytest.raises(ScenarioError, match=r"allowed: 0 to below 2 s"):
            await one.give("what-if", time=2.5, settings=["tow.speed=0.1"])

    conduct(tmp_path, monkeypatch, act, interval=0.75)
