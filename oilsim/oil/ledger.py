"""The oil ledger of a run: the only account of its oil, for whichever carrier, parcels or particles.

It is advanced once at every communication point, and everything that tells of oil reads it: summary, console, signals, scores, recordings,
and through them debriefs and exports. Words after ASTM F2084, F631 and F2709: oil is *recovered* when a skimmer has collected it; oil that
comes back into the boom that lost it is *re-contained*.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from oilsim.oil.fates import CAUSES, FATES, Fate

_FATES = tuple(fate.name.lower() for fate in Fate if fate != Fate.LOST)


def by_cause(volumes: ArrayLike) -> dict[str, float]:
    """Return volumes (causes,) [m3] by the name of the cause."""
    return dict(zip(CAUSES, np.asarray(volumes, np.float64).tolist(), strict=True))


_nothing_lost = dict.fromkeys(CAUSES, 0.0).copy


@dataclass(frozen=True, kw_only=True)
class OilRows:
    """All oil of a run at one time, in m3; each litre is in one row: `spilled` is the sum of those of `Fate`.

    spilled          all that was spilled since the start
    afloat, contained, stranded, recovered, evaporated, left_the_domain  see `Fate`
    lost             by cause: what booms have lost and none holds; where several lost it, by the cause of the last
    lost_modelled    the part of `lost` that closures carried out; the rest is resolved by particles
    recontained      what came back into the boom that had lost it, summed over time; no row of the sum
    resolved         the part of the oil that is particles of a window; no row of the sum
    """

    spilled: float = 0.0
    afloat: float = 0.0
    contained: float = 0.0
    lost: Mapping[str, float] = field(default_factory=_nothing_lost)
    lost_modelled: Mapping[str, float] = field(default_factory=_nothing_lost)
    recontained: float = 0.0
    recovered: float = 0.0
    stranded: float = 0.0
    evaporated: float = 0.0
    left_the_domain: float = 0.0
    resolved: float = 0.0

    @property
    def all_lost(self) -> float:
        """The oil lost by any cause [m3]."""
        return math.fsum(self.lost.values())

    @property
    def residual(self) -> float:
        """The oil spilled less that of all fates [m3]; round-off."""
        return self.spilled - math.fsum([*(getattr(self, name) for name in _FATES), *self.lost.values()])

    def summary(self) -> dict[str, Any]:
        """Return all rows by name, of the losses only those that occur."""
        rows = asdict(self)
        lost = {cause: volume for cause, volume in self.lost.items() if volume}
        return rows | {"lost": lost, "lost_modelled": {cause: self.lost_modelled[cause] for cause in lost}}

    def series(self) -> dict[str, float]:
        """Return all rows by the names of their series in a recording, ``oil/contained`` and so on."""
        rows = {f"oil/{one.name}": getattr(self, one.name) for one in fields(self) if not one.name.startswith("lost")}
        return rows | {f"oil/lost/{cause}": volume for cause, volume in self.lost.items()}


def rows_of(
    spilled: float,
    volume: float | NDArray[np.float64],
    fate: NDArray[np.integer],
    modelled: NDArray[np.bool_],
    **others: float,
) -> OilRows:
    """Add up oil by its fate: volumes (N,) or one of all [m3], codes of `FATES` (N,), whether a closure carried out what is lost (N,).

    others: rows, or parts of rows, that are not among the N, by name [m3].
    """
    sums, closures = _sums(fate, volume), _sums(np.where(modelled, fate, Fate.AFLOAT), volume)
    known = {name: float(sums[code]) + others.pop(name, 0.0) for code, name in enumerate(_FATES)}
    return OilRows(
        spilled=spilled,
        lost=by_cause(sums[Fate.LOST :]),
        lost_modelled=by_cause(closures[Fate.LOST :]),
        **known,
        **others,
    )


def _sums(fate: NDArray[np.integer], volume: float | NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the oil (fates,) [m3] by its fate; particles of one volume are counted, without round-off."""
    if isinstance(volume, float):
        return np.asarray(np.bincount(fate, minlength=len(FATES)) * volume, np.float64)
    return np.asarray(np.bincount(fate, volume, len(FATES)), np.float64)


@dataclass(frozen=True, kw_only=True)
class BoomOil:
    """The oil of one boom, in m3. Booms in series lose the same oil one after another: those of several must not be added up.

    contained, inside, outside  what it holds now; all oil by its place in plan
    afloat                      what has never been in it
    lost, lost_modelled         by cause: what it has lost and not got back, and the part of it that closures carried out
    recontained                 what came back into it, summed over time
    returned                    lost oil that came into it again round a sea that repeats, summed over time
    returned_modelled           the part of it that closures had carried out
    recovered                   what skimmers at the boom have collected
    met                         the most oil that it has ever held, lost, or passed to skimmers
    """

    contained: float = 0.0
    inside: float = 0.0
    outside: float = 0.0
    afloat: float = 0.0
    lost: Mapping[str, float] = field(default_factory=_nothing_lost)
    lost_modelled: Mapping[str, float] = field(default_factory=_nothing_lost)
    recontained: float = 0.0
    returned: float = 0.0
    returned_modelled: float = 0.0
    recovered: float = 0.0
    met: float = 0.0

    @property
    def all_lost(self) -> float:
        """The oil lost by any cause [m3]."""
        return math.fsum(self.lost.values())

    @property
    def all_lost_modelled(self) -> float:
        """The part [m3] of `all_lost` that closures carried out."""
        return math.fsum(self.lost_modelled.values())

    @property
    def passed(self) -> float:
        """The oil [m3] that has gone past the boom since the start, less what came back.

        Oil that came in again across a side that repeats has passed: to a boom at sea it would be other oil.
        """
        return self.all_lost + self.returned

    @property
    def passed_modelled(self) -> float:
        """The part [m3] of `passed` that closures carried out."""
        return self.all_lost_modelled + self.returned_modelled

    @property
    def contained_share(self) -> float | None:
        """Share [-] of all oil that the boom has met that it has not lost, without round-off; None before it has met any."""
        return round(1.0 - self.all_lost / self.met, 12) if self.met > 0.0 else None

    def after(self, before: BoomOil) -> BoomOil:
        """Return this account with all oil that has been met, at or before the account `before` it."""
        there = self.contained + self.all_lost
        there += self.recovered if before.met > 0.0 or there > 0.0 else 0.0
        return replace(self, met=max(before.met, there))

    def series(self) -> dict[str, float]:
        """Return the account by the names of its series in a recording; before it has met any oil, its share is 1."""
        names = (
            "contained", "inside", "outside", "afloat", "recontained", "recovered", "met", "passed", "passed_modelled",
        )  # fmt: skip
        values = {f"oil_{name}": float(getattr(self, name)) for name in names}
        values |= {"oil_lost": self.all_lost, "oil_lost_modelled": self.all_lost_modelled}
        values["oil_contained_share"] = 1.0 if self.contained_share is None else self.contained_share
        for name in ("lost", "lost_modelled"):
            values |= {f"oil_{name}/{cause}": volume for cause, volume in getattr(self, name).items()}
        return values


class OilLedger:
    """The oil of a run, `rows`, and of each boom, `booms`, at the last communication point; only `enter` and `close` change them."""

    def __init__(self) -> None:
        self.rows = OilRows()
        self.booms: dict[str, BoomOil] = {}
        self._first: float | None = None

    def enter(self, boom: str, oil: BoomOil) -> BoomOil:
        """Write the account of a boom, and return it with what it has met."""
        self.booms[boom] = oil.after(self.booms.get(boom, BoomOil()))
        return self.booms[boom]

    def begin_with(self, volume: float) -> float:
        """Keep the `volume` [m3] that is there at the first call, and return it at every call."""
        self._first = volume if self._first is None else self._first
        return self._first

    def close(self, rows: OilRows) -> None:
        """Write the rows of the run, once those of all booms are written."""
        self.rows = replace(rows, recontained=math.fsum(boom.recontained for boom in self.booms.values()))

    def save_state(self) -> dict[str, Any]:
        """Return the ledger as plain data."""
        booms = {name: asdict(oil) for name, oil in self.booms.items()}
        return {"rows": asdict(self.rows), "booms": booms, "first": self._first}

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Go back to what `save_state` returned."""
        self.rows, self._first = OilRows(**saved["rows"]), saved["first"]
        self.booms = {name: BoomOil(**oil) for name, oil in saved["booms"].items()}
