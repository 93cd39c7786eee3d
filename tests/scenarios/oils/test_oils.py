"""The library of oils: formulas by hand, a clean table, and errors that name what is near."""

from __future__ import annotations

import csv
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import theilslopes

from scenarios.cli import main
from scenarios.oils.library import SHORT_NAMES, fault_of, library, oil_named, refusals, search
from scenarios.oils.properties import Measurement, OilRecord, api_density, api_gravity, emulsion_factor
from scenarios.schema.liquid import PhaseSettings
from scenarios.text.problems import ScenarioError
from tests.scenarios.oils.adios_import import DENSITIES, SHIPPED, TENSIONS, read_library


def oil(*measurements: Measurement, api: float | None = None) -> OilRecord:
    return OilRecord(
        record="T1",
        name="TEST",
        location="",
        product="crude",
        reference="",
        api=api,
        pour_point=None,
        interfacial_tension=None,
        measurements=measurements,
    )


TWICE = (Measurement("density", 273.15, 0.0, 910.0), Measurement("density", 293.15, 0.0, 896.0))
THIN = (Measurement("viscosity", 273.15, 0.0, 1e-4), Measurement("viscosity", 293.15, 0.0, 4e-5))


def test_density_is_linear_and_viscosity_exponential_in_the_inverse_temperature() -> None:
    found = oil(*TWICE, *THIN)
    assert found.density_at(10.0) == pytest.approx(903.0)
    assert found.density_at(30.0) == pytest.approx(889.0)  # 0.7 kg/m3 a degree goes on
    slope = math.log(1e-4 / 4e-5) / (1.0 / 273.15 - 1.0 / 293.15)
    assert found.viscosity_slope == pytest.approx(slope)
    for degrees in (-1.0, 10.0, 35.0):
        expected = 1e-4 * math.exp(slope * (1.0 / (degrees + 273.15) - 1.0 / 273.15))
        assert found.kinematic_viscosity_at(degrees) == pytest.approx(expected, rel=1e-12)
        assert found.viscosity_at(degrees) == pytest.approx(expected * found.density_at(degrees), rel=1e-12)


def test_one_viscosity_is_carried_by_the_slope_of_the_library() -> None:
    """B = 14070 + 2130 log10(nu_15), where nu_15 itself comes from B: 1e-5 m2/s at 15 C gives 3420 K."""
    at_15 = oil(*TWICE, Measurement("viscosity", 288.15, 0.0, 1e-5))
    assert at_15.viscosity_slope == pytest.approx(3420.0)
    elsewhere = oil(*TWICE, Measurement("viscosity", 311.15, 0.0, at_15.kinematic_viscosity_at(38.0)))
    assert elsewhere.viscosity_slope == pytest.approx(3420.0)
    assert elsewhere.kinematic_viscosity_at(15.0) == pytest.approx(1e-5)


def test_the_slope_of_the_library_is_fitted_to_its_oils() -> None:
    several = [found for found in library().values() if len(found.temperatures("viscosity")) > 1]
    misses = sorted(
        abs(found.viscosity_slope - 14070.0 - 2130.0 * math.log10(found.kinematic_viscosity_at(15.0)))
        for found in several
    )
    assert len(several) > 600
    assert misses[len(misses) // 2] < 1000.0
    assert misses[int(0.9 * len(misses))] < 3200.0


def test_the_usual_gain_of_viscosity_is_fitted_to_the_weathered_samples() -> None:
    """And every record with samples of its own is within a factor of 1.6 at the median of them, where one law for all misses by more."""
    sampled = [found for found in library().values() if found.own_gain("viscosity")]
    assert len(sampled) == 115
    gravity, gain = np.array([(found.gravity, found.viscosity_gain) for found in sampled]).T
    slope, offset, *_ = theilslopes(gain, gravity)
    assert (offset, slope) == (pytest.approx(27.1, abs=0.05), pytest.approx(-0.510, abs=0.0005))
    misses = [
        abs(math.log(point.value / found.kinematic_viscosity_at(kelvin - 273.15, evaporated=point.evaporated)))
        for found in sampled
        for point in found.measurements
        if point.quantity == "viscosity" and point.evaporated > 0.0 and (kelvin := point.temperature)
    ]
    assert np.median(misses) < math.log(1.6)


def test_records_of_the_same_oil_lend_their_weathered_samples() -> None:
    """Left out one by one, a record's own samples are nearer to those of its relatives than to the law for all (1.7 against 5.5 of C_v)."""
    by_others, by_law = [], []
    for found in library().values():
        others = tuple(one for one in found.relatives if one.record != found.record and one.own_gain("viscosity"))
        if (own := found.own_gain("viscosity")) and others:
            bare = replace(found, measurements=tuple(one for one in found.measurements if not one.evaporated))
            by_others.append(abs(replace(bare, relatives=others).viscosity_gain - own))
            by_law.append(abs(replace(bare, relatives=()).viscosity_gain - own))
    assert len(by_others) > 20
    assert np.median(by_others) < 0.5 * np.median(by_law)
    slope = library()["AD02574"]  # Alaska North Slope 2011, of which other years were weathered by 0.3
    assert [one.record for one in slope.relatives] == ["AD01986", "AD01987", "AD01988", "AD01990"]
    assert (
        7e-4 < slope.kinematic_viscosity_at(15.0, evaporated=0.3) < 1.4e-3
    )  # 0.8 to 1.1e-3 measured of thinner and thicker ones


def test_weathering_follows_the_records_own_samples_and_mooney() -> None:
    aged = (Measurement("viscosity", 273.15, 0.2, 5e-4), Measurement("density", 273.15, 0.2, 946.4))
    found = oil(*TWICE, *THIN, *aged)
    assert found.viscosity_gain == pytest.approx(math.log(5.0) / 0.2)
    assert found.density_gain == pytest.approx(0.2)
    assert found.density_at(0.0, evaporated=0.1) == pytest.approx(910.0 * 1.02)
    assert found.density_at(0.0, water_content=0.5) == pytest.approx((910.0 + 1027.0) / 2.0, abs=1.5)
    assert emulsion_factor(0.7) == pytest.approx(math.exp(1.75 / 0.545))
    ratio = found.viscosity_at(0.0, evaporated=0.2, water_content=0.7) / found.viscosity_at(0.0, evaporated=0.2)
    assert ratio == pytest.approx(emulsion_factor(0.7))
    assert oil(*TWICE, *THIN).viscosity_gain == pytest.approx(27.1 - 0.510 * oil(*TWICE, *THIN).gravity)
    assert oil(*TWICE, *THIN).density_gain == 0.18


def test_two_densities_that_contradict_thermal_expansion_give_way_to_that_of_crudes() -> None:
    """A density that grows with the temperature, or falls by 10 kg/m3 a degree, is a measuring error."""
    for second in (900.0 + 5.0, 900.0 - 100.0):
        found = oil(Measurement("density", 283.15, 0.0, 900.0), Measurement("density", 293.15, 0.0, second), *THIN)
        assert found.density_at(0.0) == pytest.approx(900.0 + 0.8 * 10.0)


def test_api_gravity_and_density_are_inverse() -> None:
    assert api_density(10.0) == pytest.approx(999.016)
    assert api_gravity(api_density(32.5)) == pytest.approx(32.5)


def test_every_shipped_oil_is_sound() -> None:
    assert len(library()) > 1300
    for found in library().values():
        assert DENSITIES[0] <= found.density_at(15.0) <= DENSITIES[1], found.record
        assert found.density_at(5.0) > found.density_at(25.0) - 2.0, found.record
        assert 1e-7 < found.kinematic_viscosity_at(40.0) < found.kinematic_viscosity_at(0.0) < 1e4, found.record
        assert found.interfacial_tension is None or TENSIONS[0] <= found.interfacial_tension <= TENSIONS[1]
    dropped = {row["record"] for row in refusals() if row["refused"] == "oil"}
    assert len(dropped) > 50
    assert not dropped & set(library())


def test_short_names_give_the_known_values() -> None:
    crude = oil_named("alaska-north-slope")
    assert (crude.density_at(15.0), crude.viscosity_at(15.0)) == pytest.approx((875.0, 1.54e-2))
    assert oil_named("bunker-c").viscosity_at(15.0) == pytest.approx(45.0)
    assert all(oil_named(name).record == record for name, (record, _) in SHORT_NAMES.items())


def test_names_that_are_unclear_are_refused_with_what_is_near() -> None:
    assert "did you mean 'brent'?" in fault_of("brnt")
    assert "names 2 oils, allowed: one record" in fault_of(next(twin for twin in names_of_two()))
    assert "is refused" in fault_of(next(row["record"] for row in refusals() if row["refused"] == "oil"))
    assert [found.record for found in search(["north", "slope", "2011"])] == ["AD02574"]


def names_of_two() -> list[str]:
    names = [found.name for found in library().values()]
    return [name for name in names if names.count(name) == 2]


def test_a_phase_takes_its_values_from_the_library_unless_it_states_them() -> None:
    state = {"temperature": 5.0, "evaporated": 0.1, "water_content": 0.4}
    phase = PhaseSettings(oil="AD00730", density=950.0, **state)
    named = oil_named("maya")
    assert phase.rest_density == 950.0
    assert phase.viscosity == named.viscosity_at(5.0, evaporated=0.1, water_content=0.4)
    assert phase.tension == named.interfacial_tension == pytest.approx(0.027)
    with pytest.raises(ScenarioError) as found:
        PhaseSettings(density=900.0, dynamic_viscosity=0.1, temperature=0.0, evaporated=0.1, water_content=0.2)
    assert [problem.path for problem in found.value.problems] == ["temperature", "evaporated", "water_content"]


def imported(folder: Path, rows: list[dict[str, str]]) -> tuple[list[OilRecord], list[tuple[str, str, str, str]]]:
    """Import a library of these rows; a column that a row does not name is empty."""
    heads = ["Oil_Name", "ADIOS_Oil_ID", "Location", "Reference", "API", "Pour_Point_Max_K", "Product_Type"]
    heads += [f"Oil_{water}_Interfacial_Tension_N_m" for water in ("Water", "SeaWater")]
    kinds = {"Density": ("_Kg_m_3", 4), "KVis": ("_m_2_s", 6), "DVis": ("_kg_ms", 6)}
    for stem, (unit, count) in kinds.items():
        for number in range(1, count + 1):
            heads += [f"{stem}{number}{unit}", f"{stem}{number}_Ref_Temp_K", f"{stem}{number}_Weathering"]
    lines = ["5\t9/20/2017\tadios", "\t".join(heads), *("\t".join(row.get(head, "") for head in heads) for row in rows)]
    (folder / "lib.txt").write_text("\n".join(lines), encoding="utf-8")
    return read_library(folder / "lib.txt")


SOUND = {"Oil_Name": "SOUND", "ADIOS_Oil_ID": "AD1", "API": "30", "KVis1_m_2_s": "1e-5", "KVis1_Ref_Temp_K": "288"}


def test_import_takes_sound_rows_and_says_why_it_refuses_others(tmp_path: Path) -> None:
    rows = [
        SOUND | {"Oil_Water_Interfacial_Tension_N_m": "25"},  # mN/m
        SOUND | {"ADIOS_Oil_ID": "AD2", "Density1_Kg_m_3": "0.876", "Density1_Ref_Temp_K": "288"},  # g/cm3
        SOUND | {"ADIOS_Oil_ID": "AD3", "KVis1_Ref_Temp_K": "15"},  # degrees C
        SOUND | {"ADIOS_Oil_ID": "AD4", "Density1_Kg_m_3": "980", "Density1_Ref_Temp_K": "288"},
        SOUND | {"ADIOS_Oil_ID": "AD5", "KVis2_m_2_s": "2e-5", "KVis2_Ref_Temp_K": "311"},
        SOUND | {"ADIOS_Oil_ID": "AD6", "KVis1_m_2_s": "0.1"},  # a thousand times that of an oil of API 30
        SOUND | {"ADIOS_Oil_ID": "AD7", "KVis1_m_2_s": "2e-3"},  # two hundred times that of AD1, the same oil
    ]
    kept, refused = imported(tmp_path, rows)
    assert [found.record for found in kept] == ["AD1", "AD2"]
    assert kept[0].interfacial_tension is None
    assert kept[0].temperatures("viscosity") == (15.0,)
    told = {record: (what, reason) for record, _, what, reason in refused if what == "oil"}
    assert "no viscosity" in told["AD3"][1]
    assert "contradicts API gravity 30" in told["AD4"][1]
    assert "rises with temperature" in told["AD5"][1]
    assert "contradicts API gravity 30: a slipped digit" in told["AD6"][1]
    assert "contradicts 1e-05 of AD1, the same oil" in told["AD7"][1]
    assert {(record, what) for record, _, what, _ in refused} >= {("AD1", "value"), ("AD2", "value"), ("AD3", "value")}


def reasons_for(folder: Path, column: str, value: str) -> list[str]:
    """Tell why an import refuses `value` in this column of a sound row; empty where it takes it."""
    needed = {f"{column.rpartition('1_')[0]}1_Ref_Temp_K": "288"} if "1_" in column and "Temp" not in column else {}
    return [reason for _, _, what, reason in imported(folder, [SOUND | needed | {column: value}])[1] if what == "value"]


@pytest.mark.parametrize(
    ("column", "lowest", "highest"),
    [
        ("Density1_Kg_m_3", 600.0, 1100.0),
        ("KVis1_m_2_s", 1e-7, 10.0),  # 0.1 to 10 million centistokes
        ("DVis1_kg_ms", 600.0 * 1e-7, 1000.0 * 10.0),  # the same, with the least density and about that of bitumen
        ("Oil_SeaWater_Interfacial_Tension_N_m", 1e-3, 0.06),
        ("Pour_Point_Max_K", 190.0, 350.0),
        ("KVis1_Ref_Temp_K", 250.0, 400.0),
    ],
)
def test_import_takes_what_lies_within_the_limits_and_refuses_what_lies_outside(
    tmp_path: Path, column: str, lowest: float, highest: float
) -> None:
    for value in (lowest, highest):
        assert reasons_for(tmp_path, column, f"{value:.10g}") == []
    for value in (0.97 * lowest, 1.03 * highest):
        (reason,) = reasons_for(tmp_path, column, f"{value:.10g}")
        assert f"allowed: {lowest:g} to {highest:g}" in reason


def test_import_takes_samples_weathered_by_less_than_nine_tenths(tmp_path: Path) -> None:
    assert reasons_for(tmp_path, "KVis1_Weathering", "0.89") == []
    for value in ("0.9", "-0.01", "25"):
        (reason,) = reasons_for(tmp_path, "KVis1_Weathering", value)
        assert "allowed: 0 to 0.9" in reason


def test_import_divides_a_dynamic_viscosity_by_the_density_nearest_to_its_temperature(tmp_path: Path) -> None:
    row = SOUND | {"KVis1_m_2_s": "", "DVis1_kg_ms": "0.0873", "DVis1_Ref_Temp_K": "288"}
    dense = {
        "Density1_Kg_m_3": "882",
        "Density1_Ref_Temp_K": "273",
        "Density2_Kg_m_3": "873",
        "Density2_Ref_Temp_K": "288",
    }
    ((both,), _), ((by_gravity,), _) = imported(tmp_path, [row | dense]), imported(tmp_path, [row])
    assert both.kinematic_viscosity_at(15.0) == pytest.approx(1e-4, rel=2e-3)
    assert by_gravity.kinematic_viscosity_at(15.0) == pytest.approx(0.0873 / api_density(30.0), rel=2e-3)


def test_command_shows_lists_and_cards(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["oils", "maya", "--temperature", "5", "--water", "0.6"]) == 0
    card = capsys.readouterr().out
    assert "°API" in card
    assert "cSt" in card
    assert "Mooney" in card
    assert main(["oils", "bunker", "c"]) == 0
    assert "AD02051" in capsys.readouterr().out
    assert main(["oils", "maya", "--water", "2"]) == 2
    assert "--water is 2.0, allowed: 0 or more and at most 0.9" in capsys.readouterr().err
    assert main(["oils", "whisky"]) == 2
    assert "'whisky', which no oil of the library has" in capsys.readouterr().err


def test_the_card_of_an_evaporated_oil_follows_its_laws(capsys: pytest.CaptureFixture[str]) -> None:
    """Density x (1 + a F); viscosity x exp(b F), kinematic, so that the dynamic one grows with the density too."""
    cards = []
    for share in ("0", "0.2"):
        assert main(["oils", "maya", "--evaporated", share]) == 0
        cards.append(capsys.readouterr().out)
    assert "15 °C, 0% evaporated, 0% water" in cards[0] and "15 °C, 20% evaporated, 0% water" in cards[1]
    number = r"([\d.e+]+)"
    gains = [float(re.search(rf"{law} ?{number} F\)", cards[1])[1]) for law in (r"x \(1 \+", r"x exp\(")]
    (light, fresh), (dense, stiff) = (
        (float(re.search(rf"{number} kg/m3", card)[1]), float(re.search(rf"{number} cSt", card)[1])) for card in cards
    )
    assert dense / light == pytest.approx(1.0 + 0.2 * gains[0], rel=1e-3)
    assert stiff / fresh == pytest.approx(math.exp(0.2 * gains[1]), rel=2e-2)  # the gain is shown with three figures
    assert min(gains) > 0.05


def test_the_command_lists_every_refusal_with_its_reason(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "1000")
    with (SHIPPED / "refused.csv").open(newline="", encoding="utf-8") as file:
        expected = [" ".join(" ".join(row).split()) for row in list(csv.reader(file))[1:]]
    assert main(["oils", "--refused"]) == 0
    lines = [line.split("│")[1:-1] for line in capsys.readouterr().out.splitlines() if line.startswith("│")]
    assert [" ".join(" ".join(line).split()) for line in lines] == expected
    assert "AD00020 ALASKA NORTH SLOPE oil viscosity rises with temperature" in expected
