"""Vessels that run into something: the ground, another vessel, a boom or a body. Each pair is told of once a run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from recordings.model.entity_paths import BOOM, VESSELS
from recordings.model.exercise import is_ground
from scenarios.watch.boom_score import Notice


class Collisions:
    """The account of what vessels have run into so far, as pairs of a name and words: `told`."""

    def __init__(self) -> None:
        self.told: set[tuple[str, str]] = set()

    def notices(self, met: Iterable[tuple[str, str]]) -> Iterator[Notice]:
        """Yield what is new among pairs of bodies that touch now; "" is a half-space, which is the ground."""
        for pair in sorted(met):
            for one, other in (pair, pair[::-1]):
                if not one.startswith(f"{VESSELS}/") or (other.startswith(f"{VESSELS}/") and other < one):
                    continue
                vessel, words = one.partition("/")[2], _met(other)
                if (vessel, words) not in self.told:
                    self.told.add((vessel, words))
                    yield Notice(f"{vessel} {words}", level="warning", source="vessels")


def _met(body: str) -> str:
    """Write what a vessel does that meets a body."""
    group, _, rest = body.partition("/")
    if not body or is_ground(body):
        return f"runs aground on {rest}" if rest else "runs aground"
    if group == VESSELS:
        return f"and {rest} collide"
    return f"runs into boom {rest.partition('/')[0]}" if group == BOOM else f"runs into {body}"
