"""The run of a console, in a process of its own, so that pages answer whatever the run does.

The channel from a run to its console, in which only the latest state waits, and the observer that fills it.

A console that resumes a recording recalls the pieces of that run, so that marks and branches reach back, and its log.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
import time as wall_clock
from collections import deque
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from rich.console import Console

from coupling.master.observer_dispatch import CommunicationPoint
from recordings.files.writing import RecordingError
from recordings.model.frame import Event, Frame, RunDescription
from recordings.replay.joined import JoinedReplay
from scenarios.conduct.history import Means
from scenarios.conduct.snapshot import scene_of, state_of
from scenarios.running.assembly import Assembly
from scenarios.running.checkpoints import Restart, find_restart
from scenarios.running.instructor import GOES_ON, PAUSED, Pace
from scenarios.running.plan import Plan
from scenarios.running.run_loop import MARKS
from scenarios.schema.parsing.overrides import settings_of
from scenarios.text.problems import ScenarioError

MOST_LINES = 1000  # [1] of the log that wait for a console that stalls; the recording has all


class LatestSender:
    """Sends states and lines of the log through a pipe, in a thread of its own.

    A state that has not been sent when the next one comes is dropped. Lines of the log wait, up to `MOST_LINES`. A pipe that is closed ends
    the sending, not the run.
    """

    def __init__(self, pipe: Connection) -> None:
        """Send through `pipe`, which belongs to this sender from now on."""
        self._pipe = pipe
        self._changed = threading.Condition()
        self._first: list[Mapping[str, Any]] = []  # messages that must arrive
        self._lines: list[Mapping[str, Any]] = []
        self._state: Mapping[str, Any] | None = None
        self._is_ended = False
        self.dropped = 0
        self._thread = threading.Thread(target=self._work, name="console", daemon=True)
        self._thread.start()

    @property
    def is_idle(self) -> bool:
        """True if the last state has been taken, so that a new one would be sent at once."""
        return self._state is None

    def send(self, message: Mapping[str, Any]) -> None:
        """Send a message that must arrive, before all states and lines that wait."""
        with self._changed:
            self._first.append(message)
            self._changed.notify()

    def show(self, state: Mapping[str, Any]) -> None:
        """Send a state, unless another one comes before the console has read the last."""
        with self._changed:
            self.dropped += self._state is not None
            self._state = state
            self._changed.notify()

    def tell(self, line: Mapping[str, Any]) -> None:
        """Send a line of the log."""
        with self._changed:
            self._lines = [*self._lines[-MOST_LINES:], line]
            self._changed.notify()

    def close(self, patience: float) -> None:
        """Send what waits, for up to `patience` [s]."""
        with self._changed:
            self._is_ended = True
            self._changed.notify()
        self._thread.join(patience)

    def _work(self) -> None:
        while (messages := self._taken()) is not None:
            try:
                for message in messages:
                    self._pipe.send_bytes(json.dumps(message, allow_nan=False).encode())
            except OSError:
                return  # nobody listens any more

    def _taken(self) -> Sequence[Mapping[str, Any]] | None:
        """Wait for messages, and take them; None at the end."""
        with self._changed:
            while not (self._first or self._lines or self._state is not None):
                if self._is_ended:
                    return None
                self._changed.wait()
            lines = [{"kind": "lines", "lines": self._lines}] if self._lines else []
            states = [] if self._state is None else [self._state]
            taken = [*self._first, *lines, *states]
            self._first, self._lines, self._state = [], [], None
            return taken


BETWEEN = 0.1  # [s] of wall time from one state to the next
MEMORY = 5.0  # [s] of wall time over which the real-time factor is averaged


class ConsoleFeed:
    """Sends the scene, states and the log of a run to its console; it has the shape of the Observer protocol."""

    def __init__(self, assembly: Assembly, plan: Plan, pace: Pace, sender: LatestSender, *, paused: bool) -> None:
        """Watch the run `assembly` of `plan`, which keeps `pace` and begins paused or not."""
        self._assembly, self._plan, self._pace, self._sender = assembly, plan, pace, sender
        self._scenario = plan.scenario
        self._frame: Frame | None = None
        self._means = Means()
        self._sent = 0.0  # wall time [s] of the last state
        self._is_paused = paused
        self._marks: deque[tuple[float, float]] = deque()  # wall and simulated time [s]
        self.seconds = 0.0  # of wall time that making states has taken

    def initialized(self, run: RunDescription) -> None:
        """Send the scene."""
        told = self._plan.scenario.exercise
        words = {} if told is None else {"brief": told.brief.strip(), "notes": told.notes.strip()}
        self._sender.send(scene_of(self._assembly) | words)

    def step_completed(self, frame: Frame) -> None:
        """Send the state if the last one was sent long enough ago, and after each step of a run that pauses."""
        if self._frame is None:
            self._scenario = self._plan.scenario_at(frame.index)
        self._frame = frame
        now = wall_clock.perf_counter()
        self._marks.append((now, frame.time))
        while len(self._marks) > 2 and now - self._marks[0][0] > MEMORY:
            self._marks.popleft()
        if self._is_paused or (now - self._sent >= BETWEEN and self._sender.is_idle):
            self._show(frame)

    def event(self, event: Event) -> None:
        """Send the line of the log, and after an order, or other words of an instructor, the state that belongs to them."""
        self._sender.tell(line_of(event))
        if event.is_order:  # they speak at communication points, where the frame still holds
            if self._frame is None:
                self._frame = self._resumed(event.time)
            self._heed(event.text)
            self._show(self._frame)

    def terminated(self, reason: str) -> None:
        """Send the last state, and the reason of the end."""
        if self._frame is not None:
            self._show(self._frame)
        self._sender.send({"kind": "ended", "reason": reason, "console_seconds": self.seconds})

    def _resumed(self, time: float) -> Frame:
        """Return the frame at which a run goes on, at `time` [s]: it is shown to nobody else, as the run before has recorded it."""
        step = self._plan.scenario.run.communication_step
        index = round(time / step)
        self._scenario = self._plan.scenario_at(index)
        return self._assembly.frame_source(CommunicationPoint(index, time, step))

    def _heed(self, text: str) -> None:
        """Take orders, and other words of an instructor, into what is shown."""
        if text in (PAUSED, GOES_ON):
            self._is_paused = text == PAUSED
            self._marks.clear()
        elif (settings := settings_of(text)) and self._frame is not None:
            with suppress(ScenarioError):  # it is in the plan already, as with a joint that has parted
                self._plan = self._plan.ordered(settings, self._frame.index)
            self._scenario = self._plan.scenario_at(self._frame.index)

    def _show(self, frame: Frame) -> None:
        began = wall_clock.perf_counter()
        self._sender.show(state_of(self._assembly, self._scenario, frame, self._means) | self._clock())
        self._sent = wall_clock.perf_counter()
        self.seconds += self._sent - began

    def _clock(self) -> dict[str, Any]:
        factor = None
        if len(self._marks) > 1 and self._marks[-1][0] > self._marks[0][0]:
            (first_wall, first), (last_wall, last) = self._marks[0], self._marks[-1]
            factor = (last - first) / (last_wall - first_wall)
        pace = self._pace.pace
        return {
            "paused": self._is_paused,
            "pace": None if pace == float("inf") else pace,
            "real_time_factor": factor,
            "lag": self._pace.lag,
            "set_back": self._pace.set_back,
        }


def line_of(event: Event) -> dict[str, Any]:
    """Return an event as a line of the log: whether it is an order, and the name of the mark that it sets, or None."""
    is_mark = event.is_by_people and event.text.startswith(MARKS)
    mark = event.text.removeprefix(MARKS) if is_mark else None
    facts = {"time": event.time, "text": event.text, "level": event.level, "source": event.source}
    return {**facts, "order": event.is_order, "mark": mark}


FLUSH = 5.0  # [s] for the last messages to a console


@dataclass(frozen=True, kw_only=True)
class Errand:
    """A run to make: a scenario from its start, or a recorded run from a moment on.

    scenario: name or file, with the changes `overrides`, shortened if `demo`; source: the recording to continue at `at` [s] instead, with
    the orders `settings` there, and the later ones of the recording `orders_of`; record: the recording to write; pace: simulated seconds a
    second; paused: whether it begins paused; viewer: address of the viewer that shows it too, empty without one.
    """

    scenario: str
    record: Path
    overrides: tuple[str, ...] = ()
    demo: bool = False
    source: Path | None = None
    at: float = 0.0
    settings: tuple[str, ...] = ()
    orders_of: Path | None = None
    pace: float = 1.0
    paused: bool = True
    viewer: str = ""


def restart_of(errand: Errand) -> Restart:
    """Return the restart of an errand that continues a recorded run; ScenarioError for orders that are not allowed."""
    assert errand.source is not None
    return find_restart(errand.source, errand.at).with_settings(errand.settings, errand.at, errand.orders_of)


def start_run(errand: Errand) -> tuple[BaseProcess, Connection]:
    """Start a run; return its process, and the pipe from which to read what it shows."""
    context = get_context("spawn")
    reader, writer = context.Pipe(duplex=False)
    process = context.Process(target=make_run, args=(errand, writer), name=f"oilsim {errand.scenario}")
    process.start()
    writer.close()
    return process, reader


def make_run(errand: Errand, pipe: Connection) -> None:
    """Make the run, to its end; ends the process with its exit code."""
    sender = LatestSender(pipe)
    threading.Thread(target=_end_with_console, name="console's end", daemon=True).start()
    code = 1
    try:
        code = _run(errand, sender)
    except (ScenarioError, RecordingError) as error:
        sender.send({"kind": "failed", "text": str(error)})
    except BaseException as error:
        sender.send({"kind": "failed", "text": f"{type(error).__name__}: {error}"})
        raise
    finally:
        sender.close(FLUSH)
    sys.exit(code)


def _end_with_console() -> None:
    """Stop the run in order when the console's process ends, however it ends."""
    console = parent_process()
    if console is not None:
        console.join()
        os.kill(os.getpid(), signal.SIGTERM)


def _run(errand: Errand, sender: LatestSender) -> int:
    """Run the errand; return the exit code."""
    from recordings.sink.live import LiveView
    from scenarios.running.run import RunOptions, resume, run_scenario
    from scenarios.spec.load import load_scenario

    pace, quiet = Pace(errand.pace), Console(quiet=True)

    def options(plan: Plan, source: Path | None, begins: float = 0.0) -> RunOptions:
        def feed(assembly: Assembly) -> ConsoleFeed:
            return ConsoleFeed(assembly, plan, pace, sender, paused=errand.paused and begins >= errand.at - 1e-9)

        return RunOptions(
            record=errand.record,
            summary=errand.record.with_suffix(".json"),
            source=source,
            live=LiveView(errand.viewer, is_embedded=True) if errand.viewer else False,
            takes_orders=True,
            pace=pace,
            pauses_at=errand.at if errand.paused else None,
            watchers=(feed,),
        )

    if errand.source is not None:
        restart = restart_of(errand)
        return resume(restart, options=options(restart.plan, None, restart.time), console=quiet)
    loaded = load_scenario(errand.scenario, overrides=errand.overrides, demo=errand.demo)
    return run_scenario(
        loaded.scenario,
        text=loaded.text,
        overrides=errand.overrides,
        options=options(Plan(scenario=loaded.scenario), loaded.path),
        console=quiet,
    )


def end_and_names(recording: Path) -> tuple[float, list[str]]:
    """Return the last recorded time [s] of a run, and the names of its recordings; RecordingError for what is no recording."""
    replay = JoinedReplay(recording)
    end = max((float(one.time[-1]) for one in replay.scalars.values() if len(one.time)), default=0.0)
    return end, [recording.name, *(Path(branch.recording).name for branch in replay.branches)]


def recalled(errand: Errand) -> tuple[list[Errand], list[dict[str, Any]]]:
    """Return the pieces of the run that `errand` resumes, from its start, and its log up to there, each mark with its recording's name."""
    assert errand.source is not None
    replay, pieces = JoinedReplay(errand.source), list[Errand]()
    began = 0.0
    for branch in replay.branches:
        record = errand.source.with_name(Path(branch.recording).name)
        pieces.append(Errand(scenario=errand.scenario, record=record, source=_last(pieces), at=began))
        began = branch.time
    pieces.append(Errand(scenario=errand.scenario, record=errand.source, source=_last(pieces), at=began))
    events = [event for event in replay.events if event.time <= errand.at + 1e-9]
    held_by = [max((piece for piece in pieces if piece.at <= event.time), key=lambda one: one.at) for event in events]
    lines = [line_of(event) | {"recording": piece.record.name} for event, piece in zip(events, held_by, strict=True)]
    return pieces, lines


def _last(pieces: list[Errand]) -> Path | None:
    return pieces[-1].record if pieces else None
