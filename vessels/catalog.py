"""The catalogue of workboats and tugs by name, from `catalogue.toml`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

from oilsim.core.catalogue import CatalogueEntry, read_catalogue


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
    return read_catalogue("vessels", "catalogue.toml", CatalogueVessel)
