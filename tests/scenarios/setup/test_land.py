"""Land: the stream along it against potential flow and continuity, its files, and what it does to oil and vessels."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from oilsim.sea import CurrentProfile, Sea, SeaDescription, SteadyFlow
from recordings.model.exercise import Site
from recordings.model.tangent_plane import longitude_latitude
from scenarios.running.assembly import Assembly, build
from scenarios.schema.parsing.structuring import as_data
from scenarios.schema.run_settings import SiteSettings
from scenarios.schema.sea import LandSettings
from scenarios.setup.at_sea import land
from scenarios.setup.at_sea.land import Corners, stream_along
from scenarios.spec.load import load_scenario, scenario_from
from scenarios.spec.resolve import resolve
from scenarios.text.problems import Problem, ScenarioError

RADIUS, DEPTH = 100.0, 12.0
TURNS = np.linspace(0.0, 2.0 * np.pi, 200, endpoint=False)
ISLAND: Corners = tuple(zip((RADIUS * np.cos(TURNS)).tolist(), (RADIUS * np.sin(TURNS)).tolist(), strict=True))
SITE = Site(latitude=57.66, longitude=11.7, bearing=250.0)
HARBOUR = """
name = "own-harbour"
run = { duration = 60.0, communication_step = 0.1 }
fluid.particle_spacing = 0.25
[phases.water]
density = 1027.0
dynamic_viscosity = 1.05e-3
[phases.oil]
oil = "alaska-north-slope"
[fill.slick]
shape = "block"
phase = "oil"
lower = [-14.0, -5.0, -0.003]
upper = [-4.0, 5.0, 0.0]
[sea]
depth = 12.0
[sea.current]
speed = 0.5
direction = 0.0
[sea.wind]
speed = 10.0
direction = 0.0
[land.island]
outline = [[0.0, -30.0], [40.0, -30.0], [40.0, 30.0], [0.0, 30.0]]
[vessels.one]
length = 15.0
beam = 5.0
draft = 1.6
depth = 3.0
position = [-20.0, 18.0]
heading = 0.0
bollard_pull = 60000.0
yaw_moment = 250000.0
side_thrust = 20000.0
[tow]
speed_kn = 3.0
heading = 0.0
"""


def over_shoal(places: np.ndarray, water: float) -> np.ndarray:
    """Velocity (N, 2) of a unit stream along x over a round shoal, as the field of a dielectric cylinder; without water: an island.

    Within the radius it is 2 h / (h + water); outside, w = 1 - s a2 / z2, s = (h - water) / (h + water) (Batchelor 1967, section 6.6).
    """
    z = places[:, 0] + 1j * places[:, 1]
    share = (DEPTH - water) / (DEPTH + water)
    rate = np.where(np.abs(z) < RADIUS, 1.0 + share, 1.0 - share * RADIUS**2 / z**2)
    return np.stack([rate.real, -rate.imag], axis=-1)


def error(cells: int, water: float, monkeypatch: pytest.MonkeyPatch) -> float:
    """Root mean square error of the stream from 0.7 to 0.9 (if there is water) and 1.1 to 1.3 radii from the middle of a shoal."""
    monkeypatch.setattr(land, "CELLS", cells)
    stream_along.cache_clear()
    radii = np.concatenate([np.linspace(0.7, 0.9, 8) if water else [], np.linspace(1.1, 1.3, 8)]) * RADIUS
    turn, radius = np.meshgrid(np.linspace(0.0, 6.2, 60), radii)
    places = np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=-1).reshape(-1, 2)
    found = stream_along(((ISLAND, water),), DEPTH).at(places)
    stream_along.cache_clear()
    across = over_shoal(places @ [[0.0, -1.0], [1.0, 0.0]], water) @ [
        [0.0, 1.0],
        [-1.0, 0.0],
    ]  # turned by a right angle
    differences = np.concatenate([found[:, :, 0] - over_shoal(places, water), found[:, :, 1] - across])
    return float(np.sqrt((differences**2).sum(axis=1).mean()))


@pytest.mark.parametrize("water", [0.0, 1.2, 6.0])
def test_the_stream_around_an_island_and_over_a_shoal_converges(water: float, monkeypatch: pytest.MonkeyPatch) -> None:
    coarse, middle, fine = (error(cells, water, monkeypatch) for cells in (60, 120, 240))
    assert fine < 0.015
    assert coarse > 1.5 * middle > 2.0 * fine


def test_as_much_flows_through_a_gap_at_each_of_its_sections() -> None:
    walls = (((-100.0, 10.0), (100.0, 10.0), (100.0, 60.0), (-100.0, 60.0)),
             ((-100.0, -60.0), (100.0, -60.0), (100.0, -10.0), (-100.0, -10.0)))  # fmt: skip
    y = np.linspace(-9.9, 9.9, 100)
    flows = [
        stream_along(tuple((wall, 0.0) for wall in walls), DEPTH)
        .at(np.column_stack([np.full(100, x), y]))[:, 0, 0]
        .mean()
        for x in (-70.0, 0.0, 50.0)
    ]
    assert flows == pytest.approx([flows[1]] * 3, rel=0.02)


def test_a_thin_wall_does_not_leak() -> None:
    basin = ((-50.0, -50.0), (50.0, -50.0), (50.0, 50.0), (-50.0, 50.0), (-50.0, -47.0), (-47.0, -47.0), (-47.0, 47.0),
             (47.0, 47.0), (47.0, -47.0), (-50.0, -47.0))  # fmt: skip
    inside = np.random.default_rng(1).uniform(-40.0, 40.0, (200, 2))
    assert np.abs(stream_along(((basin, 0.0),), DEPTH).at(inside)).max() < 1e-6


def test_the_sea_runs_along_its_land_and_far_out_as_it_did() -> None:
    current = CurrentProfile(flow=SteadyFlow(speed=0.5, direction=0.0))
    open_sea = Sea(SeaDescription(depth=10.0, current=current))
    sea = Sea(replace(open_sea.description, stream=stream_along(((ISLAND, 0.0),), DEPTH)))
    abeam, far = np.array([[0.0, 1.5 * RADIUS]]), np.array([[0.0, 50.0 * RADIUS]])
    wanted = 0.5 * over_shoal(abeam, 0.0)[0, 0]
    assert sea.current(np.zeros(1), 0.0, abeam)[0, 0] == pytest.approx(wanted, rel=0.02)
    assert sea.velocity(np.append(abeam, [[0.0]], axis=1), 0.0)[0, 0] == pytest.approx(wanted, rel=0.02)
    np.testing.assert_array_equal(sea.current(np.zeros(1), 0.0, far), open_sea.current(np.zeros(1), 0.0))
    later = sea.followed_by(replace(open_sea.description, current=None), 1.0, np.zeros(2))
    assert later.description.stream is sea.description.stream


def test_geojson_is_read_where_the_site_says(tmp_path: Path) -> None:
    corners = np.array([[0.0, -30.0], [40.0, -30.0], [40.0, 30.0], [0.0, 30.0], [0.0, -30.0]])
    ring = np.stack(longitude_latitude(SITE, corners), axis=1).tolist()
    shapes = [{"type": "Polygon", "coordinates": [ring]}, {"type": "MultiPolygon", "coordinates": [[ring], [ring]]}]
    features = [{"type": "Feature", "properties": None, "geometry": one} for one in shapes]
    (tmp_path / "own.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    place = "[site]\nlatitude = 57.66\nlongitude = 11.7\nbearing_deg = 250.0\n"
    text = HARBOUR.replace("outline = [[0.0, -30.0], [40.0, -30.0], [40.0, 30.0], [0.0, 30.0]]", 'file = "own.geojson"')
    (tmp_path / "own.toml").write_text(text + place)
    spec = resolve(load_scenario(tmp_path / "own.toml").scenario)
    found = land.read_land(spec.land, spec.site, DEPTH, [])["island"].outlines
    np.testing.assert_allclose(found, [corners[:-1]] * 3, atol=1e-6)


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("{", "Expecting"),
        ('{"type": "FeatureCollection", "features": []}', "holds no Polygon"),
        ('{"type": "Polygon", "coordinates": [[[11, 57], [11, 58], [11, 57]]]}', "no ring of 4 or more positions"),
        ('{"type": "Polygon", "coordinates": [[[11, 57], [11, 58], [12, 58], [11, 57]]]}', "km from the origin"),
        ('{"type": "Polygon", "coordinates": [[["a", 57], [11, 58], [12, 58], [11, 57]]]}', "land.island.file"),
        ('{"type": "Polygon"}', "land.island.file"),
        ("[]", "land.island.file"),
    ],
)
def test_files_that_are_no_land_are_refused_by_their_key(content: str, told: str, tmp_path: Path) -> None:
    (tmp_path / "own.geojson").write_text(content)
    text = HARBOUR.replace("outline = [[0.0, -30.0], [40.0, -30.0], [40.0, 30.0], [0.0, 30.0]]", 'file = "own.geojson"')
    (tmp_path / "own.toml").write_text(text + "[site]\nlatitude = 57.66\nlongitude = 11.7\n")
    with pytest.raises(ScenarioError) as caught:
        build(load_scenario(tmp_path / "own.toml").scenario)
    assert told in str(caught.value) and "land.island.file" in str(caught.value)


@pytest.mark.parametrize(
    ("outline", "told"),
    [("[[0, 0], [1, 1], [2, 2]]", "encloses 0 m2"), ("[[0, 0], [1e9, 0], [0, 1]]", "km from the origin")],
)
def test_outlines_that_are_no_land_are_refused_by_their_key(outline: str, told: str, tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text(HARBOUR)
    with pytest.raises(ScenarioError) as caught:
        build(load_scenario(tmp_path / "own.toml", overrides=[f"land.island.outline={outline}"]).scenario)
    assert told in str(caught.value) and "land.island.outline" in str(caught.value)


def test_land_that_overlaps_is_land_whichever_way_its_corners_run() -> None:
    square = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
    aside = tuple((x + 5.0, y) for x, y in square[::-1])
    solid = land.Land(((square, 0.0), (aside, 0.0)), 0.02).solid("quay", level=0.0, depth=7.0)
    assert solid.placed.mesh.volume == pytest.approx(15.0 * 10.0 * (7.0 + land.RISE))
    assert solid.world_mesh().bounds[:, 2] == pytest.approx([-7.0, land.RISE])


def test_oil_strands_on_land_and_a_vessel_runs_aground_on_it(tmp_path: Path) -> None:
    assembly, told = run_in(HARBOUR, tmp_path, 60.0)
    assert told.count("one runs aground on island") == 1
    slick, world = assembly.slicks[0].slick, assembly.world
    assert world is not None
    bow = world.pose("vessels/one")[0] + 7.5
    assert -0.5 < bow < 0.5  # it would be 90 m further on
    assert float(slick.oil.stranded) > 0.0
    at = slick.parcels.position
    assert not ((at[:, 0] > 0.1) & (at[:, 0] < 39.9) & (np.abs(at[:, 1]) < 29.9)).any()


def run_in(harbour: str, folder: Path, duration: float) -> tuple[Assembly, list[str]]:
    """Step an exercise; return it as it is then, and what its log told."""
    (folder / "own.toml").write_text(harbour)
    assembly = build(load_scenario(folder / "own.toml").scenario)
    simulation, told = assembly.co_simulation(), list[str]()
    simulation.initialize()
    for _ in range(round(duration / 0.1)):
        simulation.step()
        told += [notice.text for notice in assembly.scoring.take_notices()]
    simulation.terminate()
    return assembly, told


@pytest.mark.parametrize(("water", "is_aground"), [(0.6, True), (3.0, False)])
def test_a_vessel_runs_aground_on_a_shoal_above_its_keel_and_oil_drifts_over_it(
    water: float, is_aground: bool, tmp_path: Path
) -> None:
    assembly, told = run_in(HARBOUR.replace("[land.island]", f"[land.bank]\ndepth = {water}"), tmp_path, 60.0)
    assert ("one runs aground on bank" in told) == is_aground
    assert assembly.world is not None
    bow = assembly.world.pose("vessels/one")[0] + 7.5
    assert bow < 2.5 if is_aground else bow > 50.0
    slick = assembly.slicks[0].slick
    assert float(slick.oil.stranded) == 0.0
    assert (slick.parcels.position[:, 0] > 5.0).any()


def test_depths_of_a_file_are_those_of_its_features(tmp_path: Path) -> None:
    corners = np.array([[0.0, -30.0], [40.0, -30.0], [40.0, 30.0], [0.0, 30.0], [0.0, -30.0]])
    ring = np.stack(longitude_latitude(SITE, corners), axis=1).tolist()
    polygon = {"type": "Polygon", "coordinates": [ring]}
    told = [None, {"depth": 2.5}, {"DRVAL1": 4}, {"depth": 15.0}, {"DRVAL1": -1.5}]
    features = [{"type": "Feature", "properties": one, "geometry": polygon} for one in told]
    (tmp_path / "own.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    settings = {"bank": LandSettings(file=str(tmp_path / "own.geojson"), depth=1.0)}
    site = SiteSettings(latitude=57.66, longitude=11.7)
    found = land.read_land(settings, site, DEPTH, [])["bank"]
    assert [depth for _, depth in found.polygons] == [1.0, 2.5, 4.0, 0.0]
    assert len(found.outlines) == 1


@pytest.mark.parametrize(
    ("depth", "told"),
    [('"deep"', "polygon 1 has the depth 'deep'"), ("15.0", "is 15 m of water, allowed: less than the sea's 12 m")],
)
def test_depths_of_a_file_that_are_none_are_refused(depth: str, told: str, tmp_path: Path) -> None:
    ring = "[[11.7, 57.66], [11.71, 57.66], [11.71, 57.67], [11.7, 57.66]]"
    feature = f'{{"type": "Feature", "properties": {{"depth": {depth}}}, "geometry": {{"type": "Polygon", "coordinates": [{ring}]}}}}'
    (tmp_path / "own.geojson").write_text(feature)
    problems = list[Problem]()
    settings = {"bank": LandSettings(file=str(tmp_path / "own.geojson"))}
    land.read_land(settings, SiteSettings(latitude=57.66, longitude=11.7), DEPTH, problems)
    assert [problem.path for problem in problems] == ["land.bank.file"] and told in problems[0].text


def test_orders_are_taken_beside_land_of_corners(tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text(HARBOUR)
    scenario = load_scenario(tmp_path / "own.toml").scenario
    assert scenario_from(as_data(scenario)).land == scenario.land
