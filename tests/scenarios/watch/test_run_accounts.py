"""The accounts of a run advance whether or not anybody watches, and a frame reads the run without changing it."""

from __future__ import annotations

import pytest

from recordings.model.frame import Event, Frame, RunDescription
from scenarios.running.assembly import Assembly, build
from scenarios.running.checkpoints import run_state, run_state_hash
from scenarios.running.summary import SummaryObserver
from scenarios.spec.load import load_scenario

STEPS = 6
# two vessels tow a boom through oil; the liquid's energy and momentum are accounted for
SETTINGS = (
    "fluid.particle_spacing=0.14", "run.communication_step=0.01", f"run.duration={STEPS * 0.01}", "run.threads=1",
    "run.budget=true", "tow.start=0.02",
)  # fmt: skip
WALL_TIME = ("coupling/wall_seconds", "real_time_factor")


class Watcher:
    """Reads everything of every frame."""

    def __init__(self) -> None:
        self.frames: list[Frame] = []

    def initialized(self, run: RunDescription) -> None:
        pass

    def step_completed(self, frame: Frame) -> None:
        frame.read_particles()
        self.frames.append(frame)

    def event(self, event: Event) -> None:
        pass

    def terminated(self, reason: str) -> None:
        pass


def accounts_after_run(watchers: list[Watcher], *, summary: bool = False, frames_asked: int = 0) -> dict[str, object]:
    """Run the exercise; its state hash, scores, totals and ledger at the end. `frames_asked`: frames read after every step."""
    assembly = build(load_scenario("u-sweep", overrides=list(SETTINGS)).scenario)
    simulation = assembly.co_simulation([*watchers, *([SummaryObserver(assembly)] if summary else [])])
    simulation.initialize()
    for _ in range(STEPS):
        simulation.step()
        for _ in range(frames_asked):
            assembly.frame_source(simulation.communication_point)
    totals = assembly.accounts.figures.save_state()
    del totals["stage_seconds"]  # wall time
    totals["budget"] = repr(totals["budget"])
    result = {
        "state": run_state_hash(simulation, assembly),
        "scores": assembly.scoring.summary(),
        "totals": totals,
        "ledger": assembly.ledger.figures,
        "oil": assembly.scoring.ledger.rows,
    }
    simulation.terminate("completed")
    return result


@pytest.fixture(scope="module")
def unwatched() -> dict[str, object]:
    return accounts_after_run([])


def test_an_unwatched_run_keeps_its_accounts(unwatched: dict[str, object]) -> None:
    scores, totals = unwatched["scores"], unwatched["totals"]
    assert isinstance(scores, dict) and isinstance(totals, dict)
    assert scores["main"]["contained_share"] is not None
    assert max(end["peak"] for end in scores["main"]["tow_tension_n"].values()) > 0.0
    assert totals["steps"] == STEPS
    assert totals["budget"] != "None"


@pytest.mark.parametrize("count", [1, 3])
def test_observers_change_nothing(unwatched: dict[str, object], count: int) -> None:
    """Bit for bit: state, scores, sums and ledger."""
    watchers = [Watcher() for _ in range(count)]
    assert accounts_after_run(watchers, summary=count == 3) == unwatched
    assert all(len(watcher.frames) == STEPS + 1 for watcher in watchers)


def test_a_frame_may_be_read_twice_or_never(unwatched: dict[str, object]) -> None:
    assert accounts_after_run([], frames_asked=2) == unwatched


def test_reading_a_frame_again_gives_the_same_frame_and_leaves_the_state() -> None:
    assembly = build(load_scenario("u-sweep", overrides=list(SETTINGS)).scenario)
    simulation = assembly.co_simulation()
    simulation.initialize()
    simulation.step()
    before = run_state_hash(simulation, assembly), repr(run_state(simulation, assembly)["scores"]["booms"])
    first, second = (_scalars(assembly, assembly.frame_source(simulation.communication_point)) for _ in range(2))
    assert first == second
    assert {
        "metrics/oil_contained",
        "metrics/oil/spilled",
        "metrics/ledger/exchange/work",
        "metrics/tow_speed",
    } <= first.keys()
    assert (run_state_hash(simulation, assembly), repr(run_state(simulation, assembly)["scores"]["booms"])) == before
    simulation.terminate("completed")


def _scalars(assembly: Assembly, frame: Frame) -> dict[str, float]:
    """Every figure of a frame, wall times included: they too are of the step, not of the reading."""
    assert set(frame.bodies) == set(assembly.body_names)
    assert any(name.removeprefix("metrics/").startswith(WALL_TIME) for name in frame.scalars)
    return dict(frame.scalars)
