"""Exports open in the programs they are for, and hold what was recorded: places, times, ids, causes, areas."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pyarrow.csv
import pyarrow.parquet
import pytest
import xarray
from scipy.io import netcdf_file
from shapely.geometry import shape

from recordings.export.chosen import every, oil_frames
from recordings.export.geojson import slick_outlines, write_geojson
from recordings.export.netcdf import write_netcdf
from recordings.export.tables import write_tables
from recordings.export.vtk_files import write_vtk
from recordings.files.writing import RecordingError
from recordings.model import palette
from recordings.model.appearance import legend
from recordings.model.exercise import Site
from recordings.model.frame import (
    BodyFrame,
    Event,
    Frame,
    MeshDescription,
    PhaseDescription,
    PhaseFrame,
    RunDescription,
)
from recordings.model.surface import SurfaceFrame
from recordings.model.tangent_plane import longitude_latitude
from recordings.replay.recording import Replay
from recordings.sink.recorder import Recorder

SITE = Site(latitude=45.0, longitude=5.0, bearing=90.0, start="2026-05-01T10:00:00+02:00")
SPACING, SIDE = 0.1, 12
LOST = np.array([7, 8, 20], dtype=np.uint32)
FATES = ("afloat", "contained", "stranded", "recovered", "lost_drainage")


def oil(index: int) -> np.ndarray:
    """A square film that drifts by a metre along x in every frame."""
    x, y = np.meshgrid(np.arange(SIDE) * SPACING, np.arange(SIDE) * SPACING)
    return np.column_stack([x.ravel() + index, y.ravel(), np.full(x.size, 0.25)]).astype(np.float32)


def fates(ids: np.ndarray, lost: bool = True) -> np.ndarray:
    """The last particle is ashore, and three are lost."""
    stuck = np.where(ids == ids[-1], FATES.index("stranded"), 0)
    return np.where(lost & np.isin(ids, LOST), FATES.index("lost_drainage"), stuck).astype(np.uint8)


def frame(index: int) -> Frame:
    ids = np.arange(SIDE * SIDE, dtype=np.uint32)
    kept = slice(None, None if index < 3 else -4)  # four particles leave the tank
    hull = BodyFrame(position=np.array([index, 2.0, 0.0]), orientation=np.array([0.0, 0.0, 0.0, 1.0]))
    return Frame(
        index=index,
        time=0.5 * index,
        bodies={"vessels/port": hull},
        scalars={"oil/spilled": 1.0, "oil/recovered": 0.1 * index, **({"probes/gauge": 3.0} if index == 2 else {})},
        read_phases=lambda: {"oil": PhaseFrame(oil(index)[kept], ids[kept], fate=fates(ids[kept], index >= 2))},
    )


@pytest.fixture(scope="module")
def replay(tmp_path_factory: pytest.TempPathFactory) -> Replay:
    path = tmp_path_factory.mktemp("export") / "film.rrd"
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    hull = MeshDescription(vertices=corners, faces=np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]))
    phase = PhaseDescription(name="oil", is_oil=True, rest_density=900.0, dynamic_viscosity=0.09)
    with Recorder(path, frame_rate=2.0) as recorder:
        recorder.initialized(
            RunDescription(
                name="film", particle_spacing=SPACING, phases=(phase,), meshes={"vessels/port": hull}, fates=FATES
            )
        )
        for index in range(5):
            recorder.step_completed(frame(index))
        recorder.event(Event(1.0, 'it "leaks", here', "warning", "boom main"))
    return Replay(path)


def test_a_degree_at_45_north_is_as_long_as_geodesy_says() -> None:
    """WGS 84 at 45 degrees: 111 131.78 m a degree of latitude, 78 846.84 m a degree of longitude."""
    metres = np.array([[788.46835, 0.0], [0.0, 1111.3178]])  # x is east, y is north
    longitude, latitude = longitude_latitude(SITE, metres)
    np.testing.assert_allclose(longitude, [5.01, 5.0], atol=1e-8)
    np.testing.assert_allclose(latitude, [45.0, 45.01], atol=1e-8)


@pytest.mark.parametrize(("bearing", "north", "east"), [(0.0, 1.0, 0.0), (90.0, 0.0, 1.0), (180.0, -1.0, 0.0)])
def test_the_x_axis_points_along_the_bearing(bearing: float, north: float, east: float) -> None:
    longitude, latitude = longitude_latitude(replace(SITE, bearing=bearing), np.array([[100.0, 0.0, 9.0]]))
    moved = np.array([latitude[0] - 45.0, longitude[0] - 5.0])
    np.testing.assert_allclose(moved, [north * 100.0 / 111131.78, east * 100.0 / 78846.835], atol=1e-10)


def test_dates_are_in_utc() -> None:
    assert SITE.date_at(90.0) == datetime(2026, 5, 1, 8, 1, 30, tzinfo=UTC)


def test_instants_are_at_least_the_interval_apart_and_end_with_the_last() -> None:
    times = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5]
    assert every([0, 1, 2, 3, 4, 5], 0.2, times) == [0, 2, 4, 5]
    assert every([0, 1, 2, 3, 4, 5], None, times) == [0, 1, 2, 3, 4, 5]
    assert every([], 0.2, []) == []


def test_oil_frames_know_which_particles_are_lost(replay: Replay) -> None:
    frames = list(oil_frames(replay, 1.0))
    assert [one.time for one in frames] == [0.0, 1.0, 2.0]
    assert [int((one.fate == FATES.index("lost_drainage")).sum()) for one in frames] == [0, 3, 3]
    assert [int((one.fate == FATES.index("stranded")).sum()) for one in frames] == [1, 1, 1]
    assert [one.ledger["recovered"] for one in frames] == pytest.approx([0.0, 0.2, 0.4])
    assert [one.id.tolist() for one in oil_frames(replay, 1.0, lost_only=True)] == [[], LOST.tolist(), LOST.tolist()]


def test_depths_are_below_the_surface_of_the_instant(tmp_path: Path) -> None:
    """Oil at -0.2 and -0.5 m under a surface that slopes by a tenth and rises by 0.3 m in a second; beyond the grid its edge counts."""
    phase = PhaseDescription(name="oil", is_oil=True, rest_density=900.0, dynamic_viscosity=0.09)
    lines, places = np.linspace(-1.0, 1.0, 9), np.array([[0.5, 0.0, -0.2], [9.0, 0.0, -0.5]], np.float32)
    with Recorder(tmp_path / "oil.rrd", frame_rate=1.0) as recorder:
        recorder.initialized(RunDescription(name="oil", particle_spacing=SPACING, phases=(phase,)))
        for index in range(2):
            height = np.tile(0.1 * lines[:, None] + 0.3 * index, (1, 9)).astype(np.float32)
            surface = SurfaceFrame(x=lines, y=lines, height=height, box=(-1.0, -1.0, 1.0, 1.0))
            oil = PhaseFrame(places, np.arange(2, dtype=np.uint32))
            recorder.step_completed(
                Frame(
                    index=index,
                    time=float(index),
                    read_phases=lambda one=oil: {"oil": one},
                    read_surface=lambda one=surface: one,
                )
            )
    write_netcdf(Replay(tmp_path / "oil.rrd"), tmp_path / "oil.nc", SITE)
    with xarray.open_dataset(tmp_path / "oil.nc") as data:
        assert data.depth.values == pytest.approx([0.25, 0.6, 0.55, 0.9], abs=0.004)


def test_netcdf_opens_in_xarray_with_the_ragged_layout(replay: Replay, tmp_path: Path) -> None:
    assert write_netcdf(replay, tmp_path / "oil.nc", SITE) == 5
    with xarray.open_dataset(tmp_path / "oil.nc") as data:
        counts = data.particle_count.values
        assert counts.tolist() == [144, 144, 144, 140, 140]
        assert data.sizes["data"] == counts.sum()
        assert data.time.values[2] == np.datetime64("2026-05-01T08:00:01")
        start = counts[:2].sum()
        longitude, latitude = longitude_latitude(SITE, oil(2))
        np.testing.assert_array_equal(data.longitude.values[start : start + 144], longitude)
        np.testing.assert_array_equal(data.latitude.values[start : start + 144], latitude)
        np.testing.assert_array_equal(data.id.values[start : start + 144], np.arange(144))
        fate, status = data.fate.values[start : start + 144], data.status_codes.values[start : start + 144]
        assert np.flatnonzero(fate == FATES.index("lost_drainage")).tolist() == LOST.tolist()
        assert np.flatnonzero(status != 2).tolist() == [143] and status[143] == 3  # GNOME: in_water, on_land
        np.testing.assert_allclose(data.oil_recovered.values, 0.1 * np.arange(5))
        for variable, words in ((data.fate, list(FATES)), (data.status_codes, None)):  # CF 1.8, section 3.5
            meanings, values = variable.attrs["flag_meanings"].split(), variable.attrs["flag_values"]
            assert len(values) == len(meanings) and values.dtype.newbyteorder("=") == variable.dtype
            assert words in (None, meanings) and set(np.unique(variable.values)) <= set(values.tolist())
        assert data.depth.attrs["axis"] == "Z"
        np.testing.assert_allclose(data.mass.values, 1000.0 * 900.0 * SPACING**3)
        np.testing.assert_allclose(data.viscosity.values, 1e-4)
        assert (data.depth.values == 0.0).all()  # the film is the surface


def test_netcdf_is_what_cf_asks_for(replay: Replay, tmp_path: Path) -> None:
    """The checker of IOOS finds no fault by CF 1.8, of all oil and of lost oil alone, and would find an axis that is none."""
    checker = pytest.importorskip("compliance_checker.runner", reason="compliance-checker is not installed")
    checker.CheckSuite.load_all_available_checkers()

    def faults(path: Path) -> list[str]:
        suite = checker.CheckSuite()
        scores = suite.run_all(suite.load_dataset(str(path)), ["cf:1.8"])
        results, errors = scores["cf:1.8"]
        assert not errors
        return [text for one in results for text in (one.msgs or ()) if one.value[0] < one.value[1]]

    for lost_only in (False, True):
        write_netcdf(replay, tmp_path / "oil.nc", SITE, lost_only=lost_only)
        assert faults(tmp_path / "oil.nc") == []
    with netcdf_file(tmp_path / "oil.nc", "a") as file:
        file.variables["depth"].axis = "down"
    assert any("axis" in text for text in faults(tmp_path / "oil.nc"))


def test_netcdf_opens_in_noaas_own_reader(replay: Replay, tmp_path: Path) -> None:
    reader = pytest.importorskip("nc_particles.nc4_particles", reason="nc_particles is not installed").Reader
    write_netcdf(replay, tmp_path / "oil.nc", SITE, lost_only=True)
    opened = reader(str(tmp_path / "oil.nc"))
    assert opened.get_timestep(4, ["id"])["id"].tolist() == LOST.tolist()
    assert len(opened.get_timestep(0, ["id"])["id"]) == 0


def test_opendrift_goes_on_from_the_netcdf(replay: Replay, tmp_path: Path) -> None:
    """Lost oil is seeded where and when the recording ends, and goes east with a current of 0.2 m/s for an hour."""
    openoil = pytest.importorskip("opendrift.models.openoil", reason="OpenDrift is not installed")
    write_netcdf(replay, tmp_path / "oil.nc", SITE, lost_only=True)
    with xarray.open_dataset(tmp_path / "oil.nc") as data:
        last = slice(-int(data.particle_count.values[-1]), None)
        longitude, latitude = data.longitude.values[last], data.latitude.values[last]
        time = data.time.values[-1].astype("datetime64[s]").item()
    model = openoil.OpenOil(loglevel=50, weathering_model="noaa")
    weather = {
        "x_sea_water_velocity": 0.2,
        "y_sea_water_velocity": 0.0,
        "x_wind": 0.0,
        "y_wind": 5.0,
        "land_binary_mask": 0,
    }
    settings = {f"environment:constant:{name}": value for name, value in weather.items()}
    for name, value in (settings | {"drift:current_uncertainty": 0.0, "drift:wind_uncertainty": 0.0}).items():
        model.set_config(name, value)
    model.seed_elements(lon=longitude, lat=latitude, z=0.0, time=time, oil_type="GENERIC LIGHT CRUDE")
    model.run(duration=timedelta(hours=1), time_step=600)
    drifted = (np.sort(model.elements.lon) - np.sort(longitude)) * 78846.835
    np.testing.assert_allclose(drifted, 720.0, rtol=0.01)


def test_an_outline_has_the_area_of_the_film() -> None:
    """Squares of n x n particles stand for (n d)^2; discs cut corners and scallop edges, by less than d / 10 of rim."""
    (polygon,) = slick_outlines(oil(0)[:, :2], SPACING)
    (ring,) = polygon
    assert (ring[0] == ring[-1]).all()
    x, y = ring.T
    area = 0.5 * (x[:-1] * y[1:] - x[1:] * y[:-1]).sum()
    whole = (SIDE * SPACING) ** 2
    assert whole - 4.0 * SIDE * SPACING * 0.1 * SPACING < area <= whole * (1.0 + 1e-9)  # positive: counter-clockwise


def test_geojson_has_outlines_by_fate_with_their_volume(replay: Replay, tmp_path: Path) -> None:
    write_geojson(replay, tmp_path / "oil.geojson", SITE, interval=1.0, particles=True)
    features = json.loads((tmp_path / "oil.geojson").read_text())["features"]
    slicks = [f["properties"] for f in features if f["properties"]["kind"] == "slick"]
    both, all_three = ["afloat", "stranded"], ["afloat", "stranded", "lost_drainage"]
    assert [s["fate"] for s in slicks] == [*both, *all_three, *all_three]
    assert [FATES[s["fate_code"]] for s in slicks] == [s["fate"] for s in slicks]
    assert [s["volume_m3"] for s in slicks[2:5]] == pytest.approx([count * SPACING**3 for count in (140, 1, 3)])
    ledger = [f["properties"] for f in features if f["properties"]["kind"] == "ledger"]
    assert [row["recovered_m3"] for row in ledger] == pytest.approx([0.0, 0.2, 0.4])
    features = [f for f in features if f["geometry"] is not None]
    assert slicks[2]["time"] == "2026-05-01T08:00:01+00:00"
    (track,) = [f for f in features if f["properties"]["kind"] == "track"]
    longitude, latitude = longitude_latitude(SITE, np.array([[4.0, 2.0]]))
    np.testing.assert_allclose(track["geometry"]["coordinates"][-1], [longitude[0], latitude[0]], atol=1e-8)
    dots = [f for f in features if f["geometry"]["type"] == "MultiPoint"]
    assert sum(len(f["geometry"]["coordinates"]) for f in dots) == 144 + 144 + 140


def _longitudes(coordinates: list) -> list[float]:
    if isinstance(coordinates[0], float):
        return [coordinates[0]]
    return [one for part in coordinates for one in _longitudes(part)]


@pytest.mark.parametrize(
    ("longitude", "crosses"),
    [(179.99998, True), (-179.99998, False), (179.9999999, True), (359.99999, False), (200.0, False)],
)
def test_geojson_is_cut_at_the_180th_meridian_and_loses_nothing(
    longitude: float, crosses: bool, replay: Replay, tmp_path: Path
) -> None:
    """The film drifts from 0 to 5 m east: over the meridian, along it, or in degrees beyond it. RFC 7946, section 3.1.9."""
    site = Site(latitude=17.0, longitude=longitude)
    write_geojson(replay, tmp_path / "cut.geojson", site, particles=True)
    write_geojson(replay, tmp_path / "plain.geojson", Site(latitude=17.0, longitude=0.0), particles=True)
    read = {name: json.loads((tmp_path / f"{name}.geojson").read_text())["features"] for name in ("cut", "plain")}
    cut, plain = ([one for one in features if one["geometry"] is not None] for features in read.values())
    assert len(cut) == len(plain)
    crossing = False
    for one, other in zip(cut, plain, strict=True):
        found = _longitudes(one["geometry"]["coordinates"])
        assert max(map(abs, found)) <= 180.0
        east, west = [x for x in found if x > 100.0], [x for x in found if x < -100.0]
        crossing |= bool(east and west)
        if one["geometry"]["type"] != "MultiPoint":
            geometry, whole = shape(one["geometry"]), shape(other["geometry"])
            assert geometry.is_valid
            assert geometry.area == pytest.approx(whole.area, rel=1e-2, abs=1e-16)  # of 1e-8 degrees
            assert geometry.length >= whole.length * (1.0 - 1e-2)
            for part in getattr(geometry, "geoms", [geometry]):
                assert part.bounds[2] - part.bounds[0] < 1e-3  # no piece reaches round the Earth
    assert crossing is crosses


@pytest.mark.parametrize("start", ["0001-01-01T00:00:00+14:00", "9999-12-31T23:59:59Z"])
def test_dates_at_the_end_of_the_calendar_are_refused(start: str) -> None:
    with pytest.raises(ValueError, match="allowed: years 1583 to 9000"):
        Site(latitude=0.0, longitude=0.0, start=start)


def test_vtk_reads_back_with_points_ids_and_times(replay: Replay, tmp_path: Path) -> None:
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    assert write_vtk(replay, tmp_path, interval=1.0) == 6
    series = json.loads((tmp_path / "oil.vtp.series").read_text())["files"]
    assert [entry["time"] for entry in series] == [0.0, 1.0, 2.0]
    reader = vtkXMLPolyDataReader()
    reader.SetFileName(str(tmp_path / series[1]["name"]))
    reader.Update()
    found = reader.GetOutput()
    np.testing.assert_array_equal(vtk_to_numpy(found.GetPoints().GetData()), oil(2))
    np.testing.assert_array_equal(vtk_to_numpy(found.GetPointData().GetArray("fate")), fates(np.arange(144)))
    reader.SetFileName(str(tmp_path / "bodies_000004.vtp"))
    reader.Update()
    hull = reader.GetOutput()
    assert hull.GetNumberOfPolys() == 4
    assert vtk_to_numpy(hull.GetPoints().GetData())[:, 0].max() == pytest.approx(5.0)


def test_vtk_of_a_step_without_bodies_has_no_surface(tmp_path: Path) -> None:
    """As in a recording that was damaged: the body's pose is known from the second step on."""
    path = tmp_path / "late.rrd"
    hull = MeshDescription(vertices=np.eye(3), faces=np.array([[0, 1, 2]]))
    with Recorder(path, frame_rate=2.0) as recorder:
        recorder.initialized(
            RunDescription(name="late", particle_spacing=SPACING, phases=(), meshes={"vessels/port": hull})
        )
        for index in range(2):
            bodies = frame(index).bodies if index else {}
            recorder.step_completed(
                Frame(
                    index=index,
                    time=0.5 * index,
                    bodies=bodies,
                    scalars={"oil/spilled": 1.0},
                    read_phases=dict,
                )
            )
    assert write_vtk(Replay(path), tmp_path) == 2
    assert 'NumberOfPoints="0"' in (tmp_path / "bodies_000000.vtp").read_text(errors="ignore")
    assert 'NumberOfPoints="3"' in (tmp_path / "bodies_000001.vtp").read_text(errors="ignore")


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_tables_hold_every_series_and_the_tracks_asked_for(kind: str, replay: Replay, tmp_path: Path) -> None:
    written = write_tables(replay, tmp_path, kind, tracks=["oil"], ids=[7, 143])
    read = pyarrow.csv.read_csv if kind == "csv" else pyarrow.parquet.read_table
    tables = {path.stem: read(path) for path in written}
    series = tables["series"].to_pydict()
    assert series["time"] == [0.0, 0.5, 1.0, 1.5, 2.0]
    assert series["oil/recovered"] == [0.1 * index for index in range(5)]
    assert series["probes/gauge"] == [None, None, 3.0, None, None]
    assert tables["bodies"].to_pydict()["x"] == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert tables["events"].to_pydict()["text"] == ['it "leaks", here']
    track = tables["particles-oil"].to_pydict()
    assert track["id"] == [7, 143, 7, 143, 7, 143, 7, 7]
    assert track["x"][0] == pytest.approx(0.7)
    assert track["fate"][3:6] == ["stranded", "lost_drainage", "stranded"]
    assert [FATES[code] for code in track["fate_code"]] == track["fate"]
    assert track["volume"] == pytest.approx([SPACING**3] * 8)


def two_fluids(path: Path, oil_name: str, water_name: str, dimension: int = 3) -> Replay:
    """A recording of oil and water, of which the oil loses three particles."""
    phases = (
        PhaseDescription(name=water_name, rest_density=1027.0),
        PhaseDescription(name=oil_name, rest_density=835.0, is_oil=True),
    )
    names = {water_name: np.arange(500, 510, dtype=np.uint32), oil_name: np.arange(30, dtype=np.uint32)}
    with Recorder(path, frame_rate=2.0) as recorder:
        recorder.initialized(
            RunDescription(name="sea", particle_spacing=SPACING, phases=phases, dimension=dimension, fates=FATES)
        )
        for index in range(2):
            recorder.step_completed(
                Frame(
                    index=index,
                    time=0.5 * index,
                    read_phases=lambda: {
                        n: PhaseFrame(np.zeros((len(i), 3), np.float32), i, fate=None if n == water_name else fates(i))
                        for n, i in names.items()
                    },
                )
            )
    return Replay(path)


def test_oil_is_what_the_run_called_oil_whatever_its_name(tmp_path: Path) -> None:
    """A sea that has "oil" in its name is none, and a crude called brent is."""
    replay = two_fluids(tmp_path / "brent.rrd", "brent", "boiled-sea")
    assert replay.run.oils == ("brent",)
    assert replay.lost_causes == ("drainage",)
    last = list(oil_frames(replay))[-1]
    assert (
        last.id.tolist() == list(range(30))
        and last.id[last.fate == FATES.index("lost_drainage")].tolist() == LOST.tolist()
    )
    sea, brent = replay.run.phases
    assert palette.phase_color(brent, 1) == palette.OIL and palette.phase_color(sea, 0) == palette.WATER
    assert "**Oil** is dark. **Water** is drawn as small dots." in legend(replay.run)


def test_a_planes_particles_are_a_metre_wide(tmp_path: Path) -> None:
    replay = two_fluids(tmp_path / "plane.rrd", "oil", "water", dimension=2)
    assert replay.run.particle_volume == pytest.approx(SPACING**2)
    write_netcdf(replay, tmp_path / "oil.nc", SITE)
    with xarray.open_dataset(tmp_path / "oil.nc") as data:
        np.testing.assert_allclose(data.mass.values, 1000.0 * 835.0 * SPACING**2)
    write_geojson(replay, tmp_path / "oil.geojson", SITE)
    features = json.loads((tmp_path / "oil.geojson").read_text())["features"]
    volumes = {f["properties"]["fate"]: f["properties"]["volume_m3"] for f in features if "fate" in f["properties"]}
    expected = {"afloat": 26 * SPACING**2, "stranded": SPACING**2, "lost_drainage": 3 * SPACING**2}
    assert volumes == pytest.approx(expected)


def test_tracks_of_an_unknown_phase_are_refused(replay: Replay, tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="allowed: oil"):
        write_tables(replay, tmp_path / "none", "csv", tracks=["ole"])


def test_parcels_are_exported_with_their_own_volumes(tmp_path: Path, replay: Replay) -> None:
    """They differ, change and come to an end: each frame has those of its moment."""
    path, rng = tmp_path / "parcels.rrd", np.random.default_rng(1)
    volumes = [rng.random(n).astype(np.float32) for n in (50, 50, 40, 60)]
    volumes.insert(1, volumes[0])

    def parcels(index: int) -> PhaseFrame:
        count = len(volumes[index])
        place = np.column_stack([rng.random((count, 2)) * 20.0, np.zeros(count)]).astype(np.float32)
        ids = np.arange(index // 2, index // 2 + count, dtype=np.uint32)
        return PhaseFrame(place, ids, volumes[index], np.full(count, 2.0, np.float32))

    with Recorder(path, frame_rate=2.0) as recorder:
        recorder.initialized(replace(replay.run, meshes={}))
        for index in range(len(volumes)):
            found = parcels(index)
            recorder.step_completed(
                Frame(
                    index=index,
                    time=0.5 * index,
                    bodies={},
                    scalars={},
                    read_phases=lambda one=found: {"oil": one},
                )
            )
    recorded = Replay(path)
    frames = list(oil_frames(recorded))
    assert [frame.volume.tolist() for frame in frames] == [one.astype(float).tolist() for one in volumes]
    write_netcdf(recorded, tmp_path / "oil.nc", SITE)
    with xarray.open_dataset(tmp_path / "oil.nc", decode_times=False) as data:
        assert float(data.mass.sum()) == pytest.approx(1e3 * 900.0 * sum(float(one.sum()) for one in volumes), rel=1e-5)
    write_geojson(recorded, tmp_path / "oil.geojson", SITE)
    features = json.loads((tmp_path / "oil.geojson").read_text())["features"]
    slicks = [one["properties"]["volume_m3"] for one in features if one["properties"]["kind"] == "slick"]
    assert slicks == pytest.approx([float(one.sum()) for one in volumes])
    areas = [shape(one["geometry"]).area for one in features if one["properties"]["kind"] == "slick"]
    assert min(areas) > 0.0
