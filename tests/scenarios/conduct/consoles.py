"""A console in a process of its own, as `oilsim conduct` starts it, and pages that speak to it as browsers do."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from websockets.sync.client import ClientConnection, connect

from tests.scenarios.small_tow import small_tow

# with 100 litres of oil ahead, in a current
OIL = """
phases.oil = {oil = "alaska-north-slope"}
fill.slick = {shape = "block", phase = "oil", lower = [8.0, -2.0, -0.01], upper = [13.0, 2.0, 0.0]}
sea.current = {kind = "steady", speed = 0.1, direction = 0.0}
"""
TOW = small_tow(duration=1000.0, communication_step=0.05, frame_rate=20, more=OIL)
TRAP = 'from pathlib import Path\nPath(__file__).with_name("HIJACKED").touch()\nraise ImportError("from the current folder")\n'
FOREIGN = (
    "numpy",
    "numba",
    "scipy",
    "uvicorn",
    "starlette",
    "websockets",
    "rerun",
    "trimesh",
    "pybullet",
    "rich",
    "cattrs",
)
PATIENCE = 120.0  # [s]; the first run in a fresh cache compiles


class Page:
    """A page that is open, and all that it was told."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.told: dict[str, Any] = {}  # the latest message of each kind
        self.lines: list[dict[str, Any]] = []
        self.answers: dict[int, dict[str, Any]] = {}
        self._last = 0

    def hear(self, done: Callable[[Page], bool], patience: float = PATIENCE) -> Page:
        """Read messages until `done`."""
        deadline = time.monotonic() + patience
        while not done(self):
            message = json.loads(self.socket.recv(timeout=max(0.01, deadline - time.monotonic())))
            self.told[message["kind"]] = message
            assert message.get("phase") != "failed", message["reason"]
            if message["kind"] == "lines":
                self.lines += message["lines"]
            elif message["kind"] == "answer" and not message.get("taken"):
                self.answers[message["id"]] = message
        return self

    def give(self, verb: str, **entries: object) -> dict[str, Any]:
        """Give a command; return its answer."""
        self._last += 1
        number = self._last
        self.socket.send(json.dumps({"id": number, "do": verb, **entries}))
        self.hear(lambda page: number in page.answers)
        return self.answers.pop(number)

    @property
    def state(self) -> dict[str, Any]:
        """The latest state of the run."""
        return self.told.get("state", {})

    def until(self, **wanted: object) -> Page:
        """Read messages until the session has these entries."""
        return self.hear(lambda page: wanted.items() <= page.told.get("session", {}).items())


class Console:
    """A console that is served, and the addresses of its pages."""

    def __init__(self, process: subprocess.Popen[str], folder: Path) -> None:
        self.process, self.folder = process, folder
        self.addresses: dict[str, str] = {}
        assert process.stdout is not None
        while "observer" not in self.addresses:
            line = process.stdout.readline()
            assert line, "the console has ended"
            if found := re.search(r"^\s+(\S+)\s+(http://\S+)$", line):
                self.addresses[found[1]] = found[2]

    @property
    def host(self) -> str:
        """Name and port of the server."""
        return self.addresses["observer"].removeprefix("http://").partition("/")[0]

    def token(self, role: str) -> str:
        """Return the token of a role."""
        return self.addresses[role].partition("#")[2]

    def socket(self, origin: str | None = None, **options: Any) -> ClientConnection:
        """Open a web socket, from the server's own origin unless another is given."""
        return connect(
            f"ws://{self.host}/live",
            origin=origin or f"http://{self.host}",
            max_size=None,
            ping_interval=None,
            **options,
        )  # type: ignore[arg-type]

    @contextmanager
    def page(self, role: str) -> Iterator[Page]:
        """Open a page in a role."""
        with self.socket() as socket:
            socket.send(json.dumps({"token": self.token(role)}))
            yield Page(socket).hear(lambda page: "state" in page.told)


@contextmanager
def console(
    folder: Path, text: str, *options: str, has_scene: bool = False, resumed: Path | None = None
) -> Iterator[Console]:
    """Conduct the exercise of a scenario's text in a folder, with a 3-D view if wanted; it ends in order after the block.

    `resumed` is a recording to go on with instead.
    """
    (folder / "exercise.toml").write_text(text)
    (folder / "user").mkdir(mode=0o700)
    for name in {*sys.stdlib_module_names, *FOREIGN}:
        (folder / f"{name}.py").write_text(TRAP)
    command = [
        sys.executable,
        "-P",
        "-m",
        "scenarios.cli",
        "conduct",
        *(["exercise.toml"] if resumed is None else ["--resume", str(resumed)]),
        "--record",
        "whole.rrd" if resumed is None else "resumed.rrd",
        "--no-browser",
        *([] if has_scene else ["--no-scene"]),
        *options,
    ]
    environment: Mapping[str, str] = os.environ | {
        "XDG_RUNTIME_DIR": str(folder / "user"),
        "PYTHONPATH": str(Path(__file__).parents[3]),
        "PYTHONUNBUFFERED": "1",
    }
    with subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield Console(process, folder)
        finally:
            process.send_signal(signal.SIGTERM)
            try:
                process.wait(60)
            except subprocess.TimeoutExpired:
                process.kill()
                raise
            assert process.returncode == 0
            assert not (folder / "HIJACKED").exists(), (
                "no process of a console takes its modules from the current folder"
            )
