"""Delay of the console's controls, and the run's pace, with 1, 4 and 20 pages open, beside a page that does not read and a stranger.

`python -m tests.benchmarks.console [PAGES ...]` prints a table: the time from a command to the word that it has arrived, and to the run's
answer.
"""

from __future__ import annotations

import json
import sys
import tempfile
import threading
import time
from contextlib import ExitStack, suppress
from pathlib import Path

import numpy as np
from websockets.exceptions import WebSocketException

from tests.scenarios.conduct.consoles import TOW, Console, Page, console

PAGES = (1, 4, 20)
COMMANDS = 40  # [1] for each row


def delays(page: Page) -> tuple[float, float]:
    """Return the times [s] until a command is said to have arrived, and until the run has acted."""
    began, taken = time.perf_counter(), 0.0
    page.socket.send(json.dumps({"id": 1, "do": "pace", "value": 2.0}))
    while True:
        message = json.loads(page.socket.recv(timeout=60))
        if message["kind"] != "answer":
            page.told[message["kind"]] = message
        elif message.get("taken"):
            taken = time.perf_counter() - began
        else:
            assert "told" in message, message
            return taken, time.perf_counter() - began


def reading(page: Page, stop: threading.Event) -> None:
    """Read as a browser does."""
    with suppress(WebSocketException, OSError):
        while not stop.is_set():
            with suppress(TimeoutError):
                page.socket.recv(timeout=0.2)


def pestered(one: Console, stop: threading.Event) -> None:
    """Knock with wrong tokens."""
    while not stop.is_set():
        with suppress(WebSocketException, OSError, TimeoutError), one.socket() as stranger:
            stranger.send('{"token": "wrong"}')
            stranger.recv(timeout=5)


def measure(one: Console, count: int) -> str:
    """Return a row of the table."""
    stop = threading.Event()
    with ExitStack() as stack:
        page = stack.enter_context(one.page("instructor"))
        others = [stack.enter_context(one.page("observer")) for _ in range(count - 1)]
        stack.enter_context(one.page("observer"))  # it does not read
        threads = [threading.Thread(target=reading, args=(other, stop)) for other in others]
        threads.append(threading.Thread(target=pestered, args=(one, stop)))
        for thread in threads:
            thread.start()
        found = np.array([delays(page) for _ in range(COMMANDS)]) * 1e3
        state = page.told["state"]
        stop.set()
        for thread in threads:
            thread.join()
    taken, acted = (np.percentile(column, (50, 99)) for column in found.T)
    factor = state["real_time_factor"] or 0.0
    return f"| {count:5d} | {taken[0]:6.1f} / {taken[1]:6.1f} | {acted[0]:6.1f} / {acted[1]:6.1f} | {factor:5.2f} |"


def main() -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as folder, console(Path(folder), TOW, "--pace", "2") as one:
        with one.page("instructor") as page:
            page.give("go-on")
        print("| pages | arrived, p50 / p99 [ms] | acted, p50 / p99 [ms] | real-time factor, of 2 |")
        print("|------:|------------------------:|----------------------:|-----------------------:|")
        for count in map(int, sys.argv[1:] or PAGES):
            print(measure(one, count), flush=True)


if __name__ == "__main__":
    main()
