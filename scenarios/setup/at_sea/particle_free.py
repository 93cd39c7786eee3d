"""A run without particles, or outside its window (`run.detail`): the sea by formulas, and bodies that it loads.

The liquid of the scenario is not simulated.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from scenarios.problems import Problem, ScenarioError
from scenarios.scenario import Scenario
from scenarios.schema.liquid import top_of_water
from scenarios.schema.probe_settings import BodyProbe
from scenarios.schema.sea import SeaSettings
from scenarios.setup.at_sea.build_sea import deep_to_the_floor

if TYPE_CHECKING:
    from trimesh import Trimesh

    from booms.reel import Track
    from coupling.bullet.rigid_body_world import RigidBodyWorld
    from coupling.solids.bodies import MassProperties
    from oilsim.loads.load_model import LoadModel
    from oilsim.sea import Sea
    from scenarios.setup.fleet import Fleet
    from scenarios.setup.solids.placed_solids import Solid

LEFT_OUT = 'run.detail is "{}": oil is a slick of parcels, and the sea is formulas, so {} is left out'


def without_particles(scenario: Scenario) -> Scenario:
    """Return the scenario as it is run: with a sea and without its liquid if it is run without particles, else as it is."""
    if scenario.run.has_particles:
        return scenario
    probes = {name: probe for name, probe in scenario.probes.items() if isinstance(probe, BodyProbe)}
    fluid = replace(scenario.fluid, sleep_speed=0.0)  # regions of a whole sea without water would cost a step's time
    return replace(scenario, fluid=fluid, fill={}, emitters={}, probes=probes, sea=sea_of(scenario))


def sea_of(scenario: Scenario) -> SeaSettings:
    """Return the sea of a run without particles, or outside its windows, with its depth and level: where nothing is said, the tank's."""
    top = top_of_water(scenario.fill, scenario.phases)
    if scenario.sea.depth is None and top is None:
        text = "is missing, allowed without particles: a depth, or water in a slab or block of [fill]"
        raise ScenarioError([Problem("sea.depth", text)], scenario.name)
    return deep_to_the_floor(scenario, top or 0.0)


def left_out(scenario: Scenario) -> tuple[str, ...]:
    """Say what of the scenario as written a run without particles leaves out; empty for other runs."""
    if scenario.run.has_particles:
        return ()
    names = [f"fill.{name}" for name, fill in scenario.fill.items() if not scenario.phases[fill.phase].is_oil]
    names += [f"emitters.{name}" for name, pipe in scenario.emitters.items() if not scenario.phases[pipe.phase].is_oil]
    names += [f"probes.{name}" for name, probe in scenario.probes.items() if not isinstance(probe, BodyProbe)]
    return (LEFT_OUT.format(scenario.run.detail, ", ".join(names)),) if names else ()


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
