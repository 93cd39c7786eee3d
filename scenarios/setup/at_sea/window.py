"""The window of a run: particles around a target, inside the sea by formulas (`oilsim.window`), and what they meet at the start."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from booms.deployment import BoomLayout
from coupling.bullet.assembly import FLUID, CoupledBodies, couple_participant
from coupling.bullet.rigid_body_participant import Requested
from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.participants.slick import SlickParticipant
from coupling.participants.window import FADE, SharedEnvironment, Target, WindowBody, WindowParticipant
from coupling.solids.hydrostatics import hydrostatics
from coupling.solids.signed_distance import SignedDistance
from coupling.solids.surface_sampling import LARGEST, SurfaceSampling
from oilsim import BoundaryParticles, Phase
from oilsim.sea import Sea
from oilsim.window.oil_exchange import OilExchange
from oilsim.window.rim import share_kept
from oilsim.window.settings import WindowSettings, fluid_steps
from oilsim.window.water_motion import WaterMotion, WindowFlow
from oilsim.window.window import Window
from scenarios.schema.exercise import BoomSettings, body_of
from scenarios.schema.parsing.quantity_fields import Point2
from scenarios.setup.afloat.fleet import Fleet
from scenarios.setup.solids.placed_solids import Solid, sampled
from scenarios.spec.resolve import RunSpec
from scenarios.spec.window_choice import COARSE
from scenarios.text.problems import Problem, ScenarioError

Array = NDArray[np.float64]
# [1] columns of water along each side of a window that are looked at; numerical
COLUMNS = 16
WINDOWS = ("window", "outer window")


def build_window(
    settings: WindowSettings, liquid: RunSpec, threads: int | None, sea: Sea, outer: Window | None = None
) -> Window:
    """Fill the window of a run with water; other liquids come later."""
    phases = sorted(liquid.phases.items(), key=lambda item: item[1].is_oil)
    liquids = tuple(
        Phase(name=name, rest_density=phase.rest_density, dynamic_viscosity=phase.viscosity, adhesion=phase.adhesion)
        for name, phase in phases
    )
    return Window(settings, sea, liquids, threads, None if outer is None else WaterMotion(outer, whole=True))


def couple_window(
    windows: Sequence[Window],
    target: Target,
    wetted: Sequence[Solid],
    world: RigidBodyWorld | None,
    followed: Sequence[str],
) -> CoupledBodies:
    """Couple a window, or one and its outer one, with all bodies that may meet it; formulas load the bodies with what it leaves.

    followed: names of the bodies whose poses the slick asks for. ScenarioError for bodies that cannot be sampled.
    """
    met, window = [] if world is None else wetted, windows[0]
    there = target({} if world is None else {solid.name: world.pose(solid.name) for solid in met})
    for each in windows:
        each.follow(there, 0.0)
    bodies = [_window_bodies(each, met) for each in windows]
    participant = WindowParticipant(FLUID, windows[-1], bodies[-1], target)
    if len(windows) > 1:
        from coupling.participants.nested_window import NestedWindowParticipant  # of few runs

        participant = NestedWindowParticipant(FLUID, window, bodies[0], target, participant)
    if world is not None and world.environment is not None:
        world.change_environment(SharedEnvironment(world.environment, world.loaded_names, participant.all_shares))
    requested = None if world is None else Requested(world.body_names, followed)
    return couple_participant(participant, window.fluid, tuple(solid.name for solid in met), world, requested=requested)


def _window_bodies(window: Window, met: Sequence[Solid]) -> dict[str, WindowBody]:
    """Return the bodies as a window's particles meet them, by name; ScenarioError for those that cannot be sampled.

    A boom's segments share one sampling. Of what is large an outline is sampled, and the rest when it comes near.
    """
    kept: dict[tuple[int, float], SurfaceSampling] = {}

    def sample(solid: Solid, is_pile: bool, spacing: float) -> BoundaryParticles:
        key = id(solid.placed.mesh), spacing
        if key not in kept:
            kept[key] = sampled([solid], spacing)[key[0]]
        surface = solid.surface(kept[key])
        return replace(surface, displaced=np.empty((0, 4))) if is_pile else surface

    found = {}
    for solid in met:
        pile, spacing = _foot_below(window, solid), window.settings.spacing
        one = WindowBody(solid.placed.mesh, partial(sample, solid, bool(pile)), **pile)
        one.sample(spacing if solid.placed.mesh.area > LARGEST * spacing**2 else one.outline_spacing(spacing))
        found[solid.name] = one
    return found


def _foot_below(window: Window, solid: Solid) -> dict[str, float]:
    """Return lift and middle of a `WindowBody` that is fixed and reaches down to the window's bottom, or below; nothing of others."""
    level, spacing = window.motion.sea.level, window.settings.spacing
    bottom, mesh = level - window.settings.depth, solid.world_mesh()
    if solid.motion != "fixed" or not mesh.bounds[0, 2] < bottom + spacing or not mesh.bounds[1, 2] > bottom:
        return {}
    whole = hydrostatics(mesh, level)
    moment, volume = whole.center_of_buoyancy[2] * whole.displaced_volume, whole.displaced_volume
    if mesh.bounds[0, 2] < bottom:
        below = hydrostatics(mesh, bottom)
        moment, volume = moment - below.center_of_buoyancy[2] * below.displaced_volume, volume - below.displaced_volume
    weight = window.motion.sea.description.density * window.motion.sea.description.gravity
    return {"lift": weight * volume, "middle": float(moment / volume - solid.placed.position[2])}


def exchange_oil(window: Window, slick: SlickParticipant, oils: Sequence[str]) -> None:
    """Let a slick's oil, of phases by these names, become particles of the window and back; the window's water carries the parcels."""
    exchange = OilExchange(window, oils)
    slick.meet(exchange, WindowFlow(slick.flow, exchange.surface))


def middle_of(segments: Sequence[str]) -> list[str]:
    """Return the middle segment, or the two beside the middle: a window beside it would load one leg of a U more than the other."""
    return list(segments[(len(segments) - 1) // 2 : len(segments) // 2 + 1])


def target_of(target: str | Point2, fleet: Fleet) -> Target:
    """Return the place that a window follows, by the poses of bodies: the middle of a boom, a vessel, a body, or a place."""
    if not isinstance(target, str):
        return lambda poses: np.array(target)
    if target in fleet.booms:
        names = middle_of([segment.name for segment in fleet.booms[target].segments])
    else:
        names = [body_of(target) if any(vessel.name == target for vessel in fleet.vessels) else target]
    return lambda poses: np.mean([poses[name][:2] for name in names], axis=0)


def require_water(
    target: str | Point2, settings: WindowSettings, solids: Sequence[Solid], level: float
) -> tuple[str, ...]:
    """Say which fixed bodies reach beyond the window, which cannot meet them; ScenarioError for a window that lies inside one whole.

    level [m] of the still water.
    """
    fixed = [solid for solid in solids if solid.motion == "fixed" and solid.wetted]
    if not fixed:
        return ()
    problems, told, middle = list[Problem](), list[str](), _middle(target, solids)
    for body, share, is_beyond in _overlaps(fixed, settings, middle, level):
        if share == 1.0:
            text = f"puts all of the window inside body {body!r}, where no water is, allowed: a place in the water"
            problems.append(Problem("window.target", text))
        elif is_beyond:
            told.append(
                f"window: body {body!r} reaches beyond it, so its water flows through that body;"
                " window.size must hold all of a fixed body, or the window must be clear of it"
            )
    if problems:
        raise ScenarioError(problems)
    below = (
        f"window: body {body!r} reaches to the bottom of it or below; particles give 0.7 to 1.0 of a wave's force on its part in the"
        " window, most in a deep one, and nothing gives that on the part below"
        for body in _down_to_the_bottom(fixed, settings, middle, level)
    )
    return (*told, *below)


def _down_to_the_bottom(fixed: Sequence[Solid], settings: WindowSettings, middle: Array, level: float) -> Iterator[str]:
    """Yield the fixed bodies in a window around `middle` (2,) [m] whose foot no water of the window bears."""
    half, bottom = 0.5 * np.array(settings.whole_size), level - settings.depth + settings.spacing
    for solid in fixed:
        low, high = solid.world_mesh().bounds
        if low[2] < bottom < high[2] and (low[:2] < middle + half).all() and (high[:2] > middle - half).all():
            yield solid.name


def _middle(target: str | Point2, solids: Sequence[Solid]) -> Array:
    """Return the place (2,) [m] of a window's middle at the start."""
    if not isinstance(target, str):
        return np.array(target)
    places = {solid.name: solid.placed.position[:2] for solid in solids}
    names = middle_of([name for name in places if name.startswith(f"boom/{target}/segment-")])
    names = names or [body_of(target) if body_of(target) in places else target]
    return np.mean([places[name] for name in names], axis=0)


def _overlaps(
    fixed: Sequence[Solid], settings: WindowSettings, middle: Array, level: float
) -> Iterator[tuple[str, float, bool]]:
    """Yield each fixed body in a window around `middle` (2,) [m], the share of the window inside it, and whether it reaches beyond."""
    size = np.array(settings.whole_size)
    lines = [middle[axis] + size[axis] * ((np.arange(COLUMNS) + 0.5) / COLUMNS - 0.5) for axis in (0, 1)]
    heights = level - settings.depth * (np.arange(4) + 0.5) / 4.0
    points = np.stack(np.meshgrid(*lines, heights, indexing="ij"), -1).reshape(-1, 3)
    for solid in fixed:
        low, high = solid.world_mesh().bounds[:, :2]
        turn = Rotation.from_quat(solid.placed.orientation)
        own = np.ascontiguousarray(turn.inv().apply(points - solid.placed.position))
        share = float((SignedDistance(solid.placed.mesh).phi(own) < 0.0).mean())
        if share > 0.0:
            yield solid.name, share, bool((low < middle - 0.5 * size).any() or (high > middle + 0.5 * size).any())


def segments_borne(windows: Sequence[Window], booms: Mapping[str, BoomLayout]) -> Iterator[str]:
    """Say of each boom in a window and its outer one how many of its segments their particles bear at the start."""
    for name, window in zip(WINDOWS, windows, strict=False):
        for boom, shares in _boom_shares(window, booms):
            if shares.any():
                borne = f"{np.count_nonzero(shares)} of the {len(shares)} segments of boom {boom!r}"
                yield f"{name}: particles bear {borne} at the start; formulas bear those that are in no window"


def booms_in_rim(windows: Sequence[Window], booms: Mapping[str, BoomLayout]) -> Iterator[str]:
    """Say of each boom in the widest window if none of its segments is in the middle of any, where particles would bear it."""
    borne = {boom for window in windows for boom, shares in _boom_shares(window, booms) if shares.any()}
    for boom, _ in _boom_shares(windows[-1], booms):
        if boom not in borne:
            yield (
                f"window: boom {boom!r} lies in its rim at the start, and no segment in its middle, so formulas alone load the boom; a"
                f" larger window has it in the middle, or window.target = {boom!r}"
            )


def _boom_shares(window: Window, booms: Mapping[str, BoomLayout]) -> Iterator[tuple[str, NDArray[np.float64]]]:
    """Yield each boom in the window, and the shares (n,) of the particles in the loads of its segments."""
    rim, fade = window.rim, FADE * window.settings.spacing
    for boom, layout in booms.items():
        places = np.array([segment.position for segment in layout.segments])
        within = (np.abs(places[:, :2] - rim.center) < 0.5 * np.array(rim.size)).all(1)
        shares = np.where(within, np.clip((rim.inward(places) - rim.width) / fade, 0.0, 1.0), 0.0)
        if within.any():
            yield boom, shares


def window_facts(windows: Sequence[WindowSettings], gravity: Sequence[float], step: float) -> Iterator[str]:
    """Say what comes of the resolution of a window, and of its outer one, under a gravity (3,) [m/s2] and with communication steps [s]."""
    for name, settings in zip(WINDOWS, windows, strict=False):
        size, spacing, steps = settings.whole_size, settings.spacing, fluid_steps(settings, gravity, step)
        yield (
            f"{name}: {size[0]:.3g} by {size[1]:.3g} m, {settings.layers * spacing:.3g} m deep,"
            f" {settings.particle_count:,} particles of {spacing:.3g} m in {steps} step{'s' * (steps > 1)} a communication step"
            + f"; oil thinner than {spacing:.3g} m stays parcels"
            * (settings is windows[0])
        )


def window_remarks(
    target: str | Point2,
    windows: Sequence[WindowSettings],
    sea: Sea,
    booms: Mapping[str, BoomSettings],
    others: Sequence[Point2],
) -> Iterator[str]:
    """Say what is wrong with the size, the place and the particles of a window, and of its outer one, though it can be run.

    others: places (x, y) [m] of vessels and bodies at the start.
    """
    widest = windows[-1]
    for (name, settings), (boom, its) in product(zip(WINDOWS, windows, strict=False), booms.items()):
        deep = round(its.skirt_depth / settings.spacing, 1)
        if deep < COARSE:
            yield (
                f"{name}: the skirt of boom {boom!r} is {deep:.1f} particles deep, which hardly"
                f" shows it; {its.skirt_depth / COARSE:.3g} m or less would be better"
            )
    reach = 0.5 * max(widest.whole_size) + max((its.length for its in booms.values()), default=0.0)
    if not isinstance(target, str) and others and all(math.dist(target, at) > reach for at in others):
        x, y = target
        yield (
            f"window: no body comes near {x:g}, {y:g} at the start, so its water rests; window.target can be a boom, a vessel"
            " or a body"
        )
    rim = "" if len(windows) > 1 else "window.rim = {:.3g} in "
    yield from _short_rim(WINDOWS[len(windows) - 1], widest, sea, rim)


def _short_rim(name: str, settings: WindowSettings, sea: Sea, advice: str) -> Iterator[str]:
    """Say so if waves as long as those of the sea, which bodies send out, are too long for a rim, with advice on its width."""
    waves = sea.components
    if not waves.amplitude.size:
        return
    length = 2.0 * math.pi / float(waves.wave_number[int(np.argmax(waves.amplitude))])
    if length > min(settings.whole_size):
        kept = share_kept(settings.width, length)
        yield (
            f"{name}: it is smaller than the sea's waves of {length:.3g} m, which pass all the same; but of waves that long that bodies"
            f" send out {100.0 * kept:.0f} % come back; {advice.format(0.5 * length)}a window of {2.0 * length:.3g} m keeps 1 %"
        )
