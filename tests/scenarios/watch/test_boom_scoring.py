"""A boom's scoring ends where the boom leaves the simulated sea, and goes on where the sea repeats; what is told of it, and how often.

And what its signals read.
"""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

from booms.containment import PRACTICE_SPEED
from scenarios.bench.scenario_run import ScenarioRun
from scenarios.controls.signals import signals_of
from scenarios.running.assembly import Assembly, build
from scenarios.running.run_loop import Injects
from scenarios.spec.load import scenario_from
from scenarios.watch.boom_score import RESTED, BoomScore, Oil
from tests.scenarios.test_boom_losses import pool

STEP = 0.04
RUNAWAY: dict[str, Any] = {
    "name": "runaway",
    "run": {"duration": 2.0, "communication_step": STEP},
    "fluid": {"particle_spacing": 0.1, "maximum_time_step": 0.04},
    "phases": {"sea": {"density": 1025.0, "dynamic_viscosity": 0.0}, "oil": {"oil": "brent"}},
    "tank": {"lower": [0.0, 0.0, 0.0], "upper": [3.0, 2.0, 1.2], "open": ["+z"], "periodic": ["x", "y"]},
    "fill": {
        "sea": {"shape": "slab", "phase": "sea", "bottom": 0.0, "top": 0.6},
        "oil": {"shape": "block", "phase": "oil", "lower": [0.6, 0.9, 0.6], "upper": [0.8, 1.1, 0.7]},
    },
    "vessels": {
        name: {
            "length": 0.6, "beam": 0.3, "draft": 0.1, "depth": 0.25, "position": [2.75, y], "bollard_pull": 200.0,
            "yaw_moment": 30.0, "side_thrust": 60.0, "acceleration": 4.0,
        }
        for name, y in (("port", 1.6), ("starboard", 0.4))
    },
    "booms": {
        "main": {
            "ends": ["port", "starboard"], "length": 1.8, "segments": 6, "skirt_depth": 0.2, "freeboard": 0.1,
            "buoyancy_to_weight": 6.0, "tow_line": 0.2,
        }
    },
    "tow": {"speed": 1.0, "heading": 0.0},
}  # fmt: skip


def sailed(tank: dict[str, Any], steps: int) -> tuple[Assembly, list[str]]:
    with ScenarioRun(scenario_from(RUNAWAY | {"tank": RUNAWAY["tank"] | tank})) as run:
        run.run(steps * STEP)
    return run.assembly, [event.text for event in run.history.events]


def test_the_scoring_ends_at_an_open_side_and_the_oil_goes_on() -> None:
    assembly, told = sailed({"periodic": ["y"], "open": ["+z", "+x"]}, 25)
    assert [text for text in told if "its scoring ends here" in text] == [
        "has left the simulated sea through its open side +x: its scoring ends here"
    ]
    score = assembly.scoring.booms[0]
    assert score.values and score.series() == {}
    saved = score.save_state()
    assert saved["ended"] and saved["time"] < 0.9
    assert assembly.particle_counts()["oil"] > 0


def test_a_boom_sails_on_where_the_sea_repeats() -> None:
    assembly, told = sailed({}, 25)
    assert [text for text in told if text.startswith("sails past side +x of the sea, which repeats every 3 m")]
    score = assembly.scoring.booms[0]
    assert score.save_state()["time"] == pytest.approx(1.0)
    assert score.series()


def test_oil_in_a_boom_that_lies_across_a_periodic_side_is_inside() -> None:
    """The vessels are 0.45 m past side -x and the boom reaches back across it; the oil in it lies before side +x."""
    data = copy.deepcopy(RUNAWAY)
    for vessel in data["vessels"].values():
        vessel["position"][0] = 0.45
    data["fill"]["oil"] |= {"lower": [2.6, 0.8, 0.6], "upper": [2.8, 1.2, 0.7]}
    data["tow"]["speed"] = 0.2
    with ScenarioRun(scenario_from(data)) as run:
        run.run(5 * STEP)
    oil = run.assembly.scoring.booms[0].oil
    assert oil.inside == oil.contained == pytest.approx(8 * 0.1**3)
    assert oil.all_lost == oil.outside == 0.0


class Watched:
    """The score of a boom that stands still, to which oil and current are given by hand; its skirt is two particles deep."""

    def __init__(self, **tables: Any) -> None:
        self.scenario = scenario_from(pool() | tables)
        self.assembly = build(self.scenario)
        self.score: BoomScore = self.assembly.scoring.booms[0]
        self.told: list[tuple[float, str]] = []
        self.clock = 0.0  # [s] of `flow`

    def at(self, time: float, oil: list[list[float]], speed: float = 0.3) -> None:
        """Go on to `time` [s] with oil at these places [m], in a current of `speed` [m/s]."""
        assert self.assembly.world is not None
        particles = Oil(np.array(oil).reshape(-1, 3), np.arange(len(oil), dtype=np.uint32))
        self.score.advance(time, self.assembly.world, particles, 0.6, np.array([-speed, 0.0, 0.0]))
        self.told += [(round(time, 6), notice.text) for notice in self.score.take_notices()]

    def times(self, text: str) -> list[float]:
        """Return the times [s] at which this was told."""
        return [time for time, told in self.told if text in told]


HELD, UNDER = [1.5, 1.0, 0.5], [0.3, 1.0, 0.3]


def test_a_first_resolved_loss_is_told_at_once_and_counted_until_it_comes_back() -> None:
    watched = Watched()
    watched.at(0.0, [HELD, HELD])
    watched.at(0.04, [UNDER, HELD])
    assert watched.times("(resolved)") == [0.04]
    assert watched.score.oil.all_lost == pytest.approx(0.1**3)
    watched.at(0.08, [HELD, HELD])
    assert (watched.score.oil.all_lost, watched.score.oil.recontained) == (0.0, pytest.approx(0.1**3))


WINDOW = 0.22 / PRACTICE_SPEED  # [s] in which water at that speed passes the skirt
TOO_FAST = "at more than 0.7 kn"


def flow(account: Watched, *stretches: tuple[float, float]) -> None:
    """Let water run against the boom for stretches of a time [s] at a share of the limit [-]."""
    for duration, share in stretches:
        for _ in range(round(duration / 0.02)):
            account.at(account.clock, [], share * PRACTICE_SPEED)
            account.clock += 0.02


def test_water_that_runs_too_fast_is_told_again_after_a_rest() -> None:
    """A short rest does not repeat it, and another account goes on the same way."""
    watched, other = Watched(), Watched()
    flow(watched, *[(6.0 * WINDOW, 1.2), (2.0 * WINDOW, 0.5)] * 3)
    assert len(watched.times(TOO_FAST)) == 1
    other.score.restore_state(watched.score.save_state())
    other.clock = watched.clock
    for account in (watched, other):
        flow(account, (RESTED, 0.5), (6.0 * WINDOW, 1.2))
    assert len(watched.times(TOO_FAST)) == 2
    assert other.times(TOO_FAST) == watched.times(TOO_FAST)[1:]


def test_swings_are_not_told_and_a_tow_that_stays_too_fast_is_told_once() -> None:
    """As at the start of u-sweep: swings above the limit, then, without a rest, a tow that stays above it but for short swings."""
    watched, other = Watched(), Watched()
    flow(watched, *[(2.0 * WINDOW, 1.2), (2.0 * WINDOW, 0.8)] * 2, (2.0 * WINDOW, 1.2))
    assert watched.times(TOO_FAST) == []
    other.score.restore_state(watched.score.save_state())
    other.clock = watched.clock
    for account in (watched, other):
        flow(account, (6.0 * WINDOW, 1.2), *[(2.0 * WINDOW, 0.8), (6.0 * WINDOW, 1.2)] * 2)
        assert len(account.times(TOO_FAST)) == 1
    assert other.times(TOO_FAST) == watched.times(TOO_FAST)


FREE, ROUND = [3.0, 1.0, 0.5], [3.2, 1.0, 0.3]  # m: ahead of the boom, and there from behind it, past the sea's side


def told_by_hand() -> tuple[dict[int, dict[str, float]], dict[int, set[str]]]:
    """Let a stream take 9 of 36 particles, at two speeds, of which 3 come back; its signals and the injects due at every second.

    One is lost as the speed rises from 0.2 to 0.34 m/s, 8 as it rises from 0.4 to 0.6 m/s; 2 are re-contained, one comes round the sea, 3
    leave it from before the boom.
    """
    leaks = {"orders": ["booms.a.parted=[2]"]}
    injects = {
        name: leaks | {"when": {"signal": "booms.a.first_loss_speed", "above": above}}
        for name, above in (("leaks", 0.3), ("never", 0.35))
    }
    watched = Watched(tank=pool()["tank"] | {"open": ["+z"], "periodic": ["x", "y"]}, injects=injects)
    scenario, parts = watched.scenario, watched.assembly.parts
    asked, signals, due = Injects(scenario, parts), {}, {}
    oil = [FREE] * 4 + [HELD] * 36
    for second in range(15):
        if second == 2:
            oil[4] = UNDER
        elif second == 9:
            oil[5:13] = [UNDER] * 8
        elif second == 13:
            oil[5:8] = [HELD, HELD, ROUND]
        elif second == 14:
            oil[7:] = [HELD, *oil[8:-3]]
        watched.at(second, oil, 0.2 if second < 2 else 0.34 if second == 2 else 0.4 if second < 9 else 0.6)
        point = round(second / scenario.run.communication_step)
        asked.look(point)
        due[second] = set(asked.due(scenario, point))
        signals[second] = {
            name: one.read(parts) for name, one in signals_of(scenario.parts).items() if not one.is_input
        }
    return signals, due


def test_the_signals_of_a_boom_read_its_losses_and_their_speeds() -> None:
    """Each a number of its own, in m3, m/s and shares of what the boom has met."""
    signals, due = told_by_hand()
    one = 0.1**3
    last = {name.removeprefix("booms.a."): value for name, value in signals[14].items()}
    for name, count in {
        "lost": 6, "passed": 7, "recontained": 2, "afloat": 4, "contained": 36 - 6 - 3, "met": 36, "inside": 36 - 6 - 3,
        "outside": 4 + 6, "lost.drainage": 1, "lost.entrainment": 5, "lost.around_ends": 0,
    }.items():  # fmt: skip
        assert last[f"oil_{name}"] == pytest.approx(count * one), name
    assert last["oil_contained_share"] == pytest.approx(1.0 - 6 / 36)
    assert last["first_loss_speed"] == pytest.approx(0.34)
    assert last["gross_loss_speed"] == pytest.approx((1 * 0.27 + 8 * 0.5) / 9)
    known = {
        name: [second for second in signals if signals[second][f"booms.a.{name}_loss_speed"]]
        for name in ("first", "gross")
    }
    assert known == {"first": list(range(7, 15)), "gross": list(range(12, 15))}  # after 5 s, and after 12 s
    assert due == {second: {"leaks"} if second >= 7 else set() for second in signals}
