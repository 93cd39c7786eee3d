"""Cases 4, 5 and 12: what viscosity the fluid really has. Shear wave and Taylor-Green vortices in a periodic box."""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from oilsim import Fluid, block
from oilsim.viscosity.viscous_system import implicit_share
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace
from tests.validation.measure import decay_rate, mode_amplitude
from tests.validation.scenes import liquid, periodic_box, position, set_velocity, velocity

Double = NDArray[np.float64]

SIDE = 1.0  # m
STEP = 0.01  # s
SEED = 1
STIR_SPEED, STIR_TIME = 0.5, 1.0  # m/s, s


def stirred_points(bench: Bench, spacing: float) -> Double:
    """A full periodic box of disordered particles (N, 3) [m]: a lattice stirred by an inviscid flow of nine vortex modes.

    A lattice at rest is no test of viscosity: the operator's error on it is that of one direction only, and rows that slide past each
    other keep their order, which no real flow does.
    """
    fluid = bench.fluid(periodic_box(SIDE, spacing, liquid()))
    fluid.add_particles(block((0, 0, 0), (SIDE, 0, SIDE), spacing, 2), phase="water")
    x, _, z = 2.0 * math.pi * position(fluid) / SIDE
    random = np.random.default_rng(SEED)
    flow = np.zeros((3, fluid.particle_count))
    for m, n in itertools.product((1, 2, 3), repeat=2):
        # stream function a cos(m X + alpha) cos(n Z + beta)
        size, alpha, beta = random.normal(), *random.uniform(0.0, 2.0 * math.pi, 2)
        flow[0] += size * n * np.cos(m * x + alpha) * np.sin(n * z + beta)
        flow[2] -= size * m * np.sin(m * x + alpha) * np.cos(n * z + beta)
    set_velocity(fluid, flow * (STIR_SPEED / np.sqrt((flow**2).sum(axis=0).mean())))
    for _ in range(round(STIR_TIME / STEP)):
        bench.advance(fluid, STEP)
    return np.mod(position(fluid).T, SIDE)


def disordered_fluid(bench: Bench, points: Double, spacing: float, viscosity: float, time_step: float = STEP) -> Fluid:
    """A fluid of `viscosity` [m2/s] at stirred `points`, at rest."""
    fluid = bench.fluid(
        periodic_box(
            SIDE, spacing, liquid(kinematic_viscosity=viscosity),
            maximum_time_step=time_step, minimum_time_step=min(1e-4, time_step),
        )
    )  # fmt: skip
    fluid.add_particles(points, phase="water")
    return fluid


def shear_mode(fluid: Fluid) -> Double:
    """v_x = sin(2 pi z / L) at the particles (3, N)."""
    mode = np.zeros((3, fluid.particle_count))
    mode[0] = np.sin(2.0 * math.pi * position(fluid)[2] / SIDE)
    return mode


def shear_amplitudes(bench: Bench, fluid: Fluid, speed: float, step: float, count: int) -> Double:
    """Amplitude (count + 1,) [m/s] of a shear wave that starts at `speed` [m/s], one value a step [s]."""
    set_velocity(fluid, speed * shear_mode(fluid))
    amplitudes = [mode_amplitude(velocity(fluid), shear_mode(fluid))]
    for _ in range(count):
        bench.advance(fluid, step)
        amplitudes.append(mode_amplitude(velocity(fluid), shear_mode(fluid)))
    return np.array(amplitudes)


NUMBERS = (0.1, 1.0, 10.0, 100.0, 1000.0)  # nu dt / d^2
VISCOSITIES = (1e-4, 1e-3, 1e-2)  # m2/s
WAVE_NUMBER = 2.0 * math.pi / SIDE


def implicit_ratio(bench: Bench, points: Double, spacing: float, number: float) -> float:
    """Measured over set viscosity of slow shear at nu dt / d^2 = `number`, from the decay of every step."""
    viscosity = number * spacing**2 / (bench.step_share * STEP)
    fluid = disordered_fluid(bench, points, spacing, viscosity)
    per_step = viscosity * WAVE_NUMBER**2 * bench.step_share * STEP
    count = max(1, min(20, math.floor(math.log(1e3) / math.log1p(per_step))))
    amplitudes = shear_amplitudes(bench, fluid, 0.01, STEP, count)
    # an exact step leaves (1 - (1 - theta) q) / (1 + theta q), q = nu k^2 dt
    theta, left = implicit_share(number), float(amplitudes[-1] / amplitudes[0]) ** (bench.step_share / count)
    return (1.0 - left) / (1.0 - theta + theta * left) / per_step


def flowing_ratio(bench: Bench, points: Double, spacing: float, viscosity: float) -> tuple[float, Double]:
    """Measured over set viscosity of a wave of 0.1 m/s over 4 s (or three e-folds), and time with relative amplitude."""
    fluid = disordered_fluid(bench, points, spacing, viscosity)
    count = min(400, math.ceil(3.0 / (viscosity * WAVE_NUMBER**2 * STEP)))
    amplitudes = shear_amplitudes(bench, fluid, 0.1, STEP, count)
    times = STEP * np.arange(count + 1)
    return decay_rate(times, amplitudes) / (WAVE_NUMBER**2 * viscosity), np.stack([times, amplitudes / amplitudes[0]])


def shear_wave(resolution: int, bench: Bench) -> Outcome:
    """Case 4: set viscosity against the decay of a shear wave."""
    spacing = SIDE / resolution
    bench.plan(STIR_TIME + STEP * (20 * 5 + 400 * 3))
    points = stirred_points(bench, spacing)
    implicit = [implicit_ratio(bench, points, spacing, number) for number in NUMBERS]
    values = {f"nu / set, nu dt / d^2 = {n:g}": ratio for n, ratio in zip(NUMBERS, implicit, strict=True)}
    traces = [
        trace("stiffness", NUMBERS, implicit, markers=True),
        trace("stiffness", (NUMBERS[0], NUMBERS[-1]), (1, 1), "exact", reference=True),
    ]
    for viscosity in VISCOSITIES:
        ratio, curve = flowing_ratio(bench, points, spacing, viscosity)
        values[f"nu / set, U = 0.1 m/s, nu = {viscosity:g} m2/s"] = ratio
        traces += [
            trace("decay", curve[0], curve[1], f"nu {viscosity:g}"),
            trace("decay", curve[0], np.exp(-viscosity * WAVE_NUMBER**2 * curve[0]), "exact", reference=True),
        ]
    return Outcome(values=values, traces=tuple(traces))


STEPS = {"dt": STEP, "dt/2": STEP / 2, "dt/4": STEP / 4}  # s
RUN, SPEED = 2.0, 0.5  # s, m/s: one wavelength of travel


def inviscid_shear(resolution: int, bench: Bench) -> Outcome:
    """Case 5: a shear wave without viscosity, at dt, dt/2 and dt/4."""
    spacing = SIDE / resolution
    bench.plan(STIR_TIME + len(STEPS) * RUN)
    points = stirred_points(bench, spacing)
    values, traces, found = {}, [], []
    for label, step in STEPS.items():
        fluid = disordered_fluid(bench, points, spacing, 0.0, step)
        amplitudes = shear_amplitudes(bench, fluid, SPEED, step, round(RUN / step))
        times = step * np.arange(len(amplitudes))
        late = times >= 0.1 * RUN
        numerical = decay_rate(times[late], amplitudes[late]) / WAVE_NUMBER**2
        found.append(numerical / (SPEED * spacing))
        values[f"numerical viscosity / (U d), {label}"] = found[-1]
        traces.append(trace("decay", times, amplitudes / amplitudes[0], label))
    values["growth of it from dt to dt/4, / (U d)"] = max(0.0, abs(found[2]) - abs(found[0]))
    times = np.linspace(0.0, RUN, 50)
    gate = np.exp(-0.005 * SPEED * spacing * WAVE_NUMBER**2 * times)
    traces.append(trace("decay", times, gate, "gate 0.005 U d", reference=True))
    return Outcome(values=values, traces=tuple(traces))


REYNOLDS = (100.0, 1000.0)
VORTEX_SPEED = 1.0  # m/s
VORTEX_RUN = 2.0  # s


def vortex_mode(fluid: Fluid) -> Double:
    """v = (-cos X sin Z, sin X cos Z), X = 2 pi x / L, Z = 2 pi z / L, at the particles (3, N)."""
    x, _, z = 2.0 * math.pi * position(fluid) / SIDE
    return np.stack([-np.cos(x) * np.sin(z), np.zeros_like(x), np.sin(x) * np.cos(z)])


def vortices(bench: Bench, spacing: float, viscosity: float, longest_step: float = STEP) -> Double:
    """Time [s] and amplitude / U (2, n) of Taylor-Green vortices that start on a lattice."""
    phase = liquid(kinematic_viscosity=viscosity)
    fluid = bench.fluid(periodic_box(SIDE, spacing, phase, maximum_time_step=longest_step))
    fluid.add_particles(block((0, 0, 0), (SIDE, 0, SIDE), spacing, 2), phase="water")
    set_velocity(fluid, VORTEX_SPEED * vortex_mode(fluid))
    rows = [(0.0, 1.0)]
    for step in range(round(VORTEX_RUN / STEP)):
        bench.advance(fluid, STEP)
        rows.append(((step + 1) * STEP, mode_amplitude(velocity(fluid), vortex_mode(fluid)) / VORTEX_SPEED))
    return np.array(rows).T


def vortex_decay(history: Double) -> float:
    """Rate [1/s] at which the amplitude decays after the first tenth of the run, in which the lattice melts."""
    times, amplitude = history
    late = times >= 0.1 * VORTEX_RUN
    return decay_rate(times[late], amplitude[late])


def taylor_green(resolution: int, bench: Bench) -> Outcome:
    """Case 12: decay rate at Re 100 and 1000, and numerical viscosity without viscosity at dt, dt/2 and dt/4."""
    spacing = SIDE / resolution
    bench.plan((len(REYNOLDS) + len(STEPS)) * VORTEX_RUN)
    values, traces = {}, []
    for reynolds in REYNOLDS:
        history = vortices(bench, spacing, VORTEX_SPEED * SIDE / reynolds)
        exact = 8.0 * math.pi**2 / reynolds * VORTEX_SPEED / SIDE
        values[f"decay rate / exact, Re {reynolds:g}"] = vortex_decay(history) / exact
        traces += [
            trace("decay", *history, f"Re {reynolds:g}"),
            trace("decay", history[0], np.exp(-exact * history[0]), "exp(-8 pi^2 t U / (L Re))", reference=True),
        ]
    for label, step in STEPS.items():
        history = vortices(bench, spacing, 0.0, step)
        numerical = vortex_decay(history) * SIDE**2 / (8.0 * math.pi**2)
        values[f"numerical viscosity / (U d), {label}"] = numerical / (VORTEX_SPEED * spacing)
        traces.append(trace("decay", *history, f"inviscid, {label}"))
    return Outcome(values=values, traces=tuple(traces))


SHEAR_WAVE = Case(
    number=4,
    name="shear-wave",
    title="Shear wave of a set viscosity",
    source="exact steps, (1 - (1 - theta) nu k^2 dt) / (1 + theta nu k^2 dt); with U = 0.1 m/s exp(-nu k^2 t)",
    setup="v_x = U sin(2 pi z / L), L = 1 m, dt 0.01 s, disordered particles in a periodic box; U = 0.01 m/s for the first five rows",
    length=SIDE,
    length_symbol="L",
    resolutions=(16, 32, 64),
    quantities=tuple(
        Quantity(name=name, unit="1", reference=1.0, gate=0.05)
        for name in (
            *(f"nu / set, nu dt / d^2 = {n:g}" for n in NUMBERS),
            *(f"nu / set, U = 0.1 m/s, nu = {nu:g} m2/s" for nu in VISCOSITIES),
        )
    ),
    panels=(
        Panel("stiffness", "nu dt / d^2", "measured / set viscosity", log_x=True),
        Panel("decay", "t [s]", "amplitude / first amplitude"),
    ),
    run=shear_wave,
    note="viscosity_correction is 1, its default. The stretch goal is 1 %.",
)

INVISCID_SHEAR = Case(
    number=5,
    name="inviscid-shear",
    title="Shear wave without viscosity",
    source="no decay",
    setup="v_x = U sin(2 pi z / L), U = 0.5 m/s, L = 1 m, 2 s, disordered particles in a periodic box, dt 0.01 s",
    length=SIDE,
    length_symbol="L",
    resolutions=(16, 32, 64),
    quantities=(
        *(
            Quantity(name=f"numerical viscosity / (U d), {label}", unit="1", reference=0.0, scale=1.0, gate=0.005)
            for label in STEPS
        ),
        Quantity(name="growth of it from dt to dt/4, / (U d)", unit="1", reference=0.0, scale=1.0, gate=0.0005),
    ),
    panels=(Panel("decay", "t [s]", "amplitude / first amplitude"),),
    run=inviscid_shear,
    note="growth passes within a tenth of the viscosity's own gate, which is what one seed can resolve.",
)

TAYLOR_GREEN = Case(
    number=12,
    name="taylor-green",
    title="Taylor-Green vortices",
    source="exact solution of the Navier-Stokes equations, exp(-8 pi^2 t U / (L Re))",
    setup="periodic square of side L = 1 m, U = 1 m/s, 2 s, from a lattice, dt 0.01 s at most; amplitude by projection on the vortices",
    length=SIDE,
    length_symbol="L",
    resolutions=(16, 32, 64),
    quantities=(
        Quantity(name="decay rate / exact, Re 100", unit="1", reference=1.0, gate=0.005),
        Quantity(name="decay rate / exact, Re 1000", unit="1", reference=1.0, gate=0.03),
        *(
            Quantity(name=f"numerical viscosity / (U d), {label}", unit="1", reference=0.0, scale=1.0, gate=0.02)
            for label in STEPS
        ),
    ),
    panels=(Panel("decay", "t [s]", "amplitude / U"),),
    run=taylor_green,
)
