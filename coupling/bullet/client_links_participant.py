"""Links of a pybullet client that the user owns, as a participant of a coupled run.

A link is named <body>/<link> by the body's unique id and the link's index, -1 for the base. Each link that meets the fluid has these
variables; a link that is held takes wrenches and ignores them:

    <link>.wrench             input (6,) [N, N m]: the fluid's force and torque on the link
    <link>.pose               output (7,) [m, 1]
    <link>.twist              output (6,) [m/s, rad/s]
    <link>.free_acceleration  output (6,) [m/s2, rad/s2]: the acceleration without the fluid

All n links together have the output `inverse_mass` (6 n, 6 n) [1/kg, 1/(kg m), 1/(kg m2)].

The client's owner may move bodies between steps. So the links are observed as each step begins. Between a step and the next observation,
`free_acceleration` and `inverse_mass` keep the values from the start of the step.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from coupling.bullet.client_links import ClientLinks
from coupling.bullet.links import LinkKey
from coupling.master.participant import Causality, Participant, Status, StepResult, Variable, checked_value
from coupling.participants.fluid import same_step
from oilsim.backend.arrays import Array


def link_name(key: LinkKey) -> str:
    """Return the name of a link in a coupled run, as in "3/-1" for the base of body 3."""
    return f"{key[0]}/{key[1]}"


class ClientLinksParticipant(Participant):
    """Steps a client by the client's own time step; all bodies must be in `links` before it is created."""

    STATE = ()

    def __init__(self, name: str, links: ClientLinks) -> None:
        self._links = links
        self._keys = {link_name(key): key for key in links.met}
        self._getters: dict[str, Callable[[], Array]] = {}
        declared = []
        for link, key in self._keys.items():
            declared += [
                Variable(f"{link}.wrench", "N, N m", (6,), Causality.INPUT),
                Variable(f"{link}.pose", "m, 1", (7,), Causality.OUTPUT),
                Variable(f"{link}.twist", "m/s, rad/s", (6,), Causality.OUTPUT),
                Variable(f"{link}.free_acceleration", "m/s2, rad/s2", (6,), Causality.OUTPUT),
            ]
            for quantity in ("pose", "twist", "free_acceleration"):
                self._getters[f"{link}.{quantity}"] = partial(getattr(links, quantity), key)
        if self._keys:
            size = 6 * len(self._keys)
            declared.append(Variable("inverse_mass", "1/kg, 1/(kg m), 1/(kg m2)", (size, size), Causality.OUTPUT))
            self._getters["inverse_mass"] = links.inverse_mass
        super().__init__(name, declared)

    def enter_initialization_mode(self, start_time: float) -> None:
        """Observe the client; `start_time` is not used, because pybullet keeps no time."""
        self._links.observed()

    def observe(self) -> bool:
        """Read the links again, because the client's owner may have changed them since the last step."""
        self._links.observed()
        return True

    def get(self, name: str) -> Array:
        """Return a copy of an output, of the shape and unit in the module's list; ValueError for a name that is no output."""
        if name not in self._getters:
            raise ValueError(f"{self.name!r} has no output {name!r}, allowed: {', '.join(self._getters)}")
        return self._getters[name]()

    def set(self, name: str, value: Array) -> None:
        """Set a link's wrench (6,) [N, N m], which then acts until it is set again."""
        checked = checked_value(self.name, self.variables, name, value)
        self._links.set_wrench(self._keys[name.removesuffix(".wrench")], checked)

    def do_step(self, time: float, step_size: float) -> StepResult:
        """Make one step of the client; ValueError if the client's time step is not `step_size` [s]."""
        own = self._links.observed().duration
        if not same_step(step_size, own):
            raise ValueError(f"{self.name!r}: step is {step_size} s, allowed: {own} s, the time step of the client")
        self._links.advance()
        return StepResult(Status.OK, time + step_size)

    def save_state(self) -> object:
        """Refuse with NotImplementedError: the owner of the client saves its state."""
        raise NotImplementedError("the client is somebody else's, whose state pybullet.saveState saves")

    def restore_state(self, state: object) -> None:
        """Refuse with NotImplementedError, as `save_state` does."""
        raise NotImplementedError("the client is somebody else's, whose state pybullet.restoreState restores")
