"""The catalogue of booms: classes and products by name, from `catalogue.toml`.

`maximum_speed_kn` is the speed that the boom withstands. It holds oil only up to about 0.7 knots normal to it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

from booms.boom import Boom, BoomDesign, Pocket
from oilsim.core.catalogue import CatalogueEntry, read_catalogue
from oilsim.core.physical_constants import SEA_WATER_DENSITY

Kind = Literal["fence", "curtain", "inflatable", "shore-sealing", "high-speed"]


@dataclass(frozen=True, kw_only=True)
class CatalogueBoom(CatalogueEntry):
    """A boom of the catalogue.

    skirt_depth, freeboard, base_width [m]; buoyancy_to_weight (gross), ballast_fraction [-]; section_length [m] between connectors;
    strength, connector_strength [N] at which it and its connectors part; maximum_speed_kn [kn]; pocket: of a boom for fast water.
    """

    kind: Kind
    skirt_depth: float
    freeboard: float
    buoyancy_to_weight: float
    ballast_fraction: float = 0.35
    base_width: float | None = None
    section_length: float | None = None
    connector: str = ""
    strength: float | None = None
    connector_strength: float | None = None
    maximum_speed_kn: float | None = None
    pocket: Pocket | None = None

    def boom(self, length: float, segment_count: int, *, water_density: float = SEA_WATER_DENSITY) -> Boom:
        """Design a boom of this kind, `length` [m] long; ValueError for a pocket that is shorter than a segment."""
        return BoomDesign(
            length=length,
            segment_count=segment_count,
            skirt_depth=self.skirt_depth,
            freeboard=self.freeboard,
            buoyancy_to_weight=self.buoyancy_to_weight,
            skirt_thickness=0.005,
            ballast_fraction=self.ballast_fraction,
            base_width=self.base_width,
            pocket=self.pocket,
            water_density=water_density,
        ).boom()


@lru_cache(maxsize=1)
def catalogue() -> Mapping[str, CatalogueBoom]:
    """Read the catalogue, by name."""
    return read_catalogue("booms", "catalogue.toml", CatalogueBoom, pocket=Pocket)
