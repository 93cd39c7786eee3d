"""The oil of a run without particles: a slick of parcels, held and lost by the scenario's booms (`oilsim.slick`, `booms.losses`).

Skimmers of a run without particles: built on the slick, and connected to the bodies that carry them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from booms.boom import Boom as BoomSection
from booms.deployment import BoomLayout
from booms.losses.rates import Closures, PooledBoom, SlickLosses
from booms.recovery.skimming import SkimmingParticipant
from coupling.bullet.assembly import BODIES
from coupling.master.connection import Connection
from coupling.participants.plan_barriers import Beach, BoomBodies, ReelMouth
from coupling.participants.slick import CarryingSea, SlickParticipant
from oilsim.sea import Sea
from oilsim.slick.barriers import Barrier, Boom, Outline
from oilsim.slick.gradient_flow import joined_radius
from oilsim.slick.oil import Oil
from oilsim.slick.slick import Slick, SlickSettings
from oilsim.slick.spill_source import SpillSource
from scenarios.schema.exercise import BoomSettings, body_of
from scenarios.schema.liquid import CylinderFill, Fill, PhaseSettings, PipeEmitterSettings, SlabFill, Tank
from scenarios.schema.recovery import SkimmerSettings, carrier_of
from scenarios.setup.afloat.boom_lines import track_off_reel
from scenarios.setup.afloat.boom_losses import tension_of
from scenarios.setup.at_sea.land import Land
from scenarios.setup.solids.placed_solids import vector
from scenarios.spec.resolve import RunSpec
from scenarios.text.problems import Problem, ScenarioError


def build_skimmers(
    settings_of: Mapping[str, SkimmerSettings], slicks: Sequence[SlickParticipant], booms: Mapping[str, BoomLayout]
) -> tuple[SkimmingParticipant, ...]:
    """Build skimmers by their settings; none without oil on the water."""
    found = []
    for slick, (name, settings) in product(slicks, settings_of.items()):
        body = carrier_of(settings, {boom: len(layout.segments) for boom, layout in booms.items()})
        offset = np.array([*settings.place, 0.0])
        design = settings.design(slick.slick.settings.water_density)
        one = SkimmingParticipant(f"skimmers/{name}", design, slick, body=body, offset=offset)
        one.skimmer.is_running = settings.running
        found.append(one)
    return tuple(found)


def skimmer_connections(skimmers: tuple[SkimmingParticipant, ...]) -> tuple[Connection, ...]:
    """List the connections that tell the skimmers where their bodies are."""
    return tuple(
        Connection(BODIES, name, skimmer.name, name)
        for skimmer in skimmers
        for name in skimmer.variables
        if name.endswith((".pose", ".twist"))
    )


Array = NDArray[np.float64]

SLICK = "slick"
# parcels of each fill; numerical; a pool of 66 segments holds some 15 each
PARCELS = 1000
# parcels that a boom loses of all oil at most; numerical
LOST_PARCELS = 2000
# [m3] released by orders alone, which nobody knows at the start; numerical; sizes the parcels that booms lose
UNKNOWN_RELEASE = 1.0
# [1] depth of a boom at which the water that runs against it is taken, in drafts; numerical; the middle of the skirt
DEPTH = 0.5


class Spill(NamedTuple):
    """Oil at the start: volume [m3], center (2,) [m], radius [m] of a disc of the same area."""

    volume: float
    center: tuple[float, float]
    radius: float


class FloatingOilFlow:
    """The motion of what floats on a sea: current at the surface, drift of the wind, Stokes drift, Langmuir cells."""

    def __init__(self, sea: Sea) -> None:
        self._sea = sea

    def surface_velocity(self, points_xy: Array, time: float) -> Array:
        """Return the velocity (N, 2) [m/s] at points (N, 2) [m]."""
        level = np.full(len(points_xy), self._sea.still_level(time))
        current = self._sea.current(level, time, points_xy)
        return np.asarray(current + self._sea.surface_drift(points_xy, time), np.float64)


class WaterFlow:
    """The motion of the water at a depth [m] below the surface, by which it runs against booms: current, drift of the wind, waves.

    A boom rides the waves, and so does the water before it. So its speed through the water holds the waves' orbital velocity, too.
    """

    def __init__(self, sea: Sea, depth: float) -> None:
        self._sea, self._depth = sea, depth

    def surface_velocity(self, points_xy: Array, time: float) -> Array:
        """Return the velocity (N, 2) [m/s] at points (N, 2) [m]."""
        deep = self._sea.elevation(points_xy, time) - self._depth
        return self._sea.velocity(np.column_stack([points_xy, deep]), time)[:, :2]


def build_slick(
    liquid: RunSpec,
    sea: Sea,
    booms: Mapping[str, BoomLayout],
    beach: Beach | None,
    land: Mapping[str, Land],
    carriers: Sequence[str],
) -> SlickParticipant:
    """Build the slick of the oil that is filled in, or may be poured, among booms by their settings; `carriers` may carry sources."""
    spills = {name: spill_of(fill, liquid.domain) for name, fill in liquid.spills.items()}
    bodies = [_boom_bodies(name, layout, liquid.booms[name]) for name, layout in booms.items()]
    sources = oil_sources(liquid)
    released = sum(spill.volume for spill in spills.values()) + _poured(liquid, sources)
    settings = SlickSettings(
        loss_volume=(released or UNKNOWN_RELEASE) / LOST_PARCELS,
        water_density=sea.description.density,
        diffusivity=sea.description.diffusivity,
        seed=liquid.run.seed,
    )
    slick = Slick(
        settings, [*_barriers(booms, bodies, beach), *(one for name, own in land.items() for one in own.barriers(name))]
    )
    for name in booms:
        for joint in liquid.booms[name].parted:
            slick.part(name, joint)
    for name, spill in spills.items():
        oil = _oil(liquid.phases, liquid.spills[name].phase)
        slick.release(
            oil, spill.volume, count=PARCELS, center=spill.center, radius=spill.radius, age=_age(spill, oil, settings)
        )
    participant = SlickParticipant(
        SLICK,
        slick,
        carrying_sea(sea, booms),
        booms=bodies,
        loss_rate=_losses(liquid.booms, slick, booms),
        beach=beach,
        carriers=carriers,
    )
    participant.sources.extend(sources.values())
    return participant


def _barriers(booms: Mapping[str, BoomLayout], bodies: Sequence[BoomBodies], beach: Beach | None) -> list[Barrier]:
    """Return the barriers of the slick: the booms, and the waterline of the beach."""
    barriers: list[Barrier] = [
        _boom(name, layout, own) for (name, layout), own in zip(booms.items(), bodies, strict=True)
    ]
    if beach is not None:
        barriers.append(Outline(name=beach.name, nodes=beach.outline(0.0), capacity=beach.capacity, carries=False))
    return barriers


def _poured(liquid: RunSpec, sources: Mapping[str, SpillSource]) -> float:
    """Return the volume [m3] that the sources pour until the run's end."""
    return sum(
        min(settings.volume or math.inf, sources[name].rate * max(0.0, liquid.run.duration - settings.start))
        for name, settings in liquid.sources.items()
    )


def _losses(settings_of: Mapping[str, BoomSettings], slick: Slick, booms: Mapping[str, BoomLayout]) -> SlickLosses:
    """Return the closures of the booms that have them."""
    return SlickLosses(
        [
            _pooled(slick.barriers.rows(name), layout.boom)
            for name, layout in booms.items()
            if settings_of[name].losses == "closures"
        ]
    )


def _pooled(rows: slice, boom: BoomSection) -> PooledBoom:
    """Return a boom of the slick that has these rows there."""
    closures = Closures(skirt_depth=boom.skirt_depth)
    if boom.pocket is None:
        return PooledBoom(rows=rows, closures=closures)
    own = boom.pocket.segments(boom.length, boom.segment_count)
    inside = slice(rows.start + own.start, rows.start + own.stop)
    return PooledBoom(rows=rows, closures=closures, pocket=boom.pocket, pocket_rows=inside)


def oil_sources(liquid: RunSpec) -> dict[str, SpillSource]:
    """Return the pipes of oil as sources of parcels, by name: each pours its opening's area times its speed."""
    return {
        name: SpillSource(
            name,
            _oil(liquid.phases, pipe.phase),
            (pipe.mouth[0], pipe.mouth[1]),
            pipe.radius,
            rate_of(pipe),
            start=pipe.start,
            volume=pipe.volume,
            body="" if pipe.on is None else body_of(pipe.on),
        )
        for name, pipe in liquid.sources.items()
    }


def rate_of(pipe: PipeEmitterSettings) -> float:
    """Return the rate [m3/s] at which a pipe pours."""
    return math.pi * pipe.radius**2 * pipe.speed


def new_sources(slick: SlickParticipant, liquid: RunSpec) -> list[SpillSource]:
    """Return the sources that orders have added; ScenarioError for one that pours no oil, and so is left out."""
    known = {source.name for source in slick.sources}
    sources = oil_sources(liquid)
    others = [place.removeprefix("emitters.") for place in liquid.left_out if place.startswith("emitters.")]
    if others:
        text = "pours no oil, allowed without a tank: oil, which becomes parcels"
        raise ScenarioError([Problem(f"emitters.{name}", text) for name in others], "oilsim")
    return [source for name, source in sources.items() if name not in known]


def _oil(phases: Mapping[str, PhaseSettings], name: str) -> Oil:
    """Return the oil of a phase, numbered in the order of the oils."""
    phase, oils = phases[name], [name for name, one in phases.items() if one.is_oil]
    return Oil(
        density=phase.rest_density,
        dynamic_viscosity=phase.viscosity,
        interfacial_tension=tension_of(phase),
        number=oils.index(name),
    )


def carry_slick(slick: SlickParticipant, booms: Mapping[str, BoomLayout], sea: Sea) -> None:
    """Let another sea carry the slick from now on."""
    slick.change_sea(carrying_sea(sea, booms))


def carrying_sea(sea: Sea, booms: Mapping[str, BoomLayout]) -> CarryingSea:
    """Return the sea as it carries a slick; its water is that at the middle of the deepest skirt."""
    deepest = max((layout.boom.skirt_depth for layout in booms.values()), default=0.0)
    return CarryingSea(FloatingOilFlow(sea), WaterFlow(sea, DEPTH * deepest), sea)


def slick_connections(slick: SlickParticipant) -> tuple[Connection, ...]:
    """List the connections that tell the slick where the booms are."""
    return (Connection(BODIES, "poses", SLICK, "poses"),) if slick.bodies else ()


def spill_of(fill: Fill, tank: Tank) -> Spill:
    """Return the oil of a region as a disc of the same area."""
    if isinstance(fill, CylinderFill):
        return Spill(math.pi * fill.radius**2 * fill.height, fill.base[:2], fill.radius)
    lower, upper = (tank.lower, tank.upper) if isinstance(fill, SlabFill) else (fill.lower, fill.upper)
    depth = fill.top - fill.bottom if isinstance(fill, SlabFill) else upper[2] - lower[2]
    area = (upper[0] - lower[0]) * (upper[1] - lower[1])
    return Spill(area * depth, (0.5 * (lower[0] + upper[0]), 0.5 * (lower[1] + upper[1])), math.sqrt(area / math.pi))


def _age(spill: Spill, oil: Oil, settings: SlickSettings) -> float:
    """Return the time [s] in which the oil would have spread from a point to the radius of the spill, by bisection."""
    buoyancy = 1.0 - oil.density / settings.water_density
    terms = (spill.volume, buoyancy, oil.spreading_tension, settings.water_density, settings.water_viscosity)
    low, high = 0.0, 1e7
    for _ in range(60):
        middle = 0.5 * (low + high)
        if joined_radius(middle, *terms) < spill.radius:
            low = middle
        else:
            high = middle
    return low


def _boom_bodies(name: str, layout: BoomLayout, settings: BoomSettings) -> BoomBodies:
    start, end = (vector(point) for point in layout.segment.joint_points)
    waterline = layout.segment.waterline
    return BoomBodies(
        name=name,
        bodies=tuple(one.name for one in layout.segments),
        start=start,
        end=end,
        foot=(0.0, 0.0, waterline - layout.boom.skirt_depth),
        top=(0.0, 0.0, waterline + layout.boom.freeboard),
        seals=settings.base_width is not None,
        mouth=_mouth(layout, settings),
    )


def _mouth(layout: BoomLayout, settings: BoomSettings) -> ReelMouth | None:
    """Return the mouth of a boom's reel; None without one."""
    track = track_off_reel(layout, settings)
    if track is None:
        return None
    (x, y, _), (out_x, out_y, _) = track.mouth.tolist(), track.outward.tolist()
    return ReelMouth(place=(x, y), outward=(out_x, out_y))


def _boom(name: str, layout: BoomLayout, bodies: BoomBodies) -> Boom:
    """Return a boom of the slick as laid, whole and off its reel."""
    poses = np.array([np.concatenate([one.position, one.orientation]) for one in layout.segments])
    nodes = replace(bodies, mouth=None).nodes(poses, np.zeros(len(poses), np.bool_))
    return Boom(name=name, nodes=nodes, draft=layout.boom.skirt_depth, flow_share=layout.boom.flow_shares)
