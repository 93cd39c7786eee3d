"""Accuracy of the default scheme on quick plane cases: still column, floating squares, standing wave, still cube of water.

    python -m tests.benchmarks.accuracy

Each row is one run; the text behind it says what the figure is. Some ten seconds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track
from rich.table import Table

from oilsim import Fluid, FluidConfig, Phase, block, solid_box, tank_walls

GRAVITY = 9.81
STEP = 0.01
WATER = Phase(name="water", rest_density=1000.0)


@dataclass(frozen=True)
class Row:
    """One figure: the case, what was measured, the value and what it should be."""

    case: str
    quantity: str
    value: str
    expected: str


def tank(width: float, depth: float, spacing: float, dimension: int = 2) -> tuple[Fluid, NDArray[np.float64]]:
    """A tank open above and the lattice of water that fills it to `depth` [m]."""
    config = FluidConfig(
        particle_spacing=spacing,
        phases=(WATER,),
        lower=(-0.2, -0.2, -0.2),
        upper=(width + 0.2, width + 0.2, 2.0 * depth),
        dimension=dimension,
    )
    fluid = Fluid(config)
    sides = ("-x", "+x", "-z") if dimension == 2 else ("-x", "+x", "-y", "+y", "-z")
    across = width if dimension == 3 else 0.0
    fluid.add_boundary(tank_walls((0, 0, 0), (width, across, 1.9 * depth), spacing, sides=sides, dimension=dimension))
    return fluid, block((0, 0, 0), (width, across, depth), spacing, dimension)


def still_column(dimension: int, width: float, depth: float, spacing: float, duration: float) -> list[Row]:
    """Water at rest: pressure at a tenth of the depth above the floor, and what motion is left."""
    fluid, water = tank(width, depth, spacing, dimension)
    fluid.add_particles(water, phase="water")
    place = (width / 2, width / 2 if dimension == 3 else 0.0, 0.1 * depth)
    readings = []
    for step in range(round(duration / STEP)):
        fluid.advance(STEP)
        if step * STEP >= duration - 1.0:
            readings.append(fluid.pressure_at([place])[0])
    pressure = np.mean(readings) / (1000.0 * GRAVITY * 0.9 * depth)
    speed = math.sqrt(2.0 * fluid.energy().kinetic / (1000.0 * fluid.particle_count * fluid.config.rest_volume))
    case = f"still column, {dimension}-D, {round(depth / spacing)} particles deep, {duration:g} s"
    return [
        Row(case, "pressure over rho g z", f"{pressure:.3f}", "1"),
        Row(case, "rms speed over sqrt(g H)", f"{100 * speed / math.sqrt(GRAVITY * depth):.2f} %", "0"),
    ]


def floating_square(ratio: float, spacing: float = 0.05, side: float = 0.5, duration: float = 10.0) -> list[Row]:
    """A free square of a share of the water's density, with a slight roll: draft against Archimedes, and the angle it comes to."""
    width, depth = 2.0, 1.0
    fluid, water = tank(width, depth, spacing)
    start = depth + side * (0.5 - ratio)
    inside = (np.abs(water[:, 0] - width / 2) < side / 2) & (np.abs(water[:, 2] - start) < side / 2)
    fluid.add_particles(water[~inside], phase="water")
    handle = fluid.add_boundary(solid_box((side, 0, side), spacing, dimension=2))
    mass = 1000.0 * ratio * side**2
    inverse_mass = np.diag([1 / mass, 0, 1 / mass, 0, 6.0 / (mass * side**2), 0])
    position, orientation, twist = (
        np.array([width / 2, 0, start]),
        np.array([0.0, 0, 0, 1]),
        np.array([0, 0, 0, 0, 0.3, 0]),
    )
    submerged, angles = [], []
    for step in range(round(duration / STEP)):
        fall = (0, 0, -GRAVITY, 0, 0, 0)
        fluid.set_boundary_motion(handle, position, orientation, twist[:3], twist[3:], inverse_mass, fall)
        fluid.advance(STEP)
        position, orientation, twist = fluid.boundary_motion(handle)
        if step * STEP >= duration - 2.0:
            level = fluid.surface_height_at([(x, 0) for x in (0.2, 0.3, 1.7, 1.8)]).mean()
            angle = abs(math.degrees(2 * math.asin(orientation[1]))) % 90.0
            submerged.append(_submerged_area(position[2], math.radians(angle), side, level))
            angles.append(angle)
    error = (np.mean(submerged) - ratio * side**2) / (side * spacing)
    case = f"floating square, density {ratio:g}, side {round(side / spacing)} d, last 2 of {duration:g} s"
    return [
        Row(case, "submerged area off Archimedes', in spacings of draft", f"{error:+.2f}", "0"),
        Row(case, "angle", f"{np.mean(angles):.0f} deg", "45 deg" if 0.22 < ratio < 0.78 else "0 or 90 deg"),
    ]


def _submerged_area(height: float, angle: float, side: float, level: float) -> float:
    """Area below `level` of a square whose centre is at `height`, turned by `angle` (strips of a hundredth)."""
    x, z = np.meshgrid(*[(np.arange(200) + 0.5) / 200 * side - side / 2] * 2)
    world = height - math.sin(angle) * x + math.cos(angle) * z
    return float((world < level).mean()) * side**2


def standing_wave(spacing: float = 0.05, amplitude: float = 0.05) -> list[Row]:
    """First mode of a tank 2 m wide, 1 m deep: T = 2 pi / sqrt(g k tanh k h) = 1.1339 s; the water settles for 1 s first."""
    fluid, water = tank(2.0, 1.0, spacing)
    fluid.add_particles(water, phase="water")
    for _ in range(100):
        fluid.advance(STEP)
    k = math.pi
    omega = math.sqrt(GRAVITY * k * math.tanh(k))
    (x, _, z), velocity = fluid.particles.position, fluid.particles.velocity.copy()
    scale = amplitude * omega / math.sinh(k)
    velocity[0] += (scale * np.cosh(k * z) * np.sin(k * x)).astype(np.float32)
    velocity[2] -= (scale * np.sinh(k * z) * np.cos(k * x)).astype(np.float32)
    fluid.set_velocities(velocity)
    heaves = []
    for _ in range(600):
        fluid.advance(STEP)
        x, _, z = fluid.particles.position
        heaves.append(float(((z - 0.5) * np.cos(k * x)).mean()))
    heave = np.array(heaves) - np.mean(heaves)
    crossings = np.flatnonzero(np.diff(np.sign(heave)) != 0)[:9]
    period = 2.0 * STEP * float(np.diff(crossings).mean())
    peaks = [np.abs(heave[a : b + 1]).max() for a, b in pairwise(crossings)]
    # crests stand further from the mean than troughs: each is held against its like
    loss = 1.0 - (peaks[-1] * peaks[-2] / (peaks[0] * peaks[1])) ** (1.0 / (len(peaks) - 2))
    case = f"standing wave, {round(1.0 / spacing)} particles deep, 4 periods"
    return [
        Row(case, "period over theory's", f"{period / (2 * math.pi / omega):.3f}", "1"),
        Row(case, "amplitude lost a period", f"{100 * loss:.1f} %", "0"),
    ]


def main() -> None:
    """Run the cases and print the table."""
    cases = [
        lambda: still_column(2, 1.0, 1.0, 0.05, 5.0),
        lambda: still_column(3, 0.6, 0.7, 0.05, 4.0),
        lambda: floating_square(0.5),
        lambda: floating_square(0.1),
        standing_wave,
    ]
    console = Console(width=140)
    table = Table(title="accuracy of the default scheme")
    for column in ("case", "quantity", "measured", "exact"):
        table.add_column(column)
    for case in track(cases, description="running", console=console):
        for row in case():
            table.add_row(row.case, row.quantity, row.value, row.expected)
    console.print(table)


if __name__ == "__main__":
    main()
