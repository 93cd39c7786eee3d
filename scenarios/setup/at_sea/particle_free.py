"""A run without particles, or outside its window (`run.detail`): the sea by formulas, and bodies that it loads.

The liquid of the scenario is not simulated. A scenario without a [sea] gets one from its tank and its [forcing], so that any exercise can
be run both ways.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from scenarios.problems import Problem, ScenarioError
from scenarios.scenario import Scenario
from scenarios.schema.liquid import BlockFill, SlabFill
from scenarios.schema.probe_settings import BodyProbe
from scenarios.schema.sea import RegularSeaWaves, SeaSettings, SteadySeaCurrent, SteadySeaWind
from scenarios.schema.weather import CurrentSettings, ForcingSettings

if TYPE_CHECKING:
    from trimesh import Trimesh

    from booms.reel import Track
    from coupling.bullet.rigid_body_world import RigidBodyWorld
    from coupling.solids.bodies import MassProperties
    from oilsim.loads.load_model import LoadModel
    from oilsim.sea import Sea
    from scenarios.setup.fleet import Fleet
    from scenarios.setup.solids.placed_solids import Solid

WEATHER_OF_THE_SEA = 'run.detail is "{}": the weather is that of [sea], so {} is left out'
LEFT_OUT = 'run.detail is "{}": oil is a slick of parcels, and the sea is formulas, so {} is left out'


def without_particles(scenario: Scenario) -> Scenario:
    """Return the scenario as it is run: with a sea and without its liquid if it is run without particles, else as it is."""
    if scenario.run.has_particles:
        return scenario
    sea = scenario.sea or _sea_of_the_tank(scenario)
    steady = sea.current if isinstance(sea.current, SteadySeaCurrent) else None
    current = None if steady is None else CurrentSettings(speed=steady.speed, direction=steady.direction)
    probes = {name: probe for name, probe in scenario.probes.items() if isinstance(probe, BodyProbe)}
    fluid = replace(scenario.fluid, sleep_speed=0.0)  # regions of a whole sea without water would cost a step's time
    forcing = ForcingSettings(current=current)
    return replace(scenario, fluid=fluid, fill={}, emitters={}, probes=probes, sea=sea, forcing=forcing)


def sea_depth(scenario: Scenario) -> float:
    """Return the depth [m] of the sea of a run without particles, or outside its windows."""
    return (scenario.sea or _sea_of_the_tank(scenario)).depth


def left_out(scenario: Scenario) -> tuple[str, ...]:
    """Say what of the scenario as written a run without particles leaves out; empty for other runs."""
    if scenario.run.has_particles:
        return ()
    names = [f"fill.{name}" for name, fill in scenario.fill.items() if not scenario.phases[fill.phase].is_oil]
    names += [f"emitters.{name}" for name, pipe in scenario.emitters.items() if not scenario.phases[pipe.phase].is_oil]
    names += [f"probes.{name}" for name, probe in scenario.probes.items() if not isinstance(probe, BodyProbe)]
    told = [LEFT_OUT.format(scenario.run.detail, ", ".join(names))] if names else []
    weather = [f"forcing.{name}" for name, table in vars(scenario.forcing).items() if table is not None]
    if scenario.sea is not None and weather:
        told.append(WEATHER_OF_THE_SEA.format(scenario.run.detail, ", ".join(weather)))
    return tuple(told)


def load_bodies(world: RigidBodyWorld, scenario: Scenario, sea: Sea, fleet: Fleet, solids: Sequence[Solid]) -> None:
    """Let the sea load all free bodies of the world; ScenarioError with every body that does not float."""
    from oilsim.loads.morison import FloatingBodies
    from scenarios.setup.solids.placed_solids import table_entry

    models = dict(_models_of_fleet(fleet))
    problems = []
    for solid in solids:
        if solid.motion != "free" or not solid.wetted or solid.name in models:
            continue
        try:
            placed = solid.placed
            models[solid.name] = loads_of_mesh(placed.mesh, placed.mass_properties, sea.description.density)
        except ValueError as error:
            problems.append(
                Problem(table_entry(solid.name), f'{error}, allowed with run.detail = "none": bodies that float')
            )
    if problems:
        raise ScenarioError(problems)
    tracks = tuple(_tracks(scenario, fleet, list(models)))
    if tracks:
        from booms.reel import ReeledBodies

        world.set_environment(ReeledBodies(list(models.values()), sea, tracks), list(models))
    else:
        world.set_environment(FloatingBodies(list(models.values()), sea), list(models))


def _tracks(scenario: Scenario, fleet: Fleet, names: Sequence[str]) -> Iterator[Track]:
    """Yield the lines of booms on reels; names of the loaded bodies."""
    from scenarios.setup.boom_lines import track_off_reel

    for name, layout in fleet.booms.items():
        track = track_off_reel(layout, scenario.booms[name], names.index(layout.segments[0].name))
        if track is not None:
            yield track


def _models_of_fleet(fleet: Fleet) -> Iterator[tuple[str, LoadModel]]:
    from booms.loads import segment_loads
    from scenarios.schema.exercise import body_of
    from vessels.loads import hull_loads, with_superstructure

    for layout in fleet.booms.values():
        model = segment_loads(layout.segment, layout.boom)
        yield from ((segment.name, model) for segment in layout.segments)
    for vessel in fleet.vessels:
        model, above = hull_loads(vessel.hull), vessel.superstructure
        if above is not None and above.area > 0.0:
            model = with_superstructure(model, above.area, above.drag_coefficient, above.center)
        yield body_of(vessel.name), model


def loads_of_mesh(mesh: Trimesh, properties: MassProperties, water_density: float) -> LoadModel:
    """Return the load model of a body of any shape, afloat upright as its mesh is drawn; ValueError for one that sinks.

    mesh [m] is about the body's centre of mass; water_density [kg/m3].
    """
    from coupling.solids.hydrostatics import hydrostatics, waterline_for_volume
    from vessels.hull import Hull
    from vessels.loads import hull_loads

    waterline = waterline_for_volume(mesh, properties.mass / water_density)
    hull = Hull(
        mesh=mesh,
        mass_properties=properties,
        draft=waterline - float(mesh.bounds[0, 2]),
        waterline=waterline,
        water_density=water_density,
        hydrostatics=hydrostatics(mesh, waterline),
    )
    return hull_loads(hull)


def _sea_of_the_tank(scenario: Scenario) -> SeaSettings:
    """Return the sea that the tank's water and the weather on it amount to."""
    forcing, level = scenario.forcing, _level(scenario)
    waves, current, wind = forcing.waves, forcing.current, forcing.wind
    return SeaSettings(
        depth=level - scenario.tank.lower[2],
        level=level,
        waves=None
        if waves is None
        else RegularSeaWaves(height=waves.height, period=waves.period, direction=waves.direction),
        current=None if current is None else SteadySeaCurrent(speed=current.speed, direction=current.direction),
        wind=None
        if wind is None
        else SteadySeaWind(speed=wind.speed, direction=wind.direction, gust_intensity=wind.gustiness),
    )


def _level(scenario: Scenario) -> float:
    """Return the height [m] of the water at the start: the top of the liquid that is no oil, in slabs and blocks."""
    water = [fill for fill in scenario.fill.values() if not scenario.phases[fill.phase].is_oil]
    tops = [fill.top for fill in water if isinstance(fill, SlabFill)]
    tops += [fill.upper[2] for fill in water if isinstance(fill, BlockFill)]
    if not tops:
        problem = Problem(
            "sea", 'is missing, allowed with run.detail = "none": a [sea], or water in a slab or block of [fill]'
        )
        raise ScenarioError([problem], scenario.name)
    return max(tops)
