"""The fates of oil, in the words of ASTM F2084, F631 and F2709, and the causes by which booms lose it."""

from __future__ import annotations

from enum import IntEnum


class LossCause(IntEnum):
    """The ways in which oil leaves a boom."""

    ENTRAINMENT = 0
    DRAINAGE = 1
    CRITICAL_ACCUMULATION = 2
    PLANING = 3
    SUBMERGENCE = 4
    SPLASH_OVER = 5
    AROUND_ENDS = 6
    THROUGH = 7


CAUSES = tuple(cause.name.lower() for cause in LossCause)
"""Names of the causes, in their order, as ledgers and recordings have them."""


class Fate(IntEnum):
    """The place of a litre of oil; a fate of `LOST` plus a `LossCause` is that of oil which a boom has lost by that cause.

    AFLOAT: at large, held by no boom and lost by none. CONTAINED: a boom holds it. STRANDED: ashore, or on a hull. RECOVERED: a skimmer has
    collected it. EVAPORATED: in the air; oil is weathered before it is spilled, so none evaporates in a run. LEFT_THE_DOMAIN: it has left
    the simulated water, and no boom had lost it.
    """

    AFLOAT = 0
    CONTAINED = 1
    STRANDED = 2
    RECOVERED = 3
    EVAPORATED = 4
    LEFT_THE_DOMAIN = 5
    LOST = 6


FATES = (*(fate.name.lower() for fate in Fate if fate != Fate.LOST), *(f"lost_{cause}" for cause in CAUSES))
"""Names of all fates; the place of a name is the code of the fate in frames, recordings and exports."""
