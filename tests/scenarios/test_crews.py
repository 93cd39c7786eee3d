"""A good and a bad crew for each exercise at full size: the good one passes, the bad one fails for the reason that the exercise teaches.

A crew is a set of orders: injects, given at their times, and choices that it makes before the start.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import pytest
from rich.console import Console

from recordings.replay.recording import Replay
from scenarios.debrief.boom_history import boom_histories
from scenarios.debrief.grade import Grade, grade
from scenarios.running.run import RunOptions, run_scenario
from scenarios.spec.load import library_paths, load_scenario

PASSED = ("A", "B")


class Crews(NamedTuple):
    """Settings of a good and of a bad crew, the boom that is graded, and the criterion that the bad crew misses."""

    good: tuple[str, ...]
    bad: tuple[str, ...]
    boom: str
    missed: str


CREWS = {
    "j-sweep-skimmer": Crews(
        good=("injects.waits={at=155.0, orders=['tow.speed_kn=0.05'], text='The crew waits for the brush'}",),
        bad=("injects.hurries={at=40.0, orders=['tow.speed_kn=0.7'], text='The crew hurries'}",),
        boom="main",
        missed="speed",
    ),
    "v-sweep": Crews(
        good=(),
        bad=("injects.hurries={at=40.0, orders=['tow.speed_kn=0.7'], text='The crew hurries'}",),
        boom="main",
        missed="speed",
    ),
    "open-apex-follow": Crews(
        good=(),
        bad=(
            "injects.strays={at=10.0, orders=['vessels.follower.legs=[{speed_kn=0.2, heading_deg=25.0}]',"
            " 'vessels.outrigger.legs=[{speed_kn=0.2, heading_deg=25.0}]'], text='The sweep strays from behind the opening'}",
        ),
        boom="pocket",
        missed="fed",
    ),
    "fast-sweep": Crews(
        good=(),
        bad=("tow.speed_kn=3.0",),
        boom="main",
        missed="held",
    ),
    "deploy-from-reel": Crews(
        good=("injects.pays={at=12.0, orders=['booms.main.reel.paid_out=58.0'], text='The reel lets out'}",),
        bad=("injects.pays={at=12.0, orders=['booms.main.reel.paid_out=30.0'], text='The reel lets out, and stops'}",),
        boom="main",
        missed="deployed",
    ),
    "launch-from-slip": Crews(
        good=("injects.pays={at=12.0, orders=['ties.brake.hauled=-54.0'], text='The crew ashore pays out'}",),
        bad=("injects.pays={at=12.0, orders=['ties.brake.hauled=-20.0'], text='The crew ashore pays out, and stops'}",),
        boom="main",
        missed="deployed",
    ),
    "shore-seal": Crews(
        good=(),
        bad=("booms.main.boom=cfr-rivers",),
        boom="main",
        missed="clean",
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
    ),
    "inlet-exclusion": Crews(
        good=(),
        bad=(
            "booms.main.ends=[[-30.0, 0.0], [2.0, 0.0]]",
            "booms.main.length=44.8",
        ),  # it ends in the middle of the inlet
        boom="main",
        missed="clean",
    ),
    "river-diversion-cascade": Crews(
        good=(),
        bad=("booms.upper.ends=[[60.0, 13.0], [36.0, -18.4]]",),
        boom="upper",
        missed="speed",
    ),
    "deploy-and-connect": Crews(
        good=(
            "injects.connects={when={signal='ties.connect.distance', below=4.0}, orders=['ties.connect.made_fast=true'],"
            " text='The crew connects the booms'}",
        ),
        bad=("injects.rests={at=40.0, orders=['vessels.boat.engine=stopped'], text='The crew rests'}",),
        boom="main",
        missed="connected",
    ),
}


def graded(name: str, settings: tuple[str, ...], boom: str, folder: Path) -> Grade:
    """Run an exercise with a crew's settings, and grade a boom as the debrief does."""
    scenario = load_scenario(name, overrides=["recording.checkpoint_interval=0", *settings]).scenario
    record = folder / "run.rrd"
    options = RunOptions(record=record, overwrite=True)  # each crew in the place of the one before
    assert run_scenario(scenario, options=options, console=Console(quiet=True)) == 0
    history = next(one for one in boom_histories(Replay(record)) if one.boom.name == boom)
    return grade(history, scenario.criteria)


@pytest.mark.slow
@pytest.mark.timeout(3000)
@pytest.mark.parametrize("name", sorted(CREWS))
def test_the_good_crew_passes_and_the_bad_one_misses_what_the_exercise_teaches(name: str, tmp_path: Path) -> None:
    crews = CREWS[name]
    good = graded(name, crews.good, crews.boom, tmp_path)
    assert good.letter in PASSED, [(f.criterion.key, f.value, f.verdict) for f in good.findings]
    bad = graded(name, crews.bad, crews.boom, tmp_path)
    found = {finding.criterion.key: finding.verdict for finding in bad.findings}
    assert found[crews.missed] == "missed", [(f.criterion.key, f.value, f.verdict) for f in bad.findings]
    assert bad.letter not in PASSED


@pytest.mark.parametrize("name", sorted(CREWS))
def test_every_crew_and_level_is_a_sound_exercise(name: str) -> None:
    for settings in (CREWS[name].good, CREWS[name].bad, ("level=easy",), ("level=hard",)):
        scenario = load_scenario(name, overrides=settings).scenario
        assert scenario.exercise is not None
        assert scenario.exercise.brief.strip() and scenario.exercise.notes.strip()
        assert all(criterion.why for criterion in scenario.criteria.values() if criterion.weight != 0.0)


def test_every_exercise_has_goal_brief_and_notes() -> None:
    exercises = [load_scenario(name).scenario.exercise for name in library_paths()]
    found = [one for one in exercises if one is not None]
    assert len(found) >= 13
    assert all(one.goal.strip() and one.brief.strip() and one.notes.strip() for one in found)
