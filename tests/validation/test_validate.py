"""The command runs a case, writes its report, and tells failures from missed gates."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from tests.validation import jobs
from tests.validation.__main__ import main, status_of
from tests.validation.bodies import wave_flume
from tests.validation.bodies.floating import SIZE, solids
from tests.validation.bodies.released import cylinder_added_mass, sphere_added_mass, turning_points
from tests.validation.case import Bench, Case, Map, Outcome, Panel, Quantity, trace
from tests.validation.cases import CASES, KNOWN_MISSES, select
from tests.validation.liquids.channel import couette, poiseuille
from tests.validation.liquids.corner_jet import plate_of
from tests.validation.liquids.wave_drift import DEPTH, Wave
from tests.validation.liquids.waves import exact_omega, interface_roots
from tests.validation.pages import made, report
from tests.validation.rigid import Body, disc
from tests.validation.scenes import fill, liquid, open_tank, read_table


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


def on_record(case: Case, *wanted: tuple[int, float]) -> report.CaseResult:
    """Run a case at resolutions and shares of the step, keep the records and read them back."""
    for resolution, share in wanted:
        jobs.keep(case, jobs.run(jobs.Job(case, resolution, share), Bench(threads=1, step_share=share)))
    return report.result_of(case)


@pytest.fixture
def of_its_own(tmp_path, monkeypatch):
    """Records and a page of the test's own; a made-up case has no file."""
    monkeypatch.setattr(jobs, "RECORDS", tmp_path)
    monkeypatch.setattr(report, "PAGE", tmp_path / "page.md")
    monkeypatch.setattr(made, "PAGES", [])
    named = jobs.sources
    monkeypatch.setattr(jobs, "sources", lambda name: "made up" if name == "made-up" else named(name))


def test_page_tells_order_gate_and_verdict(of_its_own, tmp_path):
    case = case_that(made_up)
    result = on_record(case, (4, 1.0), (1, 1.0), (2, 1.0))  # in any order
    good, bad = case.quantities
    assert [result.verdict(good), result.verdict(bad)] == ["pass", "MISSED"]
    assert result.order(good) == pytest.approx(2.0, rel=1e-4)
    told = report.page([result])
    assert "| good [m] | 2 | 2.16 | 2.04 | 2.01 | 0.5 % | 2 | 1 % | pass |" in told
    assert "- [made-up](#99-made-up): bad, 0.5\n" in told
    report.draw(result, tmp_path / "made-up.png")
    assert (tmp_path / "made-up.png").stat().st_size > 1000


def test_maps_are_kept_to_a_hundredth_and_drawn(of_its_own, tmp_path):
    assert "maps" not in on_record(case_that(made_up), (1, 1.0)).levels[0]
    values, outline = np.array([[0.0, 12.34], [0.004, 250.0]]), np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 0.5]])
    row = (Map("oil", (0.0, 2.0, 0.0, 2.0), values, outline), Map("none", (0.0, 2.0, 0.0, 2.0), 0.0 * values))
    case = case_that(lambda resolution, bench: Outcome(values={"good": 2.0}, maps=(row,)))
    result = on_record(case, (1, 1.0))
    ((oil, none),) = result.levels[0]["maps"]
    assert (oil["title"], oil["extent"], oil["outline"]) == ("oil", [0.0, 2.0, 0.0, 2.0], outline.tolist())
    assert (oil["values"], none["values"]) == ([[0, 12], [0, 250]], [[0, 0], [0, 0]])
    report.draw(result, tmp_path / "made-up.png")
    assert (tmp_path / "made-up.png").stat().st_size > 1000
    assert ["maps" in level for level in on_record(case, (2, 1.0)).levels] == [False, True]  # the finest only


def test_a_case_that_breaks_is_told_and_not_hidden(of_its_own):
    def breaks(resolution, bench):
        raise ValueError("no such tank")

    case = case_that(breaks)
    result = on_record(case, (1, 1.0))
    assert result.failed
    assert "no such tank" in report.page([result])
    assert result.verdict(case.quantities[0]) == "CANNOT RUN"


def test_a_later_record_takes_the_place_of_the_earlier(of_its_own):
    values = iter([1.0, math.nan])
    case = case_that(lambda resolution, bench: Outcome(values={"good": next(values)}))
    assert on_record(case, (1, 1.0)).values(case.quantities[0]) == [1.0]
    assert math.isnan(on_record(case, (1, 1.0)).values(case.quantities[0])[0])


def test_jobs_of_changed_code_are_stale_and_the_most_valuable_come_first(of_its_own, monkeypatch):
    case = case_that(made_up)
    on_record(case, (1, 1.0), (4, 1.0))
    asked = jobs.jobs([case])
    assert [(job.resolution, job.step_share) for job in asked] == [(1, 1.0), (2, 1.0), (4, 1.0), (1, 0.5)]
    assert [job.resolution for job in asked if job.is_stale] == [2, 1]
    monkeypatch.setattr(jobs, "sources", lambda name: "changed")
    assert [(job.resolution, job.step_share) for job in jobs.by_worth(asked)][:2] == [(2, 1.0), (1, 0.5)]
    assert all(job.is_stale for job in asked)


def test_words_leave_the_code_as_it_is_and_numbers_do_not(tmp_path, monkeypatch):
    monkeypatch.setattr(jobs, "ROOT", tmp_path)
    told = []
    for number, text in enumerate(['"""Say."""\nx = 1\n', '"""Say more."""  # why\nx = 1\n', "x = 2\n"]):
        (tmp_path / f"{number}.py").write_text(text)
        told.append(jobs.code(Path(f"{number}.py")))
    assert told[0] == told[1] != told[2]


def test_pages_say_what_is_on_record():
    """A number that is typed over a made one, or a record that the pages do not show, fails here."""
    differ = [page.name for page, text in made.contents().items() if page.read_text(encoding="utf-8") != text]
    assert differ == [], "run make docs"


def test_a_made_part_tells_each_spacing_and_what_was_not_run(of_its_own, monkeypatch):
    case = case_that(made_up)
    monkeypatch.setattr(made, "select", lambda name: [case])
    text = "<!-- made: made-up: good -->7<!-- / -->; <!-- made: made-up: good: error -->8<!-- / -->"
    assert re.findall("not run", made.filled(text)) == ["not run"] * 2
    on_record(case, (1, 1.0), (2, 1.0))
    told = re.sub("<!--.*?-->", "", made.filled(text))
    assert told == "2.16, 2.04 m at L/1, 2; 8, 2 % at L/1, 2"
    assert made.filled(made.filled(text)) == made.filled(text)
    with pytest.raises(ValueError, match="no part of a page"):
        made.made("made-up: better")


def test_records_are_of_cases_and_their_quantities():
    known = {case.name: case for case in CASES}
    files = list(jobs.RECORDS.glob("*.json"))
    assert files
    for file in files:
        for record in jobs.records(known[file.stem]):
            missing = {one.name for one in known[file.stem].quantities} - set(record["values"])
            assert record["failure"] or not missing, file.name


@pytest.mark.parametrize(
    ("missed", "level", "failure", "status", "told"),
    [
        ({"oil-slick, exponent"}, -1, "", 0, []),
        ({"oil-slick, exponent", "archimedes, box 0.1"}, -1, "", 1, ["MISSED, and no known miss: archimedes, box 0.1"]),
        (set(), -1, "", 0, ["met, though a known miss: oil-slick, exponent"]),
        ({"archimedes, box 0.1"}, 0, "", 0, []),  # at a coarser spacing, nothing is judged
        ({"oil-slick, exponent"}, -1, "no such tank", 1, []),
    ],
)
def test_a_missed_gate_that_is_not_known_ends_with_1(missed, level, failure, status, told, capsys):
    """Oil on water whose exponent is known to be missed, and bodies afloat with no known miss, with made-up values."""
    results = []
    for case in select("oil-slick,archimedes"):
        values = {
            quantity.name: quantity.reference + (99.0 if f"{case.name}, {quantity.name}" in missed else 0.0)
            for quantity in case.quantities
        }
        one = {"resolution": case.resolutions[level], "step": 1.0, "values": values, "failure": failure}
        results.append(report.CaseResult(case, [one]))
    assert status_of(results, Console()) == status
    assert capsys.readouterr().out.splitlines() == told


def test_known_misses_are_gates_of_cases():
    gates = {(case.name, one.name) for case in CASES for one in case.quantities if one.passes([math.nan]) is not None}
    assert gates >= KNOWN_MISSES


def test_half_the_step_shows_what_hangs_on_it(of_its_own):
    """The good quantity moves by a tenth of its gate, the bad one by 30 gates."""

    def run(resolution, bench):
        return Outcome(values={"good": 2.0 + 0.002 * bench.step_share, "bad": 0.6 * bench.step_share})

    case = case_that(run)
    result = on_record(case, (1, 1.0), (1, 0.5))
    assert [result.at_half_step(one) for one in case.quantities] == ["2.001", "**0.3**"]


@pytest.mark.parametrize("exchange", [0.05, 1e-3], ids=["limits of the fluid", "an exchange shorter than its steps"])
def test_half_the_step_is_half_whatever_limits_it(exchange):
    """A body that moves in water whose depth, not its speed, limits the step."""

    def steps(share):
        bench = Bench(threads=1, step_share=share)
        fluid, _ = open_tank(bench, 0.4, 0.6, 0.02, (liquid(),))
        fill(fluid, (0, 0), (0.4, 0.4))
        body = Body(fluid, disc(0.05, 0.02), 1.0, np.eye(3), np.array([0.2, 0.0, 0.55]))
        for _ in range(20):
            body.advance(bench, exchange)
        return bench.particle_steps / fluid.particle_count

    assert steps(0.5) == pytest.approx(2.0 * steps(1.0), rel=0.1)


def test_a_gate_of_zero_allows_no_change():
    exact = Quantity(name="lost", unit="1", reference=0.0, gate=0.0, scale=1.0)
    assert report.change_over_gate(exact, 0.0, 0.0) == 0.0
    assert report.change_over_gate(exact, 0.0, 1.0) == math.inf


def test_command_runs_what_is_stale_within_its_budget(of_its_own, tmp_path, capsys):
    command = ["elliptical-drop", "--levels", "1", "--threads", "1"]
    assert main([*command, "--budget", "1h"]) == 0
    assert "2 of 2 jobs to run" in capsys.readouterr().out
    (case,) = select("elliptical-drop")
    whole, half = jobs.records(case)
    assert (whole["step"], half["step"]) == (1.0, 0.5)
    assert whole["particle_steps"] > 0
    assert all(math.isfinite(value) for value in whole["values"].values())
    assert "## 8. Elliptical drop" in (tmp_path / "page.md").read_text()
    assert main(command) == 0
    assert "0 of 2 jobs to run" in capsys.readouterr().out
    assert main([*command, "--again", "--budget", "0.01s"]) == 0
    assert "2 jobs are left for another time" in capsys.readouterr().out


def test_unknown_case_is_refused(capsys):
    assert main(["no-such-case"]) == 2
    assert "no-such-case" in capsys.readouterr().err


def test_cases_are_chosen_by_name_or_number():
    assert [case.number for case in select("13, still-column")] == [1, 13]
    assert select("") == list(CASES)
    assert len({case.name for case in CASES}) == len(CASES) == 57


def test_reference_solutions_agree_with_the_tables():
    times, speeds = read_table("poiseuille_centreline.csv")
    assert [float(poiseuille(np.array([5e-4]), t)[0]) for t in times] == pytest.approx(list(speeds), rel=2e-4)
    assert couette(np.array([0.0, 1e-3]), 0.1) == pytest.approx([0.0, 1.25e-5], abs=1e-9)
    assert 2.0 * math.pi / exact_omega(math.pi, 1.0) == pytest.approx(1.13392, rel=1e-4)
    assert 2.0 * math.pi / interface_roots()[1] == pytest.approx(2.5340, rel=1e-4)


def test_drift_of_a_closed_flume_carries_nothing_and_gains_what_the_waves_lose():
    wave = Wave(3.0)
    place, speed, loss = np.array(wave_flume.GAUGED) * 2.0, wave_flume.group_speed(wave), 0.05
    time = (np.arange(wave_flume.SAMPLES * 40) + 1.0) * 2.0 * math.pi / wave.omega / wave_flume.SAMPLES
    passing = (time[:, None] > (place + 5.0) / speed) * 0.04 * np.exp(-loss * place)
    found, height = wave_flume.train(wave, place, passing), (np.arange(2000) + 0.5) / 2000 * DEPTH
    assert found.drift(height).mean() == pytest.approx(0.0, abs=1e-6 * found.mean_stokes)
    assert (found.amplitude, found.loss) == pytest.approx((0.04, loss), rel=1e-6)
    # a front at c_g: the waves behind it lose 2 loss c_g m a time, m = g a^2 / 2 c
    momentum = 0.5 * 9.81 * 0.04**2 * wave.number / wave.omega
    since = time[-wave_flume.COUNTED * wave_flume.SAMPLES :].mean() - 5.0 / speed
    assert found.shed == pytest.approx(2.0 * loss * speed * momentum * since, rel=0.05)


def test_solids_are_closed_and_have_their_volumes():
    meshes = solids()
    assert all(mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0.0 for mesh in meshes.values())
    exact = {"box": 1.0, "cylinder": math.pi / 4.0, "sphere": math.pi / 6.0, "L-beam": 0.35 + 0.35 * 0.65}
    assert {name: meshes[name].volume / SIZE**3 for name in exact} == pytest.approx(exact)


def test_added_mass_has_lambs_corrections_at_one_wall():
    # Lamb (1932), art. 137: 1 + 3/8 (a/h)^3 moving square to a wall in leading order; of a cylinder 1 + 1/2 (a/h)^2
    far, near = 1e4, 20.0
    assert sphere_added_mass(1.0, far, far, far) == pytest.approx(0.5)
    assert sphere_added_mass(1.0, far, near, far) == pytest.approx(0.5 * (1.0 + 3.0 / 8.0 / near**3), rel=1e-8)
    assert sphere_added_mass(1.0, far, far, near) == pytest.approx(0.5 * (1.0 - 3.0 / 8.0 / near**3), rel=1e-8)
    assert cylinder_added_mass(1.0, far, near, far) == pytest.approx(1.0 + 0.5 / near**2, rel=2e-6)
    assert cylinder_added_mass(1.0, far, far, near) == pytest.approx(1.0 - 0.5 / near**2, rel=2e-6)


def test_a_disc_of_points_has_the_volume_of_its_two_rings():
    points = disc(0.5, 0.05)
    assert points.volume.sum() == pytest.approx(math.pi * (0.5**2 - 0.4**2))
    assert points.area.sum() == pytest.approx(math.pi)


def test_turning_points_of_a_decaying_cosine():
    time = np.arange(0.0, 10.0, 0.05)
    height = np.exp(-0.2 * time) * np.cos(time)
    # extrema where tan t = -0.2
    expected = [(n * math.pi - math.atan(0.2)) for n in (1, 2, 3)]
    found = turning_points(time, height)
    # a parabola through three samples either side: off by about z'''/z'' (3 h)^2 / 10 at most
    assert [t for t, _ in found] == pytest.approx(expected, abs=2e-3)
    assert [z for _, z in found] == pytest.approx([math.exp(-0.2 * t) * math.cos(t) for t in expected], abs=1e-4)


@pytest.mark.parametrize("height", [0.5, 1.0, 3.0, math.inf])
def test_theory_of_a_jet_on_a_plate_keeps_momentum(height):
    """The plate takes what the jet loses along its way: 2 (1 - sin beta) in rho U^2 h / 2."""
    plate = plate_of(height)
    speeds = np.linspace(0.0, 1.0 - 1e-6, 4001)
    slope = np.array([plate.slope(speed) for speed in speeds])
    force = np.trapezoid((1.0 - speeds**2) * slope, speeds)
    assert force == pytest.approx(2.0 * (1.0 - math.sin(plate.beta)), rel=1e-3)
    assert plate.pressure(1e-6) == pytest.approx(1.0, abs=1e-9)
    assert plate.pressure(0.4) == pytest.approx(
        1.0 - np.interp(0.4, [plate.height_of(q) for q in speeds[:3000:20]], speeds[:3000:20]) ** 2, abs=1e-3
    )


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_every_case_has_sources(case: Case) -> None:
    assert re.fullmatch("[0-9a-f]{16}", jobs.sources(case.name))
