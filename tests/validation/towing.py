"""Case 22: the drag of a plate towed square to itself, F = 0.5 rho C_d A V^2, between walls far away.

Plane. The water fills its channel and has no weight, so that no wave takes part and speed alone sets the scale of force: its exponent
tests that nothing else does. `maximum_time_step` would, being a time; here it is the time between samples of the force, which goes with
h / V. One speed is a power of two of the other, so that both flows are the same to the last bit unless something sets a scale; of a wake
that is chaotic other speeds would be other samples, and the drag coefficient is that of one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from oilsim.boundary import solid_box, tank_walls
from oilsim.config import FluidConfig
from oilsim.initial_conditions import block
from oilsim.solver import Fluid
from scenarios.motions import TowingMotion
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace
from tests.validation.scenes import liquid

Double = NDArray[np.float64]

PLATE = 0.25  # m: its height h
WATER = 1000.0  # kg/m3
SPEEDS = (0.5, 4.0)  # m/s
ROOM, HEIGHT = 5.0, 12.0  # h: before the plate at the start and at the end; of the channel
RISE, COUNTED, TRAVEL = 2.0, 12.0, 36.0  # h: travelled while the speed rises, before the mean begins, in all
BEATS = 20  # samples of the force in a travel of h
MASKELL = 0.96  # epsilon of a plate from side to side of a channel (Maskell 1963)


def towing_tank(bench: Bench, spacing: float, longest_step: float) -> tuple[Fluid, int]:
    """A closed channel full of water at rest, with the plate in it; its handle. longest_step [s]."""
    lower = (-ROOM * PLATE, -1.0, -0.5 * HEIGHT * PLATE)
    upper = ((TRAVEL + ROOM) * PLATE, 1.0, 0.5 * HEIGHT * PLATE)
    room = np.array([4.0 * spacing, 0.0, 4.0 * spacing])
    config = FluidConfig(
        particle_spacing=spacing, phases=(liquid(WATER),), dimension=2, gravity=(0.0, 0.0, 0.0), lower=tuple(lower - room),
        upper=tuple(upper + room), maximum_time_step=longest_step,
    )  # fmt: skip
    fluid = bench.fluid(config)
    fluid.add_boundary(tank_walls(lower, upper, spacing, sides=("-x", "+x", "-z", "+z"), dimension=2))
    points = block(lower, upper, spacing, 2)
    inside = (np.abs(points[:, 0]) < 0.5 * spacing) & (np.abs(points[:, 2]) < 0.5 * PLATE)
    fluid.add_particles(points[~inside], phase="water")
    return fluid, fluid.add_boundary(solid_box((spacing, 0.0, PLATE), spacing, dimension=2, name="plate"))


def drag(bench: Bench, spacing: float, speed: float) -> tuple[Double, Double]:
    """Travel [h] and drag [N/m] of the plate at the samples."""
    sample = PLATE / (speed * BEATS)
    fluid, plate = towing_tank(bench, spacing, sample)
    motion = TowingMotion(position=(0.0, 0.0, 0.0), velocity=(speed, 0.0, 0.0), rise_time=2.0 * RISE * PLATE / speed)
    places, forces = [0.0], [0.0]
    while places[-1] < TRAVEL:
        now = motion.at(fluid.time)
        fluid.set_boundary_motion(plate, now.position, now.orientation, now.linear_velocity, now.angular_velocity)
        bench.advance(fluid, sample)
        places.append(float(motion.at(fluid.time).position[0]) / PLATE)
        forces.append(-float(fluid.boundary_wrench(plate)[0]))
    fluid.close()
    return np.array(places), np.array(forces)


def unblocked(coefficient: float) -> float:
    """The coefficient without walls: C_d / (1 + epsilon C_d h / H) (Maskell 1963)."""
    return coefficient / (1.0 + MASKELL * coefficient / HEIGHT)


def towed_plate(resolution: int, bench: Bench) -> Outcome:
    """Case 22: the plate at both speeds."""
    speeds = np.array(SPEEDS)
    bench.plan(float(((TRAVEL + RISE) * PLATE / speeds).sum()))
    pressures, means, traces = 0.5 * WATER * speeds**2, [], []
    for speed, pressure in zip(speeds, pressures, strict=True):
        places, forces = drag(bench, PLATE / resolution, speed)
        means.append(float(forces[places > COUNTED].mean()))
        smooth = np.convolve(forces / (pressure * PLATE), np.full(BEATS, 1.0 / BEATS), mode="valid")
        traces.append(trace("drag", places[BEATS - 1 :], smooth, f"{speed:g} m/s"))
    coefficients = np.array(means) / (pressures * PLATE)
    return Outcome(
        values={
            "exponent of speed": float(np.log(means[1] / means[0]) / np.log(speeds[1] / speeds[0])),
            "drag coefficient": unblocked(float(coefficients.mean())),
        },
        traces=(*traces, trace("force", speeds, means, markers=True)),
    )


TOWED_PLATE = Case(
    number=22,
    name="towed-plate",
    title="Drag of a plate towed square to itself",
    source="F = 0.5 rho C_d A V^2; C_d of a long plate 1.9 to 2.0 in tow and wind tunnels (Fage and Johansen 1927, Hoerner 1965)",
    setup=f"plate of height h, one spacing thick, across a closed channel {HEIGHT:g} h high, plane, without weight; "
    f"{', '.join(f'{speed:g}' for speed in SPEEDS)} m/s; mean over {COUNTED:g} h to {TRAVEL:g} h of travel",
    length=PLATE,
    length_symbol="h",
    resolutions=(4, 6, 8),
    quantities=(
        Quantity(name="exponent of speed", unit="1", reference=2.0, scale=1.0, gate=0.03),
        Quantity(name="drag coefficient", unit="1", reference=1.9, scale=1.0, gate=0.1),
    ),
    panels=(
        Panel("drag", "travel / h", "C_d, mean over h", y_range=(0.0, 4.0)),
        Panel("force", "V [m/s]", "F [N/m]", log_x=True, log_y=True),
    ),
    run=towed_plate,
    note="coefficients are corrected for blockage by Maskell. The longest step is h / (20 V): a fixed one would set a scale. At both "
    "speeds the flows are the same to the last bit; the coefficient is one sample of a chaotic wake.",
)
