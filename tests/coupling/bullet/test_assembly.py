"""Scenario, test kit and plugin put fluid and bodies together in one way: the same cube moves in the same way under all of them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pybullet
import pytest

from coupling.bullet.assembly import BODIES, FLUID, ExchangeOptions, couple_world
from coupling.bullet.plugin import FluidWorld, attach_fluid
from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.master.body_exchange import Scheme
from coupling.solids.bodies import box, mass_properties
from coupling.solids.surface_sampling import boundary_particles
from coupling.testkit import Basin, Scene, WatchedWorld, assert_draft
from oilsim import Fluid, FluidConfig, Phase, tank_walls
from scenarios.bench.scenario_run import ScenarioRun
from scenarios.spec.load import scenario_from

STEP, SPACING, TIME = 1.0 / 240.0, 0.05, 0.4
SIDE, DENSITY, START, TANK = 0.2, 500.0, (0.3, 0.3, 0.36), (0.6, 0.6, 0.8)
CUBE = {
    "name": "cube",
    "run": {"duration": 2.0, "communication_step": STEP, "threads": 1},
    "fluid": {"particle_spacing": SPACING},
    "phases": {"water": {"density": 1000.0, "dynamic_viscosity": 0.0}},
    "tank": {"lower": [0.0, 0.0, 0.0], "upper": list(TANK), "open": ["+z"]},
    "fill": {"water": {"shape": "slab", "phase": "water", "bottom": 0.0, "top": 0.3}},
    "bodies": {"cube": {"shape": "box", "size": [SIDE] * 3, "density": DENSITY, "position": list(START)}},
}


def cube_in_a_client(client: int, config: FluidConfig, water: np.ndarray) -> tuple[FluidWorld, int]:
    pybullet.setTimeStep(STEP, physicsClientId=client)
    shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.5 * SIDE] * 3, physicsClientId=client)
    cube = pybullet.createMultiBody(DENSITY * SIDE**3, shape, basePosition=START, physicsClientId=client)
    pybullet.changeDynamics(cube, -1, linearDamping=0.0, angularDamping=0.0, physicsClientId=client)
    fluid = Fluid(config, threads=1)
    fluid.add_boundary(tank_walls((0.0, 0.0, 0.0), TANK, SPACING, sides=("-x", "+x", "-y", "+y", "-z")))
    fluid.add_particles(water, phase="water")
    return attach_fluid(client, fluid, [cube]), cube


def test_a_cube_moves_alike_in_scenario_test_kit_and_plugin(
    scenario_run: Callable[..., ScenarioRun], watched_world: Callable[..., WatchedWorld], pybullet_client: int
) -> None:
    scenario = scenario_run(scenario_from(CUBE))
    config, water = scenario.assembly.fluid.config, scenario.assembly.fluid.phase_positions("water").copy()
    world, cube = cube_in_a_client(pybullet_client, config, water)
    plugin = watched_world(world, {"cube": cube}, basin=Basin(TANK[0] * TANK[1], 0.0))
    with Scene(config, communication_step=STEP) as kit:
        kit.add_walls((0.0, 0.0, 0.0), TANK)
        kit.add_body("cube", box((SIDE, SIDE, SIDE)), density=DENSITY, position=START)
        kit.fluid.add_particles(water, phase="water")
        runs = (scenario, kit, plugin)
        for run in runs:
            run.run(TIME)
        heights = [run.readings().body("cube").pose[:, 2] for run in runs]
        np.testing.assert_array_equal(heights[1], heights[0])
        # pybullet's own step puts the cube where the rigid body world's does, but for rounding, which water at rest forgets
        np.testing.assert_allclose(heights[2][:60], heights[0][:60], atol=1e-4)
        draft = kit.draft("cube")
        assert draft > 0.5 * SIDE  # it dips in before it comes up
        for run in runs:
            assert_draft(run, "cube", draft, within=0.1 * SPACING)


def connections_of_a_cube(options: ExchangeOptions) -> list[str]:
    """Connections of a cube's run, as text, after a step that shows that the run can be made."""
    fluid = Fluid(config_of_the_tank(), threads=1)
    world, mesh = RigidBodyWorld(), box((SIDE, SIDE, SIDE))
    world.add_body("cube", mesh, mass_properties(mesh, density=DENSITY), START)
    handle = fluid.add_boundary(boundary_particles("cube", mesh, SPACING))
    coupled = couple_world(fluid, {"cube": handle}, world, options)
    assert [one.name for one in coupled.participants] == [FLUID, BODIES]
    run = coupled.co_simulation(STEP)
    run.initialize()
    run.step()
    assert coupled.exchange.schemes == {"cube": options.scheme or Scheme.MONOLITHIC}
    run.terminate()
    return [str(one) for one in coupled.connections]


def config_of_the_tank() -> FluidConfig:
    water = Phase(name="water", rest_density=1000.0)
    return FluidConfig(particle_spacing=SPACING, phases=(water,), lower=(-0.2, -0.2, -0.2), upper=(0.8, 0.8, 1.0))


def test_bodies_tell_how_they_answer_only_where_the_scheme_asks_it() -> None:
    told = connections_of_a_cube(ExchangeOptions())
    assert told == [
        "bodies:cube.pose -> fluid:cube.pose",
        "bodies:cube.twist -> fluid:cube.twist",
        "bodies:cube.free_acceleration -> fluid:cube.free_acceleration",
        "fluid:cube.wrench -> bodies:cube.wrench",
        "bodies:inverse_mass -> fluid:inverse_mass",
    ]
    lagged = connections_of_a_cube(ExchangeOptions(scheme=Scheme.VIRTUAL_MASS))
    assert lagged == [one for one in told if "inverse_mass" not in one and "free_acceleration" not in one]


def test_a_fluid_without_bodies_is_its_own_run() -> None:
    fluid = Fluid(config_of_the_tank(), threads=1)
    coupled = couple_world(fluid, {}, None)
    assert coupled.bodies is None and coupled.connections == ()
    run = coupled.co_simulation(STEP)
    run.initialize()
    run.step()
    assert fluid.time == STEP
    run.terminate()


def test_a_scheme_that_is_none_is_refused() -> None:
    with pytest.raises(TypeError, match="scheme of the bodies is 'lagged', allowed: None, Scheme"):
        ExchangeOptions(scheme="lagged")  # type: ignore[arg-type]
