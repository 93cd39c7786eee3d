"""POLREP, ICS 209 and the cost of an operation: what a recording knows by formula, and blanks for the rest."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from recordings.model.exercise import Equipment, ExerciseDescription, Site
from recordings.model.frame import BodyFrame, Frame, MeshDescription, PhaseDescription, PhaseFrame, RunDescription
from recordings.replay.joined import JoinedReplay
from recordings.sink.recorder import Recorder
from scenarios.cli import main
from scenarios.debrief.reports import ICS_209_BLOCKS, oil_balance, operation_cost
from scenarios.spec.load import load_scenario
from scenarios.text.problems import ScenarioError

DURATION = 1800.0  # [s]
ROWS = {"spilled": 4.0, "afloat": 1.0, "contained": 1.5, "recovered": 0.5, "stranded": 0.25, "lost/drainage": 0.75}
PRICES = {"currency": "NOK", "vessel_hour": 400.0, "skimmer_hour": 100.0, "recovered_m3": 300.0, "lost_m3": 8000.0}

PRINTED = {  # blocks of the ICS 209, version 3 (2010), as the form prints number and title
    13: "Date/time submitted",
    22: "Longitude and latitude",
    28: "Significant events for the time period reported",
    31: "Public status summary",
    33: "Life, safety, and health status/threat remarks",
    35: "Weather concerns",
    37: "Strategic objectives",
    38: "Current incident threat summary and risk information",
    40: "Strategic discussion",
    41: "Planned actions for next operational period",
    44: "Projected significant resource demobilization start date",
    45: "Estimated incident costs to date",
    47: "Remarks",
    48: "Agency or organization",
    51: "Total personnel",
    53: "Additional cooperating and assisting organizations not listed above",
}


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Half an hour of two vessels and a skimmer that ends with known rows of oil, at a known place and date."""
    path = tmp_path_factory.mktemp("priced") / "priced.rrd"
    corner = MeshDescription(vertices=np.eye(3), faces=np.array([[0, 1, 2]]))
    brush = Equipment(name="brush", kind="skimmer", ends=(("vessels/port", (0.0, 0.0, 0.0)),), width=1.0)
    run = RunDescription(
        name="priced",
        particle_spacing=0.1,
        phases=(PhaseDescription(name="crude", rest_density=900.0, dynamic_viscosity=0.02, is_oil=True),),
        meshes=dict.fromkeys(["vessels/port", "vessels/starboard"], corner),
        exercise=ExerciseDescription(wind=(0.0, -1852.0 / 360.0), equipment=(brush,), prices=PRICES),
        site=Site(latitude=58.9, longitude=5.6, start="2026-05-01T08:00:00Z"),
    )
    still = BodyFrame(position=np.zeros(3), orientation=np.array([0.0, 0.0, 0.0, 1.0]))
    oil = np.array([[-10.0, -5.0, 0.0], [10.0, 5.0, 0.0]], np.float32)
    phases = {"crude": PhaseFrame(oil, np.arange(2, dtype=np.uint32))}
    with Recorder(path, frame_rate=1.0) as recorder:
        recorder.initialized(run)
        for index, time in enumerate((0.0, DURATION)):
            scalars = {f"oil/{row}": volume for row, volume in ROWS.items()}
            scalars |= {"skimmers/brush/aboard": 0.6, "skimmers/brush/offloaded": 0.4}
            scalars |= {"wind/x": 0.0, "wind/y": -1852.0 / 360.0 * (1 + index)}  # it freshens
            bodies = dict.fromkeys(run.meshes, still)
            recorder.step_completed(
                Frame(index=index, time=time, bodies=bodies, scalars=scalars, read_phases=lambda: phases)
            )
    return path


def test_the_cost_is_amount_times_price_and_names_what_has_none(recording: Path) -> None:
    """Two vessels and a skimmer for half an hour, a cubic metre of fluid taken and 0.75 m3 lost; 0.25 m3 ashore has no price."""
    lines, unpriced = operation_cost(JoinedReplay(recording), DURATION)
    assert [line.cost for line in lines] == pytest.approx([400.0, 50.0, 300.0, 6000.0])
    assert unpriced == ["Oil stranded"]


def test_the_rows_of_the_balance_add_up_to_what_was_spilled(recording: Path) -> None:
    assert sum(volume for _, volume in oil_balance(JoinedReplay(recording))) == pytest.approx(ROWS["spilled"])


def test_the_forms_say_what_is_known_and_leave_the_rest_blank(recording: Path, tmp_path: Path) -> None:
    assert main(["debrief", str(recording), "--report", "--out", str(tmp_path)]) == 0
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    cells = re.findall(r'<td class="n">([\d-]+)</td><td class="field">([^<]*)</td><td>(.*?)</td>', page)
    forms = {title: value for _, title, value in cells}
    assert forms["Cost"] == forms["Estimated incident costs to date"] == "6,750.00 NOK"
    assert forms["Outflow"] == "4 m3"
    assert forms["Position"] == forms["Longitude and latitude"] == "58.9000° N, 5.6000° E"
    assert forms["For time period"] == "2026-05-01 08:00:00 UTC to 2026-05-01 08:30:00 UTC"
    assert forms["Wind direction and speed"] == "20 kn from 000°"
    assert forms["Percent contained or completed"] == "50 % held by booms or recovered"
    assert "20 m by 10 m" in forms["Position and extent of pollution"]
    for unknown in ("Forecast of likely effect", "Sea state and visibility", "Prepared by", "Incident number"):
        assert "blank" in forms[unknown]
    numbered = {int(number): title for number, title, _ in cells[-len(ICS_209_BLOCKS) :]}
    assert list(numbered) == list(range(1, 54))
    assert PRINTED.items() <= numbered.items()
    assert "Without a price, and not counted: Oil stranded" in page


def test_without_prices_nothing_is_counted(recording: Path) -> None:
    replay = JoinedReplay(recording)
    exercise = replay.run.exercise
    assert exercise is not None
    replay.__dict__["run"] = replace(replay.run, exercise=replace(exercise, prices={}))
    assert operation_cost(replay, DURATION) == ([], [])


@pytest.mark.parametrize("price", ["nan", "-1", "inf"])
def test_prices_are_numbers_of_0_or_more(price: str) -> None:
    with pytest.raises(ScenarioError, match=r"prices\.lost_m3"):
        load_scenario("j-sweep-skimmer", overrides=[f"prices.lost_m3={price}"])
    assert load_scenario("j-sweep-skimmer").scenario.prices is not None
