"""Moorings of a scenario: what they hold, how they drag and part, and what is refused."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from oilsim.core.physical_constants import GRAVITY
from scenarios.bench.scenario_run import ScenarioRun
from scenarios.running.assembly import build
from scenarios.setup.layout import lay_out
from scenarios.spec.load import scenario_from
from scenarios.spec.resolve import resolve
from scenarios.text.problems import ScenarioError

BASE = """
name = "moored"
fidelity = "none"
[run]
duration = 10.0
communication_step = 0.1
[fluid]
particle_spacing = 0.25
[phases.water]
density = 1027.0
dynamic_viscosity = 1.05e-3
[tank]
lower = [-60.0, -60.0, -10.0]
upper = [60.0, 60.0, 6.0]
[sea]
depth = 8.0
"""
BUOY = """
[bodies.buoy]
shape = "sphere"
radius = 0.5
density = 300.0
position = [0.0, 0.0, 0.2]
"""
BOOM = """
[booms.main]
ends = [[0.0, 9.0], [0.0, -9.0]]
length = 20.0
segments = 8
skirt_depth = 0.5
freeboard = 0.3
ballast_fraction = 0.5
"""
LEG = 'anchor = [25.0, 0.0]\nmass = 25.0\nparts = [{ material = "chain", length = 30.0, diameter = 0.013 }]\n'


def problems_of(text: str) -> dict[str, str]:
    with pytest.raises(ScenarioError) as caught:
        lay_out(resolve(scenario_from(tomllib.loads(text))))
    return {problem.path: problem.text for problem in caught.value.problems}


def test_leg_hangs_from_what_it_holds_to_the_ground() -> None:
    text = (
        BASE
        + BUOY
        + BOOM
        + f'[moorings.buoy]\nbody = "buoy"\n{LEG}[moorings.first]\nboom = "main"\n{LEG}[moorings.inner]\nboom = "main"\njoint = 3\n{LEG}'
    )
    layout = lay_out(resolve(scenario_from(tomllib.loads(text))))
    buoy, first, inner = layout.fleet.legs
    assert buoy.point == pytest.approx([0.0, 0.0, -0.3], abs=5e-3)
    assert buoy.anchor.place == (25.0, 0.0, -8.0)
    assert (first.body, inner.body) == ("boom/main/segment-00", "boom/main/segment-03")
    assert first.point == pytest.approx(layout.fleet.booms["main"].end_points[0])
    assert inner.point == pytest.approx(layout.fleet.booms["main"].joints[2].point)
    joints = layout.world.joint_names
    assert "boom/main/tow-end-0" not in joints  # the moored end is held by its leg alone
    assert "boom/main/tow-end-1" in joints
    assert layout.fleet.tension_joints["main", "end-0"] == "moorings/first"
    assert set(layout.world.lines.names) == {"moorings/buoy", "moorings/first", "moorings/inner"}


def test_anchor_holds_by_its_own_mass_and_a_fixed_one_by_what_is_stated() -> None:
    fluke, fixed = LEG, LEG.replace("mass = 25.0", 'kind = "fixed"')
    text = BASE + BUOY + "".join(
        f'[moorings.{name}]\nbody = "buoy"\n{leg}'
        for name, leg in {
            "light": fluke,
            "heavy": fluke.replace("mass = 25.0", "mass = 40.0"),
            "in_mud": fluke.replace("mass = 25.0", 'mass = 25.0\nground = "mud"'),
            "tested": fluke.replace("mass = 25.0", "mass = 25.0\nholding = 900.0"),
            "ring": fixed,
            "bolt": fixed.replace('"fixed"', '"fixed"\nholding = 5000.0'),
        }.items()
    )  # fmt: skip
    legs = lay_out(resolve(scenario_from(tomllib.loads(text)))).fleet.legs
    holding = {leg.name.removeprefix("moorings/"): leg.anchor.holding for leg in legs}
    assert holding["light"] == pytest.approx(16.0 * 25.0 * GRAVITY)  # ITOPF's least of a Danforth anchor in sand
    assert holding["heavy"] == pytest.approx(16.0 * 40.0 * GRAVITY)
    assert holding["in_mud"] == pytest.approx(13.0 * 25.0 * GRAVITY)
    assert (holding["tested"], holding["ring"], holding["bolt"]) == (900.0, np.inf, 5000.0)


def test_dragging_and_parting_are_told_once_and_read(scenario_run: type[ScenarioRun]) -> None:
    weak = LEG.replace("mass = 25.0", "mass = 25.0\nholding = 1.0").replace("25.0, 0.0]", "28.9, 0.0]")
    text = (
        BASE
        + '[sea.current]\nkind = "steady"\nspeed = 1.0\ndirection_deg = 180.0\n'
        + BUOY
        + f'[moorings.weak]\nbody = "buoy"\n{weak}'
    )
    snapping = weak.replace("holding = 1.0", 'kind = "fixed"').replace("0.013", "0.013, breaking_load = 300.0")
    run = scenario_run(scenario_from(tomllib.loads(text + f'[moorings.snapping]\nbody = "buoy"\n{snapping}')))
    run.run(6.0)
    told = [f"{event.source}: {event.text}" for event in run.history.events]
    lines = run.assembly.world.lines
    assert lines["moorings/snapping"].parted
    assert lines["moorings/weak"].dragged > 0.1
    assert sum("snapping parted" in text for text in told) == 1
    assert sum("drags its anchor" in text for text in told) == 1


def test_everything_wrong_is_told_at_once() -> None:
    text = BASE.replace("upper = [60.0, 60.0, 6.0]", 'upper = [60.0, 60.0, 6.0]\nopen = ["-z"]') + BUOY + BOOM
    text += '[moorings.a]\nbody = "boy"\n' + LEG
    text += '[moorings.b]\nboom = "main"\nbody = "buoy"\n' + LEG
    text += '[moorings.c]\nbody = "buoy"\nground = "rock"\n' + LEG
    text += '[moorings.d]\nboom = "main"\njoint = 9\n' + LEG
    text += '[moorings.e]\nbody = "buoy"\nanchor = [99.0, 0.0]\nparts = []\n'
    long = LEG.replace("length = 30.0", "length = 3000.0")
    text += f'[moorings.f]\nbody = "buoy"\n{long}'
    found = problems_of(text)
    assert found["moorings.a.body"] == "is 'boy', which is no body, did you mean 'buoy'? allowed: buoy"
    assert found["moorings.b.body"] == "is given beside boom, allowed: one of boom or vessel or body"
    assert "finds no hold on rock" in found["moorings.c.kind"]
    assert found["moorings.d.joint"] == "is 9, allowed: 0 to 8, the segments of boom 'main'"
    assert found["moorings.e.parts"] == "is empty, allowed: one part or more, from the anchor up"
    assert found["moorings.e.mass"] == 'is missing, allowed: a number in kg with kind = "fluke"'
    assert found["moorings.f.parts.0.length"] == "is 3000.0, allowed: above 0 and at most 2000 m"


def test_ground_and_length_are_checked_when_everything_has_its_place() -> None:
    short = LEG.replace("length = 30.0", "length = 20.0")
    found = problems_of(BASE + BUOY + f'[moorings.short]\nbody = "buoy"\n{short}')
    assert (
        found["moorings.short.parts"] == "are 20 m long together, allowed: 26.16 m or more, the distance of the anchor"
    )
    bottomless = BASE.replace('fidelity = "none"', "").replace("6.0]\n", '6.0]\nopen = ["-z"]\n', 1)
    water = '[fill.sea]\nshape = "slab"\nphase = "water"\nbottom = -1.0\ntop = 0.0\n'
    coarse = bottomless.replace("particle_spacing = 0.25", "particle_spacing = 5.0").replace(
        "bottom = -1.0", "bottom = -10.0"
    )
    found = problems_of(coarse + water.replace("-1.0", "-10.0") + BUOY + f'[moorings.deep]\nbody = "buoy"\n{LEG}')
    assert found["moorings.deep.anchor"].startswith("lies on no ground: the tank is open below")


@pytest.mark.slow
def test_moorings_and_drives_work_among_particles() -> None:
    """A moored buoy in a current of particles pulls at its leg, and a tug beside it gets under way by its screws."""
    text = """
name = "wet"
run = {duration = 2.0, communication_step = 0.05, threads = 1}
fluid.particle_spacing = 0.25
phases.water = {density = 1000.0, dynamic_viscosity = 1.0e-3}
tank = {lower = [0.0, 0.0, 0.0], upper = [6.0, 4.0, 3.0], periodic = ["x"], open = ["+z"]}
fill.sea = {shape = "slab", phase = "water", bottom = 0.0, top = 1.5, velocity = [0.5, 0.0, 0.0]}
bodies.buoy = {shape = "sphere", radius = 0.5, density = 300.0, position = [3.0, 1.0, 1.6]}
[vessels.tug]
length = 3.0
beam = 0.8
draft = 0.3
depth = 0.7
position = [3.0, 3.0]
bollard_pull = 800.0
control = "manual"
drive = {diameter = 0.2, spacing = 0.4, rudder_area = 0.05}
[moorings.leg]
body = "buoy"
anchor = [0.5, 1.0]
kind = "fixed"
parts = [{ material = "nylon", length = 2.75, diameter = 0.01 }]
"""
    assembly = build(scenario_from(tomllib.loads(text)))
    simulation = assembly.co_simulation()
    simulation.initialize()
    (control,) = (one for one in assembly.participants if one.name == "tug-control")
    control.set("tug.thrust_order", np.array(400.0))
    speeds = []
    for _ in range(30):
        simulation.step()
        speeds.append(assembly.world.twist("vessels/tug")[0])
    pull, buoy = assembly.world.lines["moorings/leg"].tension, assembly.world.pose("buoy")
    assert assembly.particle_counts()["water"] > 1000
    assert 20.0 < pull < 2000.0  # rho / 2 C_d A U^2 is some 60 N, and the water's inertia comes on top
    assert buoy[0] < 3.8  # the leg holds it: the water has gone 0.75 m
    assert speeds[-1] > 0.3 and speeds[-1] > speeds[5]
    simulation.terminate()
