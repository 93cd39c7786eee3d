"""Cases 3 and 8: what must be conserved, and a disc of liquid that deforms in the void."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from oilsim import Fluid, FluidConfig, block, solid_box, sphere
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace
from tests.validation.scenes import (
    liquid,
    masses,
    periodic_box,
    position,
    set_velocity,
    velocity,
)

Double = NDArray[np.float64]

RADIUS = 1.0  # m
STEP = 0.01  # s


def disc(bench: Bench, spacing: float, **options: float) -> Fluid:
    """A disc of water of radius 1 m about the origin, without gravity."""
    reach = 6.0 * RADIUS
    config = FluidConfig(
        particle_spacing=spacing, phases=(liquid(),), dimension=2, lower=(-reach, -1.0, -reach), upper=(reach, 1.0, reach),
        gravity=(0.0, 0.0, 0.0), **options,
    )  # fmt: skip
    fluid = bench.fluid(config)
    fluid.add_particles(sphere((0, 0, 0), RADIUS, spacing, 2), phase="water")
    return fluid


def momentum_scale(fluid: Fluid) -> float:
    """Sum of m |v| [kg m/s per m]."""
    return float(masses(fluid) @ np.sqrt((velocity(fluid) ** 2).sum(axis=0)))


# conservation
CONSERVATION_RUN = 1.0  # s


def stirred_box(bench: Bench, spacing: float) -> Double:
    """Relative drift of linear momentum (2, n) over time [s] of a periodic box stirred by random velocities and a current."""
    fluid = bench.fluid(periodic_box(1.0, spacing, liquid()))
    fluid.add_particles(block((0, 0, 0), (1, 0, 1), spacing, 2), phase="water", velocity=(0.3, 0.0, 0.2))
    noise = np.random.default_rng(3).normal(0.0, 0.2, (3, fluid.particle_count)) * np.array([[1.0], [0.0], [1.0]])
    set_velocity(fluid, velocity(fluid) + noise)
    first, scale = fluid.momentum(), momentum_scale(fluid)
    rows = []
    for step in range(round(CONSERVATION_RUN / STEP)):
        bench.advance(fluid, STEP)
        rows.append(((step + 1) * STEP, np.linalg.norm(fluid.momentum() - first) / scale))
    return np.array(rows).T


def translated_box(bench: Bench, spacing: float) -> float:
    """Largest departure of a uniform flow in a full periodic box from its speed, over that speed."""
    fluid = bench.fluid(periodic_box(1.0, spacing, liquid()))
    fluid.add_particles(block((0, 0, 0), (1, 0, 1), spacing, 2), phase="water", velocity=(0.3, 0.0, 0.2))
    start = np.array([[0.3], [0.0], [0.2]])
    for _ in range(round(CONSERVATION_RUN / STEP)):
        bench.advance(fluid, STEP)
    return float(np.abs(velocity(fluid) - start).max() / np.linalg.norm(start))


def spun_disc(bench: Bench, spacing: float) -> Double:
    """Relative drift of angular momentum (2, n) over time [s] of a disc in the void that starts as a solid turning at 1 1/s."""
    fluid = disc(bench, spacing)
    x, y, z = position(fluid)
    set_velocity(fluid, np.stack([z, y, -x]))
    first = fluid.angular_momentum()[1]
    rows = []
    for step in range(round(CONSERVATION_RUN / STEP)):
        bench.advance(fluid, STEP)
        rows.append(((step + 1) * STEP, fluid.angular_momentum()[1] / first - 1.0))
    return np.array(rows).T


def body_force_residual(bench: Bench, spacing: float) -> float:
    """|change of the fluid's momentum + impulse on a body| over the impulse's path, water streaming past a held square."""
    fluid = bench.fluid(periodic_box(1.0, spacing, liquid()))
    water = block((0, 0, 0), (1, 0, 1), spacing, 2)
    side = 0.25
    outside = np.abs(water[:, [0, 2]] - 0.5).max(axis=1) > 0.5 * side
    fluid.add_particles(water[outside], phase="water", velocity=(0.3, 0.0, 0.1))
    handle = fluid.add_boundary(solid_box((side, 0.0, side), spacing, dimension=2))
    residual, path = np.zeros(3), 0.0
    for _ in range(round(CONSERVATION_RUN / STEP)):
        fluid.set_boundary_motion(handle, (0.5, 0, 0.5), (0, 0, 0, 1), (0, 0, 0), (0, 0, 0))
        before = fluid.momentum()
        bench.advance(fluid, STEP)
        impulse = fluid.boundary_wrench(handle)[:3] * STEP
        residual += fluid.momentum() - before + impulse
        path += float(np.linalg.norm(impulse))
    return float(np.linalg.norm(residual)) / path


def conservation(resolution: int, bench: Bench) -> Outcome:
    """Case 3: momentum, angular momentum and the force pair on a body."""
    spacing = RADIUS / resolution
    bench.plan(4.0 * CONSERVATION_RUN)
    linear, angular = stirred_box(bench, spacing), spun_disc(bench, spacing)
    return Outcome(
        values={
            "drift of linear momentum": float(linear[1].max()),
            "drift of angular momentum": float(np.abs(angular[1]).max()),
            "force pair on a body": body_force_residual(bench, spacing),
            "change of a uniform flow": translated_box(bench, spacing),
        },
        traces=(
            trace("drift", linear[0], np.maximum(linear[1], 1e-16), "linear, stirred box"),
            trace("drift", angular[0], np.maximum(np.abs(angular[1]), 1e-16), "angular, turning disc"),
        ),
    )


# elliptical drop
STRAIN = 100.0  # 1/s
END = 0.0076  # s
SAMPLES = 38


def half_axes(fluid: Fluid) -> tuple[float, float]:
    """Half axes a, b [m] of the ellipse with the particles' second moments, <x^2> = a^2 / 4."""
    x, _, z = position(fluid)
    return 2.0 * float(x.std()), 2.0 * float(z.std())


def ellipse_axes(times: Double) -> Double:
    """Half axes (2, n) [m] at rising times (n,) [s] from 0 on: da/dt = -A a with A^2 (a^2 + b^2) = 2 A_0^2 R^2 and a b = R^2.

    That is energy, which no pressure at the edge takes, and area. Differentiated, dA/dt = A^2 (a^4 - w^4) / (a^4 + w^4) with w = R, as
    Monaghan 1994 has it; with b in the place of w energy would fall by a quarter.
    """

    def shrink(_: float, a: Double) -> Double:
        rate: Double = STRAIN * RADIUS * np.sqrt(2.0 / (a**2 + (RADIUS**2 / a) ** 2))
        return -rate * a

    solution = solve_ivp(shrink, (0.0, END), [RADIUS], t_eval=times, rtol=1e-10, atol=1e-12)
    return np.stack([solution.y[0], RADIUS**2 / solution.y[0]])


def elliptical_drop(resolution: int, bench: Bench) -> Outcome:
    """Case 8: half axes, area and energy at 0.0076 s."""
    spacing = RADIUS / resolution
    bench.plan(END)
    fluid = disc(bench, spacing, minimum_time_step=1e-6)
    x, y, z = position(fluid)
    set_velocity(fluid, STRAIN * np.stack([-x, y, z]))
    first, energy = half_axes(fluid), fluid.energy().kinetic
    rows = [(0.0, *first)]
    for step in range(SAMPLES):
        bench.advance(fluid, END / SAMPLES)
        rows.append(((step + 1) * END / SAMPLES, *half_axes(fluid)))
    time, a, b = np.array(rows).T
    fine = np.linspace(0.0, END, 77)
    axes = ellipse_axes(fine)
    return Outcome(
        values={
            "b": float(b[-1]) / first[1],
            "area / first area": float(a[-1] * b[-1] / (first[0] * first[1])),
            "kinetic energy / first": fluid.energy().kinetic / energy,
        },
        traces=(
            trace("axes", 1000.0 * time, b / first[1], "b"),
            trace("axes", 1000.0 * time, a / first[0], "a"),
            trace("axes", 1000.0 * fine, axes[0], "exact", reference=True),
            trace("axes", 1000.0 * fine, axes[1], "exact", reference=True),
        ),
    )


CONSERVATION = Case(
    number=3,
    name="conservation",
    title="Conservation of momentum",
    source="Newton's laws",
    setup="1 s each: periodic box (1 m) with random velocities and a current, uniform flow in it, flow past a held square, "
    "turning disc of radius 1 m in the void",
    length=RADIUS,
    length_symbol="1 m",
    resolutions=(16, 32, 64),
    quantities=(
        Quantity(name="drift of linear momentum", unit="1", reference=0.0, scale=1.0, gate=1e-10),
        Quantity(name="drift of angular momentum", unit="1", reference=0.0, scale=1.0, gate=1e-6),
        Quantity(name="force pair on a body", unit="1", reference=0.0, scale=1.0, gate=1e-6),
        Quantity(name="change of a uniform flow", unit="1", reference=0.0, scale=1.0),
    ),
    panels=(Panel("drift", "t [s]", "relative drift", log_y=True),),
    run=conservation,
    note="linear momentum relative to the sum of m v. Velocities are stored in single precision, which would lose 1e-8; what one "
    "particle loses by rounding is given to the next.",
)

ELLIPTICAL_DROP = Case(
    number=8,
    name="elliptical-drop",
    title="Elliptical drop",
    source="energy and area of an ellipse in linear flow; the problem is that of Monaghan 1994",
    setup="disc of radius 1 m, v = (-100 x, 100 z) 1/s, inviscid, no gravity, to t = 0.0076 s",
    length=RADIUS,
    length_symbol="R",
    resolutions=(32, 64, 128),
    quantities=(
        Quantity(name="b", unit="m", reference=float(ellipse_axes(np.array([END]))[1, -1]), gate=0.005),
        Quantity(name="area / first area", unit="1", reference=1.0, gate=0.002),
        Quantity(name="kinetic energy / first", unit="1", reference=1.0, gate=0.01),
    ),
    panels=(Panel("axes", "t [ms]", "half axis [m]"),),
    run=elliptical_drop,
    note="half axes are those of the ellipse with the particles' second moments. The smallest step is lowered to 1e-6 s.",
)
