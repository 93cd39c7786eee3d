"""Links of somebody else's pybullet client as a participant of a coupled run.

Variables of every link that meets the fluid, named <body>/<link> by the unique id and the index, -1 for the base: input `<link>.wrench`
of the fluid, outputs `<link>.pose`, `<link>.twist`, `<link>.free_acceleration`; of all of them together: output `inverse_mass`. A link that
is held takes wrenches and ignores them.

The client's owner may move bodies between steps. So the links are observed as each step begins; between a step and the next observation
`free_acceleration` and `inverse_mass` are those that the step began with.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
import numpy.typing as npt

from coupling.participant import Causality, Status, StepResult, Variable, checked_value, variable_table
from coupling.participants.step_size import same_step
from coupling.pybullet_world.client_links import ClientLinks
from coupling.pybullet_world.links import LinkKey

Array = npt.NDArray[np.float64]


def link_name(key: LinkKey) -> str:
    """The name of a link in a coupled run, as in "3/-1" for the base of body 3."""
    return f"{key[0]}/{key[1]}"


class ClientLinksParticipant:
    """Steps a client by the client's own time step; bodies are all added to `links` before."""

    def __init__(self, name: str, links: ClientLinks) -> None:
        self._name = name
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
        self._variables = variable_table(declared)

    @property
    def name(self) -> str:
        """See `Participant`."""
        return self._name

    @property
    def variables(self) -> Mapping[str, Variable]:
        """See the module."""
        return self._variables

    def enter_initialization_mode(self, start_time: float) -> None:
        """Observe the client; pybullet knows no time."""
        self._links.observed()

    def exit_initialization_mode(self) -> None:
        """Nothing is left to do."""

    def observe(self) -> None:
        """Take in what the client's owner did since the last step; see `SharedParticipant`."""
        self._links.observed()

    def get(self, name: str) -> Array:
        """A fresh copy of an output."""
        if name not in self._getters:
            raise ValueError(f"{self._name!r} has no output {name!r}, allowed: {', '.join(self._getters)}")
        return self._getters[name]()

    def set(self, name: str, value: Array) -> None:
        """Set a wrench, which then acts until it is set again."""
        checked = checked_value(self._name, self._variables, name, value)
        self._links.set_wrench(self._keys[name.removesuffix(".wrench")], checked)

    def do_step(self, time: float, step_size: float) -> StepResult:
        """One step of the client; ValueError if that is not as long as `step_size`."""
        own = self._links.observed().duration
        if not same_step(step_size, own):
            raise ValueError(f"{self._name!r}: step is {step_size} s, allowed: {own} s, the time step of the client")
        self._links.advance()
        return StepResult(Status.OK, time + step_size)

    def save_state(self) -> object:
        """NotImplementedError: the client's own state is its owner's to save and to restore."""
        raise NotImplementedError("the client is somebody else's, whose state pybullet.saveState saves")

    def restore_state(self, state: object) -> None:
        """NotImplementedError, as `save_state`."""
        raise NotImplementedError("the client is somebody else's, whose state pybullet.restoreState restores")

    def terminate(self) -> None:
        """Leave the client to its owner."""
