"""Cases 6 and 7: viscous flow between no-slip walls. Poiseuille and Couette start-up, two layers of unequal viscosity."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from oilsim import Fluid
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace
from tests.validation.measure import profile_value
from tests.validation.scenes import channel, channel_wall, fill, liquid, position, set_velocity, velocity

Double = NDArray[np.float64]

# start-up, the set-up of Morris et al. 1997
HEIGHT = 1e-3  # m
LENGTH = 0.75e-3  # m, twelve spacings at the coarsest
VISCOSITY = 1e-6  # m2/s
PULL = 1e-4  # m/s2
TOP_SPEED = PULL * HEIGHT**2 / (8.0 * VISCOSITY)  # m/s, steady centreline speed; also the speed of Couette's wall
DURATION = 1.0  # s
PROFILE_TIMES = (0.0225, 0.045, 0.1125, 0.225, 1.0)  # s, those of the table


def poiseuille(z: Double, time: float) -> Double:
    """Speed [m/s] at heights z [m] after `time` [s] from rest (Morris et al. 1997, Eq. 20).

    u = F z (L - z) / (2 nu) - sum_n 4 F L^2 / (nu pi^3 (2n+1)^3) sin((2n+1) pi z / L) exp(-(2n+1)^2 pi^2 nu t / L^2).
    """
    m = 2.0 * np.arange(200)[:, None] + 1.0
    series = np.sin(m * math.pi * z / HEIGHT) * np.exp(-((m * math.pi / HEIGHT) ** 2) * VISCOSITY * time) / m**3
    return PULL / (2.0 * VISCOSITY) * z * (HEIGHT - z) - 4.0 * PULL * HEIGHT**2 / (VISCOSITY * math.pi**3) * series.sum(
        axis=0
    )


def couette(z: Double, time: float) -> Double:
    """Speed [m/s] at heights z [m] after `time` [s], the upper wall started at TOP_SPEED (Morris et al. 1997, Eq. 19).

    u = V z / L + sum_n 2 V / (n pi) (-1)^n sin(n pi z / L) exp(-n^2 pi^2 nu t / L^2).
    """
    n = np.arange(1.0, 401.0)[:, None]
    series = (-1.0) ** n / n * np.sin(n * math.pi * z / HEIGHT)
    series = series * np.exp(-((n * math.pi / HEIGHT) ** 2) * VISCOSITY * time)
    return TOP_SPEED * z / HEIGHT + 2.0 * TOP_SPEED / math.pi * series.sum(axis=0)


def centreline(fluid: Fluid, spacing: float) -> float:
    """Speed [m/s] half-way between the walls, from a parabola through the particles within 2.5 spacings of it."""
    return profile_value(position(fluid)[2], velocity(fluid)[0], 0.5 * HEIGHT, 2.5 * spacing)


def start_up(bench: Bench, resolution: int, pull: float, wall_speed: float) -> dict[float, Double]:
    """Run from rest; height [m], speed [m/s] and centreline speed (3, N) of the particles at the PROFILE_TIMES."""
    spacing, time_step = HEIGHT / resolution, 0.0075 / resolution
    fluid = bench.fluid(
        channel(LENGTH, HEIGHT, spacing, (liquid(kinematic_viscosity=VISCOSITY),), pull, maximum_time_step=time_step)
    )
    fluid.add_boundary(channel_wall(LENGTH, HEIGHT, spacing, "-z"))
    upper = fluid.add_boundary(channel_wall(LENGTH, HEIGHT, spacing, "+z"))
    fill(fluid, (0, 0), (LENGTH, HEIGHT))
    profiles = {}
    done = 0
    for time in PROFILE_TIMES:
        count = round((time - done * time_step) / time_step)
        for _ in range(count):
            if wall_speed:
                # back to its place before every step: a wall that repeats along x
                fluid.set_boundary_motion(upper, (0, 0, 0), (0, 0, 0, 1), (wall_speed, 0, 0), (0, 0, 0))
            bench.advance(fluid, time_step)
        done += count
        middle = np.full(fluid.particle_count, centreline(fluid, spacing))
        profiles[done * time_step] = np.stack([position(fluid)[2], velocity(fluid)[0], middle])
    return profiles


def start_up_case(resolution: int, bench: Bench) -> Outcome:
    """Case 6: errors over the steady centreline speed, the largest of a profile, and that of the centreline."""
    bench.plan(2.0 * DURATION)
    values, traces = {}, []
    z = np.linspace(0.0, HEIGHT, 100)
    flows = {"Poiseuille": (poiseuille, PULL, 0.0), "Couette": (couette, 0.0, TOP_SPEED)}
    for name, (exact, pull, wall_speed) in flows.items():
        profiles = start_up(bench, resolution, pull, wall_speed)
        errors = [np.abs(u - exact(height, time)).max() / TOP_SPEED for time, (height, u, _) in profiles.items()]
        values[f"{name}, largest error of a profile"] = float(max(errors))
        for time, (height, u, _) in profiles.items():
            order = np.argsort(height)
            traces.append(trace(name, u[order] / TOP_SPEED, height[order] / HEIGHT))
            traces.append(trace(name, exact(z, time) / TOP_SPEED, z / HEIGHT, "series solution", reference=True))
        middles = {time: float(rows[2, 0]) for time, rows in profiles.items()}
        if name == "Poiseuille":
            exact_middle = [float(exact(np.array([0.5 * HEIGHT]), time)[0]) for time in middles]
            worst = max(abs(u - e) for u, e in zip(middles.values(), exact_middle, strict=True))
            values["Poiseuille, largest centreline error"] = worst / TOP_SPEED
            values["Poiseuille, centreline at 1 s"] = middles[max(middles)]
    return Outcome(values=values, traces=tuple(traces))


# two layers
TALL, LONG, LAYER = 1.0, 0.625, 0.5  # m: ten spacings long at the coarsest
RATIOS = (10.0, 100.0, 1000.0)
THIN = 0.1  # m2/s, the thinner liquid's kinematic viscosity
DRIVE = 0.32  # m/s2
LAYER_RUN, LAYER_STEP = 4.0, 0.01  # s


def two_layer_profile(z: Double, ratio: float) -> Double:
    """Steady speed [m/s] at heights z [m]: thin liquid below, `ratio` times thicker above, walls at 0 and 2 h.

    In each layer u'' = -G / mu; u and mu u' are continuous at h, where u_i = G h^2 / (mu_1 + mu_2). Densities are 1 here.
    """
    interface = DRIVE * LAYER**2 / (THIN * (1.0 + ratio))
    lower = DRIVE / (2.0 * THIN) * z * (LAYER - z) + interface * z / LAYER
    top = TALL - z
    upper = DRIVE / (2.0 * THIN * ratio) * top * (LAYER - top) + interface * top / LAYER
    return np.where(z < LAYER, lower, upper)


def layered_flow(bench: Bench, spacing: float, ratio: float) -> tuple[float, Double]:
    """2 mu_1 u_i / (G h^2), with u_i from a parabola through the thicker layer; heights and speeds (2, N)."""
    phases = (liquid(kinematic_viscosity=THIN, name="thin"), liquid(kinematic_viscosity=THIN * ratio, name="thick"))
    fluid = bench.fluid(channel(LONG, TALL, spacing, phases, DRIVE))
    for side in ("-z", "+z"):
        fluid.add_boundary(channel_wall(LONG, TALL, spacing, side))
    fill(fluid, (0, 0), (LONG, LAYER), "thin")
    fill(fluid, (0, LAYER), (LONG, TALL), "thick")
    start = np.zeros((3, fluid.particle_count))
    start[0] = two_layer_profile(position(fluid)[2], ratio)
    set_velocity(fluid, start)
    for _ in range(round(LAYER_RUN / LAYER_STEP)):
        bench.advance(fluid, LAYER_STEP)
    z, u, thick = position(fluid)[2], velocity(fluid)[0], fluid.particles.phase == 1
    interface = profile_value(z[thick], u[thick], LAYER, LAYER)
    return 2.0 * THIN * interface / (DRIVE * LAYER**2), np.stack([z, u])


def layered(resolution: int, bench: Bench) -> Outcome:
    """Case 7: interface speed at viscosity ratios of 10, 100 and 1000."""
    spacing = TALL / resolution
    bench.plan(len(RATIOS) * LAYER_RUN)
    values, traces = {}, []
    heights = np.linspace(0.0, TALL, 400)
    for ratio in RATIOS:
        interface, (z, u) = layered_flow(bench, spacing, ratio)
        values[f"2 mu_1 u_i / (G h^2), ratio {ratio:g}"] = interface
        order = np.argsort(z)
        traces.append(trace("profile", u[order], z[order], f"ratio {ratio:g}"))
        traces.append(trace("profile", two_layer_profile(heights, ratio), heights, "exact", reference=True))
    return Outcome(values=values, traces=tuple(traces))


START_UP = Case(
    number=6,
    name="start-up",
    title="Plane Poiseuille and Couette flow from rest",
    source="series solutions (Morris, Fox and Zhu 1997)",
    setup="channel 1 mm high between no-slip walls, nu 1e-6 m2/s, body force 1e-4 m/s2 or a wall at 1.25e-5 m/s; dt 0.0075 s over n",
    length=HEIGHT,
    length_symbol="L",
    resolutions=(16, 32, 64),
    quantities=(
        Quantity(name="Poiseuille, centreline at 1 s", unit="m/s", reference=1.24993e-5, gate=0.005),
        Quantity(name="Poiseuille, largest centreline error", unit="1", reference=0.0, scale=1.0, gate=0.005),
        Quantity(name="Poiseuille, largest error of a profile", unit="1", reference=0.0, scale=1.0, gate=0.005),
        Quantity(name="Couette, largest error of a profile", unit="1", reference=0.0, scale=1.0, gate=0.005),
    ),
    panels=(Panel("Poiseuille", "u / u_max", "z / L"), Panel("Couette", "u / V", "z / L")),
    run=start_up_case,
    note="errors over the steady centreline speed, or the wall's, at t = 0.0225, 0.045, 0.1125, 0.225 and 1 s. The step is shortened "
    "because one of the default 0.01 s is all but backward Euler's, whose error at 0.0225 s is 2.2 %.",
)

LAYERED = Case(
    number=7,
    name="two-layer-poiseuille",
    title="Two layers between walls",
    source="steady solution with continuous shear stress, 2 mu_1 u_i / (G h^2) = 2 / (1 + ratio)",
    setup="layers of 0.5 m, nu 0.1 m2/s below and 10, 100, 1000 times as much above, one density, body force 0.32 m/s2; "
    "4 s from the exact profile",
    length=TALL,
    length_symbol="(2 h)",
    resolutions=(16, 32, 64),
    quantities=(
        Quantity(name="2 mu_1 u_i / (G h^2), ratio 10", unit="1", reference=0.18182, gate=0.02),
        Quantity(name="2 mu_1 u_i / (G h^2), ratio 100", unit="1", reference=0.019802, gate=0.02),
        Quantity(name="2 mu_1 u_i / (G h^2), ratio 1000", unit="1", reference=0.001998, gate=0.02),
    ),
    panels=(Panel("profile", "u [m/s]", "z [m]"),),
    run=layered,
    note="the slowest mode decays at 1 to 4 1/s: after 4 s what remains is the discrete steady state.",
)
