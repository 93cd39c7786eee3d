"""Parcels: the oil of a slick as points in plan view, each with a volume, properties and a fate."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum
from typing import Any

import numpy as np

from oilsim.backend.arrays import Array, Flags, Ints
from oilsim.oil.fates import Fate

Rows = Ints

# [1] place of a parcel that no barrier holds, cause and loser of one that was never lost, particle of one that is none; layout; no index
NONE = -1


class ParcelState(IntEnum):
    """Fate of a parcel; a RESOLVED one is a particle of a window (`oilsim.window.oil_exchange`), and moves as that does."""

    AFLOAT = 0
    HELD = 1
    LOST = 2
    STRANDED = 3
    RECOVERED = 4
    RESOLVED = 5


# fate of each state but RESOLVED, in their order; of a LOST one that by its cause
_FATES = np.array([Fate.AFLOAT, Fate.CONTAINED, Fate.LOST, Fate.STRANDED, Fate.RECOVERED], np.int64)


COLUMNS: Mapping[str, tuple[Any, tuple[int, ...]]] = {
    "id": (np.int64, ()),
    "position": (np.float64, (2,)),
    "volume": (np.float64, ()),
    "thickness": (np.float64, ()),
    "density": (np.float64, ()),
    "viscosity": (np.float64, ()),
    "interfacial_tension": (np.float64, ()),
    "spreading_tension": (np.float64, ()),
    "oil": (np.int64, ()),
    "age": (np.float64, ()),
    "state": (np.int64, ()),
    "cause": (np.int64, ()),
    "loser": (np.int64, ()),
    "carried": (np.bool_, ()),
    "place": (np.int64, ()),
    "side": (np.int64, ()),
    "along": (np.float64, ()),
    "ahead": (np.float64, ()),
    "particle": (np.int64, ()),
}
EMPTY = ("cause", "loser", "place", "particle")


def sums(group: Rows, values: Array, groups: int) -> Array:
    """Return the sums (groups,) of values (N,), in their unit, by group (N,); zeros where there are none."""
    return np.bincount(group, values, groups).astype(np.float64)


class Parcels:
    """N parcels, one row each.

    id                   (N,) unique, in the order of their making
    position             (N, 2) [m] in the world
    volume               (N,) [m3]; thickness (N,) [m] of the oil there, by the last step
    density              (N,) [kg/m3]; viscosity (N,) [Pa s]; interfacial_tension, spreading_tension (N,) [N/m]; age (N,) [s]
    oil                  (N,) place among the oils of the run, `Oil.number`
    state                (N,) a `ParcelState`
    cause                (N,) the `LossCause` by which it was lost, `NONE` for one that is not lost
    loser                (N,) the barrier that lost it, see `Barriers.owner`; `NONE` for one that is not lost
    carried              (N,) whether a particle carried it past that barrier, so that the loss is resolved
    place                (N,) the segment that holds it or to which it sticks, else `NONE`
    side                 (N,) side of that segment: 1 left of the way from its start to its end, -1 right
    along                (N,) [-] share of the segment's length at which it lies, from its start
    ahead                (N,) [m] distance from the segment, against the flow
    particle             (N,) id of the particle that it is, `NONE` for one that is not resolved
    """

    id: Rows
    position: Array
    volume: Array
    thickness: Array
    density: Array
    viscosity: Array
    interfacial_tension: Array
    spreading_tension: Array
    oil: Rows
    age: Array
    state: Rows
    cause: Rows
    loser: Rows
    carried: Flags
    place: Rows
    side: Rows
    along: Array
    ahead: Array
    particle: Rows

    def __init__(self) -> None:
        self._born = 0
        for name, (kind, shape) in COLUMNS.items():
            setattr(self, name, np.empty((0, *shape), kind))

    def __len__(self) -> int:
        return len(self.id)

    def append(self, columns: Mapping[str, Any], count: int) -> Rows:
        """Add `count` parcels and return their rows (count,); columns (count,) or scalars, `id` aside, in their unit; the rest is 0."""
        rows = np.arange(len(self), len(self) + count)
        for name, (kind, shape) in COLUMNS.items():
            added = np.zeros((count, *shape), kind)
            if name == "id":
                added[:] = np.arange(self._born, self._born + count)
            else:
                added[:] = columns.get(name, NONE if name in EMPTY else 0)
            setattr(self, name, np.concatenate([getattr(self, name), added]))
        self._born += count
        return rows

    def split(self, row: int, volume: float) -> int:
        """Split `volume` [m3], less than the parcel's own, off a parcel and return the row of the new one, which is equal else."""
        columns = {name: getattr(self, name)[row] for name in COLUMNS}
        new = int(self.append(columns | {"volume": volume}, 1)[0])
        self.volume[row] -= volume
        return new

    def keep(self, mask: Flags) -> None:
        """Remove all parcels but those of the mask (N,)."""
        for name in COLUMNS:
            setattr(self, name, np.ascontiguousarray(getattr(self, name)[mask]))

    def detach(self, rows: Rows) -> None:
        """Let the parcels of rows (M,) float freely."""
        self.place[rows], self.side[rows], self.ahead[rows] = NONE, 0, 0.0

    def mark_lost(self, rows: Rows, cause: Rows | int, loser: Rows, carried: Flags | bool) -> None:
        """Note the causes (M,) by which barriers (M,) lost the oil of rows (M,), and whether particles carried it past."""
        self.cause[rows], self.loser[rows], self.carried[rows] = cause, loser, carried

    def mark_found(self, rows: Rows) -> None:
        """Forget how the oil of rows (M,) was lost."""
        self.mark_lost(rows, NONE, np.full(len(rows), NONE), carried=False)

    def position_of(self, rows: Rows) -> Array:
        """Return a copy of the positions (M, 2) [m] of the parcels of rows (M,), in a quarter of the time that indexing takes."""
        return self.position.take(rows, axis=0)

    def put_position(self, rows: Rows, position: Array) -> None:
        """Set the positions (M, 2) [m] of the parcels of rows (M,), in a quarter of the time that indexing takes."""
        points = np.ascontiguousarray(position).view(np.complex128)
        self.position.view(np.complex128)[rows] = points

    def there(self) -> Flags:
        """Return a mask (N,) of the oil that is still on the water or ashore: all but what skimmers have taken."""
        return np.asarray(self.state != ParcelState.RECOVERED)

    def fates(self) -> Rows:
        """Return the states (N,), but of a resolved one that which it would have as a parcel: lost, held before a segment, or afloat."""
        held = np.where(self.place != NONE, int(ParcelState.HELD), int(ParcelState.AFLOAT))
        own = np.where(self.cause != NONE, int(ParcelState.LOST), held)
        return np.where(self.state == ParcelState.RESOLVED, own, self.state)

    def fate_codes(self) -> Rows:
        """Return the fates (N,), codes of `FATES`."""
        state = self.fates()
        return np.asarray(_FATES[state] + np.where(state == ParcelState.LOST, self.cause, 0))

    def in_pools(self) -> Rows:
        """Return the rows (M,) of the oil that booms hold: parcels that are held, and resolved ones that lie before a segment."""
        resolved = (self.state == ParcelState.RESOLVED) & (self.place != NONE)
        return np.flatnonzero((self.state == ParcelState.HELD) | resolved)

    def save_state(self) -> dict[str, Any]:
        """Return copies of all columns."""
        return {name: getattr(self, name).copy() for name in COLUMNS} | {"born": self._born}

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Go back to what `save_state` returned."""
        for name in COLUMNS:
            setattr(self, name, saved[name].copy())
        self._born = saved["born"]
