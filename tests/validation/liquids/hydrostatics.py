"""Case 1: water at rest. Bottom pressure, force on the floor, what motion is left."""

from __future__ import annotations

import math

import numpy as np

from oilsim import BoundaryParticles, Fluid, tank_walls
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace
from tests.validation.scenes import (
    GRAVITY,
    SAMPLE,
    disturb,
    fill,
    liquid,
    masses,
    open_tank,
    position,
    rms_speed,
    set_velocity,
)

DEPTH = WIDTH = 1.0  # m
DURATION, LAST = 10.0, 1.0  # s: length of the run, and of its end over which means are taken
DISORDER = 0.2  # spacings, normally distributed, by which water is put off its lattice
MENDING = 1.0  # s until it is brought to rest
NARROW, MINUTE = 0.25, 60.0  # m, s: of a column so long at rest that flow which feeds on pressure would show
GAUGES = np.linspace(0.25, 0.75, 9)  # of the width


def gauge_pressure(fluid: Fluid, width: float, height: float) -> float:
    """Mean pressure [Pa] of nine gauges across the middle half of the tank at `height` [m]."""
    return float(fluid.pressure_at([(x * width, 0.0, height) for x in GAUGES]).mean())


def settle(
    bench: Bench, fluid: Fluid, width: float, gauge: float, scale: float
) -> tuple[np.ndarray, float, np.ndarray]:
    """Run for DURATION; returns the rms speed over `scale` at each sample, the mean gauge pressure [Pa] and profile points."""
    speeds, pressures = [], []
    heights = np.append(gauge, np.linspace(0.1, 0.95, 18) * DEPTH)
    profiles = []
    for step in range(round(DURATION / SAMPLE)):
        bench.advance(fluid, SAMPLE)
        speeds.append(rms_speed(fluid) / scale)
        if (step + 1) * SAMPLE > DURATION - LAST and step % 5 == 0:
            pressures.append(gauge_pressure(fluid, width, gauge))
            profiles.append(fluid.pressure_at([(0.5 * width, 0.0, z) for z in heights]))
    return np.array(speeds), float(np.mean(pressures)), np.stack([heights, np.mean(profiles, axis=0)])


def floor_and_sides(spacing: float) -> tuple[BoundaryParticles, BoundaryParticles]:
    """The walls of the tank as two bodies, so that the floor's force can be asked for."""
    walls = tank_walls((0, 0, 0), (WIDTH, 0, 1.5 * DEPTH), spacing, sides=("-x", "+x", "-z"), dimension=2)
    floor = walls.position[:, 2] < 0.0
    return walls.part("floor", floor), walls.part("sides", ~floor)


def floor_force(bench: Bench, fluid: Fluid, tank: int, spacing: float) -> float:
    """Mean upward reaction [N/m] on the floor over LAST, after the tank's walls were exchanged for a floor and sides."""
    floor, sides = floor_and_sides(spacing)
    fluid.remove_boundary(tank)
    fluid.add_boundary(sides)
    handle = fluid.add_boundary(floor)
    forces = []
    for _ in range(round(LAST / SAMPLE)):
        fluid.set_boundary_motion(handle, (0, 0, 0), (0, 0, 0, 1), (0, 0, 0), (0, 0, 0))
        bench.advance(fluid, SAMPLE)
        forces.append(-fluid.boundary_wrench(handle)[2])
    return float(np.mean(forces))


def disordered_column(bench: Bench, spacing: float) -> Fluid:
    """The tank with water at rest that has lost its lattice, on which it would lie stillest."""
    fluid, _ = open_tank(bench, WIDTH, DEPTH, spacing, (liquid(),))
    fill(fluid, (0, 0), (WIDTH, DEPTH))
    disturb(fluid, DISORDER * spacing, seed=1)
    bench.advance(fluid, MENDING)
    fluid.finish_step()
    set_velocity(fluid, np.zeros((3, fluid.particle_count)))
    return fluid


def unrest_after_a_minute(bench: Bench, spacing: float, scale: float) -> np.ndarray:
    """Time [s] and the rms speed over `scale` in a narrow column (2, n)."""
    fluid, _ = open_tank(bench, NARROW, DEPTH, spacing, (liquid(),))
    fill(fluid, (0, 0), (NARROW, DEPTH))
    rows = []
    for step in range(round(MINUTE / SAMPLE)):
        bench.advance(fluid, SAMPLE)
        rows.append(((step + 1) * SAMPLE, rms_speed(fluid) / scale))
    return np.array(rows).T


def still_column(resolution: int, bench: Bench) -> Outcome:
    """Case 1: water 1 m deep at rest for 10 s, and a narrow column of it for 60 s."""
    spacing = DEPTH / resolution
    bench.plan(2.0 * DURATION + LAST + MENDING + MINUTE)
    fluid, tank = open_tank(bench, WIDTH, DEPTH, spacing, (liquid(),))
    fill(fluid, (0, 0), (WIDTH, DEPTH))
    level = 2.0 * float(position(fluid)[2].mean())
    scale = math.sqrt(GRAVITY * DEPTH)
    speeds, pressure, profile = settle(bench, fluid, WIDTH, spacing, scale)
    drift = 2.0 * float(position(fluid)[2].mean()) / level - 1.0
    force = floor_force(bench, fluid, tank, spacing)
    unrest, _, _ = settle(bench, disordered_column(bench, spacing), WIDTH, spacing, scale)
    minute = unrest_after_a_minute(bench, spacing, scale)
    hydrostatic = 1000.0 * GRAVITY
    z = np.array([0.0, DEPTH])
    return Outcome(
        values={
            "bottom pressure / rho g z": pressure / (hydrostatic * (DEPTH - spacing)),
            "floor force / weight": force / (GRAVITY * float(masses(fluid).sum())),
            "volume drift": drift,
            "rms speed / sqrt(g H)": float(speeds[-round(LAST / SAMPLE) :].mean()),
            "the same, off its lattice": float(unrest[-round(LAST / SAMPLE) :].mean()),
            "the same after 60 s on it, 0.25 m wide": float(minute[1, -round(LAST / SAMPLE) :].mean()),
        },
        traces=(
            trace("pressure", profile[1] / (hydrostatic * DEPTH), profile[0]),
            trace("pressure", 1.0 - z / DEPTH, z, "rho g (H - z)", reference=True),
            trace("motion", SAMPLE * (1 + np.arange(len(speeds))), np.maximum(speeds, 1e-9)),
            trace("motion", SAMPLE * (1 + np.arange(len(unrest))), unrest, "off its lattice"),
            trace("motion", minute[0], np.maximum(minute[1], 1e-9), "0.25 m wide"),
            trace("motion", (0.0, MINUTE), (0.002, 0.002), "gate", reference=True),
        ),
    )


STILL_COLUMN = Case(
    number=1,
    name="still-column",
    title="Still column of water",
    source="hydrostatics, p = rho g z",
    setup="water 1 m deep, 1 m wide, free-slip walls, at rest for 10 s; means over the last second; 1 s more with the floor as a body; "
    "put 0.2 spacings off its lattice, brought to rest after 1 s, 10 s; 0.25 m wide for 60 s",
    length=DEPTH,
    length_symbol="H",
    resolutions=(16, 32, 64),
    quantities=(
        Quantity(name="bottom pressure / rho g z", unit="1", reference=1.0, gate=0.005),
        Quantity(name="floor force / weight", unit="1", reference=1.0, gate=0.005),
        Quantity(name="volume drift", unit="1", reference=0.0, scale=1.0, gate=0.001),
        Quantity(name="rms speed / sqrt(g H)", unit="1", reference=0.0, scale=1.0, gate=0.002),
        Quantity(name="the same, off its lattice", unit="1", reference=0.0, scale=1.0, gate=0.002),
        Quantity(name="the same after 60 s on it, 0.25 m wide", unit="1", reference=0.0, scale=1.0, gate=0.01),
    ),
    panels=(
        Panel("pressure", "p / (rho g H)", "z [m]"),
        Panel("motion", "t [s]", "rms speed / sqrt(g H)", log_y=True),
    ),
    run=still_column,
    note="pressure from gauges one spacing above the floor; the floor force is the wrench on the floor as a body that does not move.",
)
