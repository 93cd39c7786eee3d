"""The tables of a scenario that have the same form in a file, in the checks between tables, and in a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace

from scenarios.schema.bodies import Body
from scenarios.schema.criteria import CriterionSettings, PriceSettings
from scenarios.schema.exercise import BoomSettings, TowSettings, VesselSettings
from scenarios.schema.fmu_settings import FmuSettings
from scenarios.schema.injects import InjectSettings
from scenarios.schema.liquid import Fill, FluidSettings, PhaseSettings, PipeEmitterSettings, Tank
from scenarios.schema.moorings import MooringSettings, TieSettings
from scenarios.schema.recovery import SkimmerSettings
from scenarios.schema.run_settings import Fidelity, Probe, RunSettings, SiteSettings
from scenarios.schema.sea import AreaSettings, LandSettings, SeaSettings, ShoreSettings
from scenarios.schema.window import WindowTable


@dataclass(frozen=True, kw_only=True)
class Tables:
    """Tables of a scenario, of named things by name; None for one that is not given."""

    phases: Mapping[str, PhaseSettings] = field(default_factory=dict)
    tank: Tank | None = None
    fill: Mapping[str, Fill] = field(default_factory=dict)
    emitters: Mapping[str, PipeEmitterSettings] = field(default_factory=dict)
    shore: ShoreSettings | None = None
    land: Mapping[str, LandSettings] = field(default_factory=dict)
    areas: Mapping[str, AreaSettings] = field(default_factory=dict)
    window: WindowTable | None = None
    bodies: Mapping[str, Body] = field(default_factory=dict)
    vessels: Mapping[str, VesselSettings] = field(default_factory=dict)
    booms: Mapping[str, BoomSettings] = field(default_factory=dict)
    moorings: Mapping[str, MooringSettings] = field(default_factory=dict)
    ties: Mapping[str, TieSettings] = field(default_factory=dict)
    skimmers: Mapping[str, SkimmerSettings] = field(default_factory=dict)
    tow: TowSettings | None = None
    injects: Mapping[str, InjectSettings] = field(default_factory=dict)
    criteria: Mapping[str, CriterionSettings] = field(default_factory=dict)
    prices: PriceSettings | None = None
    probes: Mapping[str, Probe] = field(default_factory=dict)
    fmus: Mapping[str, FmuSettings] = field(default_factory=dict)
    site: SiteSettings | None = None


NAMED_TABLES = tuple(item.name for item in fields(Tables) if item.default_factory is dict)


@dataclass(frozen=True, kw_only=True)
class Parts(Tables):
    """The valid parts of a scenario, all names that it defines by table, and the tables that are given."""

    names: Mapping[str, tuple[str, ...]]
    given: frozenset[str]
    run: RunSettings | None = None
    fluid: FluidSettings | None = None
    sea: SeaSettings | None = None
    fidelity: Fidelity | None = None
    fidelities: Mapping[str, object] | None = None

    @property
    def boxes(self) -> frozenset[str]:
        """The kind of box that the run has particles in, "tank" or "window"; empty without any."""
        kinds = () if self.fidelity == "none" else ("window", "tank")
        return frozenset([kind for kind in kinds if kind in self.given][:1])

    def as_run(self) -> Parts:
        """Return the parts with those boxes alone that the run has."""
        tank, window = self.tank if "tank" in self.boxes else None, self.window if "window" in self.boxes else None
        return replace(self, tank=tank, window=window)
