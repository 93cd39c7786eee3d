"""The simulators of a run: the fluid, the rigid bodies, and the exchange between them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from coupling.bullet.assembly import CoupledBodies, couple_world
from coupling.bullet.rigid_body_participant import Requested
from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.solids.surface_sampling import SurfaceSampling
from oilsim import Fluid
from recordings.model.exercise import ChartImage
from scenarios.schema.exercise import body_of
from scenarios.schema.recovery import SkimmerSettings
from scenarios.setup.afloat.boom_remarks import boom_remarks
from scenarios.setup.afloat.fleet import Fleet
from scenarios.setup.at_sea.land import Corners, Polygon, polygons_of
from scenarios.setup.at_sea.run_sea import RunSea
from scenarios.setup.cost import surfaces_off
from scenarios.setup.fluid import air_remarks, build_fluid, drive, interface_remarks
from scenarios.setup.layout import Layout, lay_out
from scenarios.setup.solids.placed_solids import Solid, sampled, thin_bodies
from scenarios.spec.resolve import RunSpec
from scenarios.text.problems import problems_of

if TYPE_CHECKING:
    from booms.recovery.skimming import SkimmingParticipant
    from coupling.participants.slick import SlickParticipant
    from oilsim.sea import Sea
    from oilsim.window.window import Window
    from scenarios.schema.window import WindowTable


@dataclass(frozen=True, kw_only=True, eq=False)
class Simulators:
    """Simulators of everything that a scenario describes.

    level: of the still water [m]; solids: all bodies, those of the fleet too; coupled: names of those that exchange motion and
    wrench with the fluid, and `bodies` how they do; tank: the fluid's handle of the tank's sides, None without closed ones; world: None
    if nothing is coupled; left_out: what bodies take of the liquid at the start, in words, by region; thin: what is to be told of bodies
    too thin for their particles and of booms, by name; notes: what was mended of bodies' meshes, in words; sea: as it is now;
    facts: what comes of windows' resolution, in words;
    slicks: the oil that is parcels, one slick or none; skimmers: what takes it off the water; windows: the box of particles of a run at
    sea, which has `fluid`, and the outer one around it, if there is one; areas: outlines [m] of those that are sensitive, by name; land:
    polygons; chart: of the site.
    """

    scenario: RunSpec
    level: float
    fleet: Fleet
    solids: tuple[Solid, ...]
    coupled: tuple[str, ...]
    fluid: Fluid
    tank: int | None
    sea: RunSea
    bodies: CoupledBodies
    world: RigidBodyWorld | None
    left_out: Mapping[str, str]
    thin: Mapping[str, str]
    notes: tuple[str, ...]
    facts: tuple[str, ...] = ()
    slicks: tuple[SlickParticipant, ...] = ()
    skimmers: tuple[SkimmingParticipant, ...] = ()
    windows: tuple[Window, ...] = ()
    areas: Mapping[str, Sequence[Corners]] = field(default_factory=dict)
    chart: ChartImage | None = None
    land: Sequence[Polygon] = ()

    def positions(self, phase: str, time: float) -> NDArray[np.float32]:
        """Return where the particles (N, 3) [m] of a phase are at `time` [s], in the order of their ids."""
        return self.windows[0].phase_places(phase, time) if self.windows else self.fluid.phase_positions(phase)

    def wrench(self, body: str) -> NDArray[np.float64]:
        """Return the wrench (6,) [N, N m] of the fluid, or of the sea without particles, on a body; 0 on a body that neither meets."""
        by_sea = np.zeros(6) if self.world is None else self.world.sea_wrench(body)
        return by_sea + self.bodies.fluid.get(f"{body}.wrench") if body in self.coupled else by_sea


def build_simulators(spec: RunSpec) -> Simulators:
    """Lay everything out and fill the tank; ScenarioError for what cannot be made."""
    layout = lay_out(spec)
    solids, coupled = layout.solids, layout.coupled
    if spec.window is not None:
        return _with_window(spec, spec.window, layout)
    with problems_of("fluid", "cannot be built"):
        fluid, tank = build_fluid(spec, layout.positions, layout.sea)
    wetted = [solid for solid in solids if solid.wetted and spec.in_tank]
    samplings = sampled(wetted, spec.spacing)
    handles = _wet(fluid, wetted, samplings, coupled)
    slicks = _slicks(spec, layout)
    skimmers = _skimmers(spec.skimmers, layout, slicks)
    requested = None if spec.in_tank else _asked(layout, slicks, skimmers)
    thin: Mapping[str, str] = {}
    if spec.in_tank:
        thin = thin_bodies(solids, samplings, spec.spacing) | boom_remarks(spec, layout.waters.level)
    return Simulators(
        scenario=spec,
        level=layout.waters.level,
        fleet=layout.fleet,
        solids=solids,
        coupled=coupled,
        fluid=fluid,
        tank=tank,
        sea=_sea(spec, layout, fluid, slicks),
        bodies=couple_world(fluid, {name: handles[name] for name in coupled}, layout.world, requested=requested),
        world=layout.world,
        left_out=layout.left_out,
        thin=thin,
        notes=(
            *(note for solid in solids for note in solid.notes),
            *spec.left_out_in_words,
            *air_remarks(spec, layout.positions, has_bodies=bool(spec.bodies)),
            *interface_remarks(spec, layout.positions),
            *layout.chart.notes,
        ),
        facts=(*surfaces_off(spec), *layout.chart.facts),
        slicks=slicks,
        skimmers=skimmers,
        areas=layout.areas,
        chart=layout.chart.image,
        land=polygons_of(layout.land),
    )


def _with_window(spec: RunSpec, table: WindowTable, layout: Layout) -> Simulators:
    """Put a window of particles into the sea; ScenarioError for bodies that cannot be sampled."""
    from scenarios.setup.at_sea.window import build_window, couple_window, exchange_oil, require_water, target_of

    settings, *around = table.boxes(spec.fluid)
    beyond = require_water(table.target, (settings, *around)[-1], layout.solids, layout.waters.level)
    outer = [build_window(one, spec, spec.run.threads, layout.sea) for one in around]
    window = build_window(settings, spec, spec.run.threads, layout.sea, *outer)
    windows = (window, *outer)
    wetted = [solid for solid in layout.solids if solid.wetted]
    target, slicks = target_of(table.target, layout.fleet), _slicks(spec, layout)
    for slick in slicks:
        exchange_oil(window, slick, [name for name, phase in spec.phases.items() if phase.is_oil])
    bodies = couple_window(windows, target, wetted, layout.world, [body for slick in slicks for body in slick.bodies])
    notes, facts = _told(spec, table, layout, windows)
    return Simulators(
        scenario=spec,
        level=layout.waters.level,
        fleet=layout.fleet,
        solids=layout.solids,
        coupled=() if layout.world is None else tuple(solid.name for solid in wetted),
        fluid=window.fluid,
        tank=None,
        sea=RunSea(layout.sea, lambda: window.fluid.time, lambda: np.zeros(2)),  # whose particles move with it as it is
        bodies=bodies,
        world=layout.world,
        left_out=layout.left_out,
        thin={},
        notes=(*notes, *beyond, *layout.chart.notes),
        facts=(*facts, *layout.chart.facts),
        slicks=slicks,
        skimmers=_skimmers(spec.skimmers, layout, slicks),
        windows=windows,
        chart=layout.chart.image,
    )


def _told(
    spec: RunSpec, table: WindowTable, layout: Layout, windows: Sequence[Window]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return warnings and facts of a run with a window, which follows its target already."""
    from scenarios.setup.at_sea.window import booms_in_rim, segments_borne, window_facts, window_remarks

    booms, sizes = layout.fleet.booms, [one.settings for one in windows]
    mended = (note for solid in layout.solids for note in solid.notes)
    remarks = window_remarks(table.target, sizes, layout.sea, spec.booms, spec.places)
    facts = window_facts(sizes, spec.fluid.gravity, spec.run.communication_step)
    return (*mended, *spec.left_out_in_words, *remarks, *booms_in_rim(windows, booms)), (
        *facts,
        *segments_borne(windows, booms),
    )


def _slicks(spec: RunSpec, layout: Layout) -> tuple[SlickParticipant, ...]:
    """Build the oil of a run without a tank; none in other runs, and without oil."""
    if spec.tanks or not any(phase.is_oil for phase in spec.phases.values()):
        return ()
    from scenarios.setup.at_sea.parcels import build_slick

    with problems_of("fill", "cannot become a slick"):
        carriers = [body_of(vessel.name) for vessel in layout.fleet.vessels]
        one = build_slick(
            spec,
            layout.sea,
            layout.fleet.booms,
            layout.waters.beach,
            layout.land,
            carriers,
        )
    return (one,)


def _sea(spec: RunSpec, layout: Layout, fluid: Fluid, slicks: Sequence[SlickParticipant]) -> RunSea:
    """Return the sea of a run, which tells the forcing of a tank, the bodies that it loads, and the slick that it carries."""
    world, tank = layout.world, spec.domain
    environment = None if world is None else world.environment
    middle = 0.5 * (np.array(tank.lower[:2]) + np.array(tank.upper[:2]))

    def place() -> NDArray[np.float64]:
        at_sea = world is not None and world.environment is not None
        return world.poses(world.loaded_names)[:, :2].mean(axis=0) if at_sea and world is not None else middle

    def clock() -> float:
        return fluid.time if world is None else world.time

    sea = RunSea(layout.sea, clock, place)
    if environment is not None and world is not None:
        from oilsim.loads.morison import FloatingBodies

        def load(now: Sea) -> None:
            assert isinstance(world.environment, FloatingBodies)
            world.change_environment(world.environment.in_sea(now))

        sea.tell(load)
    for slick in slicks:
        from scenarios.setup.at_sea.parcels import carry_slick  # only a run with parcels pays for its kernels

        sea.tell(partial(carry_slick, slick, layout.fleet.booms))
    if spec.in_tank:
        sea.tell(lambda now: drive(fluid, spec, now))
    return sea


def _asked(layout: Layout, slicks: Sequence[SlickParticipant], skimmers: Sequence[SkimmingParticipant]) -> Requested:
    """Say what helmsmen, slick and skimmers ask of the bodies."""
    carried = [name.removesuffix(".pose") for one in skimmers for name in one.variables if name.endswith(".pose")]
    steered = [body_of(vessel.name) for vessel in layout.fleet.vessels]
    return Requested(
        tuple(dict.fromkeys([*steered, *carried])), tuple(body for slick in slicks for body in slick.bodies)
    )


def _skimmers(
    settings_of: Mapping[str, SkimmerSettings], layout: Layout, slicks: Sequence[SlickParticipant]
) -> tuple[SkimmingParticipant, ...]:
    """Build the skimmers, whose code is imported only if there are some."""
    if not settings_of:
        return ()
    from scenarios.setup.at_sea.parcels import build_skimmers

    return build_skimmers(settings_of, slicks, layout.fleet.booms)


def _wet(
    fluid: Fluid, solids: Sequence[Solid], samplings: Mapping[int, SurfaceSampling], coupled: Sequence[str]
) -> dict[str, int]:
    """Give the fluid the surfaces of wetted solids; return their handles by name.

    The surface of a coupled body is placed about its centre of mass, that of another body at its final place.
    """
    handles = {}
    for solid in solids:
        surface = solid.surface(samplings[id(solid.placed.mesh)])
        if solid.name not in coupled:
            rotation = Rotation.from_quat(solid.placed.orientation)
            surface = replace(surface, position=rotation.apply(surface.position) + solid.placed.position)
        handles[solid.name] = fluid.add_boundary(surface)
    return handles
