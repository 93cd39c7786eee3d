"""The sea of a run: what it is now, and whom it tells when orders or signals change it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from oilsim.sea import Continuation, Sea, SteadyFlow


class RunSea:
    """The present sea of a run, `now`, and everything that it moves.

    Another current, other waves or another wind take over from those that there are: the patterns of the sea go on, gusts at the place
    where the run is.
    """

    def __init__(self, sea: Sea, clock: Callable[[], float], place: Callable[[], NDArray[np.float64]]) -> None:
        """Take the sea at the start; clock: the time [s]; place: (2,) [m] where gusts go on."""
        self.now, self._clock, self._place = sea, clock, place
        self._listeners = list[Callable[[Sea], None]]()

    @property
    def time(self) -> float:
        """The time [s] of the run."""
        return self._clock()

    def tell(self, listener: Callable[[Sea], None]) -> None:
        """Tell a listener of every sea that comes; what nobody listens to never changes."""
        self._listeners.append(listener)

    def ordered(self, sea: Sea) -> Sea:
        """Return another sea as it goes on from the present one."""
        return self.now.followed_by(sea.description, self._clock(), self._place())

    def save_state(self) -> dict[str, Any]:
        """Return what the sea took over from those before it; nothing where there is none."""
        carried = self.now.description.carried
        return {} if carried == Continuation() else {"sea": asdict(carried)}

    def restore_state(self, state: Mapping[str, Any]) -> None:
        """Let the sea go on as in a state with what `save_state` returned."""
        saved = state.get("sea", {})
        made_in = saved.get("made_in")
        steady = None if made_in is None else SteadyFlow(**made_in)
        carried = Continuation(**{**saved, "made_in": steady, "turn": tuple(saved.get("turn", ()))})
        if carried != self.now.description.carried:
            self.become(Sea(replace(self.now.description, carried=carried)))

    def become(self, sea: Sea) -> None:
        """Let a sea that was `ordered` be that of the run from now on."""
        if self._listeners:
            self.now = sea
        for listener in self._listeners:
            listener(sea)
