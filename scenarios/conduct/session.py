"""The session of a console: the run that goes on, its branches, and what is done with commands from pages.

The run is a process of its own. A thread reads what it shows; the session keeps the latest state, the log, and a sample of the past.
"""

from __future__ import annotations

import asyncio
import json
import math
import threading
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from scenarios.conduct.access import INSTRUCTOR, Role
from scenarios.conduct.commands import Command, refused, settings_of
from scenarios.conduct.conducted_run import Errand, recalled, restart_of, start_run
from scenarios.conduct.history import Album, History
from scenarios.debrief.order_words import order_in_words
from scenarios.orders.client import NoAnswerError, ask
from scenarios.orders.protocol import Kind
from scenarios.running.output_paths import free_recording

_STATE = b'{"kind": "state"'


class Inbox:
    """Reads messages from a pipe; of the states that wait for the event loop, only the latest is kept."""

    def __init__(
        self, pipe: Connection, loop: asyncio.AbstractEventLoop, arrived: Callable[[Sequence[bytes] | None], None]
    ) -> None:
        """Call `arrived` in the loop with messages, in order; last with None, when the pipe is closed."""
        self._pipe, self._loop, self._arrived = pipe, loop, arrived
        self._lock = threading.Lock()
        self._messages: list[bytes] = []
        threading.Thread(target=self._read, name="inbox", daemon=True).start()

    def _read(self) -> None:
        with suppress(RuntimeError):  # the loop has been closed
            with suppress(EOFError, OSError):
                while True:
                    self._put(self._pipe.recv_bytes())
            self._loop.call_soon_threadsafe(self._arrived, None)
        self._pipe.close()

    def _put(self, message: bytes) -> None:
        with self._lock:
            was_empty = not self._messages
            if message.startswith(_STATE) and not was_empty and self._messages[-1].startswith(_STATE):
                self._messages[-1] = message
            else:
                self._messages.append(message)
        if was_empty:
            self._loop.call_soon_threadsafe(self._deliver)

    def _deliver(self) -> None:
        with self._lock:
            messages, self._messages = self._messages, []
        self._arrived(messages)


MOST_LINES = 1000  # [1] of the log that pages can still see
MOST_WAITING = 4  # [1] commands of one role that wait for the run
BREATH = 0.05  # [s] after each order of a crew, in which the run steps and the instructor is heard
LAST_WORDS = 120.0  # [s] that a run may take over its end, checkpoint and summary included, on a busy machine
CONDUCTING = Role(INSTRUCTOR)
ALL_STATIONS = "all stations"
_PLAIN: Mapping[str, Kind] = {"pause": "pause", "go-on": "go-on", "step": "step", "end": "end"}


class Session:
    """One exercise on a console, from its start over all branches to its end."""

    def __init__(self, errand: Errand, changed: Callable[[], None]) -> None:
        """Prepare the run of `errand`; `changed` is called in the event loop whenever there is more to show."""
        self._errand, self._changed = errand, changed
        self._process: BaseProcess | None = None
        self._inbox: Inbox | None = None
        self._waiting = Counter[str]()  # commands, by role
        self._crews = asyncio.Lock()  # one order of a crew is with the run at a time: an instructor's waits for no more
        self._ended = asyncio.Event()  # the present run
        self._turning = asyncio.Lock()  # held while the run ends for a branch or a debrief
        self._pieces: dict[str, Errand] = {}  # all runs so far, by the names of their recordings
        self.run_number = 0  # counts branches
        self.phase = "building"
        self.reason = ""
        self.recording = errand.record
        self.scene: dict[str, Any] | None = None
        self.state: dict[str, Any] | None = None
        self.state_text = ""
        self.given: list[str] = []  # names of injects, for the instructor alone
        self.history, self.album = History(), Album()
        self.lines: deque[dict[str, Any]] = deque(maxlen=MOST_LINES)
        self.line_count = 0
        self.marks: list[dict[str, Any]] = []
        self.debriefs: dict[str, Path] = {}
        self.what_ifs: dict[str, dict[str, Any]] = {}  # comparisons with the run that people conducted, by recording
        self._recalled: list[dict[str, Any]] = []  # the log of a recording that is resumed
        self._conducted, self._came_to = errand, 0.0  # the last run that people conducted, and its time [s] so far

    def start(self) -> None:
        """Start the run; RecordingError if it resumes one that cannot be read."""
        if self._errand.source is not None:
            pieces, self._recalled = recalled(self._errand)
            self._pieces = {piece.record.name: piece for piece in pieces}
        self._launch(self._errand)

    def close(self) -> None:
        """Let the run end in order, and wait for it; a run that does not end in `LAST_WORDS` is ended."""
        process = self._process
        if process is None:
            return
        process.terminate()  # SIGTERM: an orderly stop
        process.join(LAST_WORDS)
        if process.is_alive():
            process.kill()
            process.join()

    @property
    def summary(self) -> dict[str, Any]:
        """The facts of the session that all pages know besides scene, state and log."""
        return {
            "kind": "session",
            "run": self.run_number,
            "phase": self.phase,
            "reason": self.reason,
            "recording": self.recording.name,
            "marks": self.marks,
            "debriefs": list(self.debriefs),
            "what_ifs": list(self.what_ifs),
        }

    async def do(self, command: Command, role: Role) -> str:
        """Do what a command asks for; return what has happened. ScenarioError if it is not done, with every reason."""
        entries = command.entries
        if not role.may(command.verb, str(entries.get("vessel", ""))):
            raise refused(command.verb, f"is not for {role.name}, allowed: for the instructor")
        match command.verb:
            case "branch":
                async with self._turning:
                    return await self._branch(float(entries["time"]), entries["recording"], tuple(entries["settings"]))
            case "debrief":
                async with self._turning:
                    return await self._debrief()
            case "what-if":
                async with self._turning:
                    return await self._what_if(float(entries["time"]), tuple(entries["settings"]))
            case "pace":
                value = entries["value"]
                return await self._ask("pace", "inf" if value is None else repr(float(value)))
            case "say":
                return await self._say_by_radio(str(entries["to"]), str(entries["text"]), role)
            case "mark":
                return await self._ask("mark", entries["name"])
            case verb if verb in _PLAIN:
                return await self._ask(_PLAIN[verb])
        skimmers = {one["name"]: one["skimmers"] for one in (self.scene or {}).get("vessels", ())}
        settings = settings_of(command, (self.state or {}).get("vessels", {}), skimmers)
        return await self._ask("order", *settings, role=role)

    async def _say_by_radio(self, to: str, text: str, role: Role) -> str:
        """Call a station by radio, where all hear it; ScenarioError for a station that is not there."""
        stations = (ALL_STATIONS, INSTRUCTOR, *(one["name"] for one in (self.scene or {}).get("vessels", ())))
        if to not in stations or to == role.name:
            raise refused("to", f"is {to!r}, allowed: {', '.join(one for one in stations if one != role.name)}")
        return await self._ask(
            "say", f"{to}, this is {role.name}{f', {role.person}' * bool(role.person)}: {text}", role=role
        )

    async def _ask(self, kind: Kind, *words: str, role: Role = CONDUCTING) -> str:
        """Ask the run for a role; ScenarioError if it refuses, or cannot answer."""
        if self.phase != "running":
            raise refused(kind, f"cannot be done: the run is {self.phase}")
        if self._waiting[role.name] >= MOST_WAITING:
            raise refused(kind, f"comes while {MOST_WAITING} commands wait for the run, allowed: after it has answered")
        self._waiting[role.name] += 1
        try:
            if role.kind == INSTRUCTOR:
                answer = await asyncio.to_thread(ask, self.recording, kind, words, by=role.source)
            else:
                async with self._crews:
                    answer = await asyncio.to_thread(ask, self.recording, kind, words, by=role.source)
                    await asyncio.sleep(BREATH)
        except NoAnswerError as error:
            raise refused(kind, str(error)) from error
        finally:
            self._waiting[role.name] -= 1
        return f"{answer.text} at {answer.time:.1f} s"

    async def _branch(self, time: float, marked: str | None, settings: tuple[str, ...]) -> str:
        """End the run, and go on from its moment at `time` [s] in a new recording, or from the mark there in the recording `marked`."""
        source = self._piece_at(time) if marked is None else self._piece_of_mark(time, marked)
        await self._end("branch")
        errand = replace(
            self._errand, source=source.record, at=time, settings=settings, record=self._free(source.record, time)
        )
        self._go_back(errand, source)
        self._say(f"goes back to {time:.1f} s, and on in {errand.record.name}", source="console")
        return f"goes back to {time:.1f} s"

    def _go_back(self, errand: Errand, source: Errand) -> None:
        """Launch a run that goes on from a moment of the piece `source`, after which the past that is shown is another."""
        parting = self._parting(source, errand.at)
        self.history.forget_after(parting)
        self.album.forget_after(parting)
        self._launch(errand)

    async def _what_if(self, time: float, settings: tuple[str, ...]) -> str:
        """Make the run that people conducted last again from a moment, with other orders there and all its own orders; compare the two.

        It goes as fast as it can, to where the first has come. ScenarioError, and no run made, for orders that are not allowed.
        """
        await self._end("what-if")
        base, end = self._conducted, self._came_to
        if not settings or not 0.0 <= time < end:
            text = f"is {time:g} s, allowed: 0 to below {end:g} s, where the run ended, with one order or more"
            raise refused("time", text)
        source = self._piece_of(base, time)
        errand = replace(
            self._errand,
            source=source.record,
            at=time,
            settings=(f"run.duration={end!r}", *settings),
            orders_of=base.record,
            record=self._free(source.record, time, "-what-if-"),
            pace=math.inf,
            paused=False,
        )
        await asyncio.to_thread(restart_of, errand)
        self._go_back(errand, source)
        self._say(f"what if, from {time:.1f} s: {' '.join(settings)}", source="console")
        await self._ended.wait()
        await self._end("what-if")
        if self.phase == "failed":
            raise refused("what-if", f"failed: {self.reason}")
        from scenarios.debrief.what_if import what_if

        for recording in (base.record, errand.record):
            if recording.stem not in self.debriefs:
                await self._write_debrief(recording)
        self.what_ifs[errand.record.stem] = await asyncio.to_thread(what_if, base.record, errand.record)
        self._changed()
        return errand.record.stem

    async def _debrief(self) -> str:
        """End the run, and write the debrief of its recording."""
        await self._end("debrief")
        return await self._write_debrief(self.recording)

    async def _write_debrief(self, recording: Path) -> str:
        from scenarios.debrief.page import write_debrief

        page = await asyncio.to_thread(write_debrief, recording, recording.with_suffix(".debrief"))
        self.debriefs[recording.stem] = page
        self._changed()
        return recording.stem

    def _piece_at(self, time: float) -> Errand:
        """Return the piece of the present run that holds its moment at `time` [s]; ScenarioError for a moment that has not been."""
        if self.state is None or not 0.0 <= time <= self.state["time"]:
            now = 0.0 if self.state is None else self.state["time"]
            raise refused("time", f"is {time:g} s, allowed: 0 to {now:g} s")
        return self._piece_of(self._pieces[self.recording.name], time)

    def _piece_of(self, last: Errand, time: float) -> Errand:
        """Return the piece that holds the moment at `time` [s] of the run that ends with the piece `last`."""
        pieces = self._lineage(last)
        while len(pieces) > 1 and pieces[-1].at >= time:  # its first moment is kept by the piece before
            pieces.pop()
        return pieces[-1]

    def _piece_of_mark(self, time: float, recording: str) -> Errand:
        """Return the piece that a mark was set in, which may be none of the present run's; ScenarioError for a mark that is not known."""
        if not any((mark["recording"], mark["time"]) == (recording, time) for mark in self.marks):
            known = ", ".join(f"{mark['time']:g} s in {mark['recording']}" for mark in self.marks) or "none"
            raise refused("the mark", f"is at {time:g} s in {recording}, allowed: {known}")
        return self._pieces[recording]

    def _lineage(self, piece: Errand) -> list[Errand]:
        """Return the pieces of the run that ends with this one, from its start."""
        pieces = [piece]
        while (source := pieces[0].source) is not None and source.name in self._pieces:
            pieces.insert(0, self._pieces[source.name])
        return pieces

    def _free(self, source: Path, time: float, word: str = "-from-") -> Path:
        """Choose a free name for the recording of a branch, beside its source; that of a branch that failed stays its own."""
        stem = source.stem.partition("-from-")[0].partition("-what-if-")[0]
        return free_recording(source.with_name(f"{stem}{word}{time:g}s"), self._pieces.keys())

    def _parting(self, source: Errand, time: float) -> float:
        """Return the time [s] until which the present run has the same past as one that goes on at `time` [s] in the piece `source`."""
        present, other = self._lineage(self._pieces[self.recording.name]), self._lineage(source)
        shared = sum(one is two for one, two in zip(present, other, strict=False))
        return min([time, *(piece.at for piece in (*present[shared:], *other[shared:]))])

    async def _end(self, verb: str) -> None:
        """End the run for a command, and wait until its process has ended; ScenarioError for a run that has not begun."""
        if self.phase == "building":
            raise refused(verb, "cannot be done: the run is building")
        if self.phase == "running":
            await self._ask("end")
        if self._process is not None:
            await asyncio.to_thread(self._process.join, LAST_WORDS)
            if self._process.is_alive():
                raise refused("the run", f"has not ended within {LAST_WORDS:g} s")

    def _launch(self, errand: Errand) -> None:
        self.run_number += 1
        self.phase, self.reason, self.recording = "building", "", errand.record
        self._ended.clear()
        if errand.orders_of is None:
            self._conducted, self._came_to = errand, errand.at
        self._pieces[errand.record.name] = errand
        self._process, pipe = start_run(errand)
        self._inbox = self._listen(pipe, self.run_number)
        self._changed()

    def _listen(self, pipe: Connection, number: int) -> Inbox:
        """Read what the run shows; messages of an earlier run are left."""
        loop = asyncio.get_running_loop()

        def arrived(texts: Sequence[bytes] | None) -> None:
            if number == self.run_number:
                self._take(texts)

        return Inbox(pipe, loop, arrived)

    def _take(self, texts: Sequence[bytes] | None) -> None:
        """Take messages of the run; None: its pipe is closed."""
        if texts is None and self.phase not in ("ended", "failed"):
            self.phase, self.reason = "failed", "the run ended without a word"
        if texts is None:
            self._ended.set()
        for text in texts or ():
            message = json.loads(text)
            match message["kind"]:
                case "scene":
                    self.scene, self.phase = message, "running"
                    recalled_lines, self._recalled = self._recalled, []
                    for line in recalled_lines:
                        self._add(line)
                case "state":
                    self.given = message.pop("given", [])
                    self.state, self.state_text = message, json.dumps(message)
                    self.history.take(message)
                    self.album.take(message["time"], self.state_text)
                    if self._pieces[self.recording.name] is self._conducted:
                        self._came_to = message["time"]
                case "lines":
                    for line in message["lines"]:
                        self._add(line)
                case "ended" | "failed":
                    self.reason = message.get("reason") or message["text"]
                    self.phase = "failed" if self.reason.startswith("failed") else message["kind"]
        self._changed()

    def _add(self, line: dict[str, Any]) -> None:
        self.line_count += 1
        bearing = 0.0 if self.scene is None else self.scene["bearing"]
        words = order_in_words(line["text"], bearing) if line.get("order") else line["text"]
        self.lines.append(line | {"number": self.line_count, "words": words})
        if line.get("mark"):
            recording = line.get("recording", self.recording.name)
            self.marks.append({"name": line["mark"], "time": line["time"], "recording": recording})

    def _say(self, text: str, source: str) -> None:
        """Add a line of the console itself to the log."""
        time = 0.0 if self.state is None else self.state["time"]
        self._add({"time": time, "text": text, "level": "info", "source": source, "mark": None})
        self._changed()
