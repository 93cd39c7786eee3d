"""Messages between a run and a program that gives it orders: one line of JSON each way.

A request holds the token of the run's card, a kind, and its words: for orders the settings, written as for ``--set``; for a mark its
name; for a pace the number of simulated seconds a second. An answer holds what the run says and its simulated time [s], or the problems of
a refused request, each a place and a text.
"""

from __future__ import annotations

import hmac
import json
from collections.abc import Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

from scenarios.problems import Problem
from scenarios.text.json_object import read_object

Kind = Literal["order", "pause", "go-on", "step", "pace", "mark", "end"]
KINDS: tuple[Kind, ...] = get_args(Kind)

LONGEST = 64 * 1024  # [bytes] of a request
MOST_WORDS: Mapping[Kind, int] = {"order": 100, "mark": 1, "pace": 1}  # with all other kinds, none


class Refused(Exception):
    """A request that the run does not take, with the reasons."""

    def __init__(self, *problems: Problem) -> None:
        super().__init__("; ".join(map(str, problems)))
        self.problems = problems


@dataclass(frozen=True, eq=False)
class Request:
    """A request that waits for the run's answer."""

    kind: Kind
    settings: tuple[str, ...] = ()
    answer: Future[bytes] = field(default_factory=Future)

    def told(self, text: str, time: float) -> None:
        """Answer what has happened, and at which simulated time [s]."""
        self._end(answer_line(text=text, time=time))

    def refused(self, problems: Sequence[Problem]) -> None:
        """Answer that nothing has happened, and why."""
        self._end(refusal_line(problems))

    def _end(self, line: bytes) -> None:
        if self.answer.set_running_or_notify_cancel():  # else the sender has gone
            self.answer.set_result(line)


def request_line(kind: Kind, settings: Sequence[str], token: str) -> bytes:
    """Write a request; Refused if it is longer than a run reads."""
    line = _line({"token": token, "kind": kind, "settings": list(settings)})
    if len(line) > LONGEST:
        raise Refused(_too_long(len(line)))
    return line


def read_request(line: bytes, token: str) -> Request:
    """Read a request; Refused for one that is none, or comes without the token."""
    if not line.endswith(b"\n"):
        raise Refused(Problem("the request", "ends too early, allowed: one whole line of JSON"))
    data = read_object(line)
    if data is None:
        raise Refused(Problem("the request", "cannot be read, allowed: one line of JSON, an object"))
    if not hmac.compare_digest(str(data.get("token", "")).encode("utf-8", "replace"), token.encode()):
        raise Refused(Problem("token", "is not that of this run, allowed: the one on its card"))
    kind, settings = data.get("kind"), data.get("settings")
    if kind not in KINDS:
        raise Refused(Problem("kind", f"is {kind!r}, allowed: {', '.join(KINDS)}"))
    if not (isinstance(settings, list) and all(isinstance(one, str) and _is_printed(one) for one in settings)):
        raise Refused(Problem("settings", "are no list of texts on one line each, allowed: key=value, ..."))
    most = MOST_WORDS.get(kind, 0)
    if not min(most, 1) <= len(settings) <= most:
        text = f"are {len(settings)}, allowed with {kind}: {f'1 to {most}' if most > 1 else most}"
        raise Refused(Problem("settings", text))
    return Request(kind, tuple(settings))


def answer_line(*, text: str, time: float) -> bytes:
    """Write the answer that a request was done."""
    return _line({"told": text, "time": time})


def refusal_line(problems: Sequence[Problem]) -> bytes:
    """Write the answer that a request was refused."""
    return _line({"problems": [[problem.path, problem.text] for problem in problems]})


def read_answer(line: bytes) -> tuple[float, str]:
    """Read an answer: simulated time [s] and text. Refused with the reasons; ValueError for what is no answer."""
    data: Any = json.loads(line)
    if isinstance(data, dict) and isinstance(data.get("problems"), list):
        raise Refused(*(Problem(str(path), str(text)) for path, text in data["problems"]))
    if not (isinstance(data, dict) and isinstance(data.get("time"), int | float)):
        raise ValueError("the answer is no answer of a run")
    return float(data["time"]), str(data.get("told", ""))


def too_long() -> Refused:
    """Return the refusal of a request whose end was not read."""
    return Refused(_too_long(LONGEST + 1))


def _too_long(length: int) -> Problem:
    return Problem("the request", f"has {length} bytes or more, allowed: up to {LONGEST}")


def _is_printed(text: str) -> bool:
    return text.isprintable() and not any("\ud800" <= letter <= "\udfff" for letter in text)


def _line(data: dict[str, Any]) -> bytes:
    return json.dumps(data).encode() + b"\n"
