"""Cases 14 and 15: dam breaks. Front on a dry floor, pressure on the wall that it hits."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from oilsim import BoundaryParticles, Fluid, FluidConfig, tank_walls
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace
from tests.validation.measure import best_time_shift, crossing_time, front_position
from tests.validation.scenes import GRAVITY, fill, liquid, read_table

Double = NDArray[np.float64]

WATER = liquid(1000.0, 1e-6)


def basin(bench: Bench, length: float, height: float, spacing: float) -> Fluid:
    """A plane domain [m] open above, empty, without walls."""
    room = 4.0 * spacing
    return bench.fluid(
        FluidConfig(
            particle_spacing=spacing, phases=(WATER,), dimension=2, lower=(-room, -1.0, -room),
            upper=(length + room, 1.0, height),
        )
    )  # fmt: skip


def basin_walls(length: float, height: float, spacing: float) -> BoundaryParticles:
    """The walls of a basin, which hold the water: on dry floors its front is a film as thin as its boundary layer."""
    return tank_walls((0, 0, 0), (length, 0, height), spacing, sides=("-x", "+x", "-z"), dimension=2, no_slip=True)


# front
FRONT_END = 6.4  # t sqrt(2 g / a)
FRONT_SAMPLES = 160


@dataclass(frozen=True)
class Collapse:
    """An experiment: the column's base a [m], the tank's length over it, and the file of its front."""

    base: float
    length: float
    file: str


EXPERIMENTS = {
    "Martin and Moyce, a = 1.125 in": Collapse(0.028575, 8.0, "dam_break_martin_moyce_a1125.csv"),
    "Martin and Moyce, a = 2.25 in": Collapse(0.05715, 10.0, "dam_break_martin_moyce_a2250.csv"),
    "Koshizuka and Oka": Collapse(0.146, 4.0, "dam_break_koshizuka_oka.csv"),
}


def front_history(bench: Bench, experiment: Collapse, spacing: float) -> Double:
    """t sqrt(2 g / a) and front over a (2, n) of the collapse of a column twice as high as wide."""
    base, height = experiment.base, 6.0 * experiment.base
    length = experiment.length * base
    fluid = basin(bench, length, height, spacing)
    fluid.add_boundary(basin_walls(length, height, spacing))
    fill(fluid, (0, 0), (base, 2.0 * base))
    return follow_front(bench, fluid, experiment)


def follow_front(bench: Bench, fluid: Fluid, experiment: Collapse) -> Double:
    """t sqrt(2 g / a) and front over a (2, n) of the water of a fluid that begins to collapse."""
    base, spacing = experiment.base, fluid.config.particle_spacing
    unit = math.sqrt(base / (2.0 * GRAVITY))
    step = FRONT_END * unit / FRONT_SAMPLES
    rows = [(0.0, 1.0)]
    for index in range(FRONT_SAMPLES):
        bench.advance(fluid, step)
        x, _, z = fluid.phase_positions("water").T.astype(np.float64)
        front = front_position(x[z < 3.0 * spacing], spacing) / base
        rows.append(((index + 1) * step / unit, front))
        if front > experiment.length - 0.2:
            break
    return np.array(rows).T


def dam_front(resolution: int, bench: Bench) -> Outcome:
    """Case 14: rms difference from three experiments, each in its own size, after one shift in time each."""
    values, traces = {}, []
    bench.plan(sum(FRONT_END * math.sqrt(each.base / (2.0 * GRAVITY)) for each in EXPERIMENTS.values()))
    for name, experiment in EXPERIMENTS.items():
        history = front_history(bench, experiment, experiment.base / resolution)
        time, front = read_table(experiment.file)
        inside = front <= history[1].max()
        shifted = best_time_shift(history[0], history[1], time[inside], front[inside], 1.0)
        values[f"rms, {name}"] = shifted.rms
        values[f"shift, {name}"] = shifted.shift
        traces.append(trace(name, *history))
        traces.append(trace(name, time - shifted.shift, front, "measured, shifted", reference=True, markers=True))
    return Outcome(values=values, traces=tuple(traces))


# pressure
LOBOVSKY_DEPTH, LOBOVSKY_COLUMN, LOBOVSKY_TANK = 0.3, 0.6, 1.61  # m
SENSORS = {"3 mm": (0.003, "p1"), "30 mm": (0.030, "p3"), "80 mm": (0.080, "p4")}
# plane SPH of three kinds at H/400: columns of its tables, and its impulses over the measured ones
PEERS = ("TrixiParticles.jl, EDAC", "TrixiParticles.jl, WCSPH", "De Courcy et al. 2024")
ARRIVAL, ARRIVAL_SPREAD = 2.38, 0.05  # t sqrt(g / H)
PLANE = {"3 mm": (1.40, 0.10), "30 mm": (1.15, 0.05), "80 mm": (0.72, 0.06)}
IMPACT = 2.2  # t sqrt(g / H) from which impulses count
PRESSURE_END = 6.0  # t sqrt(g / H)
ARRIVED = 0.2  # p / (rho g H) that tells the arrival
PLATE = 0.1  # m, height of the lowest part of the end wall whose force is read
PLATE_NAME = "impulse of the force on the lowest 0.1 m / measured"
READING = 0.002  # s between readings


def add_plate(fluid: Fluid, spacing: float) -> tuple[int, float]:
    """Add the basin's walls with the lowest PLATE of the end wall as a body; its handle and its height [m]."""
    walls = basin_walls(LOBOVSKY_TANK, 3.0 * LOBOVSKY_DEPTH, spacing)
    x, _, z = walls.position.T
    end = (x > LOBOVSKY_TANK) & (z > 0.0)
    plate = end & (z < PLATE)
    for name, chosen in (("basin", ~plate), ("plate", plate)):
        handle = fluid.add_boundary(walls.part(name, chosen))
    return handle, float(walls.area[plate].sum())


def pressure_history(bench: Bench, spacing: float) -> Double:
    """t sqrt(g / H), p / (rho g H) at the sensors and as the mean over the plate (2 + sensors, n)."""
    unit, scale = math.sqrt(LOBOVSKY_DEPTH / GRAVITY), 1000.0 * GRAVITY * LOBOVSKY_DEPTH
    bench.plan(PRESSURE_END * unit)
    fluid = basin(bench, LOBOVSKY_TANK, 3.0 * LOBOVSKY_DEPTH, spacing)
    plate, height = add_plate(fluid, spacing)
    fill(fluid, (0, 0), (LOBOVSKY_COLUMN, LOBOVSKY_DEPTH))
    places = [(LOBOVSKY_TANK, 0.0, height) for height, _ in SENSORS.values()]
    rows = [np.zeros(2 + len(places))]
    for step in range(math.ceil(PRESSURE_END * unit / READING)):
        fluid.set_boundary_motion(plate, (0, 0, 0), (0, 0, 0, 1), (0, 0, 0), (0, 0, 0))
        bench.advance(fluid, READING)
        force = fluid.boundary_wrench(plate)[0] / height
        rows.append(np.array([(step + 1) * READING / unit, *(fluid.pressure_at(places) / scale), force / scale]))
    return np.array(rows).T


def plate_measurement() -> tuple[Double, Double]:
    """Mean measured p / (rho g H) over the plate: a trapezoid through the sensors, the lowest and highest carried to its edges."""
    tables = [read_table(f"dam_break_lobovsky_{file}.csv") for _, file in SENSORS.values()]
    time = np.linspace(0.1, PRESSURE_END, 400)
    pressure = np.stack([np.interp(time, *table) for table in tables])
    nodes = np.array([0.0, *(height for height, _ in SENSORS.values()), PLATE])
    values = np.concatenate([pressure[:1], pressure, pressure[-1:]])
    return time, np.trapezoid(values, nodes, axis=0) / PLATE


def impulse(time: Double, pressure: Double, start: float) -> float:
    """Integral of pressure over time from `start` to PRESSURE_END, both dimensionless, on 600 interpolated points."""
    grid = np.linspace(start, PRESSURE_END, 600)
    return float(np.trapezoid(np.interp(grid, time, pressure), grid))


def dam_pressure(resolution: int, bench: Bench) -> Outcome:
    """Case 15: arrival at the lowest sensor and impulse at three heights, from t* = 2.2 to 6."""
    history = pressure_history(bench, LOBOVSKY_DEPTH / resolution)
    values, traces = {}, []
    for index, (name, (_, file)) in enumerate(SENSORS.items()):
        time, measured = read_table(f"dam_break_lobovsky_{file}.csv")
        if index == 0:
            values["arrival"] = crossing_time(history[0], history[1], ARRIVED)
        share = impulse(history[0], history[1 + index], IMPACT) / impulse(time, measured, IMPACT)
        values[f"impulse / measured, {name}"] = share
        traces.append(trace(name, history[0], history[1 + index]))
        traces.append(trace(name, time, measured, "Lobovsky et al.", reference=True, markers=True))
        time, *pressures = read_table(f"dam_break_plane_sph_{file}.csv")
        traces += [trace(name, time, *one, reference=True) for one in zip(pressures, PEERS, strict=True)]
    measured_plate = plate_measurement()
    values[PLATE_NAME] = impulse(history[0], history[-1], IMPACT) / impulse(*measured_plate, IMPACT)
    traces.append(trace("plate", history[0], history[-1]))
    traces.append(trace("plate", *measured_plate, "Lobovsky et al., between sensors", reference=True))
    return Outcome(values=values, traces=tuple(traces))


DAM_FRONT = Case(
    number=14,
    name="dam-break-front",
    title="Dam break, front on a dry floor",
    source="Martin and Moyce 1952; Koshizuka and Oka 1996",
    setup="columns twice as high as wide, 28.6, 57.2 and 146 mm wide, nu 1e-6 m2/s, no-slip floor and walls, plane",
    length=EXPERIMENTS["Martin and Moyce, a = 2.25 in"].base,
    length_symbol="a",
    resolutions=(32, 64, 128),
    quantities=tuple(
        quantity
        for name in EXPERIMENTS
        for quantity in (
            Quantity(
                name=f"rms, {name}", unit="1", reference=0.0, scale=1.0, gate=None if name.startswith("K") else 0.03
            ),
            Quantity(name=f"shift, {name}", unit="1", reference=0.0, scale=1.0),
        )
    ),
    panels=tuple(Panel(name, "t sqrt(2 g / a)", f"front / a, {name}") for name in EXPERIMENTS),
    run=dam_front,
    note="rms of the relative difference after the best shift in time, one per experiment; every column has its own base a (the "
    "spacings in m are those of the middle one). Koshizuka and Oka's front lies a fifth apart from the others' under the same law: "
    "information. A free surface has no tension; it holds back fronts of 1 to 2 mm "
    "(`front-in-air`).",
)

DAM_PRESSURE = Case(
    number=15,
    name="dam-break-pressure",
    title="Dam break, pressure on the end wall",
    source="plane SPH of three kinds at H/400, over the impulses that Lobovsky et al. 2014 measured in a tank with a gate and air; the "
    "force on the lowest 0.1 m has the measured one, as information",
    setup="column 0.6 m wide and 0.3 m high in a tank 1.61 m long, nu 1e-6 m2/s, no-slip walls, plane",
    length=LOBOVSKY_DEPTH,
    length_symbol="H",
    resolutions=(32, 64, 128),
    quantities=(
        Quantity(name="arrival", unit="sqrt(H / g)", reference=ARRIVAL, scale=1.0, gate=ARRIVAL_SPREAD),
        *(
            Quantity(name=f"impulse / measured, {name}", unit="1", reference=share, scale=1.0, gate=spread)
            for name, (share, spread) in PLANE.items()
        ),
        Quantity(name=PLATE_NAME, unit="1", reference=1.0),
    ),
    panels=(
        *(Panel(name, "t sqrt(g / H)", f"p / (rho g H) at {name}", y_range=(-1.0, 5.0)) for name in SENSORS),
        Panel("plate", "t sqrt(g / H)", "mean p / (rho g H) over 0 to 0.1 m", y_range=(-1.0, 5.0)),
    ),
    run=dam_pressure,
    note="arrival: p first above 0.2 rho g H at the sensor 3 mm above the floor; impulse from t* = 2.2 to 6. The sensors are read by "
    "Fluid.pressure_at; the force on the wall is its wrench and does not depend on how pressure is interpolated. Readings outside the "
    "picture's range are cut off.",
)
