"""Bodies that are held where they are until they are released, such as a boat on its cradle or a gate's weight."""

from __future__ import annotations

from coupling.rigid.prescribed_motion import Motion
from coupling.rigid.rigid_state import RigidBodyState

_SLACK = 1e-9  # [s] by which a time may miss the release and count


class Holds:
    """The holds of free bodies: while one lasts, the body answers no force, as a fixed body does."""

    def __init__(self, state: RigidBodyState) -> None:
        self._state = state
        self._releases: dict[int, float] = {}  # by row [s]
        self.held: frozenset[int] = frozenset()  # rows of the bodies that are held now

    def add(self, row: int, release: float, now: float) -> None:
        """Hold the body of a row until `release` [s]; the time is `now` [s]."""
        self._releases[row] = release
        self.settle(now)

    def settle(self, now: float) -> None:
        """Hold, and release, the bodies whose time it is at `now` [s]."""
        self.held = frozenset(row for row, release in self._releases.items() if now < release - _SLACK)
        for row in self._releases:
            self._state.hold(row, row in self.held)

    def rest(self, row: int) -> Motion:
        """Return a body's place, at rest."""
        pose = self._state.pose[row]
        return Motion(pose[:3].copy(), pose[3:].copy())
