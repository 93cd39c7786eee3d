"""Sensitive areas: how much oil lies in each, and that it has come there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from coupling.participants.slick import SlickParticipant
from recordings.model.words import volume_in_words
from scenarios.setup.at_sea.land import Corners
from scenarios.watch.boom_score import Notice
from scenarios.watch.slick_oil import volume_within

REACHED = 1e-3  # [m3] in an area from which on its oil is told of; chosen; a litre is seen


class SensitiveAreas:
    """The oil [m3] in each area at the last communication point, afloat and ashore; `advance` changes it."""

    def __init__(self, outlines: Mapping[str, Sequence[Corners]]) -> None:
        """Watch areas by name, each of one outline (K, 2) [m] or more."""
        self.oil = dict.fromkeys(outlines, 0.0)
        self._outlines = {name: [np.array(one) for one in own] for name, own in outlines.items()}
        self._reached = set[str]()

    def advance(self, slicks: Sequence[SlickParticipant]) -> Iterator[Notice]:
        """Take the present oil into account; yield what is told the first time that it is in an area."""
        for name, outlines in self._outlines.items():
            self.oil[name] = sum(volume_within(slick, one) for slick in slicks for one in outlines)
            if self.oil[name] >= REACHED and name not in self._reached:
                self._reached.add(name)
                yield Notice(
                    f"oil has come in: {volume_in_words(self.oil[name])}", level="warning", source=f"area {name}"
                )

    def series(self) -> dict[str, float]:
        """Return the oil [m3] in each area by the names of its series."""
        return {f"areas/{name}/oil": volume for name, volume in self.oil.items()}
