"""Case 22: the drag of a plate towed square to itself, F = 0.5 rho C_d A V^2, between walls far away; and of a skirt at the surface.

Plane. Round the plate the water fills its channel and has no weight, so that no wave takes part and speed alone sets the scale of force:
its exponent tests that nothing else does. `maximum_time_step` would, being a time; here it is the time between samples of the force, which
goes with h / V. One speed is a power of two of the other, so that both flows are the same to the last bit unless something sets a scale;
of a wake that is chaotic other speeds would be other samples, and the drag coefficient is that of one.

The skirt pierces the surface of heavy water, as a boom's does. Depth's pressure over that of the flow goes with 1 / V^2, so that any force
that weight or the surface make of their own, such as a heap of water that stands before the skirt, shows in the exponent.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from oilsim import Fluid, block, solid_box
from tests.validation.bodies.towing_motion import TowingMotion
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace
from tests.validation.scenes import GRAVITY, closed_channel, liquid, open_tank

Double = NDArray[np.float64]

PLATE = 0.25  # m: its height h
WATER = 1000.0  # kg/m3
SPEEDS = (0.5, 4.0)  # m/s
ROOM, HEIGHT = 5.0, 12.0  # h: before the plate at the start and at the end; of the channel
RISE, COUNTED, TRAVEL = 2.0, 12.0, 36.0  # h: travelled while the speed rises, before the mean begins, in all
FROUDE_NUMBERS = (0.1, 0.2)  # V / sqrt(g h) of the skirt, whose draft is h
SKIRT_DEPTH, FREEBOARD = 8.0, 0.5  # h: of the water, and of the skirt above it
SKIRT_COUNTED, SKIRT_TRAVEL = 12.0, 30.0  # h: travelled before the mean begins, in all
BEATS = 20  # samples of the force in a travel of h
MASKELL = 0.96  # epsilon of a plate from side to side of a channel (Maskell 1963)


def towing_tank(bench: Bench, spacing: float, longest_step: float) -> tuple[Fluid, int]:
    """A closed channel full of water at rest, with the plate in it; its handle. longest_step [s]."""
    lower = np.array([-ROOM * PLATE, -1.0, -0.5 * HEIGHT * PLATE])
    upper = np.array([(TRAVEL + ROOM) * PLATE, 1.0, 0.5 * HEIGHT * PLATE])
    fluid = closed_channel(bench, lower, upper, spacing, liquid(WATER), longest_step)
    points = block(lower, upper, spacing, 2)
    inside = (np.abs(points[:, 0]) < 0.5 * spacing) & (np.abs(points[:, 2]) < 0.5 * PLATE)
    fluid.add_particles(points[~inside], phase="water")
    return fluid, fluid.add_boundary(solid_box((spacing, 0.0, PLATE), spacing, dimension=2, name="plate"))


def towed(
    bench: Bench, fluid: Fluid, handle: int, motion: TowingMotion, travel: float, length: float = PLATE
) -> tuple[Double, Double]:
    """Tow a boundary for `travel` times its `length` [m]: travel in these and drag [N/m] at BEATS samples in each; ends the fluid."""
    sample, start = length / (motion.velocity[0] * BEATS), motion.position[0]
    places, forces = [0.0], [0.0]
    while places[-1] < travel:
        now = motion.at(fluid.time)
        fluid.set_boundary_motion(handle, now.position, now.orientation, now.linear_velocity, now.angular_velocity)
        bench.advance(fluid, sample)
        places.append((float(motion.at(fluid.time).position[0]) - start) / length)
        forces.append(-float(fluid.boundary_wrench(handle)[0]))
    fluid.close()
    return np.array(places), np.array(forces)


def towing_motion(x: float, z: float, speed: float) -> TowingMotion:
    """Along x from (x, z) [m], its speed [m/s] risen within RISE h."""
    return TowingMotion(position=(x, 0.0, z), velocity=(speed, 0.0, 0.0), rise_time=2.0 * RISE * PLATE / speed)


def drag(bench: Bench, spacing: float, speed: float) -> tuple[Double, Double]:
    """Travel [h] and drag [N/m] of the plate at the samples."""
    fluid, plate = towing_tank(bench, spacing, PLATE / (speed * BEATS))
    return towed(bench, fluid, plate, towing_motion(0.0, 0.0, speed), TRAVEL)


def skirt_drag(bench: Bench, spacing: float, speed: float) -> tuple[Double, Double]:
    """Travel [h] and drag [N/m] of a skirt of draft h that pierces the surface."""
    width, depth = (SKIRT_TRAVEL + 2.0 * ROOM) * PLATE, SKIRT_DEPTH * PLATE
    fluid, _ = open_tank(bench, width, depth, spacing, (liquid(WATER),), maximum_time_step=PLATE / (speed * BEATS))
    start, height = ROOM * PLATE, (1.0 + FREEBOARD) * PLATE
    points = block((0, 0, 0), (width, 0, depth), spacing, 2)
    wet = (np.abs(points[:, 0] - start) > 0.5 * spacing) | (points[:, 2] < depth - PLATE)
    fluid.add_particles(points[wet], phase="water")
    skirt = fluid.add_boundary(solid_box((spacing, 0.0, height), spacing, dimension=2, name="skirt"))
    return towed(bench, fluid, skirt, towing_motion(start, depth - PLATE + 0.5 * height, speed), SKIRT_TRAVEL)


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


def towed_skirt(resolution: int, bench: Bench) -> Outcome:
    """Case 22: the skirt at both speeds."""
    speeds = np.array(FROUDE_NUMBERS) * math.sqrt(GRAVITY * PLATE)
    bench.plan(float(((SKIRT_TRAVEL + RISE) * PLATE / speeds).sum()))
    coefficients, traces = [], []
    for number, speed in zip(FROUDE_NUMBERS, speeds, strict=True):
        places, forces = skirt_drag(bench, PLATE / resolution, float(speed))
        found = forces / (0.5 * WATER * speed**2 * PLATE)
        coefficients.append(float(found[places > SKIRT_COUNTED].mean()))
        smooth = np.convolve(found, np.full(BEATS, 1.0 / BEATS), mode="valid")
        traces.append(trace("drag", places[BEATS - 1 :], smooth, f"{number:g} sqrt(g h)"))
    slow, fast = coefficients
    return Outcome(
        values={
            "exponent of speed": 2.0 + math.log(fast / slow) / math.log(speeds[1] / speeds[0]),
            "drag coefficient at 0.1 sqrt(g h)": slow,
            "drag coefficient at 0.2 sqrt(g h)": fast,
        },
        traces=tuple(traces),
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

TOWED_SKIRT = Case(
    number=22,
    name="towed-skirt",
    title="Drag of a skirt that pierces the surface",
    source="F = 0.5 rho C_d A V^2 of slow tow; 1.9 is C_d of the rule for booms, F [kg] = 26 A [m2] (V [kn])^2 (ITOPF)",
    setup=f"plate of draft h, one spacing thick, in water {SKIRT_DEPTH:g} h deep, plane, towed at {FROUDE_NUMBERS[0]:g} and "
    f"{FROUDE_NUMBERS[1]:g} sqrt(g h); mean over {SKIRT_COUNTED:g} h to {SKIRT_TRAVEL:g} h of travel",
    length=PLATE,
    length_symbol="h",
    resolutions=(4, 6, 8),
    quantities=(
        Quantity(name="exponent of speed", unit="1", reference=2.0, scale=1.0, gate=0.03),
        Quantity(name="drag coefficient at 0.1 sqrt(g h)", unit="1", reference=1.9, scale=1.0),
        Quantity(name="drag coefficient at 0.2 sqrt(g h)", unit="1", reference=1.9, scale=1.0),
    ),
    panels=(Panel("drag", "travel / h", "C_d, mean over h", y_range=(0.0, 4.0)),),
    run=towed_skirt,
    note="the surface parts the wake from its mirror image, so that no vortices are shed in turn: plates with a long wall behind them "
    "have 1.4 (Arie and Rouse 1956). The water is 8 h deep, for which nothing is corrected.",
)
