"""All oil that was let in is somewhere, and once: runs whose booms stand alone, one behind the other and one in the other."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.constants import knot

from oilsim.oil.fates import FATES, Fate
from recordings.model.frame import Frame, RunDescription
from recordings.replay.comparison import scores
from recordings.replay.recording import Replay
from recordings.sink.recorder import Recorder
from scenarios.bench.scenario_run import ScenarioRun
from scenarios.controls.signals import signals_of
from scenarios.debrief.boom_history import boom_histories
from scenarios.running.assembly import Assembly, build
from scenarios.running.summary import SummaryObserver
from scenarios.spec.load import scenario_from

SPACING = 0.1
BOOM = {"skirt_depth": 0.22, "freeboard": 0.15}
UPSTREAM = {"ends": [[1.9, 1.8], [1.9, 0.2]], "length": 3.0, "segments": 9, **BOOM}
DOWNSTREAM = {"ends": [[0.8, 1.8], [0.8, 0.2]], "length": 1.8, "segments": 6, **BOOM}
WITHIN = {"ends": [[1.9, 1.4], [1.9, 0.6]], "length": 1.6, "segments": 6, **BOOM}
BOOMS = {"alone": {"a": UPSTREAM}, "series": {"a": UPSTREAM, "b": DOWNSTREAM}, "nested": {"a": UPSTREAM, "b": WITHIN}}


def channel(booms: dict[str, Any]) -> dict[str, Any]:
    """Oil in a stream of 0.8 m/s, which sweeps it out of booms and out of the tank."""
    stream = [-0.8, 0.0, 0.0]
    return {
        "name": "channel",
        "run": {"duration": 2.4, "communication_step": 0.02, "threads": 1},
        "fluid": {"particle_spacing": SPACING, "maximum_time_step": 0.02},
        "phases": {"sea": {"density": 1027.0, "dynamic_viscosity": 1.05e-3}, "oil": {"oil": "brent"}},
        "tank": {"lower": [0.0, 0.0, 0.0], "upper": [4.0, 2.0, 1.2], "open": ["-x", "+z"]},
        "fill": {
            "water": {"shape": "slab", "phase": "sea", "bottom": 0.0, "top": 0.6, "velocity": stream},
            "slick": {
                "shape": "block", "phase": "oil", "lower": [1.0, 0.5, 0.5], "upper": [1.8, 1.5, 0.6], "velocity": stream,
            },
        },
        "sea": {"current": {"speed": 0.8, "direction_deg": 180.0}},
        "booms": copy.deepcopy(booms),
    }  # fmt: skip


def test_oil_is_recorded_as_oil_by_its_role_and_not_by_its_name() -> None:
    """What the scores count is what recordings, exports and debriefs show."""
    data = channel(BOOMS["alone"])
    data["phases"] = {"boiled-sea": data["phases"]["sea"], "brent": data["phases"]["oil"]}
    data["fill"]["water"]["phase"], data["fill"]["slick"]["phase"] = "boiled-sea", "brent"
    assert build(scenario_from(data)).description.oils == ("brent",)


@pytest.mark.slow
def test_recording_debrief_and_comparison_know_the_peaks_of_the_summary(tmp_path: Path) -> None:
    """Though one communication point in ten is recorded."""
    with ScenarioRun(scenario_from(channel(BOOMS["alone"]))) as run:
        run.watch(Recorder(tmp_path / "channel.rrd", frame_rate=5.0))
        run.run(1.2)
    replay, summary = Replay(tmp_path / "channel.rrd"), run.assembly.scoring.summary()["a"]
    peaks = {end: tension["peak"] for end, tension in summary["tow_tension_n"].items()}
    (history,) = boom_histories(replay)
    assert {end: peak.max() for end, peak in history.tow_peak.items()} == pytest.approx(peaks)
    assert max(tension.max() for tension in history.tow_tension.values()) < 0.9 * max(peaks.values())
    assert history.held_peak.max() / knot == pytest.approx(summary["largest_held_normal_speed_kn"])
    found = {score.label: score.first for score in scores(replay, replay)}
    assert {end: 1e3 * found[f"largest tow tension, {end}"] for end in peaks} == pytest.approx(peaks)  # kN
    assert found["largest held speed normal to the boom"] == pytest.approx(summary["largest_held_normal_speed_kn"])
    assert found["largest lean of the skirt"] == pytest.approx(summary["largest_skirt_angle_deg"])
    assert found["smallest draft"] == pytest.approx(summary["smallest_effective_draft_m"])


class Balance:
    """Holds the summary of every communication point to its sum, and looks for lost particles that are shown twice."""

    def __init__(self, assembly: Assembly, summary: SummaryObserver) -> None:
        self.assembly, self.summary = assembly, summary
        self.spilled = 0.0

    def initialized(self, run: RunDescription) -> None:
        pass

    def step_completed(self, frame: Frame) -> None:
        oil = self.summary.summary(frame.time)["oil_m3"]
        self.spilled = self.spilled or oil["spilled"]
        assert oil["spilled"] == pytest.approx(self.spilled, rel=1e-12)
        settled = oil["contained"] + oil["afloat"] + oil["left_the_domain"] + sum(oil["lost"].values())
        assert settled == pytest.approx(self.spilled, rel=1e-12)
        assert min([0.0, *oil["lost"].values()]) >= 0.0
        shown = np.bincount(frame.phases["oil"].fate, minlength=len(FATES)) * SPACING**3
        assert [shown[Fate.AFLOAT], shown[Fate.CONTAINED]] == pytest.approx([oil["afloat"], oil["contained"]])
        assert shown[Fate.LOST :].sum() <= sum(oil["lost"].values()) + 1e-12  # some lost oil has left the tank

    def event(self, event: object) -> None:
        pass

    def terminated(self, reason: str) -> None:
        pass


@pytest.mark.parametrize(
    "which", [pytest.param(name, marks=[] if name == "alone" else pytest.mark.slow) for name in BOOMS]
)
def test_all_oil_is_accounted_for_once_at_every_communication_point(
    which: str, scenario_run: type[ScenarioRun]
) -> None:
    """74 particles, most of which booms lose before the stream takes them out of the tank."""
    scenario = scenario_from(channel(BOOMS[which]))
    run = scenario_run(scenario)
    assembly = run.assembly
    summary = SummaryObserver(assembly)
    for observer in (summary, Balance(assembly, summary)):
        run.watch(observer)
    run.run()
    result = json.loads(json.dumps(summary.summary(scenario.run.duration)))
    oil = result["oil_m3"]
    assert result["left_the_tank"]["oil"] > 0
    lost = sum(oil["lost"].values())
    assert 0.0 < lost <= oil["spilled"]
    own = [boom.oil for boom in assembly.scoring.booms]
    if len(own) > 1:  # their own accounts hold some oil twice
        assert sum(one.contained + one.all_lost for one in own) > 1.1 * oil["spilled"]
    if which == "alone":  # what its own history says, which an exported exercise gives
        signals = {
            name: signal.read(assembly.parts)
            for name, signal in signals_of(scenario.parts).items()
            if not signal.is_input
        }
        assert signals["booms.a.oil_contained"] == signals["oil.contained"] == pytest.approx(oil["contained"])
        assert signals["booms.a.oil_afloat"] == signals["oil.afloat"] == pytest.approx(oil["afloat"])
        assert signals["booms.a.oil_lost"] == pytest.approx(lost)
        assert signals["oil.left_the_domain"] == oil["left_the_domain"]
    before = assembly.scoring.ledger.rows
    assembly.scoring.restore_state(copy.deepcopy(assembly.scoring.save_state()))
    assert assembly.scoring.ledger.rows == before
