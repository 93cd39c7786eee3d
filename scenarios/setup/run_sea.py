"""The sea of a run: what it is now, and whom it tells when orders or signals change it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from oilsim.sea import Continuation, Sea, SteadyFlow
from scenarios.schema.sea import SeaSettings, SteadySeaCurrent, SteadySeaWind
from scenarios.setup.at_sea.build_sea import build_sea
from scenarios.setup.fleet import water_density
from scenarios.setup.resolve import RunSpec, deep_to_the_floor

Flows = dict[str, tuple[float, float]]


class RunSea:
    """The present sea of a run, `now`, and everything that it moves.

    Another current, other waves or another wind take over from those that there are: the patterns of the sea go on, gusts at the place
    where the run is. Signals set the speed and direction of a steady wind or current; what they have set rules over orders.
    """

    def __init__(
        self, scenario: RunSpec, sea: Sea, clock: Callable[[], float], place: Callable[[], NDArray[np.float64]]
    ) -> None:
        """Take the sea at the start; clock: the time [s]; place: (2,) [m] where gusts go on."""
        self.now, self._scenario, self._clock, self._place = sea, scenario, clock, place
        self._signaled: Flows = {}
        self._listeners = list[Callable[[Sea], None]]()

    def tell(self, listener: Callable[[Sea], None]) -> None:
        """Tell a listener of every sea that comes; what nobody listens to never changes."""
        self._listeners.append(listener)

    def ordered(self, scenario: RunSpec) -> Sea:
        """Return the sea of `scenario` as it goes on from the present one; ScenarioError for one that cannot be built."""
        return self._signaled_sea(scenario, self._signaled)

    def take_orders(self, scenario: RunSpec, sea: Sea) -> None:
        """Let the sea that was `ordered` be that of the run from now on."""
        self._scenario = scenario
        self._become(sea)

    def signal(self, kind: str, speed: float, direction: float) -> None:
        """Set the speed [m/s] and direction [rad] of the steady `wind` or `current`; ScenarioError for a sea that cannot be built."""
        if self._signaled.get(kind) != (speed, direction):
            signaled = self._signaled | {kind: (speed, direction)}
            self._become(self._signaled_sea(self._scenario, signaled))
            self._signaled = signaled

    def save_state(self) -> dict[str, Any]:
        """Return what signals have set, and what the sea took over from those before it; nothing where there is none."""
        carried = self.now.description.carried
        state: dict[str, Any] = {} if carried == Continuation() else {"sea": asdict(carried)}
        return state | ({"signaled": dict(self._signaled)} if self._signaled else {})

    def restore_state(self, state: Mapping[str, Any]) -> None:
        """Let the sea go on as in a state with what `save_state` returned."""
        saved = state.get("sea", {})
        made_in = saved.get("made_in")
        carried = Continuation(**{**saved, "made_in": None if made_in is None else SteadyFlow(**made_in)})
        signaled = {kind: (float(flow[0]), float(flow[1])) for kind, flow in state.get("signaled", {}).items()}
        if signaled != self._signaled:
            self.now, self._signaled = self._signaled_sea(self._scenario, signaled), signaled
        if carried != self.now.description.carried:
            self._become(Sea(replace(self.now.description, carried=carried)))

    def _signaled_sea(self, scenario: RunSpec, flows: Flows) -> Sea:
        """Return the sea of `scenario` with flows that signals have set, as it goes on from the present one."""
        settings: SeaSettings = deep_to_the_floor(scenario, self.now.level)
        for kind, (speed, direction) in flows.items():
            given = getattr(settings, kind)
            if isinstance(given, SteadySeaWind | SteadySeaCurrent):
                changed: dict[str, Any] = {kind: replace(given, speed=speed, direction=direction)}
                settings = replace(settings, **changed)
        sea = build_sea(replace(scenario, sea=settings), water_density(scenario))
        return self.now.followed_by(sea.description, self._clock(), self._place())

    def _become(self, sea: Sea) -> None:
        if self._listeners:
            self.now = sea
        for listener in self._listeners:
            listener(sea)
