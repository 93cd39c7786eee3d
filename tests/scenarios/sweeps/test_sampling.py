"""Sampled sweeps: every slice once, the same seed the same points, tables as Parquet, and options that do not go together."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from scenarios.cli import main
from scenarios.sweeps.charts import (
    _rank_correlation,
    draw_loss_map,
    draw_sweep,
    drawn_figures,
    entry_in_words,
    figure_in_words,
    lines_of,
    lost_share,
)
from scenarios.sweeps.results import Outcome, differing, write_parquet
from scenarios.sweeps.variants import Range, Variation, parse_range, parse_variation, samples, variants
from scenarios.text.problems import ScenarioError

SPEED, DENSITY = Range(key="tow.speed_kn", low=0.2, high=0.9), Range(key="phases.oil.density", low=840.0, high=960.0)


def test_a_latin_hypercube_has_one_point_in_every_slice() -> None:
    found = samples([SPEED, DENSITY], 20, "latin-hypercube", 3)
    for one in (SPEED, DENSITY):
        values = np.array([float(point[one.key]) for point in found])
        slices = np.floor(20 * (values - one.low) / (one.high - one.low)).astype(int)
        assert sorted(slices) == list(range(20))


@pytest.mark.parametrize("method", ["latin-hypercube", "monte-carlo"])
def test_the_same_seed_gives_the_same_points(method: str) -> None:
    first, again, other = (samples([SPEED], 5, method, seed) for seed in (1, 1, 2))
    assert first == again != other


def test_monte_carlo_draws_every_point_of_a_range_with_the_same_chance() -> None:
    """200 points: not one in every slice, as a Latin hypercube has; mean and variance within 4 sigma of a uniform's, 1/2 and 1/12."""
    count = 200
    found = samples([SPEED, DENSITY], count, "monte-carlo", 3)
    shares = np.array(
        [[(float(point[one.key]) - one.low) / (one.high - one.low) for one in (SPEED, DENSITY)] for point in found]
    )
    assert shares.min() >= 0.0 and shares.max() <= 1.0
    for share in shares.T:
        filled = len(set(np.minimum(np.floor(count * share), count - 1).astype(int)))
        empty = (1.0 - 1.0 / count) ** count  # chance of a slice to stay empty, 0.37
        assert filled / count == pytest.approx(1.0 - empty, abs=0.1)
        assert share.mean() == pytest.approx(1 / 2, abs=4 * math.sqrt(1 / 12 / count))
        assert share.var() == pytest.approx(1 / 12, abs=4 * math.sqrt(1 / 180 / count))
    assert abs(np.corrcoef(shares.T)[0, 1]) < 4 / math.sqrt(count)


def test_samples_and_values_are_combined() -> None:
    chosen = variants(
        "u-sweep",
        [Variation(key="booms.main.segments", values=("10", "20"))],
        samples=samples([SPEED], 3, "monte-carlo", 0),
    )
    assert len({variant.name for variant in chosen}) == 6
    assert {len(variant.values) for variant in chosen} == {2}


@pytest.mark.parametrize(
    "text", ["tow.speed_kn", "tow.speed_kn=0.3", "=0:1", "a.b=1:1", "a.b=2:1", "a.b=0:inf", "a.b=x:1"]
)
def test_ranges_that_are_none_are_refused(text: str) -> None:
    with pytest.raises(ScenarioError, match=r"--range is .*allowed: key=low:high"):
        parse_range(text)


def test_options_that_do_not_go_together_are_all_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sweep", "u-sweep", "--runs", "3", "--seed", "-1", "--scheduler", "tcp://x:1", "--record"]) == 2
    said = capsys.readouterr().err
    assert all(option in said for option in ("--vary is missing", "--runs is 3", "--seed is -1", "--record is given"))
    assert main(["sweep", "u-sweep", "--vary", "run.duration=1,2", "--workers", "0"]) == 2
    assert main(["sweep", "u-sweep", "--vary", "run.duration=1,2", "--workers", "2", "--scheduler", "tcp://x:1"]) == 2
    said = capsys.readouterr().err
    assert "--workers is 0, allowed: 1 or more" in said and "--workers is given, allowed: without" in said


def outcomes() -> list[Outcome]:
    """Runs whose loss rises with the speed and does not depend on the density."""
    chosen = variants("u-sweep", [], samples=samples([SPEED, DENSITY], 8, "latin-hypercube", 1))
    ended = {"ended": "completed", "simulated_s": 1.0, "wall_s": 1.0, "density_error": {"mean": 0.0}, "probes": {}}
    return [
        Outcome(
            one,
            ended
            | {
                "oil_m3": {"spilled": 1.0, "lost": float(one.values[SPEED.key]) ** 3},
                "scores": {"main": {"gap": None}},
            },
        )
        for one in chosen
    ]


def test_parquet_holds_numbers_and_the_tornado_finds_what_moves_a_figure(tmp_path: Path) -> None:
    found = outcomes()
    write_parquet(found, tmp_path / "sweep.parquet")
    table = pq.read_table(tmp_path / "sweep.parquet").to_pydict()
    assert table["oil_m3.lost"] == pytest.approx([speed**3 for speed in table["tow.speed_kn"]])
    assert set(table["ended"]) == {"completed"}
    lost = [one.figures()["oil_m3.lost"] for one in found]
    assert _rank_correlation(found, SPEED.key, lost) == pytest.approx(1.0)
    assert abs(_rank_correlation(found, DENSITY.key, lost)) < 0.9
    assert draw_sweep(found, tmp_path / "sweep.png")
    assert (tmp_path / "sweep.png").stat().st_size > 5000


@pytest.mark.parametrize("count", [2, 4])  # panels, and the tornado of sampled entries
def test_a_figure_that_one_run_alone_has_measured_leaves_no_picture(tmp_path: Path, count: int) -> None:
    found = outcomes()[:count]
    for number, one in enumerate(found):
        one.summary["oil_m3"].clear()
        one.summary["scores"] = {"main": {"first_loss_speed_kn": 0.6 if number == 0 else None}}
    assert differing([one.figures() for one in found]) == ["scores.main.first_loss_speed_kn"]
    assert not draw_sweep(found, tmp_path / "sweep.png")
    assert not (tmp_path / "sweep.png").exists()


def test_lines_over_a_sampled_entry_do_not_run_to_and_fro() -> None:
    found = outcomes()
    names = [one.variant.values[SPEED.key] for one in found]
    assert names != sorted(names, key=float)  # as they are drawn
    for one in found:
        del one.variant.values[DENSITY.key]
    (points,) = lines_of([one.figures()["oil_m3.lost"] for one in found], found).values()
    assert points == [(speed, pytest.approx(speed**3)) for speed in sorted(map(float, names))]


def test_panels_are_of_figures_that_say_something_new() -> None:
    runs = [
        {
            "oil_m3.lost.planing": 0.5,
            "oil_m3.lost_modelled.planing": 0.5,
            "scores.main.share": 1.0,
            "scores.main.pull_n": 3.0,
        },
        {"oil_m3.lost.drainage": 0.2, "oil_m3.lost_modelled.drainage": 0.1, "scores.main.pull_n": 4.0},
    ]
    assert drawn_figures(runs) == {
        "oil_m3.lost.planing": [0.5, 0.0],  # the modelled part repeats it, and the share says nothing
        "scores.main.pull_n": [3.0, 4.0],
        "oil_m3.lost.drainage": [0.0, 0.2],
        "oil_m3.lost_modelled.drainage": [0.0, 0.1],
    }
    assert figure_in_words("scores.main.tow_tension_n.port.mean") == "main tow tension port mean [N]"
    assert figure_in_words("oil_m3.lost.splash_over") == "oil lost splash over [m³]"


def test_a_loss_map_has_a_dot_for_each_sample_and_a_tile_for_each_pair(tmp_path: Path) -> None:
    found = outcomes()
    assert draw_loss_map(found, tmp_path / "dots.png")
    grid = variants("u-sweep", [parse_variation("tow.speed_kn=0.4,0.6"), parse_variation("run.seed=1,2")])
    ended = {"probes": {}, "scores": {}}
    tiles = [
        Outcome(one, ended | {"oil_m3": {"spilled": 2.0, "lost": {"drainage": 0.5 * n}}}) for n, one in enumerate(grid)
    ]
    assert [lost_share(one) for one in tiles] == pytest.approx([0.0, 25.0, 50.0, 75.0])
    assert draw_loss_map(tiles, tmp_path / "tiles.png")
    assert all((tmp_path / name).stat().st_size > 5000 for name in ("dots.png", "tiles.png"))


@pytest.mark.parametrize(
    "varied", [["tow.speed_kn=0.4,0.5,0.6,0.7"], ["tow.speed_kn=0.4,0.6", "run.budget=true,false"]]
)
def test_there_is_no_loss_map_without_two_numbers(tmp_path: Path, varied: list[str]) -> None:
    chosen = variants("u-sweep", [parse_variation(one) for one in varied])
    found = [Outcome(one, {"oil_m3": {"spilled": 1.0, "lost": 0.5}, "scores": {}, "probes": {}}) for one in chosen]
    assert not draw_loss_map(found, tmp_path / "map.png")
    assert not (tmp_path / "map.png").exists()


def test_oil_that_left_the_tank_is_not_lost_by_a_boom() -> None:
    (one,) = variants("u-sweep", [parse_variation("tow.speed_kn=0.4")])
    oil = {"spilled": 2.0, "left_the_domain": 1.0, "lost": {"entrainment": 0.1}, "lost_modelled": {"entrainment": 0.1}}
    assert lost_share(Outcome(one, {"oil_m3": oil, "scores": {}, "probes": {}})) == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("tow.speed_kn", "0.5", "tow speed [kn]"),
        ("tow.heading_compass", "90", "tow heading [° clockwise from north]"),
        ("phases.oil.density", "900", "phases oil density [kg/m3]"),
        ("tank.upper.2", "2.5", "tank upper 2 [m]"),
        ("booms.main.segments", "20", "booms main segments"),
        ("run.seed", "7", "run seed"),
        ("run.budget", "true", "run budget"),
    ],
)
def test_axes_name_an_entry_with_its_unit(key: str, value: str, words: str) -> None:
    (one,) = variants("u-sweep", [parse_variation(f"{key}={value}")])
    assert entry_in_words(one.plan.scenario, key) == words
