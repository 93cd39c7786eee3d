"""The wind's drag on what a floating body shows above the water: freeboard, deck and whatever stands on it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import trimesh

from coupling.master.participant import Causality, Participant, Status, StepResult, Variable
from oilsim.backend.arrays import Array
from oilsim.core.physical_constants import AIR_DENSITY
from oilsim.loads.body_axes import rotation_matrices

Wind = Callable[[Array, float], Array]  # (3,) [m/s] at a place (2,) [m] and a time [s]
DRAG_COEFFICIENT = (
    1.0  # [1] of boxes and hulls in the wind; the rule 26 A (V / 40)^2 kgf of responders, V in knots, is 0.98
)
_PANELS = 12.0  # panels of a body's length, by which the waterline cuts its surface finely enough


class Windage:
    """The surface of a body in the wind, by panels: F = 0.5 rho_air Cd A V |V|, with A the area above the water that faces the wind.

    The area is exact for convex bodies; of others, what stands in the lee of the same body counts too.
    """

    def __init__(self, mesh: trimesh.Trimesh, level: float) -> None:
        """Take a closed mesh in the body frame [m], and the level [m] of the still water, below which there is no wind."""
        edge = float(mesh.extents.max()) / _PANELS
        panels = trimesh.Trimesh(*trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, edge), process=False)
        self._center, self._level = np.array(panels.triangles_center), level
        self._outward = np.array(panels.face_normals) * panels.area_faces[:, None]  # [m2]

    def wrench(self, pose: Array, twist: Array, wind: Array) -> Array:
        """Compute force [N] and moment [N m] (6,) of a horizontal wind (3,) [m/s] about the body's origin, in the world frame.

        pose (7,) [m, 1] and twist (6,) [m/s, rad/s] of the body.
        """
        relative = np.asarray(wind, dtype=np.float64) - twist[:3]
        relative[2] = 0.0
        speed = float(np.hypot(relative[0], relative[1]))
        if speed == 0.0:
            return np.zeros(6)
        turn = rotation_matrices(pose[None, 3:])[0]
        arm = self._center @ turn.T
        facing = np.maximum(0.0, -(self._outward @ turn.T) @ (relative / speed))
        facing[arm[:, 2] + pose[2] <= self._level] = 0.0
        area = float(facing.sum())
        force = 0.5 * AIR_DENSITY * DRAG_COEFFICIENT * area * speed * relative
        center = facing @ arm / area if area > 0.0 else np.zeros(3)
        return np.concatenate([force, np.cross(center, force)])


class WindOnBodies(Participant):
    """The wind on floating bodies that no helmsman steers.

    Inputs: <body>.pose (7,) [m, 1], <body>.twist (6,) [m/s, rad/s]. Output: <body>.applied_wrench (6,) [N, N m].
    """

    def __init__(self, bodies: Mapping[str, Windage], wind: Wind) -> None:
        """Take the surfaces of the bodies by name, and the wind (3,) [m/s] by place (2,) [m] and time [s]."""
        self._bodies, self._wind = dict(bodies), wind
        super().__init__("wind", _variables(list(bodies)))
        for body in bodies:
            self._values[f"{body}.pose"][6] = 1.0

    @property
    def body_names(self) -> tuple[str, ...]:
        """Names of the bodies in the wind."""
        return tuple(self._bodies)

    def do_step(self, time: float, step_size: float) -> StepResult:
        """Choose the wrenches that act from `time` to `time + step_size` [s]."""
        for body, windage in self._bodies.items():
            pose, twist = self._values[f"{body}.pose"], self._values[f"{body}.twist"]
            self._values[f"{body}.applied_wrench"] = windage.wrench(pose, twist, self._wind(pose[:2], time))
        return StepResult(Status.OK, time + step_size)


def _variables(bodies: Sequence[str]) -> list[Variable]:
    given, taken = Causality.INPUT, Causality.OUTPUT
    found = []
    for body in bodies:
        found += [Variable(f"{body}.pose", "m, 1", (7,), given), Variable(f"{body}.twist", "m/s, rad/s", (6,), given)]
        found.append(Variable(f"{body}.applied_wrench", "N, N m", (6,), taken))
    return found
