"""The rule by which a closure is off: where the particle spacing resolves the mechanism, the particles alone decide.

mechanism                 off where
drainage                  the skirt is 16 spacings deep or more: then suction round the foot and the slick's profile are resolved
critical accumulation     as drainage
entrainment               as drainage, and the spacing is 10 mm or less: particles then tear off, and rise (`oilsim.drops`), as drops do
splash-over, submergence  the overflow is two spacings deep or more, at each instant

Words on the particles of a boom's skirt and on the part of the water's section that it fills: which figures suffer from either.
"""

from __future__ import annotations

from dataclasses import dataclass

from oilsim.core.quantity import quantity, require

# [-] spacings of draft; measured: suction factors of runs with 16 are those of finer ones
DRAFT_SPACINGS = 16.0
# [m] spacing; measured: flumes of 10, 6 and 4 mm lose their first oil at 0.36, 0.32 and 0.28 m/s, those of 20 and 30 mm at 0.44 and above
DROP_SPACING = 0.010
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
    def entrainment(self) -> bool:
        """Tell whether the oil that the water tears off the slick is resolved."""
        return self.drainage and self.spacing <= DROP_SPACING

    @property
    def overflow_depth(self) -> float:
        """Depth [m] of an overflow from which on it is resolved."""
        return OVERFLOW_SPACINGS * self.spacing


COARSE = 5.0  # particles over the skirt's depth: with fewer, draft and tension are off too
WIDE_SEA = 0.05  # part of the section that a boom may fill without a word: the water then speeds up by as much
_NARROWEST = 0.05  # part of the section that is taken to stay open, for the words alone


def skirt_in_words(skirt_depth: float, spacing: float, *, has_closures: bool) -> str:
    """Say how many particles deep a skirt is, and which figures are not to be trusted for that; depth and spacing [m].

    has_closures: whether what particles are too coarse to lose is modelled (`booms.losses`).
    """
    count = skirt_depth / spacing
    deep = f"its skirt is {count:.2g} particles deep"
    if count < COARSE and has_closures:
        return (
            f"{deep}: the speed of the first loss is modelled, within the band of practice; "
            "lost volumes, draft and tension are not to be trusted"
        )
    if count < COARSE:
        return f"{deep}: how the boom fails can be seen, but loss speeds, lost volumes, draft and tension are not to be trusted"
    if count < DRAFT_SPACINGS and has_closures:
        return f"{deep}: the speed of the first loss is modelled, within the band of practice"
    if count < DRAFT_SPACINGS:
        return f"{deep}: loss speeds are those of the particles, for most skirts too high"
    if has_closures and spacing > DROP_SPACING:
        return f"{deep}: particles decide what drains under it, and droplets are modelled"
    return f"{deep}: particles alone decide what is lost under it; their first loss in flumes of 4 to 10 mm is at 0.28 to 0.36 m/s"


def blockage_in_words(share: float) -> str:
    """Say what it means that a boom and its vessels fill this share [-] of the section; empty for one that hardly matters."""
    if share <= WIDE_SEA:
        return ""
    faster = 1.0 / max(1.0 - share, _NARROWEST)
    return (
        f"it fills {100.0 * share:.0f} % of the water's section: the water that must pass runs up to "
        f"{faster:.2g} times as fast as at sea, and forces are up to {faster**2:.2g} times as large"
    )
