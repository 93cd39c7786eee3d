"""What `oilsim check` says, against counts that can be had otherwise."""

from __future__ import annotations

from pathlib import Path

import pytest

from oilsim import tank_walls
from scenarios.cli import main
from scenarios.setup.cost import estimate
from scenarios.setup.simulators import build_simulators
from scenarios.spec.load import library_paths, load_scenario
from scenarios.spec.resolve import resolve
from scenarios.text.problems import ScenarioError

FINE = """
name = "fine"
title = "Oil on water in a shallow dish"
run = {{ duration = 1.0 }}
fluid = {{ particle_spacing = {spacing}, dimension = 2, interfacial_tension = true }}
tank = {{ lower = [0.0, 0.0, 0.0], upper = [0.06, 0.06, 0.06], open = ["+z"] }}
[phases]
water = {{ density = 1027.0, dynamic_viscosity = 1.05e-3 }}
oil = {{ density = 840.0, dynamic_viscosity = 9.0e-3, interfacial_tension = 0.02 }}
[fill]
water = {{ shape = "slab", phase = "water", bottom = 0.0, top = 0.018 }}
oil = {{ shape = "slab", phase = "oil", bottom = 0.018, top = 0.03 }}
"""


def test_particles_of_calm_spread() -> None:
    """The paper's 78.4k, 8.2k and about 175k particles."""
    cost = estimate(load_scenario("calm-spread").scenario)
    assert cost.particles == {"ocean": 78_408, "oil": 8_192}
    assert cost.boundary["tank"] == pytest.approx(175_100, rel=0.02)


def test_wall_particles_are_those_that_are_built() -> None:
    """Area over the area of one; edges and corners, which it counts once, are about 10 % of so small a tank."""
    scenario = load_scenario("still-column").scenario
    tank = scenario.tank
    walls = tank_walls(tank.lower, tank.upper, scenario.fluid.particle_spacing, sides=tank.closed_sides)
    assert estimate(scenario).boundary["tank"] == pytest.approx(len(walls.position), rel=0.2)


def test_pipe_pours_the_papers_20000_particles() -> None:
    cost = estimate(load_scenario("rock-coating").scenario)
    assert cost.emitted == {"oil": pytest.approx(20_000, rel=0.01)}


def test_finer_particles_cost_more() -> None:
    """Half the spacing: 8 times the particles, and no fewer steps."""
    coarse = estimate(load_scenario("still-column", overrides=["fluid.particle_spacing=0.1"]).scenario)
    fine = estimate(load_scenario("still-column", overrides=["fluid.particle_spacing=0.05"]).scenario)
    assert fine.particles["water"] == 8 * coarse.particles["water"]
    assert fine.steps >= coarse.steps
    assert fine.seconds > coarse.seconds
    assert fine.memory > coarse.memory


def test_steps_are_those_that_are_made() -> None:
    """Within a half: falling and splashing liquid steps by how fast it meets liquid, not by how fast it falls."""
    scenario = load_scenario("dam-break", overrides=["run.duration=0.4"]).scenario
    fluid = build_simulators(resolve(scenario)).fluid
    steps = 0
    while fluid.time < 0.4 - 1e-9:
        steps += fluid.advance(scenario.run.communication_step).sub_steps
    fluid.close()
    assert steps / 1.5 < estimate(scenario).steps < 1.5 * steps


def test_check_and_run_tell_an_assumed_tension_without_booms_and_interfaces_that_break_up(tmp_path: Path) -> None:
    """At a spacing of 1.5 mm, 0.8 sigma / (rho g d) of oil of 840 kg/m3 is 1.3 mm, at 2 mm it is less than half a spacing."""
    tension = "fluid.interfacial_tension=true"
    assumed = "the interfacial tension of 'oil' is not given: 0.02 N/m is assumed"
    assert estimate(load_scenario("two-layer", overrides=[tension]).scenario).told == (assumed,)
    for spacing, words in ((0.0015, ("interfaces break up down to 1.3 mm",)), (0.002, ())):
        path = tmp_path / "fine.toml"
        path.write_text(FINE.format(spacing=spacing))
        scenario = load_scenario(path).scenario
        notes = build_simulators(resolve(scenario)).notes
        told = estimate(scenario).told
        assert len(told) == len(notes) == len(words)
        assert all(text.startswith(words) for text in (*told, *notes))


def test_check_finds_what_does_not_fit_at_each_level_and_names_the_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The text of each entry is right; only the sea that is made of them tells that such waves break."""
    text = library_paths()["sweep-200m"].read_text(encoding="utf-8")
    file = tmp_path / "rough.toml"
    file.write_text(text.replace("sea.waves.significant_height = 0.9", "sea.waves.significant_height = 9.9"))
    assert main(["check", str(file)]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"{file}: 1 problem\n  levels.hard.sea.waves significant_height is 9.9 m")
    assert main(["check", "sweep-200m", "--level", "hard", "--set", "injects.veers.at=5.0"]) == 0  # only hard has it
    capsys.readouterr()
    assert main(["check", str(file), "--set", "sea.waves.significant_height=8.8", "--level", "normal"]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"{file}: 1 problem\n  sea.waves significant_height is 8.8 m")


def test_check_tells_thin_air_a_tank_that_is_not_full_and_the_step_of_tension() -> None:
    def told(*changes: str) -> tuple[str, ...]:
        return estimate(load_scenario("drop-in-air", overrides=list(changes)).scenario).told

    assert told() == ()
    thin = told("phases.air.dynamic_viscosity=1.8e-5")
    assert thin == (
        "phases.air: with less than 0.00085 Pa s its particles move by themselves beside a surface, and push it about",
    )
    assert told("fill.air.top=0.0")[-1].startswith("particles fill 54 % of the tank")
    scenario = load_scenario("drop-in-air", overrides=["fluid.minimum_time_step=1e-3"]).scenario
    with pytest.raises(ScenarioError, match=r"minimum_time_step is 0\.001 s, allowed: up to 0\.000252 s"):
        estimate(scenario)
