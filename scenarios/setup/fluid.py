"""The liquid of a scenario: tank walls, particles at the start, pipes, and the sea that drives it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields, replace

import numpy as np
import trimesh
from numpy.typing import NDArray

from coupling.solids.signed_distance import SignedDistance
from oilsim import Fluid, FluidConfig, Phase, PipeEmitter, tank_walls
from oilsim.backend.arrays import Array
from oilsim.core.phases import weak_depth
from oilsim.fluid.emitter import HOLD
from oilsim.sea import Sea, SeaForcing, Zone
from scenarios.schema.liquid import LEAK_MARGIN, PipeEmitterSettings, Tank, ZoneSettings
from scenarios.schema.parsing.quantity_fields import Vector
from scenarios.setup.afloat.boom_losses import has_tension, tension_of
from scenarios.setup.fill_lattice import Lattice, within
from scenarios.spec.resolve import RunSpec
from scenarios.text.problems import Problem

CLEARANCE = 0.5  # spacings between a body's surface and the nearest particle at the start
# [1] viscosity over sqrt(rho sigma d), below which particles of air beside a surface move by themselves; measured (docs/numerics.md, Air)
STILL_AIR = 0.04
FULL = 0.995  # of a tank's particles, from which on liquid counts as filling it; as in `oilsim.stages.relaxation`


def fluid_config(liquid: RunSpec) -> FluidConfig:
    """Create the fluid core's configuration for the liquid of a run.

    Behind a closed side the domain continues for one spacing, so that a particle that is pressed onto the wall does not count as lost.
    """
    tank, settings = liquid.domain, liquid.fluid
    margin = LEAK_MARGIN * settings.particle_spacing
    lower = [low - margin * (f"-{axis}" in tank.closed_sides) for axis, low in zip("xyz", tank.lower, strict=True)]
    upper = [high + margin * (f"+{axis}" in tank.closed_sides) for axis, high in zip("xyz", tank.upper, strict=True)]
    return FluidConfig(
        phases=tuple(
            Phase(
                name=name,
                rest_density=phase.rest_density,
                dynamic_viscosity=phase.viscosity,
                adhesion=phase.adhesion,
                interfacial_tension=tension_of(phase) if settings.interfacial_tension and has_tension(phase) else 0.0,
            )
            for name, phase in liquid.phases.items()
        ),
        lower=(lower[0], lower[1], lower[2]),
        upper=(upper[0], upper[1], upper[2]),
        periodic=("x" in tank.periodic, "y" in tank.periodic, False),
        **{item.name: getattr(settings, item.name) for item in fields(settings) if item.name != "interfacial_tension"},
    )


def air_remarks(liquid: RunSpec, positions: Mapping[str, Array], *, has_bodies: bool) -> list[str]:
    """Say where air is too thin for its particles to rest, or leaves room; positions (N, 3) [m] of the particles, by region."""
    remarks, spacing = list[str](), liquid.spacing
    airs = {name: phase for name, phase in liquid.phases.items() if phase.is_air}
    for name, phase in airs.items():
        least = STILL_AIR * math.sqrt(phase.rest_density * tension_of(phase) * spacing)
        if phase.viscosity < least:
            text = f"phases.{name}: with less than {least:.2g} Pa s its particles move by themselves beside a surface, and push it about"
            remarks.append(text)
    share = _filled(liquid, positions)
    if airs and not has_bodies and share < FULL:
        remarks.append(
            f"particles fill {100.0 * share:.0f} % of the tank: surfaces in air hold together in a full tank only"
        )
    return remarks


def interface_remarks(liquid: RunSpec, positions: Mapping[str, Array]) -> list[str]:
    """Say how deep interfaces break up under a free surface, where that is more than the uppermost particles' half a spacing.

    positions (N, 3) [m] of the particles, by region.
    """
    pulls = liquid.fluid.interfacial_tension
    has_air = any(phase.is_air for phase in liquid.phases.values())
    if not pulls or has_air or _filled(liquid, positions) >= FULL:
        return []
    config = fluid_config(liquid)
    weak = weak_depth(config.phases, config.particle_spacing, float(np.linalg.norm(config.gravity)))
    if weak <= 0.5 * config.particle_spacing:
        return []
    return [
        f"interfaces break up down to {1e3 * weak:.2g} mm below a free surface: their pull exceeds the pressure there. "
        "With coarser particles, or in a full tank, they hold"
    ]


def _filled(liquid: RunSpec, positions: Mapping[str, Array]) -> float:
    """Return the share of the tank that particles fill; positions (N, 3) [m], by region."""
    room = Lattice(liquid.domain, liquid.spacing, liquid.fluid.dimension).count.tolist()
    whole = room[0] * room[2] * (1 if liquid.fluid.dimension == 2 else room[1])
    return sum(map(len, positions.values())) / whole


def clear_of(
    solids: Iterable[trimesh.Trimesh], positions: Mapping[str, Array], tank: Tank, spacing: float
) -> dict[str, Array]:
    """Return the particles (N, 3) [m], by region, that are neither inside a solid nor right at its surface."""
    clearance = CLEARANCE * spacing
    kept = {name: np.ones(len(points), bool) for name, points in positions.items()}
    for image in (image for solid in solids for image in _images(solid, tank, clearance)):
        for name, points in positions.items():
            kept[name][_inside(points, image, clearance)] = False
    return {name: points[kept[name]] for name, points in positions.items()}


def _images(solid: trimesh.Trimesh, tank: Tank, clearance: float) -> Iterator[trimesh.Trimesh]:
    """Yield a closed mesh wherever the liquid meets it: a part that reaches through a periodic side enters at the opposite side."""
    shifts = []
    for axis, low, high, bottom, top in zip("xyz", *solid.bounds, tank.lower, tank.upper, strict=True):
        period = top - bottom
        first = math.ceil((bottom - clearance - high) / period) if axis in tank.periodic else 0
        last = math.floor((top + clearance - low) / period) if axis in tank.periodic else 0
        shifts.append([times * period for times in range(first, last + 1)])
    for shift in itertools.product(*shifts):
        yield solid.copy().apply_translation(shift) if any(shift) else solid


def _inside(points: Array, solid: trimesh.Trimesh, clearance: float) -> NDArray[np.intp]:
    """Return the indices of points (N, 3) [m] inside a closed mesh, or nearer than `clearance` [m] to it.

    Walls are made from the same distance.
    """
    low, high = solid.bounds
    near = within(points, low - clearance, high + clearance)
    return near[SignedDistance(solid).phi(points[near]) < clearance * (1.0 - 1e-6)] if near.size else near


def water_level(liquid: RunSpec, positions: Mapping[str, Array]) -> float:
    """Return the height [m] of the still water: the top of the liquid that is not oil at the start, or of the oil if there is no other.

    positions (N, 3) [m] of the particles, by region.
    """
    half = 0.5 * liquid.spacing
    tops = {name: float(points[:, 2].max()) + half for name, points in positions.items() if len(points)}
    phases = {name: liquid.phases[liquid.fill[name].phase] for name in tops}
    water = [top for name, top in tops.items() if not (phases[name].is_oil or phases[name].is_air)]
    return max(water or tops.values(), default=liquid.domain.lower[2])


def build_fluid(liquid: RunSpec, positions: Mapping[str, Array], sea: Sea) -> tuple[Fluid, int | None]:
    """Build the fluid with its particles and pipes, driven by a sea; return it with the handle of its tank walls, if there are any.

    positions (N, 3) [m] of the particles, by region.
    """
    settings, tank = liquid.fluid, liquid.domain
    config = fluid_config(liquid)
    fluid = Fluid(config, threads=liquid.run.threads)
    sides = tuple(side for side in tank.closed_sides if settings.dimension == 3 or side[1] != "y")
    handle = None
    if sides and liquid.in_tank:
        walls = tank_walls(
            tank.lower,
            tank.upper,
            settings.particle_spacing,
            sides=sides,
            periodic=config.periodic,
            dimension=settings.dimension,
            no_slip=tank.no_slip,
        )
        handle = fluid.add_boundary(replace(walls, contact_angle=tank.contact_angle))
    driving = SeaForcing(sea, spacing=settings.particle_spacing, zones=zones_of(liquid, sea))
    velocities = _starting_velocities(liquid, positions, driving)
    for name, fill in liquid.fill.items():
        fluid.add_particles(positions[name], phase=fill.phase, velocity=velocities[name])
    for pipe in liquid.emitters.values():
        fluid.add_emitter(pipe_of(pipe, settings.particle_spacing))
    if liquid.in_tank and driving.acts:
        fluid.add_forcing(driving)
    if liquid.run.budget:
        fluid.watch()
    return fluid, handle


def pipe_problems(liquid: RunSpec, solids: Mapping[str, trimesh.Trimesh]) -> Iterator[Problem]:
    """Yield problems of pipes that reach out of the tank, or into a body at the start (meshes in the world frame)."""
    tank, spacing = liquid.domain, liquid.spacing
    for name, settings in liquid.emitters.items():
        points = pipe_of(settings, spacing).entrance
        for axis in (axis for axis in range(3) if "xyz"[axis] not in tank.periodic):
            low, high = points[:, axis].min(), points[:, axis].max()
            if low < tank.lower[axis] or high > tank.upper[axis]:
                room = f"{tank.lower[axis]:g} to {tank.upper[axis]:g} m, with a pipe length of {HOLD:g} spacings"
                text = f"has a pipe from {'xyz'[axis]} = {low:.3g} to {high:.3g} m, allowed: inside the tank, {room}"
                yield Problem(f"emitters.{name}.mouth", text)
        for body, mesh in solids.items():
            if any(_inside(points, image, 0.0).size for image in _images(mesh, tank, 0.0)):
                yield Problem(
                    f"emitters.{name}.mouth", f"lies in body {body!r} at the start, allowed: outside all bodies"
                )


def pipe_of(settings: PipeEmitterSettings, spacing: float) -> PipeEmitter:
    """Create a pipe of a scenario; `spacing` [m] of the particles."""
    return PipeEmitter(
        phase=settings.phase,
        mouth=settings.mouth,
        direction=settings.direction,
        radius=settings.radius,
        speed=settings.speed,
        spacing=spacing,
        start=settings.start,
        volume=settings.volume,
    )


def zones_of(liquid: RunSpec, sea: Sea) -> tuple[Zone, ...]:
    """Return the zones of the tank in which the water follows the sea; without any, the whole tank is one where the sea moves."""
    zones = list(liquid.domain.zones.values())
    if not zones and (sea.description.waves is not None or sea.description.current is not None):
        zones = [ZoneSettings()]
    return tuple(_zone(one, liquid) for one in zones)


def drive(fluid: Fluid, liquid: RunSpec, sea: Sea) -> None:
    """Let another sea drive the fluid of a tank from now on; `liquid` is that of the start."""
    driving = SeaForcing(sea, spacing=liquid.spacing, zones=zones_of(liquid, sea))
    present = [place for place, one in enumerate(fluid.forcings) if isinstance(one, SeaForcing)]
    if present:
        fluid.forcings[present[0]] = driving
    elif driving.acts:
        fluid.add_forcing(driving)


def _starting_velocities(
    liquid: RunSpec, positions: Mapping[str, Array], driving: SeaForcing
) -> dict[str, Array | Vector]:
    """Return the velocities (N, 3) or (3,) [m/s] at the start, by region: as stated, else of current and drift through the whole tank.

    Along an axis with a wall, as much water flows back below as the wind's drift takes along at the surface.
    """
    fills, sea = liquid.fill, driving.sea
    everywhere = any(one.lower is None for one in liquid.domain.zones.values()) or not liquid.domain.zones
    found = dict[str, Array | Vector]()
    for name, points in positions.items():
        flow = sea.current(points[:, 2], 0.0) if everywhere else np.zeros((len(points), 2))
        found[name] = fills[name].velocity or np.column_stack([flow, np.zeros(len(points))])
    carried = [name for name in positions if fills[name].velocity is None]
    if sea.description.wind is None or not carried:
        return found
    own = {name: driving.drift(positions[name][:, 2], 0.0) for name in carried}
    mean = np.concatenate(list(own.values())).mean(axis=0)
    for axis, name in enumerate("xy"):
        if f"-{name}" not in liquid.domain.closed_sides and f"+{name}" not in liquid.domain.closed_sides:
            mean[axis] = 0.0
    return found | {name: found[name] + np.pad(drift - mean, ((0, 0), (0, 1))) for name, drift in own.items()}


def _zone(settings: ZoneSettings, liquid: RunSpec) -> Zone:
    """Return a zone; where it ends at a side of the tank, it goes on for the width of its edge, and is whole up to there."""
    tank, edge = liquid.domain, settings.edge
    lower, upper = list(settings.lower or tank.lower), list(settings.upper or tank.upper)
    for axis in (0, 1):
        in_plane = liquid.fluid.dimension == 2 and axis == 1
        lower[axis] -= edge if in_plane or lower[axis] <= tank.lower[axis] else 0.0
        upper[axis] += edge if in_plane or upper[axis] >= tank.upper[axis] else 0.0
    corners = (lower[0], lower[1], lower[2]), (upper[0], upper[1], upper[2])
    return Zone(*corners, settings.relaxation_time, edge, settings.waves)
