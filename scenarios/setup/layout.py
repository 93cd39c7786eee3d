"""Lays out liquid and bodies of a scenario where they start, before anything is simulated, and finds every problem at once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import trimesh
from numpy.typing import NDArray

from booms.boom import FABRIC_RELAXATION
from coupling.bullet.rigid_body_world import FRICTION, RigidBodyWorld
from coupling.solids.surface_sampling import LARGEST, sample_surface
from oilsim.sea import Sea
from recordings.model.words import volume_in_words
from scenarios.schema.bodies import SineMotion
from scenarios.schema.exercise import joint_name
from scenarios.schema.liquid import Tank
from scenarios.schema.run_settings import BodyProbe, Probe
from scenarios.setup.afloat.fleet import LINE_RELAXATION_TIME, Fleet, Waters, place_fleet
from scenarios.setup.afloat.moorings import add_legs, beach_of, tie_name
from scenarios.setup.at_sea.build_sea import build_sea
from scenarios.setup.at_sea.land import Corners, Land, polygons_of, read_land, read_polygons, stream_along
from scenarios.setup.at_sea.sea_loads import load_bodies, shore_solid
from scenarios.setup.fill_lattice import empty_regions, off_lattice, placed_regions
from scenarios.setup.fluid import clear_of, pipe_problems, water_level
from scenarios.setup.site_chart import SiteChart, read_chart
from scenarios.setup.solids.placed_solids import Solid, own_solids, table_entry, vector
from scenarios.spec.resolve import RunSpec, SeaSpec
from scenarios.text.problems import Problem, ScenarioError

Array = NDArray[np.float64]

SUB_STEP = 0.01  # [s] longest step of the bodies beside particles
SEA_SUB_STEP = (
    0.05  # [s] longest step of bodies that a sea loads; numerical; a boom that heaves at 6.5 rad/s is 0.5 % too fast
)
DEEPEST_OVERLAP = 0.5  # spacings that bodies may lie in each other at the start: rigid shapes of free bodies are convex
QUICK = (
    200.0  # squares of a spacing on a surface, that are sampled at once; a larger one is not too small for particles
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Layout:
    """Everything in its place at the start.

    waters: at the start; land, areas: by name; chart: of the site; positions: particles (N, 3) [m] by region, outside all bodies; left_out:
    for each region that bodies overlap, the liquid that is left out, in words; solids: all bodies, those of the fleet included; coupled:
    names of those that exchange motion and wrench with the fluid; world: None if nothing is coupled; sea: as it moves undisturbed.
    """

    waters: Waters
    land: Mapping[str, Land]
    areas: Mapping[str, Sequence[Corners]]
    chart: SiteChart
    positions: Mapping[str, Array]
    left_out: Mapping[str, str]
    fleet: Fleet
    solids: tuple[Solid, ...]
    coupled: tuple[str, ...]
    world: RigidBodyWorld | None
    sea: Sea


def lay_out(spec: RunSpec) -> Layout:
    """Place liquid and bodies; ScenarioError with every problem."""
    fluid, problems = spec.fluid, list[Problem]()
    regions = placed_regions(spec.fill, spec.domain, fluid.particle_spacing, fluid.dimension)
    problems += empty_regions(spec.fill, regions, spec.domain, fluid.particle_spacing, fluid.dimension)
    sea_spec = spec.sea_at(water_level(spec, regions))
    waters, land = _waters(spec, sea_spec), read_land(spec.land, spec.site, sea_spec.depth, problems)
    areas = {
        name: tuple(corners for corners, _ in polygons)
        for name, polygons in read_polygons("areas", spec.areas, spec.site, problems).items()
    }
    chart = read_chart(spec.site, problems)
    own = own_solids(spec.bodies, problems)
    fleet = place_fleet(spec, waters, own, problems)
    shores = () if waters.beach is None else (shore_solid(waters.beach, sea_spec.depth),)
    grounds = (one.solid(name, sea_spec.level, sea_spec.depth) for name, one in land.items() if one.polygons)
    solids = (*own, *fleet.solids, *shores, *grounds)
    unsampled = list(_sampling_problems(solids, fluid.particle_spacing)) if spec.in_tank else []
    problems += unsampled
    refused = {problem.path for problem in unsampled}
    # a refused body is not looked for in the liquid: a tank that repeats would hold one of a thousand kilometres in thousands of places
    placed = [solid for solid in solids if table_entry(solid.name) not in refused]
    meshes = {solid.name: solid.world_mesh() for solid in placed if solid.wetted}
    if _has_low_waves(spec):
        regions = off_lattice(regions, fluid.particle_spacing, fluid.dimension, spec.run.seed)
    positions = clear_of(meshes.values(), regions, spec.domain, fluid.particle_spacing)
    problems += _displaced_regions(regions, positions)
    problems += pipe_problems(spec, meshes)
    problems += _out_of_reach(solids, meshes, spec.domain)
    coupled = _coupled(spec.probes, solids)
    # windows meet fixed bodies by their poses in the world too
    met = coupled or (spec.window and any(solid.wetted for solid in solids))
    world = _world(spec, waters, solids, fleet, problems) if met else None
    sea = _sea(spec, sea_spec, land, problems)
    if problems or sea is None:
        raise ScenarioError(problems, spec.name)
    if world is not None and not spec.in_tank:
        load_bodies(world, spec.booms, sea, fleet, solids)
    return Layout(
        waters=waters,
        land=land,
        areas=areas,
        chart=chart,
        positions=positions,
        left_out=dict(
            _left_out(regions, positions, fluid.particle_spacing**fluid.dimension)
        ),  # a plane is a metre thick
        fleet=fleet,
        solids=solids,
        coupled=coupled if spec.in_tank else (),
        world=world,
        sea=sea,
    )


def _has_low_waves(spec: RunSpec) -> bool:
    """Tell whether particles of a tank carry waves lower than a spacing, of the sea in its zones or of a wave maker.

    The paper's scheme stays as it is, and so does water with higher waves, which melt a lattice by themselves: off it bodies are shaken.
    """
    amplitudes = [body.motion.amplitude for body in spec.bodies.values() if isinstance(body.motion, SineMotion)]
    if spec.sea.waves is not None and spec.domain.zones:
        amplitudes.append(0.5 * spec.sea.height_and_period[0])
    is_low = bool(amplitudes) and max(amplitudes) < spec.fluid.particle_spacing
    return bool(spec.tanks) and spec.fluid.scheme == "split" and is_low


def _waters(spec: RunSpec, sea: SeaSpec) -> Waters:
    """Return the waters of a run at the start."""
    floor = None if "-z" in spec.domain.open else spec.domain.lower[2]
    return Waters(
        level=sea.level,
        density=spec.water_density,
        ground=floor if spec.tanks else sea.level - sea.depth,
        beach=beach_of(spec.shore, sea.level),
        current=sea.steady_current,
        orbital_speed=spec.orbital_speed,
        is_windy=sea.wind is not None,
        in_tank=bool(spec.tanks),
        spacing=spec.met_spacing,
    )


def _sea(spec: RunSpec, sea: SeaSpec, land: Mapping[str, Land], problems: list[Problem]) -> Sea | None:
    """Build the sea along its land; what is wrong with it, its files included, is added to `problems`, and the sea is None."""
    try:
        built = build_sea(sea, spec)
    except ScenarioError as error:
        problems += error.problems
        return None
    if not land or built.description.stream is not None:  # a table's knows its land
        return built
    return Sea(replace(built.description, stream=stream_along(polygons_of(land), sea.depth)))


def _displaced_regions(regions: Mapping[str, Array], clear: Mapping[str, Array]) -> Iterator[Problem]:
    """Yield the regions that bodies displace completely."""
    for name, points in regions.items():
        if len(points) and not len(clear[name]):
            text = f"has all its {len(points)} particles inside bodies, allowed: a region that extends beyond them"
            yield Problem(f"fill.{name}", text)


def _left_out(regions: Mapping[str, Array], clear: Mapping[str, Array], content: float) -> Iterator[tuple[str, str]]:
    """Say how much of each region the bodies displace, by its name; content [m3] of a particle."""
    for name, points in regions.items():
        missing = len(points) - len(clear[name])
        if missing:
            part, whole = (volume_in_words(count * content) for count in (missing, len(points)))
            yield name, f"fill.{name}: {part} of its {whole} are inside bodies, or at their surface, and are left out"


def _out_of_reach(solids: Sequence[Solid], meshes: Mapping[str, trimesh.Trimesh], tank: Tank) -> Iterator[Problem]:
    """Yield problems of fixed bodies that are entirely outside the tank, where no liquid meets them; others may move into it."""
    for name in (solid.name for solid in solids if solid.name in meshes and solid.motion == "fixed"):
        for axis, low, high, bottom, top in zip("xyz", *meshes[name].bounds, tank.lower, tank.upper, strict=True):
            if high < bottom or low > top:
                text = (
                    f"is fixed at {axis} = {low:.4g} to {high:.4g} m, allowed: inside the tank, {bottom:g} to {top:g} m"
                )
                yield Problem(table_entry(name), text)


def _coupled(probes: Mapping[str, Probe], solids: Sequence[Solid]) -> tuple[str, ...]:
    """List the bodies that exchange motion and wrench with the fluid: moving ones, and fixed ones whose force is asked for."""
    probed = {probe.body for probe in probes.values() if isinstance(probe, BodyProbe)}
    return tuple(solid.name for solid in solids if solid.wetted and (solid.motion != "fixed" or solid.name in probed))


def _sampling_problems(solids: Sequence[Solid], spacing: float) -> Iterator[Problem]:
    """Yield problems of surfaces that cannot be sampled: too small ones, which are tried, and too large ones, which are refused."""
    for solid in {id(solid.placed.mesh): solid for solid in solids if solid.wetted}.values():
        mesh = solid.placed.mesh
        if not QUICK < float(mesh.area) / spacing**2 <= LARGEST:
            try:
                sample_surface(mesh, spacing, minimum_thickness=solid.least_thickness(spacing))
            except ValueError as error:
                yield Problem(table_entry(solid.name), f"cannot be sampled with particles: {error}")


def _world(
    spec: RunSpec,
    waters: Waters,
    solids: Sequence[Solid],
    fleet: Fleet,
    problems: list[Problem],
) -> RigidBodyWorld:
    """Put all solids and joints into one rigid-body world, with the tank's walls if a body could run into them."""
    beach = waters.beach
    sub_step = SUB_STEP if spec.in_tank else SEA_SUB_STEP
    world = RigidBodyWorld(
        gravity=spec.fluid.gravity, sub_step=sub_step, communication_step=spec.run.communication_step
    )
    for solid in solids:
        placed = solid.placed
        x, y, z, w = (float(part) for part in placed.orientation)
        world.add_body(
            placed.name,
            placed.mesh,
            placed.mass_properties,
            vector(placed.position),
            (x, y, z, w),
            motion=solid.motion,
            twist=(*solid.linear_velocity, 0.0, 0.0, 0.0),
            friction=FRICTION if solid.contact else None,
        )
    if any(solid.motion == "free" and solid.contact for solid in solids):
        _add_tank_sides(world, spec.domain)
        if beach is not None:
            world.add_half_space(beach.waterline, beach.normal)
    for joint in fleet.joints:
        world.add_joint(
            joint.name,
            joint.body_a,
            joint.body_b,
            vector(joint.point),
            twisting_stiffness=joint.twisting_stiffness,
            relaxation_time=FABRIC_RELAXATION,
        )
    for name, boom in spec.booms.items():
        for joint_number in boom.parted if name in fleet.booms else ():
            world.part_joint(joint_name(name, joint_number))
    _add_lines(world, fleet, problems)
    for name, tie in spec.ties.items():
        if tie.waits and tie_name(name) in world.lines.names:
            world.loosen_line(tie_name(name))
        if tie.parted and tie_name(name) in world.lines.names:
            world.part_line(tie_name(name))
    add_legs(world, fleet.legs, problems)
    problems += _overlaps(world, spec, solids, has_shore=beach is not None)
    return world


def _add_lines(world: RigidBodyWorld, fleet: Fleet, problems: list[Problem]) -> None:
    """Add the elastic lines; one that is too stiff to be stepped is a problem."""
    for line in fleet.lines:
        rope: dict[str, float] = {
            "stiffness": line.stiffness,
            "relaxation_time": LINE_RELAXATION_TIME,
            "breaking_load": line.breaking_load,
        }
        ends = vector(line.points[0]), vector(line.points[1])
        try:
            world.add_line(line.name, line.body_a, line.body_b, ends, length=line.length, **rope)
        except ValueError as error:
            kind, name = line.name.split("/")[:2]
            key = f"ties.{name}.stiffness" if kind == "ties" else f"booms.{name}.line_stiffness"
            problems.append(Problem(key, f"cannot be used: {error}"))


def _overlaps(world: RigidBodyWorld, spec: RunSpec, solids: Sequence[Solid], *, has_shore: bool) -> Iterator[Problem]:
    """Yield problems of bodies that overlap deeply with each other, with a side of the tank or the shore; of a boom, only the worst."""
    sides = "the shore, or a side of the tank," if has_shore else "a side of the tank"
    if has_shore and not spec.domain.closed_sides:
        sides = "the shore"
    placed = {solid.name: solid for solid in solids}
    allowed, worst = DEEPEST_OVERLAP * spec.spacing, dict[tuple[str, str], tuple[str, str, float]]()
    for one, other, depth in sorted(world.overlaps(), key=lambda found: found[2]):
        if depth > allowed:
            worst[table_entry(one), other and table_entry(other)] = one, other, depth
    for (table, _), (one, other, depth) in worst.items():
        where = f"body {other!r}" if other else sides
        if not other and _is_outside(placed[one], spec.domain):
            yield Problem(
                table, f"has body {one!r} outside the tank at the start, by {depth:.3g} m, allowed: inside it"
            )
            continue
        text = f"has body {one!r} {depth:.2g} m deep inside {where} at the start, allowed: up to {allowed:.2g} m"
        yield Problem(table, text)


def _is_outside(solid: Solid, tank: Tank) -> bool:
    """Tell whether a solid lies beyond a closed side of the tank with all it has."""
    lower, upper = solid.world_mesh().bounds
    return any(
        upper[axis] < tank.lower[axis] if side[0] == "-" else lower[axis] > tank.upper[axis]
        for side in tank.closed_sides
        for axis in ("xyz".index(side[1]),)
    )


def _add_tank_sides(world: RigidBodyWorld, tank: Tank) -> None:
    """Let bodies run into the closed sides of the tank, which continue beyond its other sides."""
    for side in tank.closed_sides:
        inward = 1.0 if side[0] == "-" else -1.0
        normal = inward * np.eye(3)["xyz".index(side[1])]
        world.add_half_space(tank.lower if inward > 0.0 else tank.upper, vector(normal))
