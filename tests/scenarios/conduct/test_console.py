"""The console of a run: its pages see the present, their orders are obeyed by role, and the run is made again with them bit for bit."""

from __future__ import annotations

import base64
import json
import socket
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console as Terminal
from websockets.exceptions import ConnectionClosed, InvalidStatus

from recordings.replay.recording import Replay
from scenarios.conduct.commands import LONGEST
from scenarios.conduct.console import FIRST_REQUEST
from scenarios.conduct.server import CLOSED_MANY, CLOSED_TOKEN, MOST_COMMANDS, MOST_PAGES, other_origin
from scenarios.running.verify import verify
from tests.fuzz.console import attacked, faults
from tests.scenarios.conduct.consoles import TOW, Console, console


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Console]:
    with console(tmp_path_factory.mktemp("console"), TOW, "--pace", "2") as one:
        yield one


def test_connections_that_ask_for_nothing_are_closed(served: Console) -> None:
    host, port = served.host.split(":")
    with socket.create_connection((host, int(port))) as silent, socket.create_connection((host, int(port))) as slow:
        for byte in b"GET /":  # and then no more
            slow.sendall(bytes([byte]))
        for one in (silent, slow):
            one.settimeout(3.0 * FIRST_REQUEST)
            assert one.recv(100) == b""


def test_a_run_begins_paused_and_pages_steer_by_role(served: Console) -> None:
    with served.page("instructor") as instructor, served.page("port") as port, served.page("observer") as observer:
        assert instructor.state["time"] == 0.0
        assert instructor.state["paused"]
        assert set(instructor.told["hello"]["links"]) == {"instructor", "port", "starboard", "observer"}
        assert port.told["hello"]["links"] == observer.told["hello"]["links"] == {}
        assert instructor.give("step")["told"] == "makes a step at 0.0 s"
        instructor.hear(lambda page: page.state["index"] == 1)
        assert instructor.give("go-on")["told"].startswith("goes on")
        answer = port.give("steer", vessel="port", speed=0.2, heading=0.1, keeps_line=True)
        assert answer["told"].startswith("orders vessels.port.legs=")
        instructor.hear(lambda page: page.state["vessels"]["port"]["ordered"]["heading"] == 0.1)
        assert instructor.state["vessels"]["starboard"]["ordered"]["heading"] == 0.0
        for page, verb, entries in (
            (port, "steer", {"vessel": "starboard", "speed": 0.2, "heading": 0.1, "keeps_line": False}),
            (port, "pause", {}),
            (observer, "engine", {"vessel": "port", "runs": False}),
        ):
            assert "allowed: for the instructor" in page.give(verb, **entries)["problems"][0][1]
        refusal = instructor.give("order", settings=["tow.speed=99", "booms.main.length=3"])["problems"]
        assert {place for place, _ in refusal} == {"tow.speed", "booms.main.length"}
        told = instructor.give("order", settings=["sea.wind={kind='steady',speed=5.0,direction=0.0}"])["told"]
        assert "sea.wind" in told
        observer.hear(lambda page: page.state["weather"]["wind"] is not None)
        words = [line["words"] for line in observer.lines]
        assert "port: make 0.39 kn over the ground, heading 084" in words
        assert instructor.give("pause")["told"].startswith("paused")
    _assert_that_a_late_page_sees_the_present_and_the_past(served)


def _assert_that_a_late_page_sees_the_present_and_the_past(served: Console) -> None:
    with served.page("observer") as observer:
        assert observer.told["scene"]["vessels"][0]["name"] == "port"
        assert observer.told["history"]["rows"][0]["time"] == 0.0
        observer.hear(lambda page: bool(page.lines))
        assert "port: make 0.39 kn over the ground, heading 084" in [line["words"] for line in observer.lines]
        spots = np.frombuffer(base64.b64decode(observer.state["oil"]), "<f4").reshape(-1, 5)
        assert (np.pi * spots[:, 2] ** 2 * spots[:, 3]).sum() == pytest.approx(0.2, rel=1e-3)  # 5 m x 4 m x 10 mm
        line = np.array(observer.state["booms"]["main"]["line"])
        assert np.linalg.norm(np.diff(line, axis=0), axis=1).sum() == pytest.approx(24.0, rel=0.02)


def test_who_has_no_token_or_another_origin_is_refused(served: Console) -> None:
    for first in ('{"token": "wrong"}', "[]", "no json", '{"token": 1}', "x" * (LONGEST + 1)):
        with served.socket() as stranger:
            stranger.send(first)
            with pytest.raises(ConnectionClosed) as closed:
                stranger.recv(timeout=10)
            assert closed.value.rcvd is None or closed.value.rcvd.code in (CLOSED_TOKEN, 1009)
    for origin in ("http://evil.example", "null", f"https://{served.host}"):
        with pytest.raises(InvalidStatus):
            served.socket(origin=origin)
    for path in ("/page/../server.py", "/page/%2e%2e/server.py", "/page//etc/passwd", "/debrief/..%2f..%2fwhole"):
        with pytest.raises(urllib.error.HTTPError):
            urllib.request.urlopen(f"http://{served.host}{path}", timeout=10)
    with urllib.request.urlopen(f"http://{served.host}/", timeout=10) as answer:
        policy = answer.headers["content-security-policy"]
    assert f"frame-src 'self' blob: {other_origin(served.host)};" in policy
    assert "frame-ancestors 'none'" in policy
    asked = urllib.request.Request(f"http://{served.host}/", headers={"host": "evil.example"})
    with pytest.raises(urllib.error.HTTPError, match="400"):
        urllib.request.urlopen(asked, timeout=10)


def test_what_cannot_be_read_is_answered_and_harms_nothing(served: Console) -> None:
    with served.page("instructor") as page:
        for text in (
            "{",
            "[]",
            "null",
            '{"do": "pause"}',
            '{"id": 1, "do": "rm"}',
            '{"id": 1, "do": "pace", "value": "fast"}',
        ):
            page.socket.send(text)
            page.hear(lambda one: any(answer.get("problems") for answer in one.answers.values()), 10)
            page.answers.clear()
        page.socket.send(json.dumps({"id": 7, "do": "mark", "name": "\x00"}))
        page.hear(lambda one: 7 in one.answers)
        assert page.answers[7]["problems"]
        assert page.state["paused"]


def test_attacks_are_refused_and_the_run_does_not_feel_them(served: Console) -> None:
    with served.page("instructor") as page:
        begun = page.state["index"]
        page.give("step")  # what the run says at its beginning has come by then
        page.hear(lambda one: one.state["index"] == begun + 1)
        before = [line["text"] for line in page.lines]
        found = attacked(served, range(60))
        assert faults(found) == []
        assert found.total() == 60
        index = page.state["index"]
        page.give("step")
        page.hear(lambda one: one.state["index"] == index + 1)
        assert [line["text"] for line in page.lines] == before


def test_fifty_pages_at_once_are_served_or_refused_and_one_that_does_not_read_costs_nothing(served: Console) -> None:
    with ExitStack() as stack:
        pages = [stack.enter_context(served.socket()) for _ in range(12)]  # strangers are few at a time, too
        for page in pages:
            page.send(json.dumps({"token": served.token("observer")}))
            page.recv(timeout=60)
        while len(pages) < 50:
            pages.append(stack.enter_context(served.socket()))
            pages[-1].send(json.dumps({"token": served.token("observer")}))
        codes = []
        for page in pages[12:]:
            try:
                page.recv(timeout=60)
            except ConnectionClosed as closed:
                codes.append(closed.rcvd.code if closed.rcvd else None)
        assert codes.count(CLOSED_MANY) == len(codes) == 50 - MOST_PAGES
        with served.page("instructor") as instructor:  # it has a place, and none of the others has read what came since
            assert "told" in instructor.give("step")


def test_strangers_take_nobodys_place(served: Console) -> None:
    """Three hundred connections that say nothing, and thirty sockets without a token: a page that comes is served at once."""
    host, port = served.host.split(":")
    with ExitStack() as stack:
        for _ in range(300):
            stack.enter_context(socket.create_connection((host, int(port))))
        for _ in range(30):
            stack.enter_context(served.socket())
        with served.page("instructor") as instructor:
            assert "told" in instructor.give("step")


def test_headers_that_come_slowly_are_not_waited_for_after_an_answer_either(served: Console) -> None:
    host, port = served.host.split(":")
    with socket.create_connection((host, int(port))) as slow:
        slow.settimeout(3.0 * FIRST_REQUEST)
        slow.sendall(f"GET /nothing HTTP/1.1\r\nHost: {served.host}\r\n\r\n".encode())
        assert slow.recv(1 << 16).startswith(b"HTTP/1.1 404")
        slow.sendall(b"GET / HTTP/1.1\r\n")
        while slow.recv(1 << 16):
            pass


def test_a_crew_that_orders_all_the_time_keeps_nobody_waiting(served: Console) -> None:
    """Two hundred orders of a crew wait; each of the instructor's commands is done before them, and the crew is told of its own."""
    with served.page("port") as crew, served.page("instructor") as instructor:
        for number in range(200):
            order = {"id": 1000 + number, "do": "engine", "vessel": "port", "runs": number % 2 == 1}
            crew.socket.send(json.dumps(order))
            if number % MOST_COMMANDS == MOST_COMMANDS - 1:
                assert "told" in instructor.give("step")
                time.sleep(1.0)  # as many a second as a page may give
        crew.hear(lambda page: len(page.answers) == 200)
        done = [answer for answer in crew.answers.values() if "told" in answer]
        assert done and all("wait" in str(one["problems"]) for one in crew.answers.values() if "told" not in one)


@pytest.mark.slow
def test_a_branch_from_a_mark_and_the_run_is_made_again_bit_for_bit(served: Console) -> None:
    with served.page("instructor") as page:
        page.give("mark", name="before it is slower")
        page.hear(lambda one: bool(one.told["session"]["marks"]))
        mark = page.told["session"]["marks"][0]
        page.give("pace", value=None)
        page.give("go-on")
        page.hear(lambda one: one.state["time"] > mark["time"] + 0.5)
        assert page.give("branch", time=mark["time"], recording=mark["recording"], settings=["tow.speed=0.2"])[
            "told"
        ].startswith("goes back")
        page.hear(lambda one: one.told["session"]["run"] == 2 and one.state["time"] <= mark["time"] + 0.2)
        assert page.state["paused"]
        page.give("go-on")
        page.hear(lambda one: one.state["time"] > mark["time"] + 0.3)
        assert page.state["tow"]["speed"] == 0.2
        page.give("end")
        page.until(phase="ended", reason="ended by the instructor")
        branch = page.told["session"]["recording"]
    for name in ("whole.rrd", branch):
        recording = served.folder / name
        assert "ended by the instructor" in Replay(recording).end_reason
        verdict = verify(recording, console=Terminal(quiet=True))
        assert not verdict.difference
        assert verdict.equal_frames > 5


def test_another_host_needs_a_password(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from scenarios.cli import main

    assert main(["conduct", "sweep-200m", "--host", "0.0.0.0", "--record", str(tmp_path / "a.rrd")]) == 2
    assert "with --password FILE only" in capsys.readouterr().err
