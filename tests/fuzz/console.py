"""Attack a console over its port: wrong tokens, other origins, messages that are none, commands of other roles, paths out of its folder.

    python -m tests.fuzz.console [--attacks N] [--first SEED]

It conducts a small exercise meanwhile, prints a count of what came of the attacks, and compares the run's log with what was ordered: it may
hold nothing else. The exit status is 1 if an attack got through or the run stood still.
"""

from __future__ import annotations

import argparse
import json
import socket
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from random import Random

from websockets.exceptions import ConnectionClosed, InvalidStatus

from scenarios.conduct.commands import LONGEST
from tests.scenarios.conduct.consoles import TOW, Console, console

WAIT = 20.0  # [s] for an answer on a busy machine
CLOSED = (4400, 4401, 1003, 1007, 1009)  # codes that say why a page is closed
VERBS = (
    "pause",
    "go-on",
    "step",
    "end",
    "debrief",
    "pace",
    "mark",
    "order",
    "tow",
    "branch",
    "steer",
    "engine",
    "levers",
)


def _junk(random: Random, depth: int = 0) -> object:
    """Return random data that JSON can hold."""
    kinds: list[Callable[[], object]] = [
        lambda: None,
        lambda: random.choice([True, False]),
        lambda: random.choice([0, -1, 1e308, -(2**70), 0.1, float("inf"), float("nan")]),
        lambda: "".join(
            chr(random.choice([random.randrange(128), random.randrange(0xD7FF)])) for _ in range(random.randrange(12))
        ),
    ]
    if depth < 3:
        kinds += [
            lambda: [_junk(random, depth + 1) for _ in range(random.randrange(4))],
            lambda: {str(_junk(random, 3))[:9]: _junk(random, depth + 1) for _ in range(random.randrange(4))},
        ]
    return random.choice(kinds)()


def wrong_token(one: Console, random: Random) -> str:
    """Show a token that is none."""
    first = random.choice(
        [json.dumps({"token": _junk(random)}), json.dumps(_junk(random)), "{", "x" * random.randrange(2 * LONGEST)]
    )
    with one.socket() as stranger:
        stranger.send(first)
        with suppress(ConnectionClosed):
            return f"let in: {stranger.recv(timeout=WAIT)!r:.60}"
        return _closed(stranger.protocol.close_code)


def foreign_page(one: Console, random: Random) -> str:
    """Call from a page of another server."""
    port = one.host.rpartition(":")[2]
    origins = (
        "http://evil.example",
        "null",
        f"https://{one.host}",
        f"http://127.0.0.1.evil.example:{port}",
        "http://127.0.0.1:1",
        f"http://localhost:{port}",  # the 3-D view's
        f"http://{one.host}@evil.example",
    )
    try:
        with one.socket(origin=random.choice(origins)):
            return "let in"
    except InvalidStatus as error:
        return f"refused with {error.response.status_code}"


def broken_message(one: Console, random: Random) -> str:
    """Send an observer's page's messages that are no commands; the bytes are those of random data, cut or mixed up."""
    with one.socket() as page:
        page.send(json.dumps({"token": one.token("observer")}))
        raw = json.dumps(
            {"id": random.randrange(9), "do": random.choice([*VERBS, "rm"]), **dict.fromkeys("ab", _junk(random))}
        ).encode()
        if random.random() < 0.5:
            raw = raw[: random.randrange(len(raw))] + random.randbytes(random.randrange(20))
        sent: str | bytes = raw if random.random() < 0.3 else raw.decode("utf-8", "replace")
        page.send(random.choice([sent, "[" * random.randrange(1, LONGEST), "9" * (LONGEST + random.randrange(9))]))
        return _answer(page)


def command_of_others(one: Console, random: Random) -> str:
    """Give a whole command that belongs to another role."""
    role = random.choice(["observer", "port"])
    entries: dict[str, object] = {
        "vessel": "starboard",
        "speed": 0.3,
        "heading": 0.0,
        "keeps_line": False,
        "runs": False,
        "thrust": 1.0,
    }
    wanted = {
        "pace": ["value"], "mark": ["name"], "order": ["settings"], "tow": ["speed", "heading"],
        "branch": ["time", "recording", "settings"],
        "steer": ["vessel", "speed", "heading", "keeps_line"], "engine": ["vessel", "runs"], "levers": ["vessel", "thrust", "steering"],
    }  # fmt: skip
    entries |= {
        "value": 5.0,
        "name": "mine",
        "settings": ["tow.speed=0.1"],
        "time": 0.0,
        "recording": None,
        "steering": 1.0,
    }
    verb = random.choice(VERBS)
    with one.socket() as page:
        page.send(json.dumps({"token": one.token(role)}))
        page.send(json.dumps({"id": 1, "do": verb} | {key: entries[key] for key in wanted.get(verb, [])}))
        return _answer(page)


def path_outside(one: Console, random: Random) -> str:
    """Ask for a file that is none of the page's, with dots and slashes written in many ways."""
    up = random.choice(
        ["../", "..%2f", "%2e%2e/", "%2e%2e%2f", "..\\", "..%5c", "....//", "%252e%252e%252f", "..%c0%af", "/"]
    )
    start = random.choice(["/page/", "/page/vendor/", "/debrief/", "/viewer/", "/scene/", "/"])
    target = random.choice(["etc/passwd", "server.py", "whole.rrd", "exercise.toml", "proc/self/environ", ""])
    return _asked(
        one,
        f"GET {start}{up * random.randrange(1, 9)}{target} HTTP/1.1\r\nhost: {one.host}\r\nconnection: close\r\n\r\n".encode(),
    )


def no_request(one: Console, random: Random) -> str:
    """Send bytes that are no request, or one with a wrong host or endless headers."""
    return _asked(
        one,
        random.choice(
            [
                random.randbytes(random.randrange(1, 400)) + b"\r\n\r\n",
                b"GET / HTTP/1.1\r\nhost: evil.example\r\nconnection: close\r\n\r\n",
                b"GET / HTTP/1.1\r\nx: " + b"a" * 200_000 + b"\r\n\r\n",
                f"POST /live HTTP/1.1\r\nhost: {one.host}\r\ncontent-length: 4\r\nconnection: close\r\n\r\nhey!".encode(),
            ]
        ),
    )


ATTACKS = (wrong_token, foreign_page, broken_message, command_of_others, path_outside, no_request)


def _closed(code: int | None) -> str:
    return f"closed with {code}" if code in CLOSED else f"closed without a reason ({code})"


def _answer(page: object) -> str:
    """Return what becomes of a message: refused in words, or the page is closed."""
    with suppress(ConnectionClosed):
        while True:
            message = json.loads(page.recv(timeout=WAIT))  # type: ignore[attr-defined]
            if message["kind"] == "answer" and message.get("problems"):
                return "refused in words"
            if message["kind"] == "answer" and "told" in message:
                return f"done: {message['told']:.60}"
    return _closed(page.protocol.close_code)  # type: ignore[attr-defined]


def _asked(one: Console, request: bytes) -> str:
    """Return the status of the answer to a request; a page's own content is none of other files."""
    name, _, port = one.host.partition(":")
    answer = b""
    with socket.create_connection((name, int(port)), timeout=WAIT) as stream, suppress(ConnectionError):
        stream.sendall(request)
        while (part := stream.recv(1 << 16)) and len(answer) < 1 << 20:
            answer += part
            if b"connection: close" not in request:
                break
    status = answer[9:12].decode("ascii", "replace")
    if status == "200" and b"<title>oilsim conduct</title>" not in answer:
        return f"got a file: {answer[-60:]!r}"
    return f"answered {status}" if answer else "cut off"


def attacked(one: Console, seeds: range) -> Counter[str]:
    """Make the attacks of these seeds, and count what came of them."""
    found: Counter[str] = Counter()
    for seed in seeds:
        random = Random(seed)
        attack = random.choice(ATTACKS)
        found[f"{attack.__name__}: {attack(one, random)}"] += 1
    return found


def faults(found: Counter[str]) -> list[str]:
    """Return what should not have come of an attack."""
    good = ("refused", "closed with", "answered 4", "answered 5", "answered 200", "cut off")
    return [what for what in found if not what.partition(": ")[2].startswith(good)]


def main(arguments: list[str] | None = None) -> int:
    """Run what the command line asks for; returns the exit status."""
    parser = argparse.ArgumentParser(prog="fuzz.console", description="Attack a console over its port.")
    parser.add_argument("--attacks", type=int, default=2000, metavar="N", help="how many (default: 2000)")
    parser.add_argument("--first", type=int, default=0, metavar="SEED", help="seed of the first")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory(prefix="oilsim-fuzz-") as folder, console(Path(folder), TOW, "--pace", "2") as one:
        with one.page("instructor") as page:
            page.give("go-on")
            page.hear(lambda page: page.state["time"] > 0.5)
            before = page.state["time"]
        found = attacked(one, range(options.first, options.first + options.attacks))
        with one.page("instructor") as page:
            page.hear(lambda page: bool(page.lines) and page.state["time"] > before + 0.5)
            orders = [line["words"] for line in page.lines if line["source"] == "instructor"]
    for what, count in sorted(found.items()):
        print(f"{count:6d}  {what}")
    wrong = [*faults(found), *(f"the run was told: {words}" for words in orders if words not in ("paused", "goes on"))]
    print("\n".join(f"FAULT  {what}" for what in wrong) or f"{options.attacks} attacks, 0 faults, and the run goes on")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
