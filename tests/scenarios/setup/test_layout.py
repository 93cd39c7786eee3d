"""What is laid out before a run: every problem of it at once, the same for `check` as for `run`; and what bodies take of the liquid."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
import trimesh

from oilsim import FluidConfig
from scenarios.cli import main
from scenarios.running.assembly import build
from scenarios.setup.cost import estimate
from scenarios.spec.load import scenario_from
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import ScenarioError

TANK = """
name = "slick"
[run]
duration = 0.02
threads = 1
[fluid]
particle_spacing = 0.1
[phases.water]
density = 998.0
dynamic_viscosity = 1.0e-3
[phases.brent]
oil = "brent"
[tank]
lower = [0.0, 0.0, 0.0]
upper = [1.0, 1.0, 1.0]
open = ["+z"]
[fill.pool]
shape = "slab"
phase = "water"
bottom = 0.0
top = 0.4
[fill.slick]
shape = "block"
phase = "brent"
lower = [0.2, 0.2, 0.4]
upper = [0.6, 0.6, 0.6]
"""


def ball(radius: float, position: tuple[float, float, float], motion: str = "fixed", name: str = "ball") -> str:
    """A body's table."""
    free = "density = 600.0" if motion == "free" else ""
    return f'[bodies.{name}]\nshape = "sphere"\nradius = {radius}\nposition = {list(position)}\nmotion = "{motion}"\n{free}\n'


def scenario_of(extra: str) -> Scenario:
    return scenario_from(tomllib.loads(TANK + extra))


def problems_of(scenario: Scenario) -> dict[str, str]:
    """By path, what both `check` and `run` refuse."""
    with pytest.raises(ScenarioError) as checked:
        estimate(scenario)
    with pytest.raises(ScenarioError) as built:
        build(scenario)
    assert checked.value.problems == built.value.problems
    return {problem.path: problem.text for problem in built.value.problems}


def test_the_terms_of_the_liquid_are_those_of_its_table() -> None:
    """Each other than by default."""
    given = {
        "divergence_tolerance": 3e-4, "relaxation": 0.2, "viscosity_correction": 0.3,
        "minimum_time_step": 2e-4, "maximum_time_step": 5e-3, "sleep_speed": 0.01,
    }  # fmt: skip
    lines = "".join(f"{name} = {value}\n" for name, value in given.items())
    text = TANK.replace("particle_spacing = 0.1\n", "particle_spacing = 0.1\n" + lines)
    config = build(scenario_from(tomllib.loads(text))).fluid.config
    assert {name: getattr(config, name) for name in given} == given
    assert all(getattr(FluidConfig, name) != value for name, value in given.items())


def test_oil_that_lies_in_a_body_altogether_is_refused() -> None:
    found = problems_of(scenario_of(ball(0.38, (0.4, 0.4, 0.5))))
    assert found == {"fill.slick": "has all its 32 particles inside bodies, allowed: a region that extends beyond them"}


def test_liquid_that_bodies_take_the_place_of_is_told_once_and_not_counted() -> None:
    """What starts is what `check` counts; oil is warned of, water is what the body displaces."""
    scenario = scenario_of(ball(0.15, (0.5, 0.5, 0.4)))
    assembly = build(scenario)
    cost, counts = estimate(scenario), assembly.particle_counts()
    assert cost.particles == {name: counts[name] for name in ("water", "brent")}
    assert 0 < cost.particles["brent"] < 32
    assert cost.particles["water"] < 400
    water, oil = assembly.remarks.look(None)
    taken = 32 - counts["brent"]
    assert (
        oil.text
        == f"fill.slick: {taken} litres of its 32 litres are inside bodies, or at their surface, and are left out"
    )
    assert (water.level, oil.level) == ("info", "warning")
    assert water.text.startswith(f"fill.pool: {400 - counts['water']} litres of its 400 litres")
    assert assembly.remarks.look(None) == []


def test_check_says_what_bodies_take_and_refuses_what_run_does(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "slick.toml"
    file.write_text(TANK + ball(0.15, (0.5, 0.5, 0.4)))
    assert main(["check", str(file)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "fill.slick: " in said
    assert "litres of its 32 litres are inside bodies, or at their surface, and are left out" in said
    file.write_text(TANK + ball(0.15, (0.5, 0.5, 0.05), "free"))
    assert main(["check", str(file)]) == 2
    assert "bodies.ball has body 'ball' 0.1 m deep inside a side of the tank" in capsys.readouterr().err


def test_liquid_beside_bodies_is_not_remarked_on() -> None:
    scenario = scenario_of(ball(0.1, (0.8, 0.8, 0.8), "free"))
    assert estimate(scenario).left_out == {}
    assert build(scenario).remarks.look(None) == []


def test_everything_that_cannot_be_placed_is_told_at_once(tmp_path: Path) -> None:
    """A boom that does not float, an open mesh, a body smaller than a particle, two bodies in each other, pipes out of the tank and in a
    body, and an empty region."""
    box = trimesh.creation.box((0.2, 0.2, 0.2))
    box.update_faces(np.arange(len(box.faces)) > 0)
    box.export(tmp_path / "open.stl")
    bad = problems_of(
        scenario_of(
            f'[bodies.hull]\nshape = "mesh"\nfile = "{tmp_path / "open.stl"}"\nposition = [0.8, 0.8, 0.5]\nmotion = "fixed"\n'
            + ball(0.001, (0.8, 0.2, 0.5), name="speck")
            + ball(0.1, (0.8, 0.5, 0.7), "free", name="one")
            + ball(0.1, (0.8, 0.55, 0.7), "free", name="two")
            + "[booms.b]\nends = [[0.2, 0.2], [0.8, 0.2]]\nlength = 0.7\nskirt_depth = 0.2\nfreeboard = 0.1\nbuoyancy_to_weight = 500.0\n"
            + '[emitters.out]\nphase = "brent"\nmouth = [0.3, 0.3, 0.9]\nradius = 0.05\nspeed = 0.1\n'
            + '[emitters.in]\nphase = "brent"\nmouth = [0.8, 0.55, 0.65]\nradius = 0.05\nspeed = 0.1\n'
            + '[fill.drop]\nshape = "cylinder"\nphase = "brent"\nbase = [0.5, 0.5, 0.75]\nradius = 0.01\nheight = 0.01\n'
        )
    )
    assert "cannot be laid: buoyancy_to_weight is 500, allowed: " in bad["booms.b"]
    assert "cannot be built" in bad["bodies.hull"]
    assert "is too small for particles of 0.1 m" in bad["bodies.speck"]
    assert "has body 'one' 0.15 m deep inside body 'two'" in bad["bodies.one"]
    assert "has a pipe from z = 0.85 to 1.15 m" in bad["emitters.out.mouth"]
    assert "lies in body 'two' at the start" in bad["emitters.in.mouth"]
    assert "has no particle" in bad["fill.drop"]
    assert len(bad) == 7


def test_a_fixed_body_out_of_the_tank_is_refused() -> None:
    """One with lengths in millimetres is refused; one that a motion leads in is not, nor one that falls in from above."""
    found = problems_of(scenario_of(ball(0.1, (500.0, 0.5, 0.5))))
    assert found == {"bodies.ball": "is fixed at x = 499.9 to 500.1 m, allowed: inside the tank, 0 to 1 m"}
    above = ball(0.1, (0.5, 0.5, 1.5), "free", name="above")
    led = '[bodies.led]\nshape = "sphere"\nradius = 0.1\nposition = [0.5, 0.5, 2.5]\n'
    stroke = 'motion = {kind = "sine", direction = [0.0, 0.0, 1.0], amplitude = 2.0, period = 4.0}\n'
    assert estimate(scenario_of(above + led + stroke)).left_out == {}


def test_a_boom_is_not_told_for_its_vessel() -> None:
    """A vessel that is no hull has no boom laid behind it; another boom is told all the same."""
    vessel = "length = 0.001\nbeam = 0.2\ndraft = 0.1\ndepth = 0.2\nposition = [0.5, 0.5]\nbollard_pull = 1.0\nyaw_moment = 1.0\n"
    boom = "length = 0.4\nskirt_depth = 0.2\nfreeboard = 0.1\nbuoyancy_to_weight = 500.0\n"
    found = problems_of(
        scenario_of(
            f'[vessels.v]\ncontrol = "manual"\n{vessel}[booms.a]\nends = ["v", [0.2, 0.5]]\n{boom}'
            f"[booms.b]\nends = [[0.2, 0.2], [0.5, 0.2]]\n{boom}"
        )
    )
    assert set(found) == {"vessels.v", "booms.b"}


BOOM = "skirt_depth = 0.2\nfreeboard = 0.12\nsegments = 12\n"


def test_a_boom_that_is_held_straight_is_refused() -> None:
    """Its tension would have no bound: with a thousandth of its length to give it runs, between vessels it needs none."""
    taut = "[booms.b]\nends = [[0.2, 0.1], [0.2, 0.9]]\nlength = 0.8\n" + BOOM
    told = problems_of(scenario_of(taut))["booms.b"]
    assert "the ends are 0.8 m apart, allowed: at most 0.7992 m for a boom of 0.8 m" in told
    assert "booms.b" not in str(estimate(scenario_of(taut.replace("0.9]", "0.8992]"))))


def test_of_a_boom_that_reaches_far_out_of_the_tank_one_segment_is_told() -> None:
    with pytest.raises(ScenarioError) as caught:
        estimate(scenario_of("[booms.b]\nends = [[0.6, 0.2], [0.6, 0.8]]\nlength = 1.6\n" + BOOM))
    (problem,) = caught.value.problems
    assert problem.path == "booms.b" and "outside the tank at the start, by 0." in problem.text


def test_a_body_that_reaches_through_a_periodic_side_takes_the_place_of_liquid_on_both() -> None:
    """Half a ball kept the liquid that it displaces, which was then pressed out of it, and turned it over."""
    around = TANK.replace('open = ["+z"]', 'open = ["+z"]\nperiodic = ["x"]')
    kept = []
    for x in (0.5, 1.0, 0.0, 7.5):
        scenario = scenario_from(tomllib.loads(around + ball(0.25, (x, 0.5, 0.3), "free")))
        kept.append(sum(estimate(scenario).particles.values()))
    assert kept[0] == kept[3]  # seven tanks on
    assert kept[1] == kept[2] < 480  # of 448 + 32
    pipe = '[emitters.in]\nphase = "brent"\nmouth = [0.1, 0.5, 0.35]\nradius = 0.05\nspeed = 0.1\n'
    told = problems_of(scenario_from(tomllib.loads(around + ball(0.25, (1.0, 0.5, 0.3), "free") + pipe)))
    assert "lies in body 'ball' at the start" in told["emitters.in.mouth"]
