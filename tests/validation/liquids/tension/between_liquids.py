"""Cases 48 to 50: interfacial tension. A drop at rest and one that swings, a bubble that rises, and waves between liquids that slip."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from oilsim import Fluid, FluidConfig, Phase, tank_walls
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace
from tests.validation.liquids.tension.drops import DISORDER, RESTING, STRETCH, SWINGS, Drop, rest, swing
from tests.validation.measure import growth_rate, mode_amplitude
from tests.validation.scenes import fill, masses, position, set_velocity, velocity

Double = NDArray[np.float64]

# drops: oil in water of the same density and viscosity, without weight
RADIUS, TENSION, DENSITY = 0.01, 0.07, 1000.0  # m, N/m, kg/m3
THICK, THIN = 0.05, 0.01  # Pa s: of the drop at rest, and of the one that swings


def oil_drop(viscosity: float) -> Drop:
    """A drop of oil in water of its density and `viscosity` [Pa s]."""
    water = Phase(name="water", rest_density=DENSITY, dynamic_viscosity=viscosity)
    return Drop(replace(water, name="oil", interfacial_tension=TENSION), water, RADIUS)


def interfacial_drop(resolution: int, bench: Bench) -> Outcome:
    """Case 48: Laplace's pressure and unrest of a drop at rest, period and decay of one that swings."""
    still, loose = oil_drop(THICK), oil_drop(THIN)
    bench.plan(RESTING * still.capillary_time + SWINGS * 2.0 * math.pi / loose.swinging(2).imag)
    pressure, *speeds = rest(bench, still, resolution)
    values, traces = swing(bench, loose, resolution)
    return Outcome(values={"pressure over Laplace's": pressure, "unrest": max(speeds), **values}, traces=traces)


# rising bubble: case 1 of Hysing et al. 2009
WIDE, HIGH, BUBBLE, RISE_TIME = 1.0, 2.0, 0.25, 3.0  # m, m, m, s
HEAVY = Phase(name="water", rest_density=1000.0, dynamic_viscosity=10.0)
LIGHT = Phase(name="bubble", rest_density=100.0, dynamic_viscosity=1.0, interfacial_tension=24.5)
PULL = 0.98  # m/s2
RISE, RISES_AT, REACHED = 0.2417, 0.9213, 1.0813  # m/s, s, m: mean of the three codes, Table VIII


def bubble_tank(bench: Bench, resolution: int) -> Fluid:
    """Hysing's tank: no-slip floor and lid, slippery sides, full of liquid with a round bubble."""
    spacing = BUBBLE / resolution
    room = 4.0 * spacing
    config = FluidConfig(
        particle_spacing=spacing, phases=(HEAVY, LIGHT), dimension=2, lower=(-room, -1.0, -room),
        upper=(WIDE + room, 1.0, HIGH + room), gravity=(0.0, 0.0, -PULL),
    )  # fmt: skip
    fluid = bench.fluid(config)
    box = ((0.0, 0.0, 0.0), (WIDE, 0.0, HIGH), spacing)
    fluid.add_boundary(tank_walls(*box, sides=("-x", "+x"), dimension=2, name="sides"))
    fluid.add_boundary(tank_walls(*box, sides=("-z", "+z"), dimension=2, name="floor and lid", no_slip=True))
    points = fill(fluid, (0.0, 0.0), (WIDE, HIGH))
    fluid.remove_particles(np.ones(fluid.particle_count, bool))
    inside = np.hypot(points[:, 0] - 0.5 * WIDE, points[:, 2] - 0.5 * WIDE) < BUBBLE
    fluid.add_particles(points[~inside], phase="water")
    fluid.add_particles(points[inside], phase="bubble")
    return fluid


def rising_bubble(resolution: int, bench: Bench) -> Outcome:
    """Case 49: rise of a bubble whose tension keeps it together."""
    bench.plan(RISE_TIME)
    fluid = bubble_tank(bench, resolution)
    rows = [(0.0, 0.5, 0.0)]
    for _ in range(60):
        bench.advance(fluid, RISE_TIME / 60)
        height = fluid.phase_positions("bubble")[:, 2].mean(dtype=np.float64)
        rows.append((fluid.time, height, fluid.phase_velocities("bubble")[:, 2].mean(dtype=np.float64)))
    time, height, speed = np.array(rows).T
    smooth = np.convolve(speed, np.ones(3) / 3.0, "same")[1:-1]
    fastest = int(np.argmax(smooth))
    fluid.close()
    return Outcome(
        values={"rise": float(smooth[fastest]), "time of it": float(time[fastest + 1]), "height": float(height[-1])},
        traces=(trace("rise", time, speed), trace("height", time, height)),
    )


# two layers that slip past each other
WAVE, SLIP, SHEAR_DENSITY = 1.0, 1.0, 1000.0  # m, m/s, kg/m3
NUMBER = 2.0 * math.pi / WAVE
CUT_OFF = 0.5 * SHEAR_DENSITY * SLIP**2 / NUMBER  # N/m: the tension that just holds the wave down
START, LINEAR_PART = 0.005, 0.25  # of the slip, k times the interface's amplitude
SHARES = (0.0, 0.5, 1.5)  # of that tension


def shear_growth(share: float) -> float:
    """Growth rate [1/s] of the wave under `share` of the tension that holds it down; s^2 = k^2 U^2 / 4 - sigma k^3 / (2 rho)."""
    return 0.5 * NUMBER * SLIP * math.sqrt(max(1.0 - share, 0.0))


def shear_mode(fluid: Fluid) -> Double:
    """Velocity (3, N) of a wave on the lower of two interfaces, 1 where it rises fastest; the other one is a wave's length above it."""
    x, _, z = position(fluid) * NUMBER
    away = z - math.pi
    fade = np.exp(-np.abs(away))
    return np.stack([np.sign(away) * fade * np.sin(x), np.zeros_like(x), fade * np.cos(x)])


def shear_growth_measured(bench: Bench, resolution: int, share: float) -> tuple[float, Double, Double]:
    """Growth rate [1/s], and time [s] and speed [m/s] of the wave on a layer that slips past its neighbours."""
    spacing, tension = WAVE / resolution, share * CUT_OFF
    phases = (
        Phase(name="water", rest_density=SHEAR_DENSITY),
        Phase(name="oil", rest_density=SHEAR_DENSITY, interfacial_tension=tension),
    )
    config = FluidConfig(
        particle_spacing=spacing, phases=phases, dimension=2, lower=(0.0, -1.0, 0.0), upper=(WAVE, 1.0, 2.0 * WAVE),
        periodic=(True, False, True), gravity=(0.0, 0.0, 0.0),
    )  # fmt: skip
    fluid = bench.fluid(config)
    for low, liquid in ((0.0, "water"), (0.5 * WAVE, "oil"), (1.0 * WAVE, "oil"), (1.5 * WAVE, "water")):
        fill(fluid, (0.0, low), (WAVE, low + 0.5 * WAVE), liquid)
    slip = np.where(fluid.particles.phase == 1, 0.5, -0.5) * SLIP
    set_velocity(fluid, START * SLIP * shear_mode(fluid) + np.stack([slip, 0.0 * slip, 0.0 * slip]))
    rows = []
    for _ in range(150):
        bench.advance(fluid, 0.01 * WAVE / SLIP)
        rows.append((fluid.time, mode_amplitude(velocity(fluid), shear_mode(fluid), masses(fluid))))
    fluid.close()
    time, speed = np.array(rows).T
    moved = np.cumsum(np.abs(speed)) * (time[1] - time[0])
    linear = moved * NUMBER < LINEAR_PART
    rate = growth_rate(time[linear], speed[linear], max(shear_growth(share), 0.5)) if share < 1.0 else math.nan
    return rate, time, speed


def interface_shear(resolution: int, bench: Bench) -> Outcome:
    """Case 50: growth of a wave between layers that slip, by tension."""
    bench.plan(len(SHARES) * 1.5 * WAVE / SLIP)
    values, curves = dict[str, float](), []
    for share in SHARES:
        rate, time, speed = shear_growth_measured(bench, resolution, share)
        name = f"tension {share:g} of the cut-off's"
        if share < 1.0:
            values[f"growth over theory, {name}"] = rate / shear_growth(share)
        else:
            values[f"largest speed over the first, {name}"] = float(np.abs(speed).max() / (START * SLIP))
        curves.append(trace("growth", time, np.maximum(np.abs(speed) / (START * SLIP), 0.1), name))
        if share < 1.0:
            curves.append(trace("growth", time, np.cosh(shear_growth(share) * time), f"theory, {name}", reference=True))
    return Outcome(values=values, traces=tuple(curves))


INTERFACIAL_DROP = Case(
    number=48,
    name="interfacial-drop",
    title="A drop of oil in water of its own density, held together by interfacial tension",
    source="Laplace's pressure sigma / R; exact rate of small swings of viscous drops (`Drop.swinging`), which is "
    "Lamb's 1932, art. 275, without viscosity",
    setup=f"plane drop of radius {RADIUS:g} m, sigma {TENSION:g} N/m, without weight, in a box of 6 R that repeats. At rest: "
    f"{THICK:g} Pa s, particles disordered by {DISORDER:g} d, {RESTING:g} sqrt(2 rho R^3 / sigma). Swinging: {THIN:g} Pa s, axes "
    f"{100 * STRETCH:g} % from the radius, {SWINGS:g} periods",
    length=RADIUS,
    length_symbol="R",
    resolutions=(8, 12, 16),
    quantities=(
        Quantity(name="pressure over Laplace's", unit="1", reference=1.0, gate=0.03),
        Quantity(name="unrest", unit="sigma / mu", reference=0.0, scale=1.0, gate=1e-3),
        Quantity(name="period over theory", unit="1", reference=1.0, gate=0.03),
        Quantity(name="decay over theory", unit="1", reference=1.0),
    ),
    panels=(Panel("swing", "t / period", "(<x2> - <z2>) / (<x2> + <z2>)"),),
    run=interfacial_drop,
    note="unrest is the fastest particle's speed, mean of the last two fifths. The field is smooth over some three spacings, so a curved "
    "interface has a little less tension and swings slowly.",
)

RISING_BUBBLE = Case(
    number=49,
    name="rising-bubble",
    title="A bubble that rises and stays whole",
    source="mean of three codes, Hysing et al. 2009, case 1: fastest rise 0.2417 m/s at 0.921 s, height 1.081 m after 3 s",
    setup="plane tank of 1 m x 2 m, full, no-slip floor and lid, slippery sides; bubble of radius 0.25 m, 100 in 1000 kg/m3, 1 in 10 Pa s, "
    "sigma 24.5 N/m, gravity 0.98 m/s2",
    length=BUBBLE,
    length_symbol="R",
    resolutions=(8, 12, 16),
    quantities=(
        Quantity(name="rise", unit="m/s", reference=RISE, gate=0.03),
        Quantity(name="time of it", unit="s", reference=RISES_AT),
        Quantity(name="height", unit="m", reference=REACHED, gate=0.03),
    ),
    panels=(Panel("rise", "t [s]", "mean speed [m/s]"), Panel("height", "t [s]", "centre [m]")),
    run=rising_bubble,
    note="the rise has a flat maximum, and its time scatters by a tenth of a second",
)

INTERFACE_SHEAR = Case(
    number=50,
    name="interface-shear",
    title="Waves between liquids that slip past each other",
    source="s^2 = k^2 U^2 / 4 - sigma k^3 / (2 rho) (Kelvin 1871; Chandrasekhar 1961, sec. 101)",
    setup="two layers of one density, inviscid, without weight, each a wave's length high, pass each other at 1 m/s in a box that repeats; "
    "tension 0, 0.5 and 1.5 of the least one that holds the wave down",
    length=WAVE,
    length_symbol="wave",
    resolutions=(32, 48, 64),
    quantities=(
        Quantity(name="growth over theory, tension 0 of the cut-off's", unit="1", reference=1.0, gate=0.2),
        Quantity(name="growth over theory, tension 0.5 of the cut-off's", unit="1", reference=1.0),
        Quantity(name="largest speed over the first, tension 1.5 of the cut-off's", unit="1", reference=1.0, gate=0.05),
    ),
    panels=(Panel("growth", "t [s]", "modal speed / first", log_y=True),),
    run=interface_shear,
    note="a layer of uniform shear (Rayleigh 1880) of 1.6, 2.0 and 3.0 d has the growth that is measured at 32, 48 and 64 spacings a wave "
    "without tension.",
)
