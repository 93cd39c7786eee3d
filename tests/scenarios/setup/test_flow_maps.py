"""Currents on a grid from NetCDF: what they are between its lines, in time, under orders, and files that are refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.io import netcdf_file

from oilsim.sea import CurrentProfile, FlowTable, Sea, SeaDescription, SteadyFlow
from oilsim.sea.stream import StreamTable
from recordings.model.tangent_plane import longitude_latitude, world_points
from scenarios.schema.run_settings import SiteSettings
from scenarios.setup.at_sea.flow_columns import FlowFileError
from scenarios.setup.at_sea.flow_maps import read_stream
from scenarios.setup.layout import lay_out
from scenarios.spec.load import load_scenario
from scenarios.spec.resolve import resolve
from scenarios.text.problems import ScenarioError
from tests.scenarios.setup.test_land import HARBOUR

SITE = SiteSettings(latitude=57.66, longitude=11.7, bearing=np.radians(250.0), start="2026-05-01T08:00:00Z")
PLACES = np.random.default_rng(3).uniform(-400.0, 400.0, (200, 2))


def linear(places: np.ndarray, time: float) -> np.ndarray:
    """A stream that turns about a place and grows with time: linear in place and time."""
    x, y = places.T
    return (1.0 + time / 600.0) * np.stack([0.3 - 4e-4 * y, 0.1 + 4e-4 * x], axis=-1)


def write(
    path: Path,
    stream=linear,
    *,
    lines: int = 21,
    times=(-600.0, 0.0, 600.0, 1200.0),
    turned=False,
    dry=None,
    **names: str,
) -> Path:
    """Write a stream to the east and the north on `lines` x `lines` + 1 lines of longitude and latitude around the site."""
    corners = np.stack(
        longitude_latitude(SITE.recorded, np.array([[-900.0, -900.0], [900.0, 900.0], [900.0, -900.0]])), axis=-1
    )
    longitude = np.linspace(corners[:, 0].min(), corners[:, 0].max(), lines)
    latitude = np.linspace(corners[:, 1].min(), corners[:, 1].max(), lines + 1)[:: -1 if turned else 1]
    grid = np.stack(np.meshgrid(longitude, latitude, indexing="xy"), axis=-1).reshape(-1, 2)
    places = world_points(SITE.recorded, *grid.T)
    sine, cosine = np.sin(SITE.bearing), np.cos(SITE.bearing)
    with netcdf_file(path, "w") as file:
        for name, axis, unit, size in (
            ("lon", longitude, "degrees_east", lines),
            ("lat", latitude, "degrees_north", lines + 1),
        ):
            file.createDimension(name, size)
            variable = file.createVariable(name, "d", (name,))
            variable[:], variable.units = axis, unit
            variable.standard_name = {"lon": "longitude", "lat": "latitude"}[name]
        file.createDimension("time", len(times))
        file.createDimension("depth", 1)
        clock = file.createVariable("time", "d", ("time",))
        clock[:], clock.units, clock.standard_name = times, "seconds since 2026-05-01 08:00:00", "time"
        values = np.array([stream(places, one) for one in times])
        if dry is not None:
            values[:, dry(places)] = -999.0
        east = values[..., 0] * sine - values[..., 1] * cosine
        north = values[..., 0] * cosine + values[..., 1] * sine
        for name, field in (("eastward", east), ("northward", north)):
            variable = file.createVariable(name, "d", ("time", "depth", "lat", "lon"))
            field = np.where(np.abs(values[..., 0]) > 900.0, -999.0, field)
            variable[:] = field.reshape(len(times), 1, lines + 1, lines)
            variable.units, variable._FillValue = names.get("units", "m s-1"), -999.0
            variable.standard_name = f"surface_{name}_sea_water_velocity"
    return path


def sea_of(table: StreamTable) -> Sea:
    flow = FlowTable(table.time, table.at_origin())
    return Sea(SeaDescription(depth=12.0, current=CurrentProfile(flow=flow), stream=table))


@pytest.mark.parametrize("turned", [False, True])
def test_a_linear_stream_is_found_as_it_was_written(turned: bool, tmp_path: Path) -> None:
    table = read_stream(write(tmp_path / "bay.nc", turned=turned), SITE, 900.0)
    assert table is not None
    sea = sea_of(table)
    for time in (0.0, 250.0, 900.0):
        points = np.column_stack([PLACES, np.full(len(PLACES), -1.0)])
        np.testing.assert_allclose(sea.velocity(points, time)[:, :2], linear(PLACES, time), atol=1e-5)
        np.testing.assert_allclose(sea.current(np.zeros(200), time, PLACES), linear(PLACES, time), atol=1e-5)
        rate = (linear(PLACES, time + 1.0) - linear(PLACES, time)) / 1.0
        np.testing.assert_allclose(sea.acceleration(points, time)[:, :2], rate, atol=1e-8)


def test_a_vortex_converges_by_the_square_of_the_spacing(tmp_path: Path) -> None:
    def vortex(places: np.ndarray, time: float) -> np.ndarray:
        turn = 0.5 * np.exp(-(places**2).sum(axis=1) / 250.0**2)[:, None] * 4e-3
        return 0.2 + turn * places @ [[0.0, 1.0], [-1.0, 0.0]]

    errors = []
    for lines in (11, 21, 41):
        table = read_stream(write(tmp_path / "bay.nc", vortex, lines=lines), SITE, 600.0)
        assert table is not None
        found = sea_of(table).current(np.zeros(200), 300.0, PLACES)
        errors.append(float(np.sqrt(((found - vortex(PLACES, 0.0)) ** 2).mean())))
    assert errors[0] > 3.0 * errors[1] > 9.0 * errors[2]


def test_an_order_shifts_the_whole_stream_and_where_there_is_no_water_nothing_runs(tmp_path: Path) -> None:
    table = read_stream(write(tmp_path / "bay.nc", dry=lambda places: places[:, 0] > 200.0), SITE, 600.0)
    assert table is not None
    sea = sea_of(table)
    ashore, afloat = np.array([[600.0, 0.0]]), np.array([[-300.0, 50.0]])
    assert sea.current(np.zeros(1), 0.0, ashore) == pytest.approx(0.0, abs=1e-12)
    assert np.isfinite(sea.current(np.zeros(200), 0.0, PLACES)).all()
    ordered = replace(sea.description, current=CurrentProfile(flow=SteadyFlow(speed=0.5, direction=0.0)), stream=None)
    after = sea.followed_by(ordered, 0.0, np.zeros(2))
    wanted = linear(afloat, 0.0) - linear(np.zeros((1, 2)), 0.0) + [0.5, 0.0]
    np.testing.assert_allclose(after.current(np.zeros(1), 0.0, afloat), wanted, atol=1e-5)


@pytest.mark.parametrize(
    ("given", "duration", "site", "told"),
    [
        ({}, 900.0, None, r"only with \[site\]"),
        ({}, 5000.0, SITE, "holds the times from -600 to 1200 s, allowed: a file that holds the run, from 0 to 5000 s"),
        ({"units": "furlong"}, 900.0, SITE, "has the unit 'furlong'"),
        ({"times": (0.0, 1200.0, 600.0)}, 900.0, SITE, "times that do not rise"),
        ({"dry": lambda places: np.hypot(*places.T) < 400.0}, 900.0, SITE, r"has no water at the \[site\]"),
        ({}, 900.0, replace(SITE, latitude=20.0), "has a latitude from 57"),
    ],
)
def test_grids_that_cannot_be_used_are_refused(
    given: dict, duration: float, site: SiteSettings | None, told: str, tmp_path: Path
) -> None:
    with pytest.raises(FlowFileError, match=told):
        read_stream(write(tmp_path / "bay.nc", **given), site, duration)


def test_an_exercise_runs_in_a_stream_from_a_file_and_refuses_it_by_its_key(tmp_path: Path) -> None:
    write(tmp_path / "bay.nc")
    current = 'kind = "file"\nfile = "bay.nc"'
    site = '[site]\nlatitude = 57.66\nlongitude = 11.7\nbearing_deg = 250.0\nstart = "2026-05-01T08:00:00Z"\n'
    (tmp_path / "own.toml").write_text(HARBOUR.replace("speed = 0.5\ndirection = 0.0", current, 1) + site)
    layout = lay_out(resolve(load_scenario(tmp_path / "own.toml").scenario))
    np.testing.assert_allclose(layout.sea.current(np.zeros(200), 0.0, PLACES), linear(PLACES, 0.0), atol=1e-5)
    with pytest.raises(ScenarioError, match=r"sea.current.file bay.nc: holds the times"):
        lay_out(resolve(load_scenario(tmp_path / "own.toml", overrides=["run.duration=9000"]).scenario))
