"""The rule by which a closure is off: where the particle spacing resolves the mechanism, the particles alone decide.

mechanism            off where
drainage             the skirt is 16 spacings deep or more: then suction round the foot and the slick's profile are resolved
critical accumulation  as drainage
splash-over, submergence  the overflow is two spacings deep or more, at each instant

Entrainment is never off. Its first wave is 20 to 30 mm long, but particles of 2.7 to 6 mm with interfacial tension tear oil off too early
(docs/losses.md), and finer ones have not been run.
"""

from __future__ import annotations

from dataclasses import dataclass

from oilsim.core.quantity import quantity, require

# [-] spacings of draft; measured: suction factors of runs with 16 are those of finer ones
DRAFT_SPACINGS = 16.0
# [-] spacings of an overflow's depth; numerical
OVERFLOW_SPACINGS = 2.0


@dataclass(frozen=True, kw_only=True)
class Resolution:
    """The resolution of the particles: spacing [m], and skirt_depth [m].

    Raises ValueError for a skirt that is not one spacing deep: no particle can lie before it.
    """

    spacing: float = quantity("m", above=0.0)
    skirt_depth: float = quantity("m", above=0.0)

    def __post_init__(self) -> None:
        problems = []
        if 0.0 < self.skirt_depth < self.spacing:
            problems.append(f"skirt_depth is {self.skirt_depth:g} m, allowed: {self.spacing:g} m or more, one spacing")
        require("particles at a boom", Resolution, vars(self), problems)

    @property
    def drainage(self) -> bool:
        """Tell whether the flow under the skirt and the slick before it are resolved."""
        return DRAFT_SPACINGS * self.spacing <= self.skirt_depth * (1.0 + 1e-9)

    @property
    def overflow_depth(self) -> float:
        """Depth [m] of an overflow from which on it is resolved."""
        return OVERFLOW_SPACINGS * self.spacing
