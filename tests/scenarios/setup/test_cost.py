"""What `oilsim check` says, against counts that can be had otherwise."""

from __future__ import annotations

import pytest

from oilsim.boundaries.boundary_particles import tank_walls
from scenarios.load import load_scenario
from scenarios.problems import ScenarioError
from scenarios.setup.cost import estimate


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
