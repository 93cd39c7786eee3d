"""The shore of a run without particles: its ground, which bodies run into, its picture, and booms that lie on it at the start."""

from __future__ import annotations

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from booms.deployment import BoomLayout, PlacedBody, lay_aground
from coupling.bodies import mass_properties
from coupling.participants.plan_barriers import Beach
from scenarios.scenario import Scenario
from scenarios.setup.placed_solids import HELD_DENSITY, Solid

# [m] thickness of the ground in pictures
THICKNESS = 0.5
# red, green, blue, opacity of sand in pictures
SAND = (196, 178, 138, 255)


def beach_of(scenario: Scenario) -> Beach | None:
    """Return the shore of a scenario; None without one."""
    shore, sea = scenario.shore, scenario.sea
    if shore is None or sea is None:
        return None
    return Beach(
        waterline=(*shore.waterline, sea.level),
        seaward=shore.seaward,
        slope=shore.slope,
        width=shore.width,
        capacity=shore.capacity,
    )


def shore_solid(beach: Beach, depth: float) -> Solid:
    """Return the ground as pictures show it: from the sea's floor, `depth` [m] under the waterline, as far up as down."""
    run = 2.0 * depth * np.hypot(1.0, 1.0 / beach.slope)
    mesh = trimesh.creation.box((run, beach.width, THICKNESS))
    turn = Rotation.from_euler("z", beach.seaward) * Rotation.from_euler("y", np.arctan(beach.slope))
    placed = PlacedBody(
        name=beach.name,
        mesh=mesh,
        mass_properties=mass_properties(mesh, density=HELD_DENSITY),
        position=np.array(beach.waterline) - 0.5 * THICKNESS * np.array(beach.normal),
        orientation=np.asarray(turn.as_quat()),
    )
    return Solid(placed=placed, motion="fixed", contact=False, wetted=False, color=SAND)


def grounded(layout: BoomLayout, scenario: Scenario, water_level: float) -> BoomLayout:
    """Return a boom with the part of it that reaches over the shore lying there; water_level [m]."""
    beach = beach_of(scenario)
    return layout if beach is None else lay_aground(layout, beach.height, water_level)
