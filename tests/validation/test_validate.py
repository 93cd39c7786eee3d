"""The command runs a case, writes its report, and tells failures from missed gates."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from tests.validation import report
from tests.validation.__main__ import main, run_level
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace
from tests.validation.cases import CASES, select
from tests.validation.channel import couette, poiseuille
from tests.validation.drop import ellipse_axes
from tests.validation.scenes import read_table
from tests.validation.waves import exact_omega, interface_roots


def case_that(run) -> Case:
    """A case of two quantities that runs `run`."""
    return Case(
        number=99, name="made-up", title="Made up", source="none", setup="none", length=1.0, length_symbol="L",
        resolutions=(1, 2, 4), run=run, panels=(Panel("curve", "x", "y"),),
        quantities=(
            Quantity(name="good", unit="m", reference=2.0, gate=0.01),
            Quantity(name="bad", unit="1", reference=0.0, scale=1.0, gate=0.01),
        ),
    )  # fmt: skip


def made_up(resolution, bench):
    """Second order in the first quantity, far off in the second."""
    return Outcome(
        values={"good": 2.0 + 0.16 / resolution**2, "bad": 0.5}, traces=(trace("curve", [0, 1], [0, 1], "line"),)
    )


def test_report_tells_order_gate_and_verdict(tmp_path):
    case = case_that(made_up)
    result = report.CaseResult(case, [run_level(case, n, Bench()) for n in case.resolutions])
    report.write([result], tmp_path, 1)
    found = json.loads((tmp_path / "validation.json").read_text())["cases"][0]["quantities"]
    assert [each["verdict"] for each in found] == ["pass", "MISSED"]
    assert found[0]["order"] == pytest.approx(2.0)
    assert found[0]["errors"][-1] == pytest.approx(0.005)
    assert "MISSED" in (tmp_path / "validation.md").read_text()
    assert (tmp_path / "made-up.png").stat().st_size > 1000


def test_a_case_that_breaks_is_told_and_not_hidden(tmp_path):
    def breaks(resolution, bench):
        raise ValueError("no such tank")

    case = case_that(breaks)
    result = report.CaseResult(case, [run_level(case, 1, Bench())])
    report.write([result], tmp_path, None)
    assert result.failed
    assert "no such tank" in (tmp_path / "validation.md").read_text()
    assert result.verdict(case.quantities[0]) == "CANNOT RUN"


def test_command_runs_the_cheapest_case(tmp_path, capsys):
    assert main(["elliptical-drop", "--levels", "1", "--threads", "1", "--output", str(tmp_path)]) == 0
    found = json.loads((tmp_path / "validation.json").read_text())["cases"][0]
    assert found["name"] == "elliptical-drop"
    assert found["levels"][0]["particle_steps"] > 0
    assert all(math.isfinite(each["values"][0]) for each in found["quantities"])


def test_unknown_case_is_refused(capsys):
    assert main(["no-such-case"]) == 2
    assert "no-such-case" in capsys.readouterr().err


def test_cases_are_chosen_by_name_or_number():
    assert [case.number for case in select("13, still-column")] == [1, 13]
    assert select("") == list(CASES)
    assert len({case.name for case in CASES}) == len(CASES) == 17


def test_reference_solutions_agree_with_the_tables():
    times, speeds = read_table("poiseuille_centreline.csv")
    assert [float(poiseuille(np.array([5e-4]), t)[0]) for t in times] == pytest.approx(list(speeds), rel=2e-4)
    assert couette(np.array([0.0, 1e-3]), 0.1) == pytest.approx([0.0, 1.25e-5], abs=1e-9)
    t, a, b, _ = read_table("elliptical_drop.csv")
    assert ellipse_axes(t).ravel() == pytest.approx(np.concatenate([a, b]), rel=2e-4)
    assert 2.0 * math.pi / exact_omega(math.pi, 1.0) == pytest.approx(1.13392, rel=1e-4)
    assert 2.0 * math.pi / interface_roots()[1] == pytest.approx(2.5340, rel=1e-4)
