"""The size of a hull and its limits. They are read without the meshes of hulls, so that a scenario is checked without them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from oilsim.core.quantity import quantity, require


@dataclass(frozen=True, kw_only=True)
class HullSize:
    """Size of a hull [m]; draft: keel below the design waterline; depth: keel to deck. ValueError for one that has no freeboard.

    No length is above 1 km: the longest ship so far had 458 m, and sections of far longer hulls are lost in rounding.
    """

    length: float = quantity("m", at_least=1e-3, at_most=1000.0)
    beam: float = quantity("m", at_least=1e-3, at_most=1000.0)
    draft: float = quantity("m", at_least=1e-3, at_most=1000.0)
    depth: float = quantity("m", at_least=1e-3, at_most=1000.0)

    def __post_init__(self) -> None:
        require("hull", HullSize, vars(self), self._problems())

    def _problems(self) -> Iterator[str]:
        if not self.depth > self.draft:
            yield f"depth is {self.depth:g} m, allowed: above draft = {self.draft:g} m, so that there is freeboard"
