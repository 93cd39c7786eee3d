"""The fluid as a participant of a coupled run.

Variables of every coupled body <body>: the inputs `<body>.pose`, `<body>.twist`, `<body>.inverse_mass`, `<body>.free_acceleration` are
the body's motion at the start of a step and its answer to an impulse; the outputs are `<body>.wrench`, the mean over the step, and
`<body>.predicted_twist`, the twist that the fluid expects at its end. The input `inverse_mass` (6 n, 6 n), if it is connected, is the
common answer of all coupled bodies, tied by joints, and replaces their own. Within the step the bodies answer inside the fluid's pressure
solve (`oilsim.pressure.rigid_response`); the rigid engine then makes the same motion from the wrenches, so momentum is transferred
without loss.

Steps of a fixed length that a master asks for by the difference of two times.

Estimates a submerged body's added mass: the mass of liquid that the body accelerates along with itself.

With e_i the direction from the body's surface to a point i of a lattice about it, m_i the liquid's mass that the point stands for, r_i the
surface point and the row j_i = (e_i, r_i x e_i),

    A = sum_i m_i j_i j_i^T    over the points within the depth l of the surface,

the kinetic energy of liquid that follows the normal velocity of the surface. l = c S^(1/2) with S the body's whole surface, c S in
two dimensions (per metre). For a sphere the exact A needs c = 0.101, for a disc 0.169; in two dimensions a cylinder needs 0.117
and a plate 0.196. The value used lies between them, and A is right within a factor of two. The estimate serves to choose how a body is
coupled; no exchange of forces relies on it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np
from scipy.spatial import cKDTree

from coupling.master.participant import Causality, Participant, Status, StepResult, Variable, checked_value
from oilsim import AdvanceReport, BoundaryParticles, Fluid, FluidError, block
from oilsim.backend.arrays import Array
from oilsim.boundaries.walls import rotation_matrix

ROUNDING = 1e-6  # of a step: above what the difference of two times loses, below any other step that is meant


def same_step(asked: float, own: float) -> bool:
    """Tell whether the step `asked` for [s] equals a participant's `own` step [s], up to the rounding of times."""
    return abs(asked - own) <= ROUNDING * own


MOTION_VARIABLES = (
    ("pose", "m, 1", (7,)),
    ("twist", "m/s, rad/s", (6,)),
    ("inverse_mass", "1/kg, 1/(kg m2)", (6, 6)),
    ("free_acceleration", "m/s2, rad/s2", (6,)),
)
OUTPUTS = ("wrench", "predicted_twist")


class FluidParticipant(Participant):
    """Steps a `Fluid`; `boundaries` names the moving bodies it exchanges motion and wrench with, by their handles.

    own_step: where clock and threads of the fluid are somebody else's, the step [s] that it makes together with that one's bodies, to the
    last bit; None for a fluid that is the participant's own.
    """

    STATE: ClassVar[tuple[str, ...]] = ("_fluid", "_inputs", "_outputs", "entered", "left")

    def __init__(
        self, name: str, fluid: Fluid, boundaries: Mapping[str, int], *, own_step: float | None = None
    ) -> None:
        self._own_step = own_step
        self._fluid = fluid
        self._boundaries = dict(boundaries)
        self._inputs = {
            f"{body}.{quantity}": np.zeros(shape)
            for body in self._boundaries
            for quantity, _, shape in MOTION_VARIABLES
        }
        self._outputs = {f"{body}.{what}": np.zeros(6) for body in self._boundaries for what in OUTPUTS}
        inputs = [
            Variable(f"{body}.{quantity}", unit, shape, Causality.INPUT)
            for body in self._boundaries
            for quantity, unit, shape in MOTION_VARIABLES
        ]
        self._joint_inverse_mass: Array | None = None
        if self._boundaries:
            size = 6 * len(self._boundaries)
            inputs.append(Variable("inverse_mass", "1/kg, 1/(kg m), 1/(kg m2)", (size, size), Causality.INPUT))
        outputs = [
            variable
            for body in self._boundaries
            for variable in (
                Variable(f"{body}.wrench", "N, N m", (6,), Causality.OUTPUT, is_mean=True),
                Variable(f"{body}.predicted_twist", "m/s, rad/s", (6,), Causality.OUTPUT),
            )
        ]
        super().__init__(name, [*inputs, *outputs])
        self.report: AdvanceReport | None = None
        none = dict.fromkeys((phase.name for phase in fluid.config.phases), 0)
        self.entered, self.left = none, dict(none)  # particles since the start, by phase

    def enter_initialization_mode(self, start_time: float) -> None:
        """Start the fluid's clock, unless it is somebody else's; boundaries that moved before have their last wrench."""
        if self._own_step is None:
            self._fluid.time = start_time
        moved = self._fluid.moving_boundaries
        for body, handle in self._boundaries.items():
            if handle in moved:
                self._take_outputs(body, handle)

    def get(self, name: str) -> Array:
        """Return a copy of a body's wrench or predicted twist (6,) [N, N m] or [m/s, rad/s]; ValueError for another name."""
        if name not in self._outputs:
            raise ValueError(f"{self.name!r} has no output {name!r}, allowed: {', '.join(self._outputs)}")
        return self._outputs[name].copy()

    def set(self, name: str, value: Array) -> None:
        """Set a body's motion, of the variable's shape (7,), (6,) or (6, 6) and unit [m, m/s]; the next step uses it."""
        checked = checked_value(self.name, self.variables, name, value)
        if name == "inverse_mass":
            self._joint_inverse_mass = checked
        else:
            self._inputs[name] = checked

    def do_step(self, time: float, step_size: float) -> StepResult:
        """Advance the fluid to `time + step_size` [s] in sub-steps that keep the CFL condition.

        The status is ERROR if the fluid's state has become unusable. Raises ValueError for a step other than `own_step`, if there is one.
        """
        duration = self._duration(time, step_size)
        for body, handle in self._boundaries.items():
            pose, twist = self._inputs[f"{body}.pose"], self._inputs[f"{body}.twist"]
            self._fluid.set_boundary_motion(
                handle,
                pose[:3],
                pose[3:],
                twist[:3],
                twist[3:],
                self._inputs[f"{body}.inverse_mass"],
                self._inputs[f"{body}.free_acceleration"],
            )
        if self._joint_inverse_mass is not None:
            self._fluid.set_joint_inverse_mass(tuple(self._boundaries.values()), self._joint_inverse_mass)
        try:
            self._take_report(self._fluid.advance(duration))
        except FluidError as error:
            return StepResult(Status.ERROR, time, str(error), cause=error)
        for body, handle in self._boundaries.items():
            self._take_outputs(body, handle)
        return StepResult(Status.OK, time + step_size)

    def _take_report(self, report: AdvanceReport) -> None:
        """Keep a report, and count the particles that came and went."""
        self.report = report
        for total, counts in ((self.entered, report.emitted), (self.left, report.removed)):
            for phase, count in counts.items():
                total[phase] += count

    def _duration(self, time: float, step_size: float) -> float:
        """How long to advance [s], after the clock was set if it is the participant's to set."""
        if self._own_step is None:
            self._fluid.time = time
            return step_size
        if not same_step(step_size, self._own_step):
            raise ValueError(f"{self.name!r}: step is {step_size} s, allowed: {self._own_step} s, that of its bodies")
        return self._own_step

    def _take_outputs(self, body: str, handle: int) -> None:
        self._outputs[f"{body}.wrench"] = self._fluid.boundary_wrench(handle)
        self._outputs[f"{body}.predicted_twist"] = self._fluid.boundary_twist(handle)

    def expected_twist(self, body: str) -> Array:
        """Return the twist (6,) [m/s, rad/s] that the fluid expects a body to have now, after the wrench it was given."""
        return self._outputs[f"{body}.predicted_twist"].copy()

    def added_mass(self, body: str) -> Array:
        """Return the mass (6, 6) [kg, kg m, kg m2] of the densest liquid that a fully submerged body would move, world frame."""
        config = self._fluid.config
        boundary = self._fluid.boundaries[self._boundaries[body]]
        density = max(phase.rest_density for phase in config.phases)
        turn = np.kron(np.eye(2), rotation_matrix(self._inputs[f"{body}.pose"][3:]))
        added = added_mass(boundary, config.particle_spacing, config.dimension, density)
        return np.asarray(turn @ added @ turn.T)

    def save_state(self) -> Any:
        """Return the fluid's state with its last outputs and inputs; the common inverse mass is set anew for every step."""
        state = super().save_state()
        state["fluid"]["tied"] = None
        return state

    def terminate(self) -> None:
        """End the fluid's threads, unless they are somebody else's."""
        if self._own_step is None:
            self._fluid.close()


DEPTH = {3: 0.13, 2: 0.15}  # c
PATCH = {3: 4, 2: 2}  # nearest wall particles from whose mean a point is seen
FINEST = 32  # points of the lattice along the body at most
ALIKE = 16  # surfaces of which A is kept: the segments of a boom have one


def added_mass(boundary: BoundaryParticles, spacing: float, dimension: int, density: float) -> Array:
    """Return A (6, 6) [kg, kg m, kg m2] in the body's frame, about its origin, in liquid of `density` [kg/m3; kg/m2 in two dimensions].

    The wall particles of `boundary` continue a lattice of `spacing` [m] half a spacing behind the surface.
    """
    position, area = (np.asarray(one, np.float64).tobytes() for one in (boundary.position, boundary.area))
    return _added_mass(position, area, spacing, dimension, density).copy()


@lru_cache(ALIKE)
def _added_mass(positions: bytes, areas: bytes, spacing: float, dimension: int, density: float) -> Array:
    """Return A of `added_mass` for wall particles by the bytes of their positions (M, 3) [m] and areas (M,) [m2]."""
    position, area = np.frombuffer(positions).reshape(-1, 3), np.frombuffer(areas)
    facing = area > 0.0
    surface = float(area.sum())
    depth = DEPTH[dimension] * (math.sqrt(surface) if dimension == 3 else surface)
    low, high = position.min(axis=0), position.max(axis=0)
    step = max(spacing, float((high - low).max()) / FINEST)
    margin = (depth + step) * np.array((1.0, float(dimension == 3), 1.0))
    points = block(low - margin, high + margin, step, dimension=dimension)
    # behind the first layer a second one is nearer, or, where the body is thin, the other side's first
    points = points[facing[cKDTree(position).query(points)[1]]]
    distance, index = cKDTree(position[facing]).query(points, range(1, min(PATCH[dimension], int(facing.sum())) + 1))
    height = distance[:, 0] - 0.5 * spacing  # above the surface
    share = np.clip((depth - height) / step + 0.5, 0.0, 1.0) * (height > 0.0)
    away = points - position[facing][index].mean(axis=1)
    direction = away / np.maximum(np.linalg.norm(away, axis=1), 1e-9 * depth)[:, None]
    rows = np.hstack([direction, np.cross(points - height[:, None] * direction, direction)])
    return np.asarray(np.einsum("i,ij,ik->jk", density * step**dimension * share, rows, rows))
