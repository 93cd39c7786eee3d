"""Orders on their way: the card by which a sender finds its run, and the messages of the socket between them."""

from __future__ import annotations

import fcntl
import hmac
import json
import os
import secrets
import stat
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal, get_args

from recordings.files.writing import RECORDING_ENDING
from recordings.model.frame import CREW, INSTRUCTOR
from scenarios.text.problems import Problem, ScenarioError
from scenarios.text.toml import read_object

Kind = Literal["order", "pause", "go-on", "step", "pace", "mark", "say", "end"]
KINDS: tuple[Kind, ...] = get_args(Kind)

LONGEST = 64 * 1024  # [bytes] of a request
MOST_WORDS: Mapping[Kind, int] = {"order": 100, "mark": 1, "say": 1, "pace": 1}  # with all other kinds, none


class Refused(Exception):
    """A request that the run does not take, with the reasons."""

    def __init__(self, *problems: Problem) -> None:
        super().__init__("; ".join(map(str, problems)))
        self.problems = problems


@dataclass(frozen=True, eq=False)
class Request:
    """A request that waits for the run's answer; `by` is the source of the events that it leads to."""

    kind: Kind
    settings: tuple[str, ...] = ()
    by: str = INSTRUCTOR
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


def request_line(kind: Kind, settings: Sequence[str], token: str, by: str = INSTRUCTOR) -> bytes:
    """Write a request; Refused if it is longer than a run reads."""
    line = _line({"token": token, "kind": kind, "settings": list(settings), "by": by})
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
    by = data.get("by", INSTRUCTOR)
    if not (isinstance(by, str) and _is_printed(by) and by.partition(" ")[0] in (INSTRUCTOR, CREW)):
        raise Refused(Problem("by", f"is {str(by)[:40]!r}, allowed: {INSTRUCTOR}, or {CREW} and a vessel's name"))
    most = MOST_WORDS.get(kind, 0)
    if not min(most, 1) <= len(settings) <= most:
        text = f"are {len(settings)}, allowed with {kind}: {f'1 to {most}' if most > 1 else most}"
        raise Refused(Problem("settings", text))
    return Request(kind, tuple(settings), by)


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


LOOPBACK = "127.0.0.1"  # where there are no sockets in folders
ONLY_OWNER = 0o700
_CARD, _SOCKET = ".json", ".socket"


@dataclass(frozen=True, kw_only=True)
class RunCard:
    """A run that takes orders.

    name: that of its scenario; recording: whole path of its recording, empty without one; address: path of its socket, or the number of
    its port on this machine; token: what shows that a sender could read this card.
    """

    name: str
    recording: str
    address: str | int
    token: str

    @property
    def place(self) -> str:
        """The recording, or the name of a run without one."""
        return self.recording or self.name


def runtime_folder() -> Path:
    """Return the folder for cards and sockets, which is made if need be; OSError if other users could open it."""
    given = os.environ.get("XDG_RUNTIME_DIR", "")
    own = Path(tempfile.gettempdir()) / f"oilsim-{os.getuid()}"
    folder = Path(given) / "oilsim" if given and Path(given).is_dir() else own
    folder.mkdir(mode=ONLY_OWNER, exist_ok=True)
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid() or stat.S_IMODE(found.st_mode) != ONLY_OWNER:
        allowed = f"allowed: a folder of user {os.getuid()} with the mode {ONLY_OWNER:o}"
        raise PermissionError(
            f"{folder} belongs to user {found.st_uid} and has the mode {stat.S_IMODE(found.st_mode):o}, {allowed}"
        )
    return folder


def new_socket_path(folder: Path) -> Path:
    """Return a free path for a socket."""
    return folder / f"{secrets.token_hex(6)}{_SOCKET}"


@contextmanager
def posted(card: RunCard, folder: Path) -> Iterator[None]:
    """Keep a card in the folder within the block."""
    path = folder / f"{secrets.token_hex(6)}{_CARD}"
    unfinished = path.with_suffix(".new")
    handle = os.open(unfinished, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX)
        os.write(handle, json.dumps(asdict(card)).encode())
        unfinished.replace(path)
        yield
    finally:
        for file in (unfinished, path):
            file.unlink(missing_ok=True)
        os.close(handle)


def find_run(run: str | Path) -> RunCard:
    """Find the run with this recording, or the only one with this name; ScenarioError if there is none, or several."""
    cards = list(_cards(runtime_folder()))
    is_path = Path(run).suffix == RECORDING_ENDING or isinstance(run, Path)
    wanted = str(Path(run).resolve()) if is_path else str(run)
    found = [card for card in cards if wanted == (card.recording if is_path else card.name)]
    if len(found) == 1:
        return found[0]
    places = ", ".join(sorted(card.place for card in (found or cards)))
    if found:
        text = f"is {str(run)!r}, the name of {len(found)} runs, allowed: the recording of one of them: {places}"
    else:
        text = f"is {str(run)!r}, which takes no orders now, allowed: {places or 'none, since no run takes orders now'}"
    raise ScenarioError([Problem("RUN", text)], "oilsim")


def _cards(folder: Path) -> Iterator[RunCard]:
    """Yield the cards of runs that go on, and remove those of runs that were killed."""
    for path in sorted(folder.glob(f"*{_CARD}")):
        try:
            with path.open() as file:
                content = file.read()
                is_left = _is_left(file.fileno())
            card = RunCard(**json.loads(content))
        except (OSError, ValueError, TypeError):
            continue  # the run has ended meanwhile, or it is no card
        if is_left:
            path.unlink(missing_ok=True)
            if isinstance(card.address, str) and Path(card.address).parent == folder:
                Path(card.address).unlink(missing_ok=True)
        else:
            yield card


def _is_left(handle: int) -> bool:
    """Return whether no program holds a lock on an open card."""
    try:
        fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
