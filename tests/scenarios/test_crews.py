"""Four crews for each exercise at full size and length, and the letters that an expert gives them, written down beforehand with reasons.

The plan is the run that the file orders by itself. A good and a bad crew are sets of choices that they make before the start, and of orders
at their times [s]. The absent crew gives no order, and the exercise begins at rest as on a console; where nobody can order anything
during the run, all is decided before its start, and there is none.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import pytest
from rich.console import Console

from recordings.replay.recording import Replay
from scenarios.controls.order_checks import order_problems
from scenarios.debrief.grade import Grade, exercise_grade, grades_of
from scenarios.running.run import RunOptions, run_scenario
from scenarios.spec.load import library_paths, load_scenario
from scenarios.spec.scenario import rest_settings


class Expected(NamedTuple):
    """The letters that an expert gives to the plan, to a good, to a bad and to an absent crew ("" for none), and why."""

    plan: str
    good: str
    bad: str
    absent: str
    why: str


class Crews(NamedTuple):
    """Settings of a good and of a bad crew, after their times if they are ordered then; what the bad one misses, at which boom; letters."""

    good: tuple[str, ...]
    bad: tuple[str, ...]
    boom: str
    missed: str
    expected: Expected


CREWS = {
    "sweep-200m": Crews(
        good=("tow.speed_kn=0.3",),
        bad=("tow.speed_kn=1.0",),
        boom="main",
        missed="held",
        expected=Expected(
            "BC",
            "A",
            "DE",
            "E",
            "the plan holds all, but at the limit of speed; at 1.0 kn over the ground cubic metres are lost",
        ),
    ),
    "harbour-1km": Crews(
        good=(),
        bad=("vessels.two.engine=stopped", "vessels.three.engine=stopped"),
        boom="middle",
        missed="clean",  # a boom that drifts with the stream meets no oil: it holds none and loses none
        expected=Expected(
            "AB",
            "AB",
            "DE",
            "E",
            "posts that are held keep the boom; the middle length whose two boats stop drifts in with the oil",
        ),
    ),
    "j-sweep-skimmer": Crews(
        good=("155 tow.speed_kn=0.05",),  # it waits for the brush
        bad=("40 tow.speed_kn=0.7",),  # it hurries
        boom="main",
        missed="speed",
        expected=Expected("AB", "A", "DE", "E", "slow enough by itself; who hurries loses two fifths"),
    ),
    "v-sweep": Crews(
        good=(),
        bad=("40 tow.speed_kn=0.7",),  # it hurries
        boom="main",
        missed="speed",
        expected=Expected(
            "AB", "AB", "D", "E", "slow enough by itself; at 0.7 kn over the ground the apex leaks all the time"
        ),
    ),
    "open-apex-follow": Crews(
        good=(),
        bad=(  # the sweep strays from behind the opening
            "10 vessels.follower.legs=[{speed_kn=0.2, heading_deg=25.0}]",
            "10 vessels.outrigger.legs=[{speed_kn=0.2, heading_deg=25.0}]",
        ),
        boom="pocket",
        missed="fed",
        expected=Expected("AB", "AB", "DE", "E", "the sweep follows by itself; astray it meets nothing"),
    ),
    "fast-sweep": Crews(
        good=(),
        bad=("tow.speed_kn=3.0",),
        boom="main",
        missed="held",
        expected=Expected("AB", "AB", "D", "E", "1.5 kn are what the system is made for; at 3 kn it loses most"),
    ),
    "deploy-from-reel": Crews(
        good=("12 booms.main.reel.paid_out=58.0",),
        bad=("12 booms.main.reel.paid_out=30.0",),
        boom="main",
        missed="deployed",
        expected=Expected("E", "A", "E", "E", "a reel that nobody lets out, or only half, brings no boom to its berth"),
    ),
    "launch-from-slip": Crews(
        good=("12 ties.brake.hauled=-54.0",),
        bad=("12 ties.brake.hauled=-20.0",),
        boom="main",
        missed="deployed",
        expected=Expected("E", "AB", "E", "E", "as with the reel; a brake line that hangs slack gives one jerk"),
    ),
    "shore-seal": Crews(
        good=(),
        bad=("booms.main.boom=cfr-rivers",),
        boom="main",
        missed="clean",
        expected=Expected("A", "A", "DE", "", "the right boom is all; the wrong one leans over on the ground"),
    ),
    "anchored-containment": Crews(
        good=(),
        bad=(
            "moorings.south.anchor=[20.0, -23.2]",  # 14 m of line without chain, in 10 m of water
            "moorings.south.parts=[{material='polyester', length=14.3, diameter=0.024}]",
            "skimmers.weir.running=false",
        ),
        boom="main",
        missed="anchors",
        expected=Expected(
            "AB",
            "AB",
            "CD",
            "E",
            "two anchors at each end hold; a leg of 14 m in 10 m of water drags, and nothing is recovered",
        ),
    ),
    "inlet-exclusion": Crews(
        good=(),
        bad=(
            "booms.main.ends=[[-30.0, 0.0], [2.0, 0.0]]",
            "booms.main.length=44.8",
        ),  # it ends in the middle of the inlet
        boom="main",
        missed="clean",
        expected=Expected(
            "AB", "AB", "D", "E", "the marsh stays clean; who ends the boom in the middle of the inlet protects nothing"
        ),
    ),
    "river-diversion-cascade": Crews(
        good=(),
        bad=("booms.upper.ends=[[60.0, 13.0], [36.0, -18.4]]",),
        boom="upper",
        missed="speed",
        expected=Expected("B", "B", "DE", "", "three quarters reach the bank; across the stream the boom meets 1.2 kn"),
    ),
    "deploy-and-connect": Crews(
        good=("215 ties.connect.made_fast=true",),
        bad=("40 vessels.boat.engine=stopped",),  # it rests
        boom="main",
        missed="connected",
        expected=Expected("D", "A", "DE", "E", "a berth reached and not connected is a gate"),
    ),
}


def choices_and_orders(settings: tuple[str, ...]) -> tuple[list[str], list[tuple[float, list[str]]]]:
    """Return what a crew chooses before the start, and its orders by their times [s]."""
    timed = [one.partition(" ") for one in settings if one[0].isdigit()]
    return [one for one in settings if not one[0].isdigit()], [(float(at), [order]) for at, _, order in timed]


def graded(name: str, settings: tuple[str, ...], folder: Path) -> dict[str, Grade]:
    """Run an exercise with a crew's settings, and grade its booms as the debrief does."""
    choices, orders = choices_and_orders(settings)
    scenario = load_scenario(name, overrides=["recording.checkpoint_interval=0", *choices]).scenario
    record = folder / "run.rrd"
    options = RunOptions(record=record, overwrite=True)  # each crew in the place of the one before
    assert run_scenario(scenario, orders=orders, options=options, console=Console(quiet=True)) == 0
    return grades_of(Replay(record))


def assert_letter(grades: dict[str, Grade], allowed: str, why: str) -> None:
    """Check the letter of the exercise; what was measured is told."""
    found = exercise_grade(grades)
    assert found is not None
    told = [
        (boom, one.letter, one.capped_by, [(f.criterion.key, f.value, f.verdict) for f in one.findings])
        for boom, one in grades.items()
    ]
    assert found[1].letter in allowed, (why, told)


@pytest.mark.slow
@pytest.mark.timeout(3000)
@pytest.mark.parametrize("crew", ["plan", "good", "bad", "absent"])
@pytest.mark.parametrize("name", sorted(CREWS))
def test_each_crew_gets_the_letter_that_an_expert_gives(name: str, crew: str, tmp_path: Path) -> None:
    crews = CREWS[name]
    at_rest = rest_settings(load_scenario(name).scenario)
    assert bool(at_rest) == bool(crews.expected.absent)
    if crew == "absent" and not at_rest:
        pytest.skip("nobody can order anything during the run")
    if crew == "good" and not crews.good:
        assert crews.expected.good == crews.expected.plan
        pytest.skip("the plan is what a good crew does")
    settings = {"plan": (), "good": crews.good, "bad": crews.bad, "absent": at_rest}[crew]
    grades = graded(name, settings, tmp_path)
    assert_letter(grades, getattr(crews.expected, crew), crews.expected.why)
    if crew == "bad":
        verdicts = {finding.criterion.key: finding.verdict for finding in grades[crews.boom].findings}
        assert verdicts[crews.missed] == "missed", verdicts


@pytest.mark.parametrize("name", sorted(CREWS))
def test_every_crew_and_level_is_a_sound_exercise(name: str) -> None:
    at_rest = rest_settings(load_scenario(name).scenario)
    for settings in (CREWS[name].good, CREWS[name].bad, at_rest, ("level=easy",), ("level=hard",)):
        choices, orders = choices_and_orders(settings)
        scenario = load_scenario(name, overrides=choices).scenario
        for _, order in orders:
            assert not order_problems(order, scenario.parts)
        assert scenario.exercise is not None
        assert scenario.exercise.brief.strip() and scenario.exercise.notes.strip()
        assert all(criterion.why for criterion in scenario.criteria.values() if criterion.weight != 0.0)


def test_every_exercise_has_goal_brief_and_notes() -> None:
    exercises = [load_scenario(name).scenario.exercise for name in library_paths()]
    found = [one for one in exercises if one is not None]
    assert len(found) >= 13
    assert all(one.goal.strip() and one.brief.strip() and one.notes.strip() for one in found)
