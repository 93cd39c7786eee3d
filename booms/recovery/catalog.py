"""The catalogue of skimmers by name, from `catalogue.toml`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

from booms.recovery.skimmer import SkimmerKind
from oilsim.core.catalogue import CatalogueEntry, read_catalogue


@dataclass(frozen=True, kw_only=True)
class CatalogueSkimmer(CatalogueEntry):
    """A skimmer of the catalogue: nameplate [m3/h] of fluid, swath [m] of its mouth, storage [m3], and efficiencies [-] as tested."""

    kind: SkimmerKind
    nameplate: float
    swath: float | None = None
    throughput_efficiency: float | None = None
    recovery_efficiency: float | None = None
    storage: float | None = None


@lru_cache(maxsize=1)
def catalogue() -> Mapping[str, CatalogueSkimmer]:
    """Read the catalogue, by name."""
    return read_catalogue("booms.recovery", "catalogue.toml", CatalogueSkimmer)
