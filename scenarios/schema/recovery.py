"""Skimmers of a scenario and their storage."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass, field
from types import MappingProxyType
from typing import Any, ClassVar, cast

from booms.recovery.skimmer import USUAL_EFFICIENCY, SkimmerDesign, SkimmerKind, catalogue
from oilsim.core.quantity import quantity, quantity_of
from scenarios.schema.exercise import body_of, segment_names
from scenarios.schema.parsing.quantity_fields import CatalogueSection, Point2
from scenarios.schema.parsing.relations import Relation, only_with, reference
from scenarios.text.problems import Problem

HOUR = 3600.0  # [s]
USUAL: Mapping[str, tuple[float, float]] = MappingProxyType(USUAL_EFFICIENCY)


@dataclass(frozen=True, kw_only=True)
class SkimmerSettings(CatalogueSection):
    """A skimmer with a mouth on the water, outside a tank of particles. It takes oil by a closure: *modelled*.

    on          name of the vessel or boom that carries it; without it, it lies still at `place`
    place       (x, y) [m] of its mouth: ahead and to port of midships, or of the middle of a boom's segment; in the world without `on`
    segment     number of the boom's segment before which it lies, from 0; by default the middle one
    skimmer     name of a skimmer of the catalogue (`oilsim skimmers`), which gives kind, nameplate, swath, storage and efficiencies where
                it has them and they are not stated here
    kind        "weir", "brush" or "disc"; without it and `skimmer`, a weir
    nameplate   [m3/h] of fluid, oil and water together; must be given without `skimmer`
    swath       [m] diameter of its mouth; must be given unless `skimmer` has it
    throughput_efficiency  share of the oil passing its mouth that it takes; without it, 0.75 is assumed, and the run says so
    recovery_efficiency    share of oil in the fluid; without it, 0.35 is assumed for a weir, 0.75 for a brush, 0.85 for a disc
    storage     [m3] of fluid; must be given unless `skimmer` has it
    decanting   [m3/h] at which free water is let out of the storage
    offload_time  [s] to empty a full storage, during which the skimmer stops; 0: nobody empties it, and the skimmer stops for good
    running     whether it runs; an order may stop it and start it again
    """

    KEY = "skimmer"
    CATALOGUE = staticmethod(catalogue)
    USUAL_VALUES: ClassVar[Mapping[str, Any]] = MappingProxyType(
        dict.fromkeys(("nameplate", "swath", "storage"), MISSING)
        | {"kind": "weir", "throughput_efficiency": None, "recovery_efficiency": None}
    )
    RELATIONS: ClassVar[tuple[Relation, ...]] = (only_with("segment", "on"),)
    on: str | None = reference("vessels", "booms", default=None)
    place: Point2 = quantity("m", default=(0.0, 0.0))
    segment: int | None = quantity("", default=None, at_least=0, whole=True)
    skimmer: str | None = None
    kind: SkimmerKind = field(default=cast("SkimmerKind", None))
    nameplate: float = quantity("m3/h", default=None, above=0.0)
    swath: float = quantity_of(SkimmerDesign, "swath", default=None)
    throughput_efficiency: float | None = quantity_of(SkimmerDesign, "throughput_efficiency", default=None)
    recovery_efficiency: float | None = quantity_of(SkimmerDesign, "recovery_efficiency", default=None)
    storage: float = quantity_of(SkimmerDesign, "storage", default=None)
    decanting: float = quantity("m3/h", default=0.0, at_least=0.0)
    offload_time: float = quantity_of(SkimmerDesign, "offload_time")
    running: bool = True

    @property
    def assumed(self) -> dict[str, float]:
        """The efficiencies [-] that are assumed, by name."""
        names = ("throughput_efficiency", "recovery_efficiency")
        return {name: usual for name, usual in zip(names, USUAL[self.kind], strict=True) if getattr(self, name) is None}

    def design(self, water_density: float) -> SkimmerDesign:
        """Return the skimmer in SI units, on water of that density [kg/m3]."""
        usual_throughput, usual_recovery = USUAL[self.kind]
        return SkimmerDesign(
            kind=self.kind,
            nameplate=self.nameplate / HOUR,
            swath=self.swath,
            storage=self.storage,
            decanting=self.decanting / HOUR,
            offload_time=self.offload_time,
            throughput_efficiency=self.throughput_efficiency or usual_throughput,
            recovery_efficiency=self.recovery_efficiency or usual_recovery,
            water_density=water_density,
        )


def carrier_of(skimmer: SkimmerSettings, segments: Mapping[str, int]) -> str | None:
    """Return the body that carries a skimmer, None for one that lies still; `segments` are the numbers of the booms' segments."""
    if skimmer.on is None or skimmer.on not in segments:
        return skimmer.on and body_of(skimmer.on)
    count = segments[skimmer.on]
    return segment_names(skimmer.on, count)[count // 2 if skimmer.segment is None else skimmer.segment]


def skimmer_problems(
    skimmers: Mapping[str, SkimmerSettings], vessels: Mapping[str, object], segments: Mapping[str, int]
) -> Iterator[Problem]:
    """Yield what is wrong between skimmers and what carries them; `segments` are the numbers of the booms' segments."""
    for name, skimmer in skimmers.items():
        if skimmer.on is None or (skimmer.on not in vessels and skimmer.on not in segments):
            continue
        if skimmer.on in vessels and skimmer.on in segments:
            text = f"is {skimmer.on!r}, which is a vessel and a boom, allowed: a name that only one of them has"
            yield Problem(f"skimmers.{name}.on", text)
        elif skimmer.segment is not None and skimmer.segment >= segments.get(skimmer.on, 0):
            count = segments.get(skimmer.on, 0)
            allowed = f"0 to {count - 1}" if count else "only on a boom"
            yield Problem(f"skimmers.{name}.segment", f"is {skimmer.segment}, allowed: {allowed}")
