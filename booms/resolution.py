"""Words on the particles of a boom's skirt and on the part of the water's section that it fills: which figures suffer from either."""

from __future__ import annotations

from booms.losses.resolution import DRAFT_SPACINGS

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
    drops = "droplets are modelled, but " if has_closures else ""
    return f"{deep}: {drops}particles decide what drains under it: a skirt of 0.2 m then loses oil too early, one of 0.5 m as in practice"


def blockage_in_words(share: float) -> str:
    """Say what it means that a boom and its vessels fill this share [-] of the section; empty for one that hardly matters."""
    if share <= WIDE_SEA:
        return ""
    faster = 1.0 / max(1.0 - share, _NARROWEST)
    return (
        f"it fills {100.0 * share:.0f} % of the water's section: the water that must pass runs up to "
        f"{faster:.2g} times as fast as at sea, and forces are up to {faster**2:.2g} times as large"
    )
