"""The part of a sea that it takes over from the one before it: waves and gusts go on from where they are when current or wind change."""

from __future__ import annotations

from dataclasses import dataclass

from oilsim.quantity import quantity, require
from oilsim.sea.flows import SteadyFlow


@dataclass(frozen=True, kw_only=True)
class Continuation:
    """The lead of the patterns of a sea over those of a sea of the same description that began at time 0.

    way      (2,) [m] more that the current has carried the waves
    lead     [s] by which gusts are early
    made_in  the current in which periods seen from the ground became wave lengths, which no later current changes; None: the sea's own
    Raises ValueError for values that are not allowed.
    """

    way: tuple[float, float] = quantity("m", default=(0.0, 0.0))
    lead: float = quantity("s", default=0.0)
    made_in: SteadyFlow | None = None

    def __post_init__(self) -> None:
        require("continuation", Continuation, vars(self))
