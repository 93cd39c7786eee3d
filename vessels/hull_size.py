"""The size of a hull and its limits, and the catalogue of workboats and tugs, read without meshes: a scenario is checked without them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache

from oilsim.core.catalogue import CatalogueEntry, read_catalogue
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


@dataclass(frozen=True, kw_only=True)
class CatalogueVessel(CatalogueEntry):
    """A vessel of the catalogue: length, beam, draft, depth [m]; bollard_pull [N] ahead; speed_kn [kn] running free."""

    length: float
    beam: float
    draft: float
    depth: float
    bollard_pull: float
    speed_kn: float | None = None


@lru_cache(maxsize=1)
def catalogue() -> Mapping[str, CatalogueVessel]:
    """Read the catalogue, by name."""
    return read_catalogue("vessels", CatalogueVessel)
