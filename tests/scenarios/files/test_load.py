"""Scenario files: what they may say, and that every mistake is found, placed and explained, all at once."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, get_args, get_origin

import pytest

from scenarios.schema.bodies import MeshBody
from scenarios.schema.parsing.compass import PLACES
from scenarios.schema.parsing.overrides import parse_override, with_override
from scenarios.schema.parsing.quantity_fields import Section, field_kinds
from scenarios.schema.parsing.structuring import COMPASS
from scenarios.schema.sea import RegularSeaWaves, SteadySeaCurrent, SteadySeaWind
from scenarios.spec.load import library_paths, load_scenario, scenario_from
from scenarios.spec.resolve import resolve
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import ScenarioError

SMALL = """
name = "small"
[run]
duration = 0.1
[fluid]
particle_spacing = 0.1
[phases.water]
density = 1000.0
dynamic_viscosity = 1.0e-3
[phases.oil]
oil = "brent"
[tank]
lower = [0.0, 0.0, 0.0]
upper = [1.0, 1.0, 1.0]
[fill.sea]
shape = "slab"
phase = "water"
bottom = 0.0
top = 0.3
"""


def problems_of(extra: str, *, instead: dict[str, str] | None = None) -> dict[str, str]:
    """Problems, by path, of the small scenario with lines changed and a text added."""
    text = SMALL
    for old, new in (instead or {}).items():
        assert old in text
        text = text.replace(old, new)
    with pytest.raises(ScenarioError) as caught:
        scenario_from(tomllib.loads(text + extra))
    return {problem.path: problem.text for problem in caught.value.problems}


def problems_with(*overrides: str) -> dict[str, str]:
    """Problems, by path, of the small scenario with entries changed or added."""
    data = tomllib.loads(SMALL)
    for override in overrides:
        data = with_override(data, *parse_override(override))
    with pytest.raises(ScenarioError) as caught:
        scenario_from(data)
    return {problem.path: problem.text for problem in caught.value.problems}


def test_contact_angles_need_interfaces_that_pull() -> None:
    rock = '[bodies.rock]\nshape = "sphere"\nradius = 0.2\nposition = [0.5, 0.5, 0.1]\nmotion.kind = "fixed"\ncontact_angle = 120.0\n'
    wetted = {"upper = [1.0, 1.0, 1.0]": "upper = [1.0, 1.0, 1.0]\ncontact_angle = 30.0"}
    pulling = {"particle_spacing = 0.1": "particle_spacing = 0.1\ninterfacial_tension = true"}
    allowed = "allowed: 90 deg, or another with fluid.interfacial_tension = true"
    assert problems_of(rock, instead=wetted) == {
        "tank.contact_angle": f"is 30, {allowed}",
        "bodies.rock.contact_angle": f"is 120, {allowed}",
    }
    text = SMALL
    for old, new in (wetted | pulling).items():
        text = text.replace(old, new)
    assert scenario_from(tomllib.loads(text + rock)).bodies["rock"].contact_angle == 120.0
    found = problems_of(rock.replace("120.0", "181.0"), instead=wetted | pulling)
    assert found == {"bodies.rock.contact_angle": "is 181.0, allowed: 0 or more and at most 180 deg"}


def test_air_needs_tension_a_closed_tank_and_no_sky() -> None:
    air = '[phases.air]\nrole = "air"\ndensity = 10.0\ndynamic_viscosity = 1e-3\n'
    opened = {"upper = [1.0, 1.0, 1.0]": 'upper = [1.0, 1.0, 1.0]\nopen = ["+z"]'}
    assert problems_of(air + "[sea.wind]\nspeed = 3.0\ndirection = 0.0", instead=opened) == {
        "fluid.interfacial_tension": "is false, allowed with the air 'air': true",
        "tank.open": "has +z, allowed with the air 'air': no side",
        "sea": "has entries, allowed with the air 'air': none, as they need water under an open sky",
    }
    found = problems_of(air.replace("density = 10.0", 'oil = "brent"'))
    assert found["phases.air.role"] == 'is "air", allowed of an oil: "oil" or "water"'


def test_two_dimensions_have_no_y() -> None:
    plane = {"particle_spacing = 0.1": "particle_spacing = 0.1\ndimension = 2\ngravity = [0.0, 1.0, -9.81]"}
    moving = {"top = 0.3": "top = 0.3\nvelocity = [1.0, 0.5, 0.0]"}
    found = problems_of("[sea.wind]\nspeed = 3.0\ndirection_deg = 90.0", instead=plane | moving)
    assert found["fluid.gravity"] == "has y = 1, allowed: 0 with fluid.dimension = 2"
    assert found["fill.sea.velocity"] == "has y = 0.5, allowed: 0 with fluid.dimension = 2"
    assert "is 1.5708 rad, allowed: 0 or pi" in found["sea.wind.direction"]


def test_waves_need_gravity() -> None:
    weightless = {"particle_spacing = 0.1": "particle_spacing = 0.1\ngravity = [0, 0, 0]"}
    found = problems_of("[sea.waves]\nheight = 0.1\nperiod = 1.0", instead=weightless)
    assert found == {"sea.waves": "is given, allowed: only with fluid.gravity, by which waves run"}


def test_numbers_that_no_machine_holds_are_refused() -> None:
    found = problems_of("", instead={"particle_spacing = 0.1": "particle_spacing = 0.0001"})
    assert (
        "liquid takes 3e+11 particles and the tank 1.2e+09, allowed: 1e+08 together" in found["fluid.particle_spacing"]
    )
    found = problems_of("", instead={"lower = [0.0, 0": "lower = [-1700.0, 0"})
    assert found == {"tank": "reaches 1700 m from the origin, allowed: 1677.6 m, 16776 fluid.particle_spacing"}
    found = problems_of("", instead={"density = 1000.0": "density = 1e300"})
    assert found["phases.water.density"] == "is 1e+300, allowed: magnitudes up to 1e+12"


def test_small_scenario_is_sound() -> None:
    scenario = scenario_from(tomllib.loads(SMALL))
    assert scenario.phases["oil"].rest_density == 835.0
    assert scenario.phases["oil"].is_oil
    assert not scenario.phases["water"].is_oil


@pytest.mark.parametrize(
    ("old", "new", "path", "part"),
    [
        ("particle_spacing = 0.1", "particle_spacing = -0.1", "fluid.particle_spacing", "is -0.1, allowed: above 0 m"),
        ("particle_spacing = 0.1", "particle_spacing = true", "fluid.particle_spacing", "allowed: a number"),
        ("particle_spacing = 0.1", 'particle_spacing = "0.1"', "fluid.particle_spacing", "is '0.1', allowed: a number"),
        ("particle_spacing = 0.1", "particle_spacing = nan", "fluid.particle_spacing", "is nan"),
        ("particle_spacing = 0.1", "particle_spcing = 0.1", "fluid.particle_spcing", "did you mean 'particle_spacing'?"),
        ("particle_spacing = 0.1", "", "fluid.particle_spacing", "is missing"),
        ("particle_spacing = 0.1", "particle_spacing = 0.1\ndimension = 2.0", "fluid.dimension", "a whole number"),
        ("particle_spacing = 0.1", "particle_spacing = 0.1\ndimension = 4", "fluid.dimension", "at most 3"),
        ("particle_spacing = 0.1", 'particle_spacing = 0.1\nscheme = "papr"', "fluid.scheme", "did you mean 'paper'?"),
        ("particle_spacing = 0.1", "particle_spacing = 0.1\ninterfacial_tension = 1", "fluid.interfacial_tension", "true or false"),
        ("duration = 0.1", "duration = 0.0", "run.duration", "1e-06 or more and at most 1e+08 s"),
        ("duration = 0.1", "duration = 0.001", "run.communication_step", "up to duration"),
        ("duration = 0.1", "duration = 0.1\nthreads = 0", "run.threads", "1 or more"),
        ('oil = "brent"', 'oil = "brnt"', "phases.oil.oil", "did you mean 'brent'?"),
        ('oil = "brent"', "density = 850.0", "phases.oil.dynamic_viscosity", "is missing"),
        ("density = 1000.0", 'density = "1000"', "phases.water.density", "a number, above 0 and at most 25000 kg/m3"),
        ("[phases.oil]", '["phases"."the oil"]', "phases", "has an entry 'the oil'"),
        ("upper = [1.0, 1.0, 1.0]", "upper = [1.0, 1.0]", "tank.upper", "a list of 3 numbers"),
        ("upper = [1.0, 1.0, 1.0]", "upper = [1.0, -1.0, 1.0]", "tank.upper", "has y = -1 m"),
        ("upper = [1.0, 1.0, 1.0]", 'upper = [1.0, 1.0, 1.0]\nopen = ["z"]', "tank.open.0", "did you mean '+z' or '-z'?"),
        ("upper = [1.0, 1.0, 1.0]", 'upper = [1.0, 1.0, 1.0]\nopen = "+z"', "tank.open", "is '+z', allowed: a list of entries"),
        ("upper = [1.0, 1.0, 1.0]", 'upper = [1.0, 1.0, 1.0]\nperiodic = "xy"', "tank.periodic", "is 'xy', allowed: a list of entries"),
        (
            "upper = [1.0, 1.0, 1.0]",
            'upper = [1.0, 1.0, 1.0]\nopen = ["-x"]\nperiodic = ["x"]',
            "tank.open",
            "allowed: one of the two",
        ),
        ('shape = "slab"', 'shape = "slap"', "fill.sea.shape", "did you mean 'slab'?"),
        ('shape = "slab"', "", "fill.sea.shape", "is missing, allowed: 'block'"),
        ('phase = "water"', 'phase = "watr"', "fill.sea.phase", "did you mean 'water'?"),
        ("top = 0.3", "top = 1.3", "fill.sea", "has z = 0 to 1.3 m, allowed: inside the tank"),
        ("top = 0.3", "top = 0.0", "fill.sea.top", "above bottom = 0 m"),
        ("[run]", "[runs]", "runs", "did you mean 'run'?"),
        ('name = "small"', 'name = "small"\ndemo = 5', "demo", "is 5, allowed: a table"),
        ('name = "small"', 'name = "../small"', "name", "letters, digits"),
    ],
)  # fmt: skip
def test_mistake_is_found_and_explained(old: str, new: str, path: str, part: str) -> None:
    found = problems_of("", instead={old: new})
    assert path in found, found
    assert part in found[path]


@pytest.mark.parametrize(
    ("extra", "path", "part"),
    [
        ('[bodies.b]\nshape = "box"\nsize = [0.1, 0.1, 0.1]\nposition = [0.5, 0.5, 0.5]', "bodies.b.density", "is missing"),
        (
            '[bodies.b]\nshape = "box"\nsize = [0.1, 0.0, 0.1]\nposition = [0.5, 0.5, 0.5]\nmass = 1.0',
            "bodies.b.size.1",
            "above 0 m",
        ),
        (
            '[bodies.b]\nshape = "sphere"\nradius = 0.1\nposition = [0.5, 0.5, 0.5]\nmass = 1.0\ndensity = 1.0',
            "bodies.b.density",
            "one of mass or density",
        ),
        (
            '[bodies.b]\nshape = "mesh"\nfile = "nowhere.stl"\nposition = [0.0, 0.0, 0.0]\nmotion = "fixed"',
            "bodies.b.file",
            "does not exist",
        ),
        (
            '[bodies.b]\nshape = "mesh"\nfile = "b.step"\nposition = [0.0, 0.0, 0.0]\nmotion = "fixed"',
            "bodies.b.file",
            ".stl, .obj, .ply, .glb",
        ),
        (
            '[bodies.b]\nshape = "sphere"\nradius = 0.1\nposition = [0.5, 0.5, 0.5]\nmotion = "fxed"',
            "bodies.b.motion",
            "did you mean 'fixed'?",
        ),
        (
            '[bodies.b]\nshape = "sphere"\nradius = 0.1\nposition = [0.5, 0.5, 0.5]\nmotion = "fixed"\nvelocity = [1.0, 0.0, 0.0]',
            "bodies.b.velocity",
            "only for a free body",
        ),
        ('[probes.p]\nkind = "pressure"\npoint = [2.0, 0.5, 0.0]', "probes.p.point", "inside the tank"),
        ('[probes.p]\nkind = "body"\nbody = "rock"', "probes.p.body", "is no body"),
        ('[emitters.e]\nphase = "oil"\nmouth = [0.5, 0.5, 0.9]\nradius = 0.01\nspeed = 1.0', "emitters.e.radius", "0.05 m or more"),
        (
            '[emitters.e]\nphase = "oil"\nmouth = [0.5, 0.5, 0.9]\nradius = 0.1\nspeed = 1.0\nvolume = 1e-4',
            "emitters.e.volume",
            "above 0.0005 m3, half a particle",
        ),
        (
            '[emitters.e]\nphase = "oil"\nmouth = [0.5, 0.5, 0.9]\nradius = 0.1\nspeed = 1.0\ndirection = [0, 0, 0]',
            "emitters.e.direction",
            "not all zero",
        ),
        ("[sea.wind]\nspeed_kn = 300", "sea.wind.speed_kn", "is 300, allowed: 0 or more and at most 194.3 kn"),
        ("[sea.wind]\nspeed_kn = 3\nspeed = 1", "sea.wind.speed_kn", "is given beside speed"),
        ("[tank.zones.maker]\nlower = [0.0, 0.0, 0.0]", "tank.zones.maker.upper", "is missing"),
        ('[booms.b]\nends = ["port"]\nlength = 1.0\nskirt_depth = 0.1\nfreeboard = 0.1', "booms.b.ends", "a list of 2 entries, each"),
        ('[booms.b]\nends = ["tug", [0.5, 0.5]]\nlength = 1.0\nskirt_depth = 0.1\nfreeboard = 0.1', "booms.b.ends", "is no vessel"),
        (
            "[vessels.v]\nlength = 0.5\nbeam = 0.2\ndraft = 0.1\ndepth = 0.3\nposition = [0.5, 0.5]\nbollard_pull = 1\nyaw_moment = 1",
            "vessels.v.legs",
            "[tow] table",
        ),
        (
            "[booms.b]\nends = [[-3.0, 0.5], [0.5, 0.5]]\nlength = 4.0\nskirt_depth = 0.1\nfreeboard = 0.1",
            "booms.b.ends",
            "has x = -3 m, allowed: inside the tank",
        ),
        (
            '[bodies.b]\nshape = "sphere"\nradius = 0.1\nposition = [0.5, 0.5, 0.5]\ndensity = 600.0\nvelocity = [0.0, 1000.0, 0.0]',
            "bodies.b.velocity.1",
            "is 1000.0, allowed: -90 or more and at most 90 m/s",
        ),
        (
            '[bodies.b]\nshape = "sphere"\nradius = 0.1\nposition = [0.5, 0.5, 0.5]\n'
            'motion = {kind = "sine", direction = [1e-200, 0, 0], amplitude = 1, period = 1}',
            "bodies.b.motion.direction",
            "not all zero",
        ),
        (
            '[emitters.e]\nphase = "oil"\nmouth = [0.5, 0.5, 0.9]\nradius = 0.1\nspeed = 1.0\ndirection = [1e-200, 0, 0]',
            "emitters.e.direction",
            "not all zero",
        ),
        ("[site]\nlatitude = 58.9\nlongitude = 5.6\nbearing_deg = 700", "site.bearing_deg", "is 700, allowed: -360 or more and at most"),
        ("[sea]\nlevel = -1.0", "sea.level", "the tank's floor, 0 m, or above"),
        ("[demo]\nfluid.particle_spacing = -1.0", "", ""),
    ],
)  # fmt: skip
def test_mistake_in_a_table_is_found_and_explained(extra: str, path: str, part: str, tmp_path: Path) -> None:
    if path:
        found = problems_of(extra)
        assert path in found, found
        assert part in found[path]
        return
    file = tmp_path / "bad-demo.toml"
    file.write_text(SMALL + extra)
    with pytest.raises(ScenarioError, match=r"demo\.fluid\.particle_spacing is -1"):
        load_scenario(file)


def test_all_mistakes_are_reported_at_once() -> None:
    """One of each kind: unknown key, wrong type, impossible value, wrong reference, outside the tank."""
    found = problems_of(
        '[probes.p]\nkind = "body"\nbody = "rock"',
        instead={
            "duration = 0.1": "duration = 0.1\nseeds = 3",
            "particle_spacing = 0.1": 'particle_spacing = "small"',
            "density = 1000.0": "density = -1.0",
            'phase = "water"': 'phase = "milk"',
            "top = 0.3": "top = 3.0",
        },
    )
    assert set(found) == {
        "run.seeds",
        "fluid.particle_spacing",
        "phases.water.density",
        "fill.sea.phase",
        "fill.sea",
        "probes.p.body",
    }


def test_suffixes_convert_to_si() -> None:
    """1 kn = 1852 / 3600 m/s, 180 deg = pi rad."""
    scenario = scenario_from(tomllib.loads(SMALL + "[sea.wind]\nspeed_kn = 10\ndirection_deg = 180"))
    assert scenario.sea.wind is not None
    assert scenario.sea.wind.speed == pytest.approx(18520.0 / 3600.0, rel=1e-12)
    assert scenario.sea.wind.direction == pytest.approx(math.pi, rel=1e-12)


BREEZE = """
[tow]
speed_kn = 0.5
heading_compass = 45
[sea.wind]
speed_kn = 20
from_compass = 270
[sea.current]
speed_kn = 0.3
toward_compass = 180
"""


def test_sailors_give_compass_courses_and_winds_by_where_they_come_from(tmp_path: Path) -> None:
    scenario = scenario_from(tomllib.loads(SMALL + BREEZE))
    assert scenario.tow is not None and scenario.sea.wind is not None and scenario.sea.current is not None
    assert math.degrees(scenario.tow.heading) == pytest.approx(45.0)  # north-east, between +x and +y
    assert math.degrees(scenario.sea.wind.direction) == pytest.approx(0.0)  # a west wind blows to the east
    assert math.degrees(scenario.sea.current.direction) == pytest.approx(-90.0)
    turned = SMALL + BREEZE + "[site]\nlatitude = 58\nlongitude = 5\nbearing_deg = 0\n"  # x is north, y west
    scenario = scenario_from(tomllib.loads(turned))
    assert scenario.tow is not None and scenario.sea.wind is not None
    assert math.degrees(scenario.tow.heading) == pytest.approx(-45.0)
    assert math.degrees(scenario.sea.wind.direction) == pytest.approx(-90.0)
    file = tmp_path / "breeze.toml"
    file.write_text(SMALL + BREEZE)
    for order in ("sea.wind.direction_deg=90", "sea.wind.from_compass=180"):
        wind = load_scenario(file, overrides=[order]).scenario.sea.wind
        assert wind is not None and math.degrees(wind.direction) == pytest.approx(90.0)


def test_the_sea_takes_compass_courses_too() -> None:
    changes = [
        "sea.wind={kind='steady',speed=8,from_compass=225}",
        "sea.waves={kind='regular',height=0.4,period=4,from_compass=270}",
        "sea.current={kind='steady',speed=0.2,toward_compass=180}",
    ]
    sea = load_scenario("sweep-200m", overrides=changes).scenario.sea
    assert isinstance(sea.wind, SteadySeaWind) and isinstance(sea.current, SteadySeaCurrent)
    assert isinstance(sea.waves, RegularSeaWaves)
    assert math.degrees(sea.wind.direction) == pytest.approx(45.0)  # a south-west wind blows to the north-east
    assert math.degrees(sea.waves.direction) == pytest.approx(0.0)
    assert math.degrees(sea.current.direction) == pytest.approx(-90.0)


@pytest.mark.parametrize(
    ("wind", "path", "text"),
    [
        ("from_compass = 400", "sea.wind.from_compass", "is 400, allowed: a number, 0 to 360 degrees"),
        ("from_compass = 'west'", "sea.wind.from_compass", "is 'west', allowed: a number"),
        ("from_compass = 10\ndirection_deg = 3", "sea.wind.from_compass", "is given beside direction_deg"),
        ("toward_compass = 10", "sea.wind.toward_compass", "is unknown"),
    ],
)
def test_wrong_compass_courses_are_refused(wind: str, path: str, text: str) -> None:
    found = problems_of(f"[sea.wind]\nspeed = 5\n{wind}\n[tow]\nspeed = 0.2\nheading_compass = -1\n")
    assert text in found[path]
    assert set(found) == {path, "tow.heading_compass"}


def test_an_unknown_key_is_answered_with_all_ways_to_give_a_course_or_a_speed() -> None:
    found = problems_of("[tow]\nspeed_knots = 1\nheading_compas = 90\n[sea.current]\nspeed = 0.1\nfrom_compass = 90\n")
    assert (
        "did you mean 'heading_compass'? allowed: speed or speed_kn, heading or heading_deg or heading_compass, start"
        in found["tow.heading_compas"]
    )
    assert "did you mean 'speed_kn'?" in found["tow.speed_knots"]
    assert "direction or direction_deg or toward_compass" in found["sea.current.from_compass"]


def sections_at(kind: Any, place: Sequence[str]) -> Iterator[type[Section]]:
    """Yield the sections of a type of fields at a place, through tables of names, lists and kinds."""
    if isinstance(kind, type) and issubclass(kind, Section):
        if not place:
            yield kind
        elif place[0] in field_kinds(kind):
            yield from sections_at(field_kinds(kind)[place[0]], place[1:])
    elif get_origin(kind) in (Mapping, tuple):
        yield from sections_at(get_args(kind)[-1 if get_origin(kind) is Mapping else 0], place[1:])
    else:
        for part in get_args(kind):
            yield from sections_at(part, place)


def test_every_section_names_the_compass_key_that_its_place_takes() -> None:
    for place, alias in PLACES.items():
        found = [one for one in sections_at(Scenario, place) if COMPASS[alias] in field_kinds(one)]
        assert found, place
        assert {one.COMPASS for one in found} == {alias}, place


def test_overrides_reach_tables_lists_and_new_entries(tmp_path: Path) -> None:
    file = tmp_path / "small.toml"
    file.write_text(SMALL)
    scenario = load_scenario(
        file,
        overrides=[
            "phases.oil.dynamic_viscosity=0.1",
            "tank.upper.2=2",
            "fluid.scheme=paper",
            "sea.wind.speed_kn=2",
            "fluid.gravity=[0, 0, -1.62]",
        ],
    ).scenario
    assert scenario.phases["oil"].viscosity == 0.1
    assert scenario.phases["oil"].rest_density == 835.0
    assert scenario.tank.upper == (1.0, 1.0, 2.0)
    assert scenario.fluid.scheme == "paper"
    assert scenario.fluid.gravity == (0.0, 0.0, -1.62)
    assert scenario.sea.wind is not None


def test_override_replaces_the_other_spellings(tmp_path: Path) -> None:
    file = tmp_path / "small.toml"
    file.write_text(
        SMALL + "[sea.current]\nspeed = 0.1\n[bodies.b]\nshape='sphere'\nradius=0.1\nposition=[0,0,0]\nmass=1.0\n"
    )
    scenario = load_scenario(
        file, overrides=["sea.current.speed_kn=1", "phases.water.oil=maya", "bodies.b.density=500"]
    ).scenario
    assert scenario.sea.current is not None
    assert scenario.sea.current.speed == pytest.approx(1852.0 / 3600.0)
    assert scenario.phases["water"].rest_density == 926.0
    assert scenario.bodies["b"].mass is None


@pytest.mark.parametrize(
    ("override", "part"),
    [
        ("fluid.particle_spacing", "allowed: key=value"),
        ("=3", "allowed: key=value"),
        ("tank.upper.7=3", "allowed: 0 to 2"),
        ("tank.upper.0.1=3", "has no entry"),
        ("tank.upper.--1=3", "names entry '--1', allowed: 0 to 2"),
        ("tank.upper.\u00b2=3", "names entry '\u00b2', allowed: 0 to 2"),
        (f"tank.upper.{'9' * 5000}=3", "allowed: 0 to 2"),
        ("tank.open.0='+z'", "names entry '0' of an empty list, allowed: the whole list"),
        ("fluid.particle_spacng=3", "did you mean 'particle_spacing'?"),
    ],
)
def test_override_that_leads_nowhere_is_refused(override: str, part: str, tmp_path: Path) -> None:
    file = tmp_path / "small.toml"
    file.write_text(SMALL.replace("[tank]", "[tank]\nopen = []"))
    with pytest.raises(ScenarioError) as caught:
        load_scenario(file, overrides=[override])
    assert part in str(caught.value)


def test_a_date_of_toml_is_text_where_text_is_wanted(tmp_path: Path) -> None:
    file = tmp_path / "small.toml"
    file.write_text(SMALL + "[site]\nlatitude = 58.9\nlongitude = 5.6\nstart = 2026-04-01")
    site = load_scenario(file).scenario.site
    assert site is not None and site.start == "2026-04-01"
    site = load_scenario(file, overrides=["site.start=2026-05-01T08:00:00Z"]).scenario.site
    assert site is not None and site.start == "2026-05-01T08:00:00+00:00"
    with pytest.raises(ScenarioError, match=r"site\.latitude is datetime\.date"):
        load_scenario(file, overrides=["site.latitude=2026-05-01"])


def test_lists_of_tables_are_reached_by_name(tmp_path: Path) -> None:
    legs = "legs = [{start = 0, speed = 1, heading = 0}, {start = 5, speed = 0, heading = 0}]"
    vessel = f"length=0.5\nbeam=0.2\ndraft=0.1\ndepth=0.3\nposition=[0.5, 0.5]\nbollard_pull=1\nyaw_moment=1\n{legs}"
    file = tmp_path / "small.toml"
    file.write_text(f"{SMALL}[vessels.v]\n{vessel}")
    scenario = load_scenario(file, overrides=["vessels.v.legs.1.speed_kn=2"]).scenario
    assert scenario.vessels["v"].legs[1].speed == pytest.approx(2 * 1852.0 / 3600.0)
    assert scenario.vessels["v"].legs[0].speed == 1.0


def test_missing_file_names_the_shipped_scenarios() -> None:
    with pytest.raises(ScenarioError, match="did you mean 'calm-spread'"):
        load_scenario("calm-sprad")


def test_broken_toml_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "broken.toml"
    file.write_text("[run\n")
    with pytest.raises(ScenarioError, match="cannot be read"):
        load_scenario(file)


def test_mesh_path_starts_at_the_scenario_file(tmp_path: Path) -> None:
    (tmp_path / "rock.stl").write_text("solid\nendsolid\n")
    file = tmp_path / "small.toml"
    file.write_text(
        SMALL + '[bodies.b]\nshape = "mesh"\nfile = "rock.stl"\nposition = [0.0, 0.0, 0.0]\nmotion = "fixed"'
    )
    body = load_scenario(file).scenario.bodies["b"]
    assert isinstance(body, MeshBody)
    assert body.file == str(tmp_path / "rock.stl")


@pytest.mark.parametrize("name", sorted(library_paths()))
@pytest.mark.parametrize("demo", [False, True])
def test_shipped_scenarios_are_sound(name: str, demo: bool) -> None:
    scenario = load_scenario(name, demo=demo).scenario
    assert scenario.name == name
    assert scenario.title


def test_a_change_of_a_fidelity_or_level_holds_where_this_is_chosen() -> None:
    fine = load_scenario("sweep-200m", overrides=["fidelity=fine", "fidelities.fine.window.spacing=0.3"]).scenario
    assert fine.window is not None and fine.window.spacing == 0.3
    hard = load_scenario(
        "sweep-200m", overrides=["levels.hard.sea.waves.significant_height=0.6", "level=hard"]
    ).scenario
    assert hard.sea.height_and_period[0] == 0.6


def test_an_exercise_offers_fidelities_and_refuses_others() -> None:
    """A tank is fine, and none without it; a table of changes offers another one."""
    for name, fidelity, boxes in (
        ("u-sweep", None, {"tank"}),
        ("u-sweep", "fine", {"tank"}),
        ("u-sweep", "none", set()),
        ("sweep-200m", None, set()),
        ("sweep-200m", "live", {"window"}),
        ("sweep-200m", "fine", {"window"}),
    ):
        chosen = [] if fidelity is None else [f"fidelity={fidelity}"]
        assert load_scenario(name, overrides=chosen).scenario.parts.boxes == boxes, (name, fidelity)
    with pytest.raises(ScenarioError, match=r"fidelity is 'live', allowed in this exercise: fine, none; live needs"):
        load_scenario("u-sweep", overrides=["fidelity=live"])
    with pytest.raises(ScenarioError, match=r"fidelity is 'fine', allowed in this exercise: none; fine needs"):
        load_scenario("shore-seal", overrides=["fidelity=fine"])
    assert problems_of("[fidelities.best]\nrun.seed = 2")["fidelities.best"].startswith("is no fidelity, allowed")


def test_a_window_takes_the_place_of_a_tank() -> None:
    """Its water is the sea around it, as deep as the tank's was; without particles it has no walls, and a floor."""
    window = "window={target='main', size=[3.0, 3.0], depth=0.5, spacing=0.1}"
    for changes, there in (([window], True), (["fidelity=none"], False)):
        spec = resolve(load_scenario("u-sweep", overrides=changes).scenario)
        assert (spec.tanks, spec.window is not None) == ((), there)
        assert (spec.sea.level, spec.sea.depth) == pytest.approx((0.6, 0.6))
        assert spec.domain.closed_sides == ("-z",) and spec.period == (0.0, 0.0)
        assert (list(spec.spills), spec.left_out) == (["slick"], ("fill.water",))
