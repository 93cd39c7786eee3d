"""The liquids, boxes and tanks that the cases share; every fluid runs the default scheme."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from oilsim import BoundaryParticles, Fluid, FluidConfig, Phase, block, tank_walls
from tests.validation.case import Bench

Double = NDArray[np.float64]

GRAVITY = 9.81  # m/s2
SAMPLE = 0.01  # s between samples where nothing asks for another
OIL_DENSITY, WATER_DENSITY = 840.0, 1027.0  # kg/m3
REFERENCE = Path(__file__).parent / "reference"


def liquid(density: float = 1000.0, kinematic_viscosity: float = 0.0, name: str = "water") -> Phase:
    """A liquid of `density` [kg/m3] and `kinematic_viscosity` [m2/s]."""
    return Phase(name=name, rest_density=density, dynamic_viscosity=density * kinematic_viscosity)


def oil_and_water(kinematic_viscosity: float = 0.0) -> tuple[Phase, Phase]:
    """Oil of 840 and sea water of 1027 kg/m3 of one kinematic viscosity [m2/s]."""
    return liquid(OIL_DENSITY, kinematic_viscosity, "oil"), liquid(WATER_DENSITY, kinematic_viscosity, "water")


def periodic_box(side: float, spacing: float, phase: Phase, **options: Any) -> FluidConfig:
    """A plane square [m] that repeats along x and z, without gravity."""
    return FluidConfig(
        particle_spacing=spacing, phases=(phase,), dimension=2, lower=(0.0, -1.0, 0.0), upper=(side, 1.0, side),
        periodic=(True, False, True), gravity=(0.0, 0.0, 0.0), **options,
    )  # fmt: skip


def channel(
    length: float, height: float, spacing: float, phases: tuple[Phase, ...], pull: float, **options: Any
) -> FluidConfig:
    """A plane channel [m] that repeats along x, driven by a body force `pull` [m/s2] along it."""
    room = 4.0 * spacing
    return FluidConfig(
        particle_spacing=spacing, phases=phases, dimension=2, lower=(0.0, -1.0, -room), upper=(length, 1.0, height + room),
        periodic=(True, False, False), gravity=(pull, 0.0, 0.0), **options,
    )  # fmt: skip


def closed_channel(
    bench: Bench, lower: Double, upper: Double, spacing: float, phase: Phase, longest_step: float
) -> Fluid:
    """An empty plane channel from `lower` to `upper` (3,) [m] without weight, all its sides closed, which slip. longest_step [s]."""
    room = np.array([4.0 * spacing, 0.0, 4.0 * spacing])
    config = FluidConfig(
        particle_spacing=spacing, phases=(phase,), dimension=2, gravity=(0.0, 0.0, 0.0), lower=tuple(lower - room),
        upper=tuple(upper + room), maximum_time_step=longest_step,
    )  # fmt: skip
    fluid = bench.fluid(config)
    fluid.add_boundary(tank_walls(lower, upper, spacing, sides=("-x", "+x", "-z", "+z"), dimension=2))
    return fluid


def channel_wall(length: float, height: float, spacing: float, side: str) -> BoundaryParticles:
    """One no-slip wall, `side` "-z" or "+z", of a channel that repeats along x."""
    return tank_walls(
        (0.0, 0.0, 0.0), (length, 0.0, height), spacing, sides=(side,), periodic=(True, False, False), dimension=2,
        name=f"wall {side}", no_slip=True,
    )  # fmt: skip


def open_tank(
    bench: Bench, width: float, depth: float, spacing: float, phases: tuple[Phase, ...], **options: Any
) -> tuple[Fluid, int]:
    """A plane tank [m], open above, with free-slip walls 1.5 depths high; returns it empty, and its walls' handle."""
    room = 4.0 * spacing
    config = FluidConfig(
        particle_spacing=spacing, phases=phases, dimension=2, lower=(-room, -1.0, -room),
        upper=(width + room, 1.0, 2.0 * depth), **options,
    )  # fmt: skip
    fluid = bench.fluid(config)
    walls = tank_walls((0, 0, 0), (width, 0, 1.5 * depth), spacing, sides=("-x", "+x", "-z"), dimension=2)
    return fluid, fluid.add_boundary(walls)


def fill(fluid: Fluid, lower: tuple[float, float], upper: tuple[float, float], phase: str = "water") -> Double:
    """Fill a plane rectangle, lower to upper (x, z) [m], with a lattice at rest; returns its points (n, 3)."""
    points = block((lower[0], 0, lower[1]), (upper[0], 0, upper[1]), fluid.config.particle_spacing, 2)
    fluid.add_particles(points, phase=phase)
    return points


def disturb(fluid: Fluid, amount: float, seed: int) -> None:
    """Move all particles of a plane fluid at rest by a normally distributed `amount` [m] along x and z."""
    noise = np.random.default_rng(seed).normal(0.0, amount, (2, fluid.particle_count))
    position, phase = fluid.particles.position.copy(), fluid.particles.phase.copy()
    position[::2] += noise.astype(np.float32)
    fluid.remove_particles(np.ones(fluid.particle_count, bool))
    for index, own in enumerate(fluid.config.phases):
        fluid.add_particles(position[:, phase == index].T, phase=own.name)


def masses(fluid: Fluid) -> Double:
    """Mass of each particle (N,) [kg/m], in the order of `Fluid.particles`."""
    densities = np.array([phase.rest_density for phase in fluid.config.phases])
    return fluid.config.rest_volume * densities[fluid.particles.phase]


def rms_speed(fluid: Fluid) -> float:
    """Root of the mass mean of v^2 [m/s]."""
    return float(np.sqrt(2.0 * fluid.energy().kinetic / masses(fluid).sum()))


def position(fluid: Fluid) -> Double:
    """Positions (3, N) [m] in double precision, in the order of `Fluid.particles`."""
    return fluid.particles.position.astype(np.float64)


def velocity(fluid: Fluid) -> Double:
    """Velocities (3, N) [m/s] in double precision, in the order of `Fluid.particles`."""
    return fluid.particles.velocity.astype(np.float64)


def set_velocity(fluid: Fluid, values: Double) -> None:
    """Give the particles the velocities (3, N) [m/s], in the order of `Fluid.particles`."""
    fluid.set_velocities(values)


def read_table(name: str) -> Double:
    """Columns (columns, rows) of a reference table; lines that begin with # are comments."""
    return np.loadtxt(REFERENCE / name, delimiter=",", comments="#").T
