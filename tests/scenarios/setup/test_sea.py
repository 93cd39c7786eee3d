"""The table [sea] and its files of winds and currents: values as in the file, and one error with every problem."""

from __future__ import annotations

import json
import math
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from scipy.constants import knot
from scipy.io import netcdf_file

from oilsim.sea import JonswapWaves, RegularWaves, Sea
from scenarios.cli import main
from scenarios.running.exercise_fmu import SCENARIO_FILE, exercise_content
from scenarios.setup.at_sea.build_sea import build_sea
from scenarios.setup.at_sea.flow_columns import FlowFileError
from scenarios.setup.at_sea.flow_files import read_flow, seconds_of
from scenarios.setup.layout import lay_out
from scenarios.spec.load import load_scenario
from scenarios.spec.resolve import resolve
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import ScenarioError

BASIC = """
name = "bay"
[run]
duration = 600.0
communication_step = 1.0
seed = 7
[fluid]
particle_spacing = 0.1
[phases.water]
density = 1000.0
dynamic_viscosity = 1e-3
[tank]
lower = [0.0, 0.0, 0.0]
upper = [0.8, 0.8, 0.8]
[fill.pool]
shape = "slab"
phase = "water"
bottom = 0.0
top = 0.3
"""
SEA = """
[sea]
depth = 12.0
diffusivity = 0.5
[sea.waves]
kind = "jonswap"
significant_height = 0.5
peak_period = 3.0
direction_deg = 90.0
spread = 10.0
build_up = 40.0
[sea.current]
kind = "tide"
speed_kn = 1.0
turn = 100.0
shear_exponent = 0.14
[sea.wind]
kind = "steady"
speed = 8.0
direction_deg = 90.0
gust_intensity = 0.12
[sea.langmuir]
spacing = 8.0
"""
SITE = """
[site]
latitude = 60.0
longitude = 5.0
bearing = 0.0
start = "2026-05-01T08:00:00Z"
"""
START = datetime(2026, 5, 1, 8, tzinfo=UTC)


def sea_of(scenario: Scenario) -> Sea:
    """Build the sea of a scenario, on water up to 0 m where it says nothing."""
    spec = resolve(scenario)
    return build_sea(spec.sea_at(0.0), spec)


def scenario_of(folder: Path, text: str):
    (folder / "bay.toml").write_text(BASIC + text)
    return load_scenario(folder / "bay.toml").scenario


def test_a_sea_is_as_its_table_says(tmp_path):
    sea = sea_of(scenario_of(tmp_path, SEA))
    told = sea.description
    assert told.depth == 12.0
    assert told.waves == JonswapWaves(
        significant_height=0.5, peak_period=3.0, direction=0.5 * math.pi, spread=10.0, seed=7
    )
    assert sea.current(0.0, 100.0 + 6.21 * 1800)[0] == pytest.approx(knot)
    assert told.current.shear_exponent == 0.14
    assert sea.mean_wind(5.0) == pytest.approx((0.0, 8.0))
    assert (told.wind.gusts.intensity, told.wind.gusts.seed) == (0.12, 7)
    assert told.build_up == 40.0
    assert (told.langmuir.spacing, told.langmuir.seed) == (8.0, 7)
    assert told.diffusivity == 0.5


def test_the_sea_of_a_tank_is_as_deep_as_its_water(tmp_path):
    scenario = scenario_of(tmp_path, "")
    for changes, told in (({}, (0.3, 0.3)), ({"level": 0.25}, (0.25, 0.25)), ({"depth": 8.0}, (0.3, 8.0))):
        sea = lay_out(resolve(replace(scenario, sea=replace(scenario.sea, **changes)))).sea
        assert (sea.level, sea.description.depth) == pytest.approx(told)


def test_a_regular_wave(tmp_path):
    text = '[sea]\ndepth = 5.0\n[sea.waves]\nkind = "regular"\nheight = 0.4\nperiod = 4.0\n'
    sea = sea_of(scenario_of(tmp_path, text))
    assert sea.description.waves == RegularWaves(height=0.4, period=4.0)


@pytest.mark.parametrize(
    ("header", "rows"),
    [
        ("time [s], x_velocity [m/s], y_velocity [m/s]", ["0, 0, 4", "600, -2, 0"]),
        ("time [min], speed [m/s], direction [deg]", ["0, 4, 90", "10, 2, 180"]),
        # the x axis points north: from 90 degrees is to the west, which is +y; from north is to the south, -x
        ("time [h], speed [kn], from_direction [degrees]", [f"0, {4 / knot}, 90", f"{1 / 6}, {2 / knot}, 0"]),
        ("time [s], speed [km/h], to_direction [deg]", ["0, 14.4, 270", "600, 7.2, 180"]),
        ("time [s], eastward_velocity [m/s], northward_velocity [m/s]", ["0, -4, 0", "600, 0, -2"]),
        (
            "time [UTC], x_velocity [m/s], y_velocity [m/s]",
            ["2026-05-01T08:00:00Z, 0, 4", "2026-05-01T10:10:00+02:00, -2, 0"],
        ),
    ],
)
def test_columns_of_all_kinds_give_the_same_wind(tmp_path, header, rows):
    (tmp_path / "wind.csv").write_text("\n".join(["# a comment", header, *rows, ""]))
    sea = sea_of(scenario_of(tmp_path, '[sea]\ndepth = 5.0\n[sea.wind]\nkind = "file"\nfile = "wind.csv"\n' + SITE))
    assert sea.mean_wind(0.0) == pytest.approx((0.0, 4.0), abs=1e-9)
    assert sea.mean_wind(300.0) == pytest.approx((-1.0, 2.0), abs=1e-9)
    assert sea.mean_wind(600.0) == pytest.approx((-2.0, 0.0), abs=1e-9)


def write_netcdf(
    path, time, units="hours since 2026-05-01 08:00:00", calendar="standard", speed_units="m s-1", fill=False
):
    with netcdf_file(path, "w") as file:
        file.createDimension("time", len(time))
        file.createDimension("station", 1)
        axis = file.createVariable("t", "d", ("time",))
        axis[:] = time
        axis.units, axis.standard_name, axis.calendar = units, "time", calendar
        for name, standard, values in (("u10", "eastward_wind", (-40, 0)), ("v10", "northward_wind", (0, -20))):
            variable = file.createVariable(name, "h", ("time", "station"))
            variable[:] = np.array(values, "i2")[:, None]
            variable.units, variable.standard_name, variable.scale_factor = speed_units, standard, 0.1
            if fill:
                variable._FillValue = np.int16(-20)
        file.createVariable("temperature", "d", ("time",)).standard_name = "air_temperature"


def test_a_netcdf_file_gives_the_same_wind(tmp_path):
    # its attribute scale_factor has single precision
    write_netcdf(tmp_path / "wind.nc", [0.0, 1 / 6])
    sea = sea_of(scenario_of(tmp_path, '[sea]\ndepth = 5.0\n[sea.wind]\nkind = "file"\nfile = "wind.nc"\n' + SITE))
    assert sea.mean_wind(300.0) == pytest.approx((-1.0, 2.0), abs=1e-6)


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"units": "hours"}, r"variable 't' has the unit 'hours', allowed: as 'hours since 2026-05-01 00:00:00'"),
        ({"units": "weeks since 2026-05-01"}, r"variable 't' has the unit 'weeks', allowed: s, min, h, d"),
        ({"units": "hours since May"}, r"counts from 'May', allowed: a date after ISO 8601"),
        ({"calendar": "360_day"}, r"has the calendar '360_day', allowed: standard, gregorian"),
        ({"speed_units": "furlong"}, r"variable 'u10' has the unit 'furlong', allowed: m/s, km/h, kn; variable 'v10'"),
        ({"fill": True}, r"variable 'v10' is nan m s-1 in row 1, allowed: .* no empty values"),
        ({"calendar": "none"}, r"has the calendar 'none', allowed: standard, .* no dates of the real world"),
        (
            {"units": "days since 1582-10-10"},
            r"counts from '1582-10-10', allowed: a date that the calendar 'standard' has",
        ),
        ({"units": "days since 0000-01-01"}, r"allowed: a date that the calendar 'standard' has"),
    ],
)
def test_netcdf_files_that_cannot_be_used_are_refused(tmp_path, given, text):
    write_netcdf(tmp_path / "wind.nc", [0.0, 1 / 6], **given)
    with pytest.raises(FlowFileError, match=text):
        read_flow(tmp_path / "wind.nc", "wind", start=START, bearing=0.0)


def test_a_damaged_netcdf_file_is_refused_in_words(tmp_path):
    """Whichever of its bytes is lost, it gives a table or a reason: scipy ends in errors of Python of many types."""
    write_netcdf(tmp_path / "wind.nc", [0.0, 1 / 6])
    whole, told = (tmp_path / "wind.nc").read_bytes(), set()
    for place in range(3, len(whole), 3):
        for spoiled in (
            whole[:place],
            whole[:place] + b"\x7f" + whole[place + 1 :],
            whole[:place] + whole[place + 1 :],
        ):
            (tmp_path / "wind.nc").write_bytes(spoiled)
            with suppress(FlowFileError):
                read_flow(tmp_path / "wind.nc", "wind", start=START, bearing=0.0)
                continue
            told.add(place)
    assert len(told) > len(whole) / 6  # the header is refused everywhere
    (tmp_path / "wind.nc").write_bytes(whole[:60])
    with pytest.raises(FlowFileError, match="is a damaged NetCDF file, allowed: a whole one"):
        read_flow(tmp_path / "wind.nc", "wind", start=START, bearing=0.0)


def test_an_entry_of_a_csv_without_an_end_is_refused_in_words(tmp_path):
    (tmp_path / "wind.csv").write_text('time [h], speed [kn], direction [deg]\n0,1,0\n"' + "1" * 200_000)
    with pytest.raises(FlowFileError, match="cannot be read: field larger than field limit"):
        read_flow(tmp_path / "wind.csv", "wind", start=START, bearing=0.0)


def test_other_netcdf_files_are_refused(tmp_path):
    (tmp_path / "four.nc").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(100))
    with pytest.raises(
        FlowFileError, match=r"is NetCDF-4 \(HDF5\), allowed: classic NetCDF; convert it with `nccopy -k classic"
    ):
        read_flow(tmp_path / "four.nc", "wind", start=START, bearing=0.0)
    (tmp_path / "none.nc").write_bytes(b"time, speed")
    with pytest.raises(FlowFileError, match="is no NetCDF file"):
        read_flow(tmp_path / "none.nc", "wind", start=START, bearing=0.0)
    write_netcdf(tmp_path / "wind.nc", [0.0, 1.0])
    with pytest.raises(FlowFileError, match=r"has dates, allowed: only with .site. start"):
        read_flow(tmp_path / "wind.nc", "wind", start=None, bearing=0.0)
    with pytest.raises(
        FlowFileError, match="too few variables, allowed: standard names time and a pair of eastward_sea_water"
    ):
        read_flow(tmp_path / "wind.nc", "current", start=START, bearing=0.0)


@pytest.mark.parametrize(
    ("lines", "text"),
    [
        (["time [s], speed, direction [deg]", "0, 1, 0", "1, 1, 0"], r"column 'speed' has no unit, allowed: m/s, km/h, kn"),
        (["time [s], speed [m], direction [deg]", "0, 1, 0", "1, 1, 0"], r"column 'speed' has the unit 'm', allowed: m/s"),
        (["time [s], speed [m/s]", "0, 1", "1, 1"], r"has the columns speed beside time, allowed: one pair of x_velocity and"),
        (["speed [m/s], direction [deg]", "1, 0", "1, 1"], r"has no column time"),
        (["time [s], wind [m/s], direction [deg]", "0, 1, 0", "1, 1, 0"], r"has 'wind' in its header, which is no known column"),
        (["time [s], speed [m/s], direction [deg]", "0, 1, 0", "1, , 0"], r"column 'speed' has '' in line 3, allowed: a finite number"),
        (["time [s], speed [m/s], direction [deg]", "0, 1, 0", "1, -2, 0"], r"column 'speed' is -2 m/s in line 3, allowed: 0 or more"),
        (["time [s], speed [m/s], from_direction [deg]", "0, 99, 90", "1, 2, 0"], r"'speed' is 99 m/s in line 2, .* marks"),
        (["time [s], speed [cm/s], from_direction [deg]", "0, 9, 90", "1, 999, 0"], r"column 'speed' is 999 cm/s in line 3"),
        (["time [s], speed [m/s], from_direction [deg]", "0, 1, 999", "1, 2, 0"], r"'from_direction' is 999 deg in line 2"),
        (["time [s], x_velocity [m/s], y_velocity [m/s]", "0, 1, -9999", "1, 2, -9999"], r"'y_velocity' is -9999 m/s in line 2"),
        (["time [s], speed [m/s], direction [deg]", "0, nan, 0", "1, 2, 0"], r"'speed' has 'nan' in line 2, allowed: a finite number"),
        (["time [s], speed [m/s], direction [deg]", "0, 120, 0", "1, 2, 0"], r"'speed' is 120 m/s in line 2, allowed: up to 100 m/s"),
        (["time [s], speed [m/s], direction [deg]", "5, 1, 0", "1, 2, 0"], r"time goes from 5 s to 1 s at row 1, allowed: times that rise"),
        (
            ["time [min], speed [m/s], direction [deg]", "0, 1, 0", "1, 2, 0", "2, 2, 0", "9, 2, 0"],
            r"a gap of 420 s follows 120 s, allowed: intervals up to 150 s",
        ),
        (["time [s], speed [m/s], direction [deg]", "0, 1, 0", "1, 2"], r"has 2 entries in line 3, allowed: 3, as in the header"),
        (["time [s], speed [m/s], direction [deg]", "0, 1, 0"], r"has 1 rows, allowed: a header and 2 rows or more"),
        (["time [UTC], speed [m/s], direction [deg]", "noon, 1, 0", "x, 2, 0"], r"'noon' in line 2 and 1 more, allowed: a date"),
    ],
)  # fmt: skip
def test_tables_that_cannot_be_used_are_refused(tmp_path, lines, text):
    (tmp_path / "wind.csv").write_text("\n".join(lines))
    with pytest.raises(FlowFileError, match=text):
        read_flow(tmp_path / "wind.csv", "wind", start=START, bearing=0.0)


def test_all_problems_are_told_at_once_with_their_places(tmp_path, capsys):
    (tmp_path / "wind.csv").write_text("time [s], speed [furlong], direction [turns]\n0, 1, 0\n600, 1, 0\n")
    (tmp_path / "tide.csv").write_text("time [s], speed [m/s], direction [deg]\n0, 1, 0\n500, 1, 0\n")
    files = '[sea.wind]\nkind = "file"\nfile = "wind.csv"\n[sea.current]\nkind = "file"\nfile = "tide.csv"\n'
    steep = '[sea]\ndepth = 5.0\n[sea.waves]\nkind = "regular"\nheight = 3.0\nperiod = 3.0\n'
    with pytest.raises(ScenarioError) as error:
        lay_out(resolve(scenario_of(tmp_path, steep + files)))
    told = [str(problem) for problem in error.value.problems]
    assert told == [
        "sea.current.file tide.csv: holds the times from 0 to 500 s, allowed: a file that holds the run, from 0 to 600 s",
        "sea.wind.file wind.csv: column 'speed' has the unit 'furlong', allowed: m/s, km/h, kn",
        "sea.wind.file wind.csv: column 'direction' has the unit 'turns', allowed: deg, rad",
        "sea.waves height is 3 m, allowed: below 1.914 m, where waves of 13.76 m break in water of 5 m (Miche 1944)",
    ]
    assert main(["check", str(tmp_path / "bay.toml")]) == 2
    printed = capsys.readouterr()
    assert "4 problems" in printed.err + printed.out
    assert all(problem.split(" ", 1)[0] in printed.err + printed.out for problem in told)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[sea]\ndepth = -1.0", r"sea.depth is -1.0, allowed: above 0"),
        ('[sea]\ndepth = 5.0\n[sea.waves]\nkind = "cnoidal"', r"sea.waves.kind is 'cnoidal', allowed: 'regular', 'jonswap'"),
        ("[sea]\ndepth = 5.0\n[sea.langmuir]", r"sea.langmuir is given, allowed: only with wind"),
        (
            '[sea]\ndepth = 5.0\n[sea.waves]\nkind = "regular"\nheight = 0.1\nperiod = 3.0\nseen_from = "ground"\n'
            '[sea.current]\nkind = "tide"\nspeed = 0.5',
            r"sea.waves.seen_from is 'ground', allowed: 'water' on a current that changes with time",
        ),
    ],
)  # fmt: skip
def test_impossible_tables_are_refused(tmp_path, text, told):
    with pytest.raises(ScenarioError, match=told):
        scenario_of(tmp_path, text)


def test_a_missing_file_is_named(tmp_path):
    for name, told in (
        ("gone.csv", "cannot be read: .*gone.csv"),
        ("wind.xls", "is 'wind.xls', allowed: a file of the kind .csv, .nc"),
    ):
        scenario = scenario_of(tmp_path, f'[sea]\ndepth = 5.0\n[sea.wind]\nkind = "file"\nfile = "{name}"\n')
        with pytest.raises(ScenarioError, match=rf"sea.wind.file {name}: {told}"):
            sea_of(scenario)


def test_the_fmu_of_an_exercise_takes_the_files_along(tmp_path):
    (tmp_path / "wind.csv").write_text("time [s], speed [m/s], direction [deg]\n0, 1, 0\n600, 1, 0\n")
    scenario = scenario_of(tmp_path, '[sea]\ndepth = 5.0\n[sea.wind]\nkind = "file"\nfile = "wind.csv"\n')
    content = exercise_content(scenario)
    assert content.files == {"sea-wind.csv": tmp_path / "wind.csv"}
    assert json.loads(content.texts[SCENARIO_FILE])["sea"]["wind"]["file"] == "sea-wind.csv"


def test_dates_count_from_the_start_of_the_run(tmp_path):
    dates = [START + timedelta(seconds=seconds) for seconds in (-600, 0, 600)]
    rows = [f"{date:%Y-%m-%dT%H:%M:%S}, {speed}, 0" for date, speed in zip(dates, (1, 2, 3), strict=True)]
    (tmp_path / "wind.csv").write_text("\n".join(["time [UTC], speed [m/s], direction [deg]", *rows]))
    table = read_flow(tmp_path / "wind.csv", "wind", start=START, bearing=0.0)
    assert table.time == pytest.approx([-600.0, 0.0, 600.0])


@pytest.mark.parametrize(
    ("tables", "told"),
    [
        (
            "[sea.tide]\nturns = [[0, 6], [300, 0], [600, 6]]\n",
            "sea.tide falls by 6 m within the run, allowed: less than the depth, 5 m",
        ),
        (
            "[sea.tide]\nturns = [[0, 4], [300, 0], [600, 4]]\n[sea.waves]\nheight = 1.0\nperiod = 4.0\n",
            "sea.waves at low water, height is 1 m, allowed: below 0.",
        ),
        (
            "[sea.tide]\nturns = [[0, 4], [300, 0], [600, 4]]\n[sea.current]\nspeed = 3.2\n",
            "sea.current reaches 3.2 m/s, allowed: below 3.132 m/s, the speed of long waves in water of 1 m",
        ),
        (
            "[sea.waves]\nheight = 0.2\nperiod = 2.0\n[sea.current]\nspeed = 1.6\ndirection_deg = 180.0\n",
            "sea.waves of 2 s run at 1.56",
        ),
    ],
)
def test_the_settings_of_a_sea_are_checked_together(tmp_path, tables, told):
    """Water of 5 m: a tide that lays it dry, waves that break at low water, a stream faster than long waves, waves that are swept back."""
    text = BASIC.partition("[tank]")[0] + "[sea]\ndepth = 5.0\n"
    (tmp_path / "bay.toml").write_text(text + tables)
    with pytest.raises(ScenarioError) as error:
        lay_out(resolve(load_scenario(tmp_path / "bay.toml").scenario))
    assert told in str(error.value)


def test_a_tide_counts_as_far_as_the_run_goes(tmp_path):
    """A spring tide of 10 m in water of 3 m, of which a run of ten minutes sees 0.4 m."""
    text = BASIC.partition("[tank]")[0] + "[sea]\ndepth = 3.0\n[sea.tide]\nturns = [[-11178, 10], [11178, 0]]\n"
    (tmp_path / "bay.toml").write_text(text)
    assert lay_out(resolve(load_scenario(tmp_path / "bay.toml").scenario)).sea.rise(600.0) == pytest.approx(
        -0.42, abs=0.01
    )


@pytest.mark.parametrize(
    ("text", "calendar", "days"),
    [
        ("1-1-1 00:00:0.0", "", 739738.0),  # of the mixed calendar: two days more than
        ("0001-01-01", "proleptic_gregorian", 739736.0),
        ("1582-10-04", "gregorian", 162002.0),  # the day before
        ("1582-10-15T00:00:00Z", "standard", 162001.0),
        ("1990-1-1", "standard", 13269.0),
        ("2026-04-18", "julian", 0.0),  # 13 days behind
        ("2026-05-01 02:00 +2:00", "standard", 0.0),
        ("2026-04-30 18:30:00.0 -05:30", "standard", 0.0),
    ],
)
def test_dates_are_read_in_their_calendar(text, calendar, days):
    """From each to 1 May 2026; reference: cftime 1.6."""
    start = seconds_of("2026-05-01T00:00:00+00:00", "proleptic_gregorian")
    assert (start - seconds_of(text, calendar)) / 86400.0 == days


def test_a_netcdf_file_of_the_mixed_calendar_counts_by_it(tmp_path):
    """Hours since year 1 without a calendar, as many models of the ocean have them."""
    hours = 739738 * 24 + 8
    write_netcdf(tmp_path / "wind.nc", [hours, hours + 1 / 6], units="hours since 1-1-1 00:00:0.0", calendar="")
    table = read_flow(tmp_path / "wind.nc", "wind", start=START, bearing=0.0)
    assert table.time == pytest.approx([0.0, 600.0], abs=0.01)
