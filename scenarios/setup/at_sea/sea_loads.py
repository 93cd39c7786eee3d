"""Bodies that the sea loads, where no particles are, and the shore as pictures show it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from booms.deployment import PlacedBody
from coupling.participants.plan_barriers import Beach
from coupling.solids.bodies import mass_properties
from recordings.model.exercise import GROUND
from scenarios.schema.exercise import BoomSettings
from scenarios.setup.solids.placed_solids import HELD_DENSITY, Solid
from scenarios.text.problems import Problem, ScenarioError

if TYPE_CHECKING:
    from booms.reel import Track
    from coupling.bullet.rigid_body_world import RigidBodyWorld
    from oilsim.loads.load_model import LoadModel
    from oilsim.sea import Sea
    from scenarios.setup.afloat.fleet import Fleet
    from scenarios.setup.solids.placed_solids import Solid


# [m] thickness of the ground in pictures
THICKNESS = 0.5
# times that its sides are halved; numerical; a picture leaves out triangles that reach behind the camera
HALVINGS = 4
# red, green, blue, opacity of sand in pictures
SAND = (196, 178, 138, 255)


def load_bodies(
    world: RigidBodyWorld, booms: Mapping[str, BoomSettings], sea: Sea, fleet: Fleet, solids: Sequence[Solid]
) -> None:
    """Let the sea load all free bodies of the world; ScenarioError with every body that does not float."""
    from oilsim.loads.morison import FloatingBodies
    from scenarios.setup.solids.placed_solids import table_entry

    models = dict(_models_of_fleet(fleet))
    problems = []
    for solid in solids:
        if solid.motion != "free" or not solid.wetted or solid.name in models:
            continue
        try:
            models[solid.name] = loads_of_body(solid.placed, sea.description.density, is_hull=solid.is_hull)
        except ValueError as error:
            problems.append(Problem(table_entry(solid.name), f"{error}, allowed without a tank: bodies that float"))
    if problems:
        raise ScenarioError(problems)
    names, loaded = list(models), list(models.values())
    if fleet.booms:
        from booms.held_water import BodiesWithBooms, chain_of

        chains = [
            chain_of(one.boom, one.segment.waterline, names.index(one.segments[0].name), len(one.segments))
            for one in fleet.booms.values()
            if one.boom.pocket is None  # through which the water runs out below
        ]
        world.set_environment(BodiesWithBooms(loaded, sea, chains, tuple(_tracks(booms, fleet, names))), names)
    else:
        world.set_environment(FloatingBodies(loaded, sea), names)


def _tracks(booms: Mapping[str, BoomSettings], fleet: Fleet, names: Sequence[str]) -> Iterator[Track]:
    """Yield the lines of booms on reels; names of the loaded bodies."""
    from scenarios.setup.afloat.boom_lines import track_off_reel

    for name, layout in fleet.booms.items():
        track = track_off_reel(layout, booms[name], names.index(layout.segments[0].name))
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
        forces, above = vessel.hull_forces, vessel.superstructure
        model = hull_loads(vessel.hull) if forces is None else forces.loads
        if above is not None and above.area > 0.0:
            model = with_superstructure(model, above.area, above.drag_coefficient, above.center)
        yield body_of(vessel.name), model


def loads_of_body(placed: PlacedBody, water_density: float, *, is_hull: bool = False) -> LoadModel:
    """Return the load model of a body that floats as it is placed, in water of `water_density` [kg/m3]; ValueError for one that sinks.

    A hull floats upright as its mesh is drawn, with its bow along x.
    """
    from coupling.solids.hydrostatics import hydrostatics, waterline_for_volume
    from vessels.bluff_body import bluff_body_loads
    from vessels.hull import Hull
    from vessels.loads import hull_loads

    mesh, properties = placed.mesh, placed.mass_properties
    if not is_hull:
        up = Rotation.from_quat(placed.orientation).inv().apply((0.0, 0.0, 1.0))
        return bluff_body_loads(mesh, properties.mass, water_density, up)
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


def shore_solid(beach: Beach, depth: float) -> Solid:
    """Return the ground as pictures show it: from the sea's floor, `depth` [m] under the waterline, as far up as down."""
    run = max(2.0 * depth * np.hypot(1.0, 1.0 / beach.slope), THICKNESS)
    mesh = trimesh.creation.box((run, beach.width, THICKNESS))
    for _ in range(HALVINGS):
        mesh = mesh.subdivide()
    turn = Rotation.from_euler("z", beach.seaward) * Rotation.from_euler("y", np.arctan(beach.slope))
    placed = PlacedBody(
        name=GROUND,
        mesh=mesh,
        mass_properties=mass_properties(mesh, density=HELD_DENSITY),
        position=np.array(beach.waterline) - 0.5 * THICKNESS * np.array(beach.normal),
        orientation=np.asarray(turn.as_quat()),
    )
    return Solid(placed=placed, motion="fixed", contact=False, wetted=False, color=SAND)
