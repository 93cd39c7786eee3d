"""Places for those who have not shown who they are: few, counted by address, and the oldest gives way to the newest.

So nobody locks anybody out by holding places: whoever comes gets one, and has seconds to show a token. Where places are few, one of the
address that holds most of them is freed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable


class Places:
    """Places of strangers, each with its address and the call that closes it."""

    def __init__(self, most: int, of_one_address: int) -> None:
        """Hold `most` places in all, and so many of one address."""
        self._most, self._of_one_address = most, of_one_address
        self._taken: dict[object, tuple[str, Callable[[], object]]] = {}  # in order of arrival

    def enter(self, who: object, address: str, close: Callable[[], object]) -> None:
        """Give a place; if there are too many, one that is held longest is closed."""
        held = Counter(place for place, _ in self._taken.values())
        if held[address] >= self._of_one_address:
            self._free(address)
        elif len(self._taken) >= self._most:
            self._free(held.most_common(1)[0][0])
        self._taken[who] = address, close

    def leave(self, who: object) -> None:
        """Take a place back; nothing for one that has none."""
        self._taken.pop(who, None)

    def _free(self, address: str) -> None:
        oldest = next(who for who, (place, _) in self._taken.items() if place == address)
        _, close = self._taken.pop(oldest)
        close()
