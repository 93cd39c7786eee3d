"""Parts of the console: a stalled reader costs nothing, access is by token, and no message that is none gets through."""

from __future__ import annotations

import json
import threading
from functools import partial
from multiprocessing import Pipe

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oilsim.oil.fates import Fate
from scenarios.conduct.access import MOST_FAILURES, Access, Places, Role
from scenarios.conduct.commands import LONGEST, read_command, read_message, settings_of
from scenarios.conduct.conducted_run import LatestSender
from scenarios.conduct.history import MOST_ROWS, MOST_STATES, Album, History
from scenarios.conduct.server import other_origin, policy
from scenarios.conduct.snapshot import MOST_SPOTS, skimmers_of_crew, spots_of_particles
from scenarios.spec.load import load_scenario
from scenarios.text.problems import ScenarioError

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=8,
)


def test_of_the_states_that_a_stalled_console_has_not_read_only_the_last_arrives() -> None:
    reader, writer = Pipe(duplex=False)
    sender = LatestSender(writer)
    big = "x" * 100_000  # more than a pipe holds, so that the sender waits
    for number in range(200):
        sender.show({"kind": "state", "number": number, "big": big})
        sender.tell({"number": number})
    closing = threading.Thread(target=sender.close, args=(10.0,))
    closing.start()
    states, lines = [], []
    while lines[-1:] != [199] or states[-1:] != [199]:
        message = json.loads(reader.recv_bytes())
        if message["kind"] == "state":
            states.append(message["number"])
        else:
            lines += [line["number"] for line in message["lines"]]
    closing.join(10.0)
    assert len(states) < 20
    assert sender.dropped == 200 - len(states)
    assert lines == list(range(200))


def test_a_console_that_has_gone_does_not_stop_the_run() -> None:
    """The thread that sends to it has ended before the sender is closed, so closing waits for nothing."""
    others = set(threading.enumerate())
    reader, writer = Pipe(duplex=False)
    sender = LatestSender(writer)
    reader.close()
    for number in range(3):
        sender.show({"kind": "state", "number": number})
    sender.close(5.0)
    assert set(threading.enumerate()) <= others


@given(JSON)
def test_no_json_that_is_no_command_gets_through(data: object) -> None:
    with pytest.raises(ScenarioError):
        read_command(read_message(json.dumps(data)))


@given(st.binary(max_size=200))
def test_no_bytes_that_are_no_command_get_through(data: bytes) -> None:
    with pytest.raises(ScenarioError):
        read_command(read_message(data))


def test_commands_are_read_whole_or_refused_by_name() -> None:
    assert read_command({"id": 1, "do": "pace", "value": None}).entries == {"value": None}
    with pytest.raises(ScenarioError) as error:
        read_command({"id": 1, "do": "steer", "vessel": "", "speed": float("nan"), "heading": True, "extra": 1})
    assert {problem.path for problem in error.value.problems} == {"vessel", "speed", "heading", "keeps_line", "extra"}
    with pytest.raises(ScenarioError, match="allowed: up to"):
        read_message(" " * (LONGEST + 1))


def test_each_role_has_its_own_token_and_may_do_its_own() -> None:
    access = Access(["port", "starboard"])
    roles = {role.name: access.role_of(token) for role, token in access.tokens.items()}
    assert set(roles) == {"instructor", "port", "starboard", "observer"}
    assert roles["port"] == Role("vessel", "port")
    assert roles["port"].may("steer", "port")
    assert not roles["port"].may("steer", "starboard")
    assert not roles["port"].may("end")
    assert not roles["observer"].may("steer", "port")
    assert roles["instructor"].may("end")
    assert access.role_of("") is None


def test_a_crew_orders_its_own_skimmers_alone_and_of_them_what_crews_may() -> None:
    """Those that its vessel or its boom carries: start, stop, place and pump."""
    scenario = load_scenario("v-sweep").scenario
    names = {vessel: skimmers_of_crew(vessel, scenario) for vessel in (*scenario.vessels, "stranger")}
    assert names == {"port": ["brush"], "starboard": ["brush"], "stranger": []}
    settings = ["skimmers.brush.running=true", "skimmers.brush.place=[1.0, 2.0]", "skimmers.brush.nameplate=20.0"]
    command = {"id": 1, "do": "skim", "vessel": "port", "settings": settings}
    assert settings_of(read_command(command), {"port": {}}, names) == settings
    wrong = ["skimmers.disc.running=true", "skimmers.brush.storage=100.0", "sea.wind.speed=0.0"]
    with pytest.raises(ScenarioError) as found:
        settings_of(read_command(command | {"settings": [*settings, *wrong]}), {"port": {}}, names)
    assert [problem.path for problem in found.value.problems] == [one.partition("=")[0] for one in wrong]
    assert Role("vessel", "port").may("skim", "port")
    assert not Role("vessel", "port").may("skim", "starboard")


def test_a_password_is_asked_for_and_cannot_be_tried_without_end() -> None:
    access = Access([], "open sesame")
    (token, *_) = access.tokens.values()
    assert access.role_of(token, "open sesame") == Role("instructor")
    for _ in range(MOST_FAILURES):
        assert access.role_of(token, "wrong") is None
    assert access.role_of(token, "open sesame") is None


def test_wrong_passwords_of_one_address_keep_no_other_out() -> None:
    access = Access(["tug"], "open sesame")
    token = access.tokens[Role("instructor")]
    for _ in range(MOST_FAILURES):
        assert access.role_of(token, "wrong", "10.0.0.9") is None
    assert access.role_of(token, "open sesame", "10.0.0.9") is None
    assert access.role_of(token, "open sesame", "10.0.0.1") == Role("instructor")


def test_the_oldest_stranger_of_the_fullest_address_gives_way() -> None:
    places, closed = Places(5, 3), list[str]()
    for who in ("a1", "a2", "a3", "a4", "b1", "b2", "c1"):
        places.enter(who, who[0], partial(closed.append, who))
    assert closed == ["a1", "a2"]  # the fourth of one address, and the sixth of all
    places.leave("b1")
    places.leave("a1")  # gone already
    places.enter("d1", "d", partial(closed.append, "d1"))
    assert closed == ["a1", "a2"]


def test_the_3d_view_is_of_another_origin_and_embedded_by_the_page_alone() -> None:
    for one, other in (("127.0.0.1:8000", "localhost:8000"), ("localhost:8000", "127.0.0.1:8000")):
        assert other_origin(one) == f"http://{other}"
        assert policy(one)["content-security-policy"].endswith(f"frame-ancestors http://{other}")
    for host in ("evil.example:80", "127.0.0.1.evil.example:80", "[::1]:80", ""):
        assert other_origin(host) == ""


def test_history_stays_small_and_forgets_what_a_branch_takes_back() -> None:
    history = History()
    for number in range(10 * MOST_ROWS):
        history.take({"time": 0.5 * number, "vessels": {}, "booms": {}})
    assert MOST_ROWS // 2 <= len(history.rows) <= MOST_ROWS
    history.take({"time": 100.0, "vessels": {}, "booms": {}})
    assert history.rows[-1]["time"] <= 100.0


def test_album_finds_the_nearest_moment_and_stays_small() -> None:
    album = Album()
    assert album.nearest(1.0) is None
    for number in range(5 * MOST_STATES):
        album.take(float(number), str(number))
    found = album.nearest(701.3)
    assert found is not None
    assert abs(float(found) - 701.3) <= 8.0
    album.take(100.0, "again")
    assert album.nearest(1e6) in ("again", "96")


def test_what_a_run_does_not_share_with_the_one_before_is_forgotten() -> None:
    history, album = History(), Album()
    for number in range(20):
        history.take({"time": float(number), "vessels": {}, "booms": {}})
        album.take(float(number), str(number))
    history.forget_after(6.0)
    album.forget_after(6.0)
    history.take({"time": 10.0, "vessels": {}, "booms": {}})
    assert [row["time"] for row in history.rows] == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 10.0]
    assert album.nearest(9.0) == "6"


def test_spots_of_particles_have_their_volume() -> None:
    places = np.random.default_rng(1).uniform(-50.0, 50.0, (60_000, 2))
    spots = spots_of_particles(places, 1e-3, 0.2, Fate.LOST)
    assert len(spots) <= MOST_SPOTS
    assert (np.pi * spots[:, 2] ** 2 * spots[:, 3]).sum() == pytest.approx(60.0, rel=1e-4)
    assert (spots[:, 4] == Fate.LOST).all()
