"""Remarks before a run: particles of a skirt, blockage, the side to which a boom bulges, and fills that do not fit the spacing."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

from booms.losses.resolution import skirt_in_words
from scenarios.setup.afloat.boom_remarks import blockage, boom_remarks
from scenarios.setup.cost import estimate
from scenarios.setup.fill_lattice import misfits
from scenarios.setup.layout import lay_out
from scenarios.spec.load import scenario_from
from scenarios.spec.resolve import RunSpec, resolve

MOORED: dict[str, Any] = {
    "name": "moored",
    "run": {"duration": 1.0},
    "fluid": {"particle_spacing": 0.1},
    "phases": {"sea": {"density": 1025.0, "dynamic_viscosity": 0.001}, "oil": {"oil": "brent"}},
    "tank": {"lower": [0.0, 0.0, 0.0], "upper": [6.0, 4.0, 1.5], "open": ["+z"], "periodic": ["x"]},
    "fill": {
        "sea": {"shape": "slab", "phase": "sea", "bottom": 0.0, "top": 0.8},
        "oil": {"shape": "block", "phase": "oil", "lower": [1.0, 1.5, 0.8], "upper": [2.0, 2.5, 0.95]},
    },
    "sea": {"current": {"speed": 0.3, "direction": 0.0}},
    "booms": {
        "inlet": {
            "ends": [[3.0, 3.6], [3.0, 0.4]], "length": 3.7, "segments": 12, "skirt_depth": 0.4, "freeboard": 0.2,
            "buoyancy_to_weight": 6.0,
        }
    },
}  # fmt: skip


def changed(**entries: Any) -> Any:
    """The scenario with entries changed, by paths with double underscores."""
    data = copy.deepcopy(MOORED)
    for path, value in entries.items():
        *tables, key = path.split("__")
        place = data
        for table in tables:
            place = place[table]
        place[key] = value
    return resolve(scenario_from(data))


def remarks(spec: RunSpec) -> dict[str, str]:
    """Return what is said of the booms of a run in water up to 0.8 m."""
    return boom_remarks(spec, 0.8)


def filled(spec: RunSpec) -> float:
    """Return the share of the section that the boom fills in water up to 0.8 m."""
    return blockage(spec.booms["inlet"], spec, 0.8)


def test_the_share_of_the_section_that_a_boom_fills() -> None:
    """Ends 3.2 m apart across the current, 0.4 m deep, in 4 m x 0.8 m: 40 %."""
    assert filled(changed()) == pytest.approx(3.2 * 0.4 / (4.0 * 0.8))
    assert filled(changed(sea__current__direction=np.pi)) == pytest.approx(0.4)
    along = changed(sea__current__direction=0.5 * np.pi)
    assert filled(along) == pytest.approx(0.0, abs=1e-12)
    assert filled(changed(tank__open=["+z", "-y"])) == 0.0
    assert filled(changed(sea={})) == 0.0


def test_remarks_name_particles_blockage_and_side() -> None:
    told = remarks(changed())
    assert "its skirt is 4 particles deep" in told["skirt inlet"] and "not to be trusted" in told["skirt inlet"]
    assert (
        "it fills 40 % of the water's section" in told["blockage inlet"]
        and "1.7 times as fast" in told["blockage inlet"]
    )
    assert "bulge inlet" not in told  # the current's side
    slack = remarks(changed(sea={}))["bulge inlet"]
    assert slack.endswith("bulges towards 270 degrees of the compass")
    against = remarks(changed(booms__inlet__bulge="right"))["bulge inlet"]
    assert "towards 270" in against and "against the current" in against
    fine = remarks(changed(fluid__particle_spacing=0.04))["skirt inlet"]
    assert "10 particles deep: the speed of the first loss is modelled" in fine
    assert set(told.values()) <= set(estimate(changed()).told)


@pytest.mark.parametrize(
    ("bulge", "direction", "side"), [(None, 0.0, 1), (None, np.pi, -1), ("left", np.pi, 1), ("right", 0.0, -1)]
)
def test_a_moored_boom_is_laid_down_the_current_or_as_stated(bulge: str | None, direction: float, side: int) -> None:
    entries: dict[str, Any] = {"sea__current__direction": direction} | ({"booms__inlet__bulge": bulge} if bulge else {})
    fleet = lay_out(changed(**entries)).fleet
    middle = fleet.booms["inlet"].segments[6].position[0]
    assert side * (middle - 3.0) > 0.5


def test_fills_that_do_not_fit_the_spacing_are_told() -> None:
    scenario = changed()
    told = misfits(scenario.fill, scenario.tank, 0.1, 3)
    assert set(told) == {"oil"}
    assert "its particles hold 200 litres, 1.33 times the 150 litres of its shape" in told["oil"]
    assert any("1.33 times" in text for text in estimate(scenario).told)
    assert misfits(scenario.fill, scenario.tank, 0.05, 3) == {}
    drum = changed(
        fill__oil={"shape": "cylinder", "phase": "oil", "base": [1.5, 2.0, 0.9], "radius": 0.09, "height": 0.05}
    )
    assert "fill.oil: its particles hold 4 litres" in misfits(drum.fill, drum.tank, 0.1, 3)["oil"]


def test_an_exclusion_needs_its_area() -> None:
    with pytest.raises(ValueError, match=r"booms.inlet.area has 0 corners, allowed: 3 or more"):
        changed(booms__inlet__deployment="exclusion")
    assert (
        changed(booms__inlet__deployment="exclusion", booms__inlet__area=[[4, 0], [5, 0], [5, 4]]).booms["inlet"].kind
        == "exclusion"
    )
    assert changed().booms["inlet"].kind == "containment"
    with pytest.raises(ValueError, match=r"criteria.hold is unknown, did you mean 'held'"):
        scenario_from(MOORED | {"criteria": {"hold": {"weight": 2.0}}})


def test_words_on_a_skirt_follow_from_its_particles_and_from_closures() -> None:
    alone = [skirt_in_words(0.25, spacing, has_closures=False) for spacing in (0.1, 0.02, 0.005)]
    closed = [skirt_in_words(0.25, spacing, has_closures=True) for spacing in (0.1, 0.02, 0.005)]
    assert "loss speeds, lost volumes, draft and tension are not to be trusted" in alone[0]
    assert "for most skirts too high" in alone[1]
    assert all("particles alone decide what is lost under it" in words for words in (alone[2], closed[2]))
    assert "droplets are modelled" in skirt_in_words(0.4, 0.02, has_closures=True)
    assert all("the speed of the first loss is modelled" in words for words in closed[:2])


def test_check_says_which_interfacial_tension_is_assumed() -> None:
    """Brent has a measured one in the library, the other oil has none."""
    assumed = "the interfacial tension of 'oil' is not given: 0.02 N/m is assumed"
    assert assumed in estimate(changed(phases__oil__oil="alaska-north-slope")).told
    assert assumed not in estimate(changed()).told
    assert assumed not in estimate(changed(phases__oil__oil="alaska-north-slope", booms__inlet__losses="resolved")).told
    assert assumed in estimate(changed(phases__oil__oil="alaska-north-slope", fidelity="none")).told


@pytest.mark.parametrize(
    ("entries", "driven"),
    [
        ({}, {"driven inlet"}),  # it drives the whole tank
        ({"sea": {"waves": {"height": 0.1, "period": 1.5}}}, {"driven inlet"}),
        ({"sea": {}}, set()),
        ({"tank__zones": {"ahead": {"lower": [0.0, 0.0, 0.0], "upper": [1.0, 4.0, 1.5]}}}, set()),
        ({"tank__zones": {"around": {"lower": [2.0, 0.0, 0.0], "upper": [4.0, 4.0, 1.5]}}}, {"driven inlet"}),
    ],
)
def test_a_boom_in_driven_water_is_told(entries: dict[str, Any], driven: set[str]) -> None:
    """Waves that drive the water inside a boom as well as outside carry its oil over it: 44 of 102 litres in the tow-speed ramp."""
    told = remarks(changed(**entries))
    assert {name for name in told if name.startswith("driven")} == driven
    assert all("a zone (tank.zones)" in told[name] for name in driven)


INLET: dict[str, Any] = {"inlet": {"lower": [0.0, 0.0, 0.0], "upper": [1.0, 4.0, 1.5]}}


@pytest.mark.parametrize(
    ("velocity", "told"),
    [
        (None, "fill.sea starts at 0.00 kn along the current"),
        ([0.21, 0.0, 0.0], "fill.sea starts at 0.41 kn along the current"),
        ([-0.3, 0.0, 0.0], "fill.sea starts at -0.58 kn along the current"),
        ([0.23, 0.0, 0.0], None),  # 20 % of 0.3 m/s and 0.02 m/s off are fine
        ([0.3, 0.0, 0.0], None),
    ],
)
def test_water_that_starts_without_the_current_of_a_zone_is_told(
    velocity: list[float] | None, told: str | None
) -> None:
    """Closures take the ordered current everywhere from the start, though it drives the water in its zone only."""
    water = MOORED["fill"]["sea"] | ({} if velocity is None else {"velocity": velocity})
    scenario = changed(tank__zones=INLET, fill__sea=water)
    found = remarks(scenario).get("start")
    if told is None:
        assert found is None
        return
    assert found is not None and told in found and "the closures take its 0.58 kn from the start" in found
    assert found.endswith("Start it with fill.sea.velocity = [0.3, 0, 0]")
    assert found in estimate(scenario).told


def test_water_at_the_start_is_told_only_where_closures_go_by_a_current_in_a_zone() -> None:
    assert "start" not in remarks(changed())  # a current through the whole tank: the water starts with it
    assert "start" not in remarks(changed(tank__zones=INLET, booms__inlet__losses="resolved"))
    assert "start" not in remarks(changed(sea={}))
