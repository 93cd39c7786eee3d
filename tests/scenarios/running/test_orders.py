"""Orders from another program to a run that goes on: what they change, what is refused, and that the run is made again with them."""

from __future__ import annotations

import json
import signal
import socket
import stat
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import replace
from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console

from coupling.fmu.trial_process import STOPPING
from recordings.replay.recording import Replay
from scenarios.cli import main
from scenarios.orders.client import NoAnswerError, go_on, order, pause
from scenarios.orders.protocol import LONGEST, RunCard, find_run, new_socket_path, posted, request_line, runtime_folder
from scenarios.running import plan as plans
from scenarios.running.checkpoints import find_restart
from scenarios.running.instructor import GLANCE, MOST_BEHIND, Pace
from scenarios.running.plan import Plan
from scenarios.running.run import RunOptions, resume, run_scenario
from scenarios.running.run_requests import RunRequests
from scenarios.running.verify import verify
from scenarios.schema.sea import JonswapSeaWaves, SteadySeaWind
from scenarios.spec.load import load_scenario, scenario_from
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import ScenarioError
from scenarios.text.toml import read_toml
from tests.docs.guide import DOCS, commands
from tests.scenarios.small_tow import small_tow

STEP = 0.02
PACE = 0.25  # slow enough for a few orders
TOW = small_tow(duration=0.6, communication_step=STEP, frame_rate=50)
QUIET = Console(quiet=True)


@pytest.fixture(autouse=True)
def _own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The runs of a test do not meet those of others."""
    (tmp_path / "user").mkdir()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "user"))


def tow(**terms: float) -> Scenario:
    scenario = scenario_from(read_toml(TOW))
    return replace(scenario, run=replace(scenario.run, **terms))


@contextmanager
def going_on(
    scenario: Scenario, record: Path, *, resumed: bool = False, pace: float | None = PACE, code: int = 0
) -> Iterator[None]:
    """Run in a thread, from the start or from the last checkpoint of ``whole.rrd``; it has ended with that exit code after the block."""
    options = RunOptions(record=record, summary=record.with_suffix(".json"), takes_orders=True, pace=pace)
    codes: list[int] = []

    def run() -> None:
        if resumed:
            terms = (f"run.duration={scenario.run.duration}",)
            restart = find_restart(record.with_name("whole.rrd")).with_settings(terms, None)
            codes.append(resume(restart, options=options, console=QUIET))
        else:
            codes.append(run_scenario(scenario, options=options, console=QUIET))

    thread = threading.Thread(target=run)
    thread.start()
    try:
        while thread.is_alive():
            with suppress(ScenarioError):
                find_run(record)
                break
            time.sleep(0.01)
        yield
    finally:
        with suppress(ScenarioError, NoAnswerError):
            go_on(record, patience=30.0)  # so that a failing test ends
        thread.join(250)
    assert codes == [code]


def said(record: Path, source: str = "instructor") -> list[str]:
    return [event.text for event in Replay(record).events if event.source == source]


def summary(record: Path) -> dict:
    return json.loads(record.with_suffix(".json").read_text())


def assert_made_again(record: Path) -> None:
    verdict = verify(record, console=QUIET)
    assert verdict.difference == ""
    assert verdict.equal_frames >= 5


def test_orders_change_the_run_are_events_and_are_verified(tmp_path: Path) -> None:
    """Weather is added to a calm sea, an engine stops and a boom parts: the run is made again with them, goes on and is made again."""
    record = tmp_path / "whole.rrd"
    with going_on(tow(), record):
        assert pause(record).time == 0.0
        answer = order(
            record, "tow.speed_kn=0.5", "sea.wind.kind=steady", "sea.wind.speed=9", "sea.wind.direction_deg=90"
        )
        assert answer.time == 0.0
        order(str(record), "tow.speed_kn=0.7")  # at the same communication point, after the first
        go_on("tow")
        answer = order(
            record, "sea.waves={kind='regular', height=0.2, period=3, direction=0}", "vessels.port.engine=stopped"
        )
        assert 0.0 < answer.time < 0.6
        order(record, "booms.main.parted=[4]", "sea.current={kind='steady', speed=0.2, direction=0}")
    told = said(record)
    assert told[0] == "paused"
    assert told[1].startswith("orders tow.speed_kn=0.5 sea.wind.kind=steady")
    assert told[2:4] == ["orders tow.speed_kn=0.7", "goes on"]
    assert "has parted at joint 4, between segments 3 and 4" in said(record, "boom main")[-1]
    assert summary(record)["overrides"][4] == "tow.speed_kn=0.7"
    thrust = Replay(record).scalars
    assert thrust  # the recording can be read whole
    assert_made_again(record)
    second = tmp_path / "second.rrd"
    with going_on(tow(duration=0.8), second, resumed=True):
        order(second, "sea.waves.height=0.3", "booms.main.parted=[4, 6]", "vessels.port.engine=running")
    assert len(said(second)) == 1
    assert_made_again(second)


def test_a_run_is_made_again_with_another_order_among_its_own(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """On the command line: later orders are given again, at their times; `compare` says what has changed, or that nothing has."""
    record, windy, same = (tmp_path / f"{name}.rrd" for name in ("whole", "windy", "same"))
    scenario = tow()
    often = replace(scenario, recording=replace(scenario.recording, checkpoint_interval=0.04))
    with going_on(often, record):
        pause(record)
        order(record, "vessels.port.legs=[{speed=0.2,heading=0.1}]", "vessels.starboard.legs=[{speed=0.2,heading=0.1}]")
        while pause(record).time < 0.2:
            go_on(record)
            time.sleep(0.05)
        steered = order(record, "vessels.port.legs=[{speed=0.1,heading=-0.1}]")
    assert 0.2 <= steered.time < 0.6
    back = ["run", "--resume", str(record), "--at", "0.06", "--keep-orders", "--threads", "1"]
    assert main([*back, "--set", "sea.wind={kind='steady',speed=9.0,direction=1.0}", "--record", str(windy)]) == 0
    assert main([*back, "--set", "tow.speed=0.1", "--record", str(same)]) == 0
    times = [event.time for event in Replay(windy).events if event.source == "instructor"]
    assert times == pytest.approx([0.06, steered.time])
    assert_made_again(windy)
    capsys.readouterr()
    assert main(["compare", str(record), str(same), "--table"]) == 0
    assert "both runs are the same, frame for frame" in capsys.readouterr().out
    assert main(["compare", str(record), str(windy), "--table"]) == 0
    assert "the runs differ from 0.08 s on" in capsys.readouterr().out
    assert main(["run", "--resume", str(record), "--keep-orders"]) == 2
    assert "--keep-orders" in capsys.readouterr().err


def test_run_that_is_stopped_in_a_pause_goes_on_with_the_orders_given_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """To the last bit as if it had not been stopped; a checkpoint with another number of orders is refused."""
    first, second, third = (tmp_path / f"{name}.rrd" for name in ("whole", "second", "third"))
    requests = RunRequests()
    orders = [
        ("sea.wind={kind='steady', speed=9, direction=1}", "booms.main.parted=[2]"),
        ("tow.speed=0.1",),
        ("tow.speed=0.3",),
    ]
    with monkeypatch.context() as patch:
        patch.setattr("scenarios.running.run.requests_by_posix_signal", lambda: nullcontext(requests))
        with going_on(tow(), first, code=128 + signal.SIGTERM):
            pause(first)
            for settings in orders:
                order(first, *settings)
            requests.ask(signal.SIGTERM)
    STOPPING.clear()
    restart = find_restart(first)
    assert (restart.index, restart.state["orders_given"], len(restart.plan.actions)) == (0, 3, 3)
    with going_on(tow(duration=0.2), second, resumed=True, pace=None):
        pass
    with going_on(tow(duration=0.2), third, pace=None):
        pause("tow")
        for settings in orders:
            order("tow", *settings)
        go_on("tow")
    assert summary(second)["state_hash"] == summary(third)["state_hash"] is not None
    assert_made_again(second)
    damaged = replace(restart, state={**restart.state, "orders_given": 7})
    assert resume(damaged, options=RunOptions(summary=tmp_path / "damaged.json"), console=QUIET) == 1
    assert "saved after 7 orders, allowed: 0 to 3" in summary(tmp_path / "damaged.rrd")["ended"]


def test_wind_waves_and_a_release_are_added_to_water_of_particles(tmp_path: Path) -> None:
    """A tank of two layers at rest; the pipe pours oil, and may not stand outside the tank."""
    terms = ("fluid.particle_spacing=0.1", f"run.communication_step={STEP}", "run.duration=0.3", "run.threads=1")
    more = ("recording.frame_rate=50", "recording.precision=0", "recording.checkpoint_interval=0")
    scenario = load_scenario("two-layer", overrides=[*terms, *more]).scenario
    x, y, z = (0.5 * (low + high) for low, high in zip(scenario.tank.lower, scenario.tank.upper, strict=True))
    top = scenario.tank.upper[2]
    pipe = "emitters.spill={{phase='oil', mouth=[{}, {}, {}], direction=[0, 0, -1], radius=0.15, speed=2.0}}"
    record = tmp_path / "whole.rrd"
    with going_on(scenario, record):
        pause(record)
        with pytest.raises(ScenarioError, match=r"emitters.spill.mouth"):
            order(record, "sea.wind.speed=8", pipe.format(x, y, top - 0.05))
        order(record, "sea.wind.speed=8", pipe.format(x, y, z))
        order(record, "sea.waves={height=0.05, period=0.8}")
        go_on(record)
    oil = Replay(record).phase_times("oil").value
    assert oil[-1] > oil[0]
    assert_made_again(record)
    second = tmp_path / "second.rrd"
    with going_on(replace(scenario, run=replace(scenario.run, duration=0.4)), second, resumed=True, pace=None):
        pass
    assert_made_again(second)


def test_what_may_not_be_ordered_changes_nothing_and_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    record = tmp_path / "whole.rrd"
    refused = {
        (
            "tow.speed=0.5",
            "fluid.particle_spacing=0.1",
        ): "fluid.particle_spacing cannot be changed during a run, allowed: tow.speed",
        ("tow.speed=900",): "tow.speed is 900.0, allowed: 0 or more and at most 20 m/s",
        ("tow.spede=0.5",): "tow.spede is unknown, did you mean 'speed'?",
        ("tow.speed",): "order is 'tow.speed', allowed: key=value",
        ("run.duration=9",): "run.duration cannot be changed during a run",
        ("emitters.a.speed=1",): "emitters.a.speed cannot be ordered: the run has no tank",
        ("booms.main.parted=[8]",): "booms.main.parted is [8], allowed: numbers from 1 to 7",
        ("sea.waves={kind='regular', height=9, period=2}",): "sea.waves",
        ("tow.speed=0.5", "go-on", "tow.speed=0.4"): "allowed: pause as the first word",
    }
    with going_on(tow(duration=0.2), record):
        pause(record)
        for settings, told in refused.items():
            assert main(["order", str(record), *settings]) == 2
            assert told in capsys.readouterr().err
        assert main(["order", str(record), "pause", "booms.main.parted=[3]"]) == 0
        assert capsys.readouterr().out == "0.00 s  paused\n0.00 s  orders booms.main.parted=[3]\n"
        assert main(["order", str(record), "booms.main.parted=[]"]) == 2
        assert "booms.main.parted is [], allowed: numbers of joints that part" in capsys.readouterr().err
        assert main(["order", "elsewhere", "tow.speed=1"]) == 2
        assert f"takes no orders now, allowed: {record}" in capsys.readouterr().err
        assert main(["order", str(record), "go-on"]) == 0
    assert said(record) == ["paused", "orders 'booms.main.parted=[3]'", "goes on"]
    assert main(["order", str(record), "tow.speed=1"]) == 2
    assert "no run takes orders now" in capsys.readouterr().err


def test_wrong_loud_and_slow_senders_do_not_disturb_the_run(tmp_path: Path) -> None:
    """The run is the one without them, to the last bit, and an order comes through meanwhile."""
    quiet, loud = tmp_path / "quiet.rrd", tmp_path / "loud.rrd"
    with going_on(tow(), quiet):
        pass
    with going_on(tow(), loud):
        card = find_run(loud)
        silent = [_connected(card) for _ in range(5)]
        assert b"cannot be read" in _answer(card, b"dear run,\n")
        assert b"ends too early" in _answer(card, b'{"token"')
        assert b"cannot be read" in _answer(card, b"[" * 50_000 + b"\n")
        assert b"allowed: up to 65536" in _answer(card, b"x" * (LONGEST + 10) + b"\n")
        for token in ("", "wrong", "\N{LATIN SMALL LETTER E WITH ACUTE}"):
            assert b"is not that of this run" in _answer(card, request_line("pause", [], token))
        for content in (
            '"settings": [7]',
            '"settings": ["a=1\\nb=2"]',
            '"kind": "stop", "settings": []',
            '"settings": []',
        ):
            line = f'{{"token": "{card.token}", "kind": "order", {content}}}\n'
            assert b"problems" in _answer(card, line.encode())
        silent += [_connected(card) for _ in range(20)]
        assert b"senders of orders now" in _answer(card, request_line("pause", [], card.token))
        for link in silent:
            link.close()
    assert said(loud) == []
    assert summary(loud)["state_hash"] == summary(quiet)["state_hash"] is not None


def _connected(card: RunCard) -> socket.socket:
    path = isinstance(card.address, str)
    link = socket.socket(socket.AF_UNIX if path else socket.AF_INET)
    link.settimeout(20)
    link.connect(card.address if path else ("127.0.0.1", card.address))
    return link


def _answer(card: RunCard, line: bytes) -> bytes:
    with _connected(card) as link:
        with suppress(OSError):  # it may have stopped to read
            link.sendall(line)
            link.shutdown(socket.SHUT_WR)
        return link.recv(65536)


def test_orders_of_the_guide(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every order to the sweep, as it stands on the page, to a smaller boom in waves and wind."""
    monkeypatch.chdir(tmp_path)
    orders = [call for call in commands(DOCS / "guides" / "orders.md") if call[:2] == ["order", "sweep.rrd"]]
    scenario, record = tow(duration=0.2), tmp_path / "sweep.rrd"
    waves = JonswapSeaWaves(significant_height=0.2, peak_period=3.0, direction=0.0)
    boom = replace(scenario.booms["main"], segments=22)
    sea = replace(scenario.sea, waves=waves, wind=SteadySeaWind(speed=5.0, direction=0.0))
    with going_on(replace(scenario, sea=sea, booms={"main": boom}), record):
        pause(record)
        for call in orders:
            assert main(call) == 0
    assert len(orders) == len([text for text in said(record) if text.startswith("orders")]) + 1 == 6
    assert_made_again(record)


def test_only_the_user_reaches_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By a socket in a folder of his own or, where its path would be too long, a port of this machine with the card's token."""
    deep = tmp_path / ("a" * 90)
    deep.mkdir()
    for place, kind in ((tmp_path / "user", str), (deep, int)):
        monkeypatch.setenv("XDG_RUNTIME_DIR", str(place))
        record = tmp_path / f"{kind.__name__}.rrd"
        with going_on(tow(duration=0.2), record):
            pause(record)
            card = find_run("tow")
            assert isinstance(card.address, kind)
            folder = runtime_folder()
            assert stat.S_IMODE(folder.stat().st_mode) == 0o700
            assert {stat.S_IMODE(file.stat().st_mode) for file in folder.iterdir()} == {0o600}
            go_on(record)
        assert list(folder.iterdir()) == []
    folder.chmod(0o755)
    with pytest.raises(ScenarioError, match="has the mode 755"):
        order("tow", "tow.speed=1")
    console = Console(file=StringIO(), width=500)
    assert run_scenario(tow(duration=0.04), options=RunOptions(takes_orders=True), console=console) == 0
    assert "no orders can be given while this run goes on" in console.file.getvalue()


def test_card_of_a_killed_run_is_removed(tmp_path: Path) -> None:
    folder = runtime_folder()
    address = folder / "0.socket"
    address.touch()
    card = {"name": "tow", "recording": str(tmp_path / "tow.rrd"), "address": str(address), "token": "t"}
    (folder / "0.json").write_text(json.dumps(card))
    with pytest.raises(ScenarioError, match="no run takes orders now"):
        find_run("tow")
    assert list(folder.iterdir()) == []


def test_an_order_waits_for_its_answer_as_long_as_its_patience(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A run that takes the order and says nothing: the order ends with 1, and says how long it has waited."""
    folder = runtime_folder()
    card = RunCard(name="tow", recording=str(tmp_path / "tow.rrd"), address=str(new_socket_path(folder)), token="t")
    with socket.socket(socket.AF_UNIX) as silent, posted(card, folder):
        silent.bind(str(card.address))
        silent.listen()
        assert main(["order", "tow", "tow.speed=1", "--patience", "0.05"]) == 1
        assert "oilsim: tow has not answered within 0.05 s; it takes the request" in capsys.readouterr().err
        silent.settimeout(5.0)
        with silent.accept()[0] as link:
            assert link.recv(65536).endswith(b"\n")


class Clock:
    """A clock that goes on only while a run rests, and the rests that it was asked for [s]; after `most` of them the run is stopped."""

    def __init__(self) -> None:
        self.now, self.rests, self.most = 100.0, list[float](), 10**6

    def perf_counter(self) -> float:
        return self.now

    def rest(self, seconds: float) -> bool:
        self.now += seconds
        self.rests.append(seconds)
        return len(self.rests) >= self.most


def test_pace_is_never_early_and_what_is_late_does_not_pile_up(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, pace = Clock(), Pace(2.0)
    monkeypatch.setattr("scenarios.running.instructor.time", clock)
    for index in range(1, 11):
        assert pace.keep(index * STEP, clock.rest) == ""
        assert clock.now == pytest.approx(100.0 + (index - 1) * STEP / 2.0)
    pace.wait(5.0)
    clock.rests, clock.most = [], 3
    assert pace.keep(11 * STEP, clock.rest) == ""  # stopped in a wait of 5 s
    assert clock.rests == [GLANCE] * 3
    clock.most = 10**6
    pace.wait(-5.0 - MOST_BEHIND - 0.5)
    assert "cannot keep the pace 2: 1.8 s behind" in pace.keep(12 * STEP, clock.rest)
    figures = pace.figures()
    assert figures["set_back_s"] == pytest.approx(MOST_BEHIND + 0.5 + 3 * GLANCE - 2 * STEP / 2.0)
    assert not figures["kept"]
    clock.rests = []
    assert pace.keep(12 * STEP + 0.4, clock.rest) == ""  # from the clock as set back
    assert sum(clock.rests) == pytest.approx(0.4 / 2.0)


def test_summary_tells_the_lag_behind_the_clock(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with going_on(tow(duration=0.2), tmp_path / "whole.rrd", pace=0.1):
        pass
    found = summary(tmp_path / "whole.rrd")
    assert found["pace"]["pace"] == 0.1
    assert found["pace"]["lag_ms"]["median"] <= found["pace"]["lag_ms"]["p95"] <= found["pace"]["lag_ms"]["max"]
    assert found["wall_s"] > 1.5
    assert main(["run", "two-layer", "--pace", "0"]) == 2
    assert "--pace is 0.0, allowed: above 0" in capsys.readouterr().err


def test_an_order_costs_the_same_after_many(monkeypatch: pytest.MonkeyPatch) -> None:
    """A scenario is changed once by each order, however many came before, and by no step; another plan has none of it."""
    made: list[str] = []
    whole = plans._with_settings
    monkeypatch.setattr(
        plans, "_with_settings", lambda scenario, given: (made.append(*given), whole(scenario, given))[1]
    )
    plan = Plan(scenario=scenario_from(read_toml(TOW)))
    for number in range(30):
        setting = f"tow.speed=0.{number:02d}"
        plan = plan.ordered((setting,), number)
        for _ in range(3):
            assert plan.scenario_after(number + 1).tow.speed == float(f"0.{number:02d}")
        assert made == [setting]
        made.clear()
    assert plan.scenario_at(4).tow.speed == 0.04  # long ago: made again
    other = replace(plan, scenario=replace(plan.scenario, title="another"))
    assert other.scenario_after(30).title == "another"
