"""The rule by which a closure is off: where the particle spacing resolves the mechanism, the particles alone decide.

mechanism            off where
entrainment          the fluid has interfacial tension and the spacing is up to a fifth of the wave that grows first (4 to 8 mm)
drainage             the skirt is 16 spacings deep or more: then suction round the foot and the slick's profile are resolved
critical accumulation  as drainage
splash-over, submergence  the overflow is two spacings deep or more, at each instant

Without `tension_acts` entrainment is never resolved, however fine the particles are.
"""

from __future__ import annotations

from dataclasses import dataclass

from booms.losses.entrainment import interface_wavelength
from booms.losses.liquids import OilOnWater
from oilsim.quantity import quantity, require

# [-] spacings of the wave that grows first; numerical
WAVE_SPACINGS = 5.0
# [-] spacings of draft; measured: suction factors of runs with 16 are those of finer ones
DRAFT_SPACINGS = 16.0
# [-] spacings of an overflow's depth; numerical
OVERFLOW_SPACINGS = 2.0


@dataclass(frozen=True, kw_only=True)
class Resolution:
    """The resolution of the particles: spacing [m], skirt_depth [m], and whether interfacial tension acts between the particles.

    Raises ValueError for a skirt that is not one spacing deep: no particle can lie before it.
    """

    spacing: float = quantity("m", above=0.0)
    skirt_depth: float = quantity("m", above=0.0)
    tension_acts: bool = False

    def __post_init__(self) -> None:
        problems = []
        if 0.0 < self.skirt_depth < self.spacing:
            problems.append(f"skirt_depth is {self.skirt_depth:g} m, allowed: {self.spacing:g} m or more, one spacing")
        require("particles at a boom", Resolution, vars(self), problems)

    def entrainment(self, oil: OilOnWater) -> bool:
        """Tell whether the waves and drops of entrainment are resolved."""
        return self.tension_acts and WAVE_SPACINGS * self.spacing <= interface_wavelength(oil)

    @property
    def drainage(self) -> bool:
        """Tell whether the flow under the skirt and the slick before it are resolved."""
        return DRAFT_SPACINGS * self.spacing <= self.skirt_depth * (1.0 + 1e-9)

    @property
    def overflow_depth(self) -> float:
        """Depth [m] of an overflow from which on it is resolved."""
        return OVERFLOW_SPACINGS * self.spacing
