"""Runs that go on from a checkpoint are, to the last bit, the runs that never stopped; and what is refused."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path

import pytest
from rich.console import Console

from recordings.files.checkpoint import CheckpointError
from recordings.replay.moments import recorded_steps
from recordings.replay.recording import Replay
from scenarios.cli import main
from scenarios.running import checkpoints
from scenarios.running.checkpoints import find_restart
from scenarios.running.plan import Action, Plan, plan_from
from scenarios.running.run import RunOptions, resume, run_scenario
from scenarios.running.verify import verify
from scenarios.schema.parsing.structuring import as_data
from scenarios.spec.load import load_scenario, scenario_from
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import ScenarioError
from tests.scenarios.kills import started_run

STEP = 0.02
CALM = ("two-layer", "fluid.particle_spacing=0.1", f"run.communication_step={STEP}")
# two vessels tow a boom of jointed segments through oil, waves and a current, under a gusty wind
STORM = (
    "u-sweep",
    "fluid.particle_spacing=0.14",
    f"run.communication_step={STEP}",
    "fluid.maximum_time_step=0.02",
    "tow.start=0.05",
    "sea.wind.speed=8.0",
    "sea.wind.gust_intensity=0.4",
    "sea.waves.height=0.05",
    "sea.waves.period=1.3",
    "tank.zones.maker.lower=[0.0, 0.0, 0.0]",
    "tank.zones.maker.upper=[1.0, 5.0, 1.1]",
)
# boxes that lie on each other on the floor, and one that leans against them: contacts are what a rigid engine remembers
PILE = ("floating-box", "fluid.particle_spacing=0.15", f"run.communication_step={STEP}")


def scenario_of(settings: tuple[str, ...], *more: str, steps: int, interval: int) -> Scenario:
    """A shipped scenario with settings, some steps long, with a checkpoint after every so many."""
    name, *overrides = settings
    terms = [f"run.duration={steps * STEP}", f"recording.checkpoint_interval={interval * STEP}", "run.threads=1"]
    scenario = load_scenario(name, overrides=[*overrides, *terms, *more]).scenario
    return scenario if settings is not PILE else _with_pile(scenario)


def _with_pile(scenario: Scenario) -> Scenario:
    data = as_data(scenario)
    box = {"shape": "box", "size": [0.3, 0.3, 0.2], "density": 2500.0}
    places = {"under": [0.4, 0.4, 0.1], "over": [0.45, 0.4, 0.301], "leaning": [0.68, 0.45, 0.2]}
    data["bodies"] = {name: box | {"position": place} for name, place in places.items()}
    data["bodies"]["leaning"]["rotation"] = [0.0, -0.7, 0.0]
    data["probes"] = {}
    return scenario_from(data)


def run(scenario: Scenario, folder: Path) -> dict:
    """Run it whole into ``folder/whole.rrd``; its summary."""
    folder.mkdir(exist_ok=True)
    options = RunOptions(record=folder / "whole.rrd", summary=folder / "whole.json")
    assert run_scenario(scenario, options=options) == 0
    return json.loads((folder / "whole.json").read_text())


def go_on(folder: Path, *, at: float | None = None, settings: tuple[str, ...] = ()) -> dict:
    """Go on with ``folder/whole.rrd`` into ``folder/second.rrd``; its summary."""
    restart = find_restart(folder / "whole.rrd", at).with_settings(settings, at)
    options = RunOptions(record=folder / "second.rrd", summary=folder / "second.json")
    assert resume(restart, options=options) == 0
    return json.loads((folder / "second.json").read_text())


@pytest.mark.parametrize(
    ("settings", "steps", "at"),
    [
        ((*CALM, "run.budget=true"), 40, 17),
        pytest.param(STORM, 12, 5, marks=pytest.mark.slow),
        pytest.param(PILE, 40, 25, marks=pytest.mark.slow),
    ],
)
def test_resumed_run_ends_in_the_same_state(settings: tuple[str, ...], steps: int, at: int, tmp_path: Path) -> None:
    """A second program goes on from the middle: equal state hash, equal scores, and the frames that were to come."""
    whole = run(scenario_of(settings, steps=steps, interval=at), tmp_path)
    checkpoint = tmp_path / "whole.checkpoints" / f"step-{at:09d}.npz"
    files = ["--record", str(tmp_path / "second.rrd"), "--summary", str(tmp_path / "second.json")]
    command = [sys.executable, "-m", "scenarios.cli", "run", "--resume", str(checkpoint), *files]
    subprocess.run(command, check=True, stderr=subprocess.DEVNULL)
    second = json.loads((tmp_path / "second.json").read_text())
    for key in (
        "state_hash",
        "scores",
        "oil_m3",
        "particles",
        "left_the_tank",
        "steps",
        "probes",
        "iterations",
        "budget",
    ):
        assert second.get(key) == whole.get(key), key
    _assert_same_frames(Replay(tmp_path / "whole.rrd"), Replay(tmp_path / "second.rrd"), after=at)


def _assert_same_frames(whole: Replay, second: Replay, after: int) -> None:
    for phase in whole.run.phases:
        expected = [
            (index, frame.position.tobytes()) for index, _, frame in whole.phase_frames(phase.name) if index > after
        ]
        found = [(index, frame.position.tobytes()) for index, _, frame in second.phase_frames(phase.name)]
        assert found[0][0] == recorded_steps(second)[0][0]  # its own first frame is whole, whatever is thinned
        assert [frame for frame in found if frame[0] in dict(expected)] == expected
        assert expected and len(found) <= len(expected) + 1
    for name, body in whole.bodies.items():
        late = body.index > after
        assert second.bodies[name].pose.tobytes() == body.pose[late].tobytes()
        assert second.bodies[name].wrench.tobytes() == body.wrench[late].tobytes()


def test_checkpoints_do_not_change_the_run(tmp_path: Path) -> None:
    often, never = (scenario_of(PILE, steps=12, interval=interval) for interval in (3, 0))
    assert run(often, tmp_path / "often")["state_hash"] == run(never, tmp_path / "never")["state_hash"]
    assert len(list((tmp_path / "often" / "whole.checkpoints").iterdir())) == 5
    assert [file.name for file in (tmp_path / "never" / "whole.checkpoints").iterdir()] == ["step-000000012.npz"]


def test_too_many_checkpoints_are_thinned_out_and_every_time_can_still_be_gone_back_to(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """13 would be written in 12 steps: over 4, every second one goes, twice; what is asked for stays, as at the end."""
    monkeypatch.setattr(checkpoints, "KEPT", 4)
    scenario = scenario_of(CALM, steps=12, interval=1)
    whole = run(scenario, tmp_path)
    kept = [int(file.stem.removeprefix("step-")) for file in sorted((tmp_path / "whole.checkpoints").iterdir())]
    assert kept == [0, 4, 8, 12]
    told = [event["text"] for event in whole["events"] if "checkpoints" in event["text"]]
    assert told == [
        "more than 4 checkpoints: from now on the first and one every 0.04 s are kept",
        "more than 4 checkpoints: from now on the first and one every 0.08 s are kept",
    ]
    assert go_on(tmp_path, at=3 * STEP)["state_hash"] == whole["state_hash"]
    assert find_restart(tmp_path / "whole.rrd", 3 * STEP).index == 0


@pytest.mark.slow
def test_orders_on_the_way_are_the_same_whether_given_before_or_after_a_restart(tmp_path: Path) -> None:
    """An instructor goes back to step 7 and tows faster into a turned current: as if it had been planned so.

    The checkpoint is that of step 5, so that two steps are run again before the orders are given; and a third run goes on
    from a checkpoint of the second one, whose orders are history by then.
    """
    orders = ("tow.speed_kn=1.5", "tow.heading_deg=20", "sea.current.direction_deg=150", "sea.wind.speed=3")
    scenario = scenario_of(STORM, steps=12, interval=5)
    whole = run(scenario, tmp_path)
    branch = go_on(tmp_path, at=7 * STEP - 1e-3, settings=orders)
    assert branch["state_hash"] != whole["state_hash"]
    events = [event["text"] for event in branch["events"] if event["source"] == "instructor"]
    assert events == [f"orders {' '.join(orders)}"]
    plan = plan_from(json.loads(str(Replay(tmp_path / "second.rrd").run.properties["plan"])))
    assert plan == Plan(scenario=scenario).changed(orders, 7)
    third = find_restart(tmp_path / "second.rrd", 10 * STEP)
    assert third.index == 10
    summary = tmp_path / "third.json"
    assert resume(third, options=RunOptions(summary=summary)) == 0
    assert json.loads(summary.read_text())["state_hash"] == branch["state_hash"]
    verdict = verify(tmp_path / "second.rrd", console=Console(quiet=True))
    assert (verdict.equal_frames, verdict.difference, verdict.versions) == (4, "", "")  # of steps 7, 9, 10, 12


def test_a_run_that_goes_on_still_tells_its_scenario_and_all_that_was_changed(tmp_path: Path) -> None:
    """Once by overrides at its beginning, once by a term and an order; and once more, from the second run, by another order."""
    first, second, third = (str(tmp_path / f"{name}.rrd") for name in ("first", "second", "third"))
    summary = tmp_path / "third.json"
    begun = ["fluid.particle_spacing=0.1", "sea.wind.speed=2.0", "run.duration=0.04", "run.threads=1"]
    assert main(["run", "two-layer", *(part for text in begun for part in ("--set", text)), "--record", first]) == 0
    order, other = "sea.wind.speed=5", "sea.wind.speed=7"
    assert main(["run", "--resume", first, "--set", order, "--until", "0.08", "--record", second]) == 0
    more = ["--set", other, "--until", "0.12", "--record", third, "--summary", str(summary)]
    assert main(["run", "--resume", second, *more]) == 0
    changes = [*begun[:2], "run.threads=1", "run.duration=0.12", order, other]
    assert json.loads(summary.read_text())["overrides"] == changes
    told = Replay(Path(third)).run
    assert told.properties["overrides"] == " ".join(changes)
    assert told.text == load_scenario("two-layer").text


@pytest.mark.slow
def test_what_holds_from_the_beginning_is_told_there(tmp_path: Path) -> None:
    """The vessels' first orders hold from the first frame on, and those of 0.04 s from then: none is told a step late."""
    scenario = scenario_of(STORM, "tow.start=0.04", steps=4, interval=1)
    run(scenario, tmp_path)
    told = [(event.time, event.text) for event in Replay(tmp_path / "whole.rrd").events if event.source == "orders"]
    assert [time for time, _ in told] == [0.0, 0.04]
    assert told[0][1].endswith("hold your places")
    begun_again = resume(find_restart(tmp_path / "whole.rrd", 0.0), options=RunOptions(record=tmp_path / "second.rrd"))
    assert begun_again == 0
    again = [(event.time, event.text) for event in Replay(tmp_path / "second.rrd").events if event.source == "orders"]
    assert again == told[1:]


@pytest.mark.slow
def test_a_pipe_is_shut_and_opened_by_order(tmp_path: Path) -> None:
    """Shut at step 4 of 12: the oil is what it was then. Opened again at step 8, at twice the speed: it grows twice as fast."""
    pouring = ("rock-coating", "fluid.particle_spacing=0.03", f"run.communication_step={STEP}", "emitters.pipe.speed=3")
    run(scenario_of(pouring, "recording.frame_rate=50", steps=12, interval=4), tmp_path)
    go_on(tmp_path, at=4 * STEP, settings=("emitters.pipe.speed=0",))
    shut = _oil_counts(tmp_path / "second.rrd")
    assert shut == [shut[0]] * 8
    restart = find_restart(tmp_path / "second.rrd", 8 * STEP).with_settings(("emitters.pipe.speed=6",), 8 * STEP)
    assert resume(restart, options=RunOptions(record=tmp_path / "third.rrd")) == 0
    open_again, whole = _oil_counts(tmp_path / "third.rrd"), _oil_counts(tmp_path / "whole.rrd")
    layer = min(later - earlier for earlier, later in pairwise(whole) if later > earlier)
    assert open_again[-1] - shut[0] == pytest.approx(2 * (whole[12] - whole[8]), abs=2 * layer)
    assert verify(tmp_path / "third.rrd", console=Console(quiet=True)).difference == ""


def _oil_counts(recording: Path) -> list[float]:
    return Replay(recording).phase_times("oil").value.tolist()


def test_terms_may_change_and_the_rest_is_refused_by_name(tmp_path: Path) -> None:
    run(scenario_of(CALM, steps=6, interval=3), tmp_path)
    restart = find_restart(tmp_path / "whole.rrd")
    longer = restart.with_settings(("run.duration=0.2", "run.threads=2"), None)
    assert (longer.plan.scenario.run.duration, longer.plan.actions) == (0.2, ())
    with pytest.raises(ScenarioError) as caught:
        restart.with_settings(
            (
                "fluid.particle_spacing=0.2",
                "tow.speed=1",
                "phases.oil.adhesion=1",
                "run.budget=true",  # of half a run, told as if of all
            ),
            None,
        )
    assert [problem.path for problem in caught.value.problems] == [
        "--set fluid.particle_spacing", "--set tow.speed", "--set phases.oil.adhesion", "--set run.budget",
    ]  # fmt: skip
    assert "cannot be changed during a run, allowed: tow.speed" in str(caught.value)
    assert "changes tow, but the run was started without it" in str(caught.value)


def test_of_two_orders_of_one_key_the_last_rules_and_one_that_changes_nothing_is_an_order_too(tmp_path: Path) -> None:
    """The wind blows at 8 m/s from the start; what is ordered is told, and never taken for what the run was begun with."""
    scenario = scenario_of(STORM, steps=4, interval=0)
    plan = Plan(scenario=scenario)
    for settings, told in (
        (("sea.wind.speed=3", "sea.wind.speed=8"), ("sea.wind.speed=8",)),
        (("sea.wind.speed_kn=20", "sea.wind.speed=8"), ("sea.wind.speed=8",)),
        (("sea.wind.speed=8",), ("sea.wind.speed=8",)),
        (("vessels.port.legs=[]",), ("vessels.port.legs=[]",)),
    ):
        changed = plan.changed(settings, 2)
        assert (changed.scenario, changed.actions) == (scenario, (Action(index=2, settings=told),))
        assert changed.scenario_at(2).sea == scenario.sea
    gale = plan.changed(("sea.wind.speed=12",), 1).changed(("sea.wind.speed=12",), 2)
    assert gale.scenario == scenario  # as it began, whatever was ordered since
    with pytest.raises(ScenarioError, match="cannot be changed during a run"):
        plan.changed(("fluid.particle_spacing=0.14",), 2)


def test_a_run_goes_on_before_its_end_only(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Orders at its end or later would never be given, and a shorter run is over already."""
    run(scenario_of(CALM, "sea.wind.speed=2.0", steps=6, interval=3), tmp_path)
    recording, order = (
        ["run", "--resume", str(tmp_path / "whole.rrd"), "--no-record"],
        ["--set", "sea.wind.speed=9"],
    )
    for arguments, told in (
        (["--at", "0.12", *order], "--at is 0.12 s, allowed: before the run's end, 0.12 s"),
        (["--at", "50", *order], "--at is 50 s, allowed: before the run's end, 0.12 s"),
        (["--at", "0.08", "--until", "0.04"], "--at is 0.08 s, allowed: before the run's end, 0.04 s"),
        ([*order], "run.duration is 0.12 s, but the run continues from 0.12 s; allowed: a later end, set with --until"),
        (["--until", "0.06"], "run.duration is 0.06 s, but the run continues from 0.12 s; allowed: a later end"),
    ):
        assert main([*recording, *arguments]) == 2
        assert told in capsys.readouterr().err
    assert main([*recording, "--at", "0.1", "--until", "0.12", *order]) == 0
    assert "orders sea.wind.speed=9" in capsys.readouterr().err


def test_what_cannot_be_gone_on_with_is_one_clear_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scenario = scenario_of(CALM, steps=6, interval=3)
    run(scenario, tmp_path)
    recording = tmp_path / "whole.rrd"
    other = Plan(scenario=scenario_of(CALM, "fluid.particle_spacing=0.11", steps=6, interval=3)).fingerprint(0)
    with pytest.raises(CheckpointError, match="belongs to another scenario"):
        find_restart(recording, None, other)
    assert find_restart(recording, None, Plan(scenario=scenario).fingerprint(0)).index == 6
    with pytest.raises(CheckpointError, match=r"allowed: --at 0.06 or later"):
        find_restart(tmp_path / "whole.checkpoints" / "step-000000003.npz", 0.02)
    (tmp_path / "whole.checkpoints" / "step-foo.npz").touch()  # somebody else's
    assert find_restart(recording).index == 6
    with pytest.raises(CheckpointError, match=r"nothing.rrd: does not exist"):
        find_restart(tmp_path / "nothing.rrd")
    for arguments in (["--resume", str(recording), "--record", str(recording)], ["--at", "1"], []):
        assert main(["run", *arguments]) == 2
        assert "allowed" in capsys.readouterr().err


def test_signal_writes_a_checkpoint_and_a_stop_leaves_one(tmp_path: Path) -> None:
    """SIGUSR1: one at the next communication point, and the run goes on. SIGTERM: one at its end, from which it goes on."""
    record = tmp_path / "run.rrd"
    settings = ["--set", "fluid.particle_spacing=0.1", "--set", "recording.checkpoint_interval=0"]
    terms = ["--until", "1000", "--threads", "1", "--record", str(record)]
    process = started_run(tmp_path / "clock", "still-column", *settings, *terms)
    assert process.stderr is not None
    process.send_signal(signal.SIGUSR1)
    while "info: checkpoint" not in (line := process.stderr.readline()):
        assert line, "the run ended before it wrote a checkpoint"
    steps = (tmp_path / "clock").read_text().count("\n")
    while (tmp_path / "clock").read_text().count("\n") < steps + 3:  # it goes on
        time.sleep(0.005)
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=60)
    assert process.returncode == 143
    files = sorted((tmp_path / "run.checkpoints").iterdir())
    assert len(files) == 2
    assert find_restart(record).source == files[-1]
    said = [event.text for event in Replay(record).events]
    assert said == [f"checkpoint written: {file}" for file in files]


def test_branches_are_compared_in_a_table_and_in_one_recording(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A run is made longer from its end, under another wind; both are told apart, and what was ordered is said."""
    windy = ("sea.wind.speed=2.0", "probes.level.kind='wave-gauge'", "probes.level.point=[0.5, 0.5]")
    run(scenario_of(CALM, *windy, steps=6, interval=0), tmp_path)
    go_on(tmp_path, settings=("run.duration=0.2", "sea.wind.speed=9"))
    first, second, both = (str(tmp_path / f"{name}.rrd") for name in ("whole", "second", "both"))
    assert main(["compare", first, second, "--to", both]) == 0  # the second with the piece that it goes on from
    said = capsys.readouterr().out
    assert "from 0 s to 0.1 s, the time that both runs cover" in said
    assert "level at the end" in said
    assert "orders sea.wind.speed=9" in said
    assert Path(both).is_file()
