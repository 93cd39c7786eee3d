"""Cards of the runs that take orders now, by which other programs of the same user find them.

A card is a file in a folder that only its user may open: $XDG_RUNTIME_DIR/oilsim, else oilsim-UID in the folder for temporary files. It
gives the run's name, its recording, its address, and the token that every order must carry. The run holds a lock on its card; a card
without a lock is that of a run that was killed, and whoever finds it removes it.
"""

from __future__ import annotations

import fcntl
import json
import os
import secrets
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

from recordings.files.writing import RECORDING_ENDING
from scenarios.problems import Problem, ScenarioError

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
