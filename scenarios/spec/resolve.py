"""A scenario as it is run: at one fidelity, with a number for every word and for every default that follows from others.

It is resolved once, and every part of a run is built from that.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, replace

from oilsim.core.quantity import quantity_of
from oilsim.sea import SeaDescription
from scenarios.schema.bodies import Free
from scenarios.schema.liquid import (
    SOMEWHERE,
    Fill,
    FluidSettings,
    PipeEmitterSettings,
    Side,
    Tank,
    top_of_water,
)
from scenarios.schema.recovery import carrier_of
from scenarios.schema.run_settings import BodyProbe, CameraSettings, RecordingSettings, RunSettings
from scenarios.schema.sea import SeaSettings
from scenarios.schema.tables import Tables
from scenarios.schema.window import WindowTable
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import Problem, ScenarioError

# [1] layers of water that a window needs; numerical; as its own depth
LEAST_LAYERS = 4
# [m] around all that an exercise places, and above still water, which pictures and plans show; chosen; as wide as a harbour boom
MARGIN, HEADROOM = 100.0, 6.0
# [s] between checkpoints where nothing else is said; user; a second of a tank of particles takes ten to calculate
INTERVAL = 1.0
# [s] the same without a tank; user; a checkpoint takes as long as two seconds of a large exercise
INTERVAL_AT_SEA = 10.0
OPEN: tuple[Side, ...] = ("-x", "+x", "-y", "+y", "+z")


@dataclass(frozen=True, kw_only=True)
class SeaSpec(SeaSettings):
    """The sea of a run: as that of a scenario, with numbers for its depth and its level."""

    depth: float = quantity_of(SeaDescription, "depth")
    level: float = quantity_of(SeaDescription, "level")


@dataclass(frozen=True, kw_only=True)
class RunSpec(Tables):
    """A scenario as it is run, with its tables as they are felt.

    tank      the box with walls whose particles `fill`, `emitters` and `probes` are about; None without one, and then these are empty
    window    the box with rims, with numbers; None without one
    domain    the tank, or the part of the open sea around everything that is placed, which has a floor only
    spills    oil at the start that is parcels, because no tank holds it; sources: pipes that pour such oil
    left_out  the entries of the file that no part of the run feels
    """

    name: str
    title: str
    text: str
    run: RunSettings
    fluid: FluidSettings
    domain: Tank
    spills: Mapping[str, Fill]
    sources: Mapping[str, PipeEmitterSettings]
    sea: SeaSettings
    recording: RecordingSettings
    camera: CameraSettings | None
    left_out: tuple[str, ...]

    def skimmers_at(self, boom: str) -> tuple[str, ...]:
        """Return the names of the skimmers that may take the oil of a boom: on it, or on no boom."""
        return tuple(
            name for name, skimmer in self.skimmers.items() if skimmer.on == boom or skimmer.on not in self.booms
        )

    @property
    def orbital_speed(self) -> float:
        """Speed pi H / T [m/s] at which the water of the waves swings at the surface of deep water; 0 without waves."""
        height, period = self.sea.height_and_period
        return math.pi * height / period if period else 0.0

    @property
    def period(self) -> tuple[float, float]:
        """Length [m] after which the water repeats along x and y; 0 along an axis on which it does not."""
        return self.domain.period

    @property
    def in_tank(self) -> bool:
        """Tell whether particles fill the domain, between the walls of the tank."""
        return self.tank is not None

    @property
    def spacing(self) -> float:
        """Spacing of the particles [m]."""
        return self.fluid.particle_spacing

    @property
    def water_density(self) -> float:
        """Density [kg/m3] of the liquid that vessels and booms float in: the first phase that is not oil, else the first."""
        waters = [phase for phase in self.phases.values() if not phase.is_oil]
        return (waters or list(self.phases.values()))[0].rest_density

    def sea_at(self, level: float) -> SeaSpec:
        """Return the sea, on water up to `level` [m] where the file says nothing."""
        return sea_of(self.sea, self.tank, self.fluid.particle_spacing, level)

    @property
    def places(self) -> list[tuple[float, float]]:
        """Places (x, y) [m] of vessels and of the bodies of [bodies] at the start."""
        return [*(one.position for one in self.vessels.values()), *(one.position[:2] for one in self.bodies.values())]

    @property
    def bearing(self) -> float:
        """Bearing [rad] of the x axis, clockwise from north; without a site, east."""
        return 0.5 * math.pi if self.site is None else self.site.bearing

    @property
    def tanks(self) -> tuple[Tank, ...]:
        """The boxes with walls that hold particles: one, or none."""
        return () if self.tank is None else (self.tank,)

    @property
    def left_out_in_words(self) -> tuple[str, ...]:
        """Warnings about what no part of the run feels, entries of the file and forces that nothing finds; empty where all is felt."""
        told = "without a tank, oil is a slick of parcels, and the sea is formulas, so {} is left out"
        unfelt = [
            f"probes.{name}: without particles formulas load free bodies only, so force and torque on {probe.body!r} are left out"
            for name, probe in self.probes.items()
            if isinstance(probe, BodyProbe) and not self.tanks and self.window is None and self._is_led(probe.body)
        ]
        return (*([told.format(", ".join(self.left_out))] if self.left_out else ()), *unfelt)

    def _is_led(self, body: str) -> bool:
        """Tell whether a body of the file is fixed, or moves as it is told."""
        return body in self.bodies and not isinstance(self.bodies[body].motion, Free)

    @property
    def met_spacing(self) -> float | None:
        """Spacing [m] of the particles that bodies may meet; None without any."""
        if self.window is not None:
            return self.window.spacing_in(self.fluid)
        return self.fluid.particle_spacing if self.tanks else None


def numbered(scenario: Scenario) -> Scenario:
    """Return the scenario with a number in the place of each word of its window, so that a run can be repeated on another machine.

    A window ends at the bottom of its sea. Raises ScenarioError where nothing tells a size, and for water too shallow for the particles.
    """
    window = _window(scenario)
    if window is None:
        return scenario
    if not (window.size and window.depth) or isinstance(window.spacing, str):
        from scenarios.spec.window_choice import chosen  # only such a run pays for particles

        window = chosen(scenario, window)
        scenario = replace(scenario, window=window)
    depth, spacing = _sea(scenario).depth, window.spacing_in(scenario.fluid)
    if scenario.fluid.particle_spacing != spacing:  # pictures and notes tell that of the run's particles
        scenario = replace(scenario, fluid=replace(scenario.fluid, particle_spacing=spacing))
    if depth < LEAST_LAYERS * spacing:
        key = "fluid.particle_spacing" if window.spacing is None else "window.spacing"
        text = f"is {spacing:g} m, allowed in a window on water {depth:g} m deep: up to a quarter of that"
        raise ScenarioError([Problem(key, text)], scenario.name)
    if window.outer is not None and depth < LEAST_LAYERS * window.outer.spacing:
        text = f"is {window.outer.spacing:g} m, allowed in a window on water {depth:g} m deep: up to a quarter of that"
        raise ScenarioError([Problem("window.outer.spacing", text)], scenario.name)
    ends = window.depth is not None and window.depth > depth
    return replace(scenario, window=replace(window, depth=depth)) if ends else scenario


def resolve(scenario: Scenario | RunSpec) -> RunSpec:
    """Resolve a scenario, unless it is; ScenarioError for what cannot be run."""
    if isinstance(scenario, RunSpec):
        return scenario
    scenario = numbered(scenario)
    recording, window = scenario.recording, _followed(_window(scenario), scenario)
    tank = None if window is not None or scenario.fidelity == "none" else scenario.tank
    interval = INTERVAL if tank else INTERVAL_AT_SEA
    if recording.checkpoint_interval is None:
        recording = replace(recording, checkpoint_interval=interval)
    spec = {item.name: getattr(scenario, item.name) for item in fields(RunSpec) if hasattr(scenario, item.name)}
    spec |= {"recording": recording, "window": window, "tank": tank, "spills": {}, "sources": {}, "left_out": ()}
    if tank is not None:
        return RunSpec(**spec | {"domain": tank})
    sea = _sea(scenario)
    is_oil = {name: phase.is_oil for name, phase in scenario.phases.items()}
    probes = {name: probe for name, probe in scenario.probes.items() if isinstance(probe, BodyProbe)}
    spills = {name: one for name, one in scenario.fill.items() if is_oil[one.phase]}
    sources = {name: one for name, one in scenario.emitters.items() if is_oil[one.phase]}
    kept: Mapping[str, Mapping[str, object]] = {"fill": spills, "emitters": sources, "probes": probes}
    left_out = [
        f"{table}.{name}" for table, there in kept.items() for name in getattr(scenario, table) if name not in there
    ]
    spec |= {
        "fill": {},
        "emitters": {},
        "probes": probes,
        "spills": spills,
        "sources": sources,
        "left_out": tuple(left_out),
    }
    if window is None:
        spec["fluid"] = replace(
            scenario.fluid, sleep_speed=0.0
        )  # regions of a sea without water would cost a step's time
    return RunSpec(**spec | {"sea": sea, "domain": _open_sea(scenario, sea)})


def _window(scenario: Scenario) -> WindowTable | None:
    return None if scenario.fidelity == "none" else scenario.window


def _followed(window: WindowTable | None, scenario: Scenario) -> WindowTable | None:
    """Return the window as a run has it: one at a skimmer follows what carries that, or its place."""
    if window is None or window.target not in scenario.skimmers:
        return window
    skimmer = scenario.skimmers[str(window.target)]
    carrier = carrier_of(skimmer, {name: boom.segments for name, boom in scenario.booms.items()})
    return replace(window, target=skimmer.place if carrier is None else carrier)


def sea_of(settings: SeaSettings, tank: Tank | None, spacing: float, level: float) -> SeaSpec:
    """Return a sea with depth and level: where they are not given, of water up to `level` [m] over the tank's floor.

    A tank that is empty at the start has a layer of one spacing [m].
    """
    surface = level if settings.level is None else settings.level
    depth = settings.depth
    if depth is None:
        depth = spacing if tank is None else max(surface - tank.lower[2], spacing)
    parts = {item.name: getattr(settings, item.name) for item in fields(SeaSettings)}
    return SeaSpec(**parts | {"level": surface, "depth": depth})


def _sea(scenario: Scenario) -> SeaSpec:
    """Return the sea where no tank is, with its depth and level: where nothing is said, those of the water of the file."""
    top = top_of_water(scenario.fill, scenario.phases)
    if scenario.sea.depth is None and (top is None or scenario.tank is None):
        text = "is missing, allowed: a depth, or a tank with water in a slab or block of [fill]"
        raise ScenarioError([Problem("sea.depth", text)], scenario.name)
    return sea_of(scenario.sea, scenario.tank, scenario.fluid.particle_spacing, top or 0.0)


def _open_sea(scenario: Scenario, sea: SeaSpec) -> Tank:
    """Return the part of the sea around all that is placed, or of a tank that is left out; its floor is the shore's, where there is one."""
    level, open_sides = sea.level, OPEN if scenario.shore is None else (*OPEN, "-z")
    if scenario.tank is not None:
        low, high = scenario.tank.lower[:2], scenario.tank.upper[:2]
    else:
        x, y = zip(*_places(scenario), strict=True)
        low, high = (min(x) - MARGIN, min(y) - MARGIN), (max(x) + MARGIN, max(y) + MARGIN)
    return Tank(lower=(*low, level - sea.depth), upper=(*high, level + HEADROOM), open=open_sides)


def _places(scenario: Scenario) -> Iterator[tuple[float, float]]:
    """Yield places (x, y) [m] of everything that a scenario places in plan."""
    yield 0.0, 0.0
    yield from (vessel.position for vessel in scenario.vessels.values())
    yield from (end for boom in scenario.booms.values() for end in boom.ends if not isinstance(end, str))
    yield from (leg.anchor for leg in scenario.moorings.values())
    yield from (pipe.mouth[:2] for pipe in scenario.emitters.values())
    yield from (body.position[:2] for body in scenario.bodies.values())
    for fill in scenario.fill.values():
        yield from (corner[:2] for corner in fill.extent(SOMEWHERE))
