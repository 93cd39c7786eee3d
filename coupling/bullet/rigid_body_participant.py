"""Rigid bodies as a participant of a coupled run.

Variables of every body <body>: inputs `<body>.wrench` (of the fluid) and `<body>.applied_wrench` (of anything else); outputs
`<body>.pose`, `<body>.twist`, `<body>.free_acceleration`, `<body>.inverse_mass`. Of every joint: output `<joint>.tension`. Of every line:
output `<line>.tension`, input `<line>.length`. Coupled bodies have one common output `inverse_mass` instead of their own. A fixed or
prescribed body accepts wrenches and ignores them. Where only some bodies are asked for, the others and the joints have no variables: a
variable takes a master ten microseconds a step, and a kilometre of boom has a thousand.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.master.participant import Causality, Participant, Status, StepResult, Variable, checked_value
from oilsim.backend.arrays import Array

__all__ = ["RigidBodyParticipant", "RigidBodyWorld"]


BODY_VARIABLES = (
    ("wrench", "N, N m", (6,), Causality.INPUT),
    ("applied_wrench", "N, N m", (6,), Causality.INPUT),
    ("pose", "m, 1", (7,), Causality.OUTPUT),
    ("twist", "m/s, rad/s", (6,), Causality.OUTPUT),
    ("inverse_mass", "1/kg, 1/(kg m2)", (6, 6), Causality.OUTPUT),
    ("free_acceleration", "m/s2, rad/s2", (6,), Causality.OUTPUT),
)
MOBILITY = ("inverse_mass", "free_acceleration")


class Requested(NamedTuple):
    """The variables that others ask for: `bodies` with their own, and one output `poses` (n, 7) of the bodies `followed`."""

    bodies: Sequence[str]
    followed: Sequence[str] = ()


class RigidBodyParticipant(Participant):
    """The participant that steps a `RigidBodyWorld`; bodies and joints are all added before.

    `coupled` has the names of the bodies with one common `inverse_mass` (6 n, 6 n), joints included. Without `gives_mobility` no body
    tells how it answers an impulse, which nobody asks for where there is no fluid. `requested`: what variables there are, all if None.
    """

    STATE = ("_world",)

    def __init__(
        self,
        name: str,
        world: RigidBodyWorld,
        coupled: Sequence[str] = (),
        *,
        gives_mobility: bool = True,
        requested: Requested | None = None,
    ) -> None:
        self._world = world
        self._getters: dict[str, Callable[[], Array]] = {}
        self._setters: dict[str, Callable[[Array], None]] = {}
        declared = []
        for body in world.body_names if requested is None else requested.bodies:
            for quantity, unit, shape, causality in BODY_VARIABLES:
                if quantity in MOBILITY and (not gives_mobility or (quantity == "inverse_mass" and body in coupled)):
                    continue
                variable = Variable(f"{body}.{quantity}", unit, shape, causality)
                declared.append(variable)
                if causality is Causality.INPUT:
                    self._setters[variable.name] = partial(getattr(world, f"set_{quantity}"), body)
                else:
                    self._getters[variable.name] = partial(getattr(world, quantity), body)
        for joint in world.joint_names if requested is None else ():
            declared.append(Variable(f"{joint}.tension", "N", (1,), Causality.OUTPUT, is_mean=True))
            self._getters[declared[-1].name] = partial(self._tension, joint)
        for line in world.lines.names:
            declared += [
                Variable(f"{line}.tension", "N", (1,), Causality.OUTPUT),
                Variable(f"{line}.length", "m", (1,), Causality.INPUT),
            ]
            self._getters[f"{line}.tension"] = partial(self._tension, line)
            self._setters[f"{line}.length"] = partial(self._order_length, line)
        if coupled:
            size = 6 * len(coupled)
            declared.append(Variable("inverse_mass", "1/kg, 1/(kg m), 1/(kg m2)", (size, size), Causality.OUTPUT))
            self._getters["inverse_mass"] = partial(world.coupled_inverse_mass, tuple(coupled))
        if requested is not None and requested.followed:
            declared.append(Variable("poses", "m, 1", (len(requested.followed), 7), Causality.OUTPUT))
            self._getters["poses"] = partial(world.poses, tuple(requested.followed))
        super().__init__(name, declared)

    def enter_initialization_mode(self, start_time: float) -> None:
        """Begin the prescribed motions at `start_time` [s]."""
        self._world.move_to_time(start_time)

    def get(self, name: str) -> Array:
        """Return a copy of an output, of the variable's shape (N,) or (6, 6) and unit [m, m/s, N]; ValueError for another name."""
        if name not in self._getters:
            raise ValueError(f"{self.name!r} has no output {name!r}, allowed: {', '.join(self._getters)}")
        return self._getters[name]()

    def set(self, name: str, value: Array) -> None:
        """Set a wrench (6,) [N, N m] or a length (1,) [m], which acts until it is set again."""
        checked = checked_value(self.name, self.variables, name, value)
        self._setters[name](checked)

    def do_step(self, time: float, step_size: float) -> StepResult:
        """Make sub-steps of equal length up to `time + step_size` [s]."""
        self._world.time = time
        self._world.advance(step_size)
        return StepResult(Status.OK, time + step_size)

    def terminate(self) -> None:
        """Close the client."""
        self._world.close()

    def _order_length(self, line: str, length: Array) -> None:
        self._world.lines.order_length(line, float(length[0]))

    def _tension(self, joint: str) -> Array:
        return np.array([self._world.tension(joint)])
