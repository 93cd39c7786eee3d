"""The shore of a run without particles as pictures show it."""

from __future__ import annotations

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from booms.deployment import PlacedBody
from coupling.participants.plan_barriers import Beach
from coupling.solids.bodies import mass_properties
from recordings.model.exercise import GROUND
from scenarios.setup.solids.placed_solids import HELD_DENSITY, Solid

# [m] thickness of the ground in pictures
THICKNESS = 0.5
# times that its sides are halved; numerical; a picture leaves out triangles that reach behind the camera
HALVINGS = 4
# red, green, blue, opacity of sand in pictures
SAND = (196, 178, 138, 255)


def shore_solid(beach: Beach, depth: float) -> Solid:
    """Return the ground as pictures show it: from the sea's floor, `depth` [m] under the waterline, as far up as down."""
    run = 2.0 * depth * np.hypot(1.0, 1.0 / beach.slope)
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
