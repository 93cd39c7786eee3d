"""Cases 14 and 15: dam breaks. Front on a dry floor, pressure on the wall that it hits."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from oilsim.boundary import tank_walls
from oilsim.config import FluidConfig
from oilsim.solver import Fluid
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace
from tests.validation.measure import best_time_shift, crossing_time, front_position
from tests.validation.scenes import GRAVITY, fill, liquid, position, read_table

Double = NDArray[np.float64]

WATER = liquid(1000.0, 1e-6)


def basin(bench: Bench, length: float, height: float, spacing: float) -> Fluid:
    """A plane tank [m] open above, with free-slip walls, empty."""
    room = 4.0 * spacing
    fluid = bench.fluid(
        FluidConfig(
            particle_spacing=spacing, phases=(WATER,), dimension=2, lower=(-room, -1.0, -room),
            upper=(length + room, 1.0, height),
        )
    )  # fmt: skip
    fluid.add_boundary(tank_walls((0, 0, 0), (length, 0, height), spacing, sides=("-x", "+x", "-z"), dimension=2))
    return fluid


# front
BASE = 0.05715  # m, Martin and Moyce's 2.25 inches
COLUMN = 2.0 * BASE
FRONT_LENGTH = 10.0 * BASE
FRONT_END = 6.4  # t sqrt(2 g / a)
FRONT_SAMPLES = 160
EXPERIMENTS = {
    "Martin and Moyce, a = 1.125 in": "dam_break_martin_moyce_a1125.csv",
    "Martin and Moyce, a = 2.25 in": "dam_break_martin_moyce_a2250.csv",
    "Koshizuka and Oka": "dam_break_koshizuka_oka.csv",
}


def front_history(bench: Bench, spacing: float) -> Double:
    """t sqrt(2 g / a) and front over a (2, n) of the column's collapse."""
    fluid = basin(bench, FRONT_LENGTH, 3.0 * COLUMN, spacing)
    fill(fluid, (0, 0), (BASE, COLUMN))
    unit = math.sqrt(BASE / (2.0 * GRAVITY))
    step = FRONT_END * unit / FRONT_SAMPLES
    bench.plan(FRONT_END * unit)
    rows = [(0.0, 1.0)]
    for index in range(FRONT_SAMPLES):
        bench.advance(fluid, step)
        x, _, z = position(fluid)
        front = front_position(x[z < 3.0 * spacing], spacing) / BASE
        rows.append(((index + 1) * step / unit, front))
        if front > FRONT_LENGTH / BASE - 0.2:
            break
    return np.array(rows).T


def dam_front(resolution: int, bench: Bench) -> Outcome:
    """Case 14: rms difference from three experiments after one shift in time each."""
    history = front_history(bench, BASE / resolution)
    values = {}
    traces = [trace("front", *history)]
    for name, file in EXPERIMENTS.items():
        time, front = read_table(file)
        inside = front <= history[1].max()
        shifted = best_time_shift(history[0], history[1], time[inside], front[inside], 1.0)
        values[f"rms, {name}"] = shifted.rms
        values[f"shift, {name}"] = shifted.shift
        traces.append(trace("front", time - shifted.shift, front, f"{name}, shifted", reference=True, markers=True))
    return Outcome(values=values, traces=tuple(traces))


# pressure
LOBOVSKY_DEPTH, LOBOVSKY_COLUMN, LOBOVSKY_TANK = 0.3, 0.6, 1.61  # m
SENSORS = {"3 mm": (0.003, "p1"), "30 mm": (0.030, "p3"), "80 mm": (0.080, "p4")}
PRESSURE_END = 6.0  # t sqrt(g / H)
ARRIVED = 0.2  # p / (rho g H) that tells the arrival
READING = 0.002  # s between readings


def pressure_history(bench: Bench, spacing: float) -> Double:
    """t sqrt(g / H), p / (rho g H) at the sensors (1 + sensors, n)."""
    unit = math.sqrt(LOBOVSKY_DEPTH / GRAVITY)
    bench.plan(PRESSURE_END * unit)
    fluid = basin(bench, LOBOVSKY_TANK, 3.0 * LOBOVSKY_DEPTH, spacing)
    fill(fluid, (0, 0), (LOBOVSKY_COLUMN, LOBOVSKY_DEPTH))
    places = [(LOBOVSKY_TANK, 0.0, height) for height, _ in SENSORS.values()]
    rows = [np.zeros(1 + len(places))]
    for step in range(math.ceil(PRESSURE_END * unit / READING)):
        bench.advance(fluid, READING)
        pressure = fluid.pressure_at(places) / (1000.0 * GRAVITY * LOBOVSKY_DEPTH)
        rows.append(np.concatenate([[(step + 1) * READING / unit], pressure]))
    return np.array(rows).T


def impulse(time: Double, pressure: Double, start: float) -> float:
    """Integral of pressure over time from `start` to PRESSURE_END, both dimensionless, on 600 interpolated points."""
    grid = np.linspace(start, PRESSURE_END, 600)
    return float(np.trapezoid(np.interp(grid, time, pressure), grid))


def dam_pressure(resolution: int, bench: Bench) -> Outcome:
    """Case 15: arrival at the lowest sensor and impulse at three heights up to t* = 6."""
    history = pressure_history(bench, LOBOVSKY_DEPTH / resolution)
    values, traces = {}, []
    for index, (name, (_, file)) in enumerate(SENSORS.items()):
        time, measured = read_table(f"dam_break_lobovsky_{file}.csv")
        if index == 0:
            arrival = crossing_time(time, measured, ARRIVED)
            values["arrival / measured"] = crossing_time(history[0], history[1], ARRIVED) / arrival
        values[f"impulse / measured, {name}"] = impulse(history[0], history[1 + index], 2.0) / impulse(
            time, measured, 2.0
        )
        traces.append(trace(name, history[0], history[1 + index]))
        traces.append(trace(name, time, measured, "Lobovsky et al.", reference=True, markers=True))
    return Outcome(values=values, traces=tuple(traces))


DAM_FRONT = Case(
    number=14,
    name="dam-break-front",
    title="Dam break, front on a dry floor",
    source="Martin and Moyce 1952; Koshizuka and Oka 1996",
    setup="column 57.15 mm wide and twice as high, nu 1e-6 m2/s, free-slip floor, plane",
    length=BASE,
    length_symbol="a",
    resolutions=(16, 32, 64),
    quantities=tuple(
        quantity
        for name in EXPERIMENTS
        for quantity in (
            Quantity(name=f"rms, {name}", unit="1", reference=0.0, scale=1.0, gate=0.03),
            Quantity(name=f"shift, {name}", unit="1", reference=0.0, scale=1.0),
        )
    ),
    panels=(Panel("front", "t sqrt(2 g / a)", "front / a"),),
    run=dam_front,
    note="rms of the relative difference after the best shift in time, one per experiment. After such a shift the experiments themselves "
    "differ from each other by 3 to 6 %: one curve cannot be within 3 % of all three.",
)

DAM_PRESSURE = Case(
    number=15,
    name="dam-break-pressure",
    title="Dam break, pressure on the end wall",
    source="Lobovsky et al. 2014",
    setup="column 0.6 m wide and 0.3 m high in a tank 1.61 m long, nu 1e-6 m2/s, free-slip walls, plane",
    length=LOBOVSKY_DEPTH,
    length_symbol="H",
    resolutions=(16, 32, 64),
    quantities=(
        Quantity(name="arrival / measured", unit="1", reference=1.0, gate=0.02),
        *(
            Quantity(name=f"impulse / measured, {name}", unit="1", reference=1.0, gate=0.05 if name == "3 mm" else None)
            for name in SENSORS
        ),
    ),
    panels=tuple(Panel(name, "t sqrt(g / H)", f"p / (rho g H) at {name}") for name in SENSORS),
    run=dam_pressure,
    note="arrival: p first above 0.2 rho g H at the sensor 3 mm above the floor; impulse from t* = 2 to 6.",
)
