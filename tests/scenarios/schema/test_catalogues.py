"""Vessels and skimmers of the catalogues: their figures follow their sources, sections take them, and the commands show them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields

import pytest

from booms.boom import catalogue as booms
from booms.recovery.skimmer import catalogue as skimmers
from booms.recovery.skimmer import daily_capacity
from oilsim.core.catalogue import CatalogueEntry
from oilsim.core.physical_constants import GRAVITY
from scenarios.cli import main
from scenarios.schema.exercise import VesselSettings
from scenarios.schema.parsing.structuring import structure
from scenarios.schema.recovery import SkimmerSettings
from scenarios.spec.load import load_scenario
from scenarios.text.problems import ScenarioError
from vessels.hull import float_hull, raked_barge, wigley_hull
from vessels.hull_size import catalogue as vessels

SHELVES = {"booms": booms(), "vessels": vessels(), "skimmers": skimmers()}
VESSEL = {"position": [0.0, 0.0], "yaw_moment": 1e5}
BARREL = 0.158987294928  # m3
TONNE = 1000.0 * GRAVITY  # N


@pytest.mark.parametrize("name", vessels())
@pytest.mark.parametrize("shape", ["barge", "wigley"])
def test_a_vessel_takes_its_figures_from_the_catalogue_and_floats_upright(name: str, shape: str) -> None:
    entry, settings = vessels()[name], structure(VESSEL | {"vessel": name, "shape": shape}, VesselSettings)
    size = (settings.length, settings.beam, settings.draft, settings.depth)
    assert size == (entry.length, entry.beam, entry.draft, entry.depth)
    assert settings.bollard_pull == entry.bollard_pull
    mesh = raked_barge(*size) if shape == "barge" else wigley_hull(*size)
    assert float_hull(mesh, settings.draft, water_density=1025.0).hydrostatics.metacentric_height(0.0) > 0.0


@pytest.mark.parametrize("name", skimmers())
def test_a_skimmer_takes_its_figures_from_the_catalogue(name: str) -> None:
    entry = skimmers()[name]
    own = {key: 3.0 for key in ("swath", "storage") if getattr(entry, key) is None}
    settings = structure({"skimmer": name} | own, SkimmerSettings)
    design = settings.design(1025.0)
    assert (design.kind, design.nameplate * 3600.0) == (entry.kind, pytest.approx(entry.nameplate))
    assert (design.swath, design.storage) == (entry.swath or 3.0, entry.storage or 3.0)
    assert ("recovery_efficiency" in settings.assumed) == (entry.recovery_efficiency is None)


def test_what_is_stated_goes_before_the_catalogue() -> None:
    tug = structure(VESSEL | {"vessel": "stan-tug-1205", "draft": 1.8}, VesselSettings)
    assert (tug.draft, tug.depth) == (1.8, 2.3)
    weir = structure({"skimmer": "gt-185", "kind": "disc", "swath": 6.0, "storage": 15.0}, SkimmerSettings)
    assert (weir.kind, weir.nameplate) == ("disc", 45.4)
    assert structure({"nameplate": 30.0, "swath": 6.0, "storage": 15.0}, SkimmerSettings).kind == "weir"


@pytest.mark.parametrize(
    ("section", "table", "told"),
    [
        (
            VesselSettings,
            {"vessel": "stan-tug-1206"},
            {"vessel": "is no vessel of the catalogue, did you mean 'stan-tug-1205'?"},
        ),
        (
            VesselSettings,
            {"vessel": 12, "draft": -1.0},
            {"vessel": "is 12, allowed: text", "draft": "is -1.0, allowed: 0.001 or more"},
        ),
        (VesselSettings, {"vessel": "multi-cat-1205", "draft": 2.0}, {"depth": "is 1.835, allowed: above draft = 2 m"}),
        (
            VesselSettings,
            {"length": 5.0, "beam": 2.0, "draft": 0.5, "depth": 1.0},
            {"bollard_pull": "is missing, allowed: a value, or vessel = a name of the catalogue"},
        ),
        (
            SkimmerSettings,
            {"skimmer": "gt-185", "storage": 5.0},
            {"swath": "is missing, allowed: a value: 'gt-185' of the catalogue has none"},
        ),
        (SkimmerSettings, {"skimmer": "gt-158", "swath": 6.0}, {"skimmer": "did you mean 'gt-185'?"}),
    ],
)
def test_what_the_catalogue_cannot_give_is_refused(
    section: type, table: dict[str, object], told: dict[str, str]
) -> None:
    with pytest.raises(ScenarioError) as found:
        structure((VESSEL if section is VesselSettings else {}) | table, section)
    texts = {problem.path: problem.text for problem in found.value.problems}
    assert set(texts) == set(told)
    assert all(words in texts[path] for path, words in told.items()), texts


def test_estimates_follow_the_rules_that_their_sources_name() -> None:
    """MGN 280: freeboard 0.30 m up to 7 m, 0.75 m from 18 m on. Zahalka: t = 0.9 bhp / 100 x 1.10, in nozzles 1.20. 33 CFR 155: EDRC."""
    for entry in vessels().values():
        if "depth" in entry.assumed:
            freeboard = 0.3 + 0.45 * min(1.0, max(0.0, (entry.length - 7.0) / 11.0))
            assert entry.depth == pytest.approx(entry.draft + freeboard, abs=1e-3)
    for name, kilowatts, screws in (("stan-tug-1205", 442.0, 1.2), ("eco-ne028", 240.0, 1.1)):
        tonnes = 0.9 * kilowatts * 1.341 / 100.0 * screws
        assert vessels()[name].bollard_pull == pytest.approx(tonnes * TONNE, rel=5e-3)
    for name, barrels, count in (
        ("gt-185", 1371, 1),
        ("desmi-ocean", 3017, 1),
        ("transrec-350", 10567, 1),
        ("lori-brush-pack", 5000, 2),
    ):
        capacity = daily_capacity(skimmers()[name].nameplate / 3600.0)
        assert capacity == pytest.approx(barrels * BARREL / count, rel=2e-3)


def test_rates_of_tests_at_ohmsett_are_the_oil_over_its_share() -> None:
    gallon = 3.785411784e-3 * 60.0  # m3/h of a gallon a minute
    for name, gallons in (("elastec-x-challenge", 4670.0), ("current-buster-6", 2712.0)):
        entry = skimmers()[name]
        assert entry.recovery_efficiency is not None
        assert entry.nameplate * entry.recovery_efficiency == pytest.approx(gallons * gallon, rel=1e-3)


@pytest.mark.parametrize(("command", "entries"), SHELVES.items())
def test_the_commands_show_every_entry_and_its_source(
    command: str,
    entries: Mapping[str, CatalogueEntry],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("COLUMNS", "400")
    assert main([command]) == 0
    listed = capsys.readouterr().out
    for name, entry in entries.items():
        assert name in listed and entry.title in listed
        assert set(entry.assumed) <= {item.name for item in fields(entry)} | {"pocket.speed_ratio"}
        assert main([command, name]) == 0
        card = capsys.readouterr().out
        assert entry.source in card
        assert card.count("(assumed)") == len(entry.assumed)
    assert main([command, "no-such-thing"]) == 2
    assert f"is no {command.removesuffix('s')} of the catalogue" in capsys.readouterr().err


def test_shipped_exercises_name_entries() -> None:
    shipped = {name: load_scenario(name).scenario for name in ("harbour-1km", "v-sweep", "anchored-containment")}
    assert {one.vessel for one in shipped["harbour-1km"].vessels.values()} == {"stan-tug-1205"}
    assert [one.skimmer for name in ("v-sweep", "anchored-containment") for one in shipped[name].skimmers.values()] == [
        "lori-brush-pack",
        "gt-185",
    ]
