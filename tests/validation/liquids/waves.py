"""Cases 13 and 16: standing waves, at the free surface and at an interface."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from coupling.testkit.body_checks import DampedCosine, fit_damped_cosine
from oilsim import Fluid
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace
from tests.validation.measure import mode_amplitude
from tests.validation.scenes import (
    GRAVITY,
    OIL_DENSITY,
    SAMPLE,
    WATER_DENSITY,
    fill,
    liquid,
    masses,
    oil_and_water,
    open_tank,
    position,
    set_velocity,
    velocity,
)

Double = NDArray[np.float64]
Mode = Callable[[Fluid], Double]

SETTLING = 1.0  # s


def swing(bench: Bench, fluid: Fluid, mode: Mode, speed: float, duration: float) -> Double:
    """Set the fluid in motion along `mode` with `speed` [m/s]; time [s] and amplitude [m/s] (2, n) of the mode."""
    for _ in range(round(SETTLING / SAMPLE)):
        bench.advance(fluid, SAMPLE)
    set_velocity(fluid, speed * mode(fluid))
    rows = []
    for step in range(round(duration / SAMPLE)):
        bench.advance(fluid, SAMPLE)
        rows.append(((step + 1) * SAMPLE, mode_amplitude(velocity(fluid), mode(fluid), masses(fluid))))
    return np.array(rows).T


def surface_mode(wave_number: float, depth: float) -> Mode:
    """Velocity of a standing wave k [1/m] in water of `depth` [m] under flat water, 1 where the surface rises fastest.

    v = grad phi, phi = cosh(k z) cos(k x) / (k sinh(k h)).
    """

    def mode(fluid: Fluid) -> Double:
        x, _, z = position(fluid) * wave_number
        scale = 1.0 / math.sinh(wave_number * depth)
        return scale * np.stack([-np.cosh(z) * np.sin(x), np.zeros_like(x), np.sinh(z) * np.cos(x)])

    return mode


def exact_omega(wave_number: float, depth: float) -> float:
    """omega = sqrt(g k tanh k h) [1/s], linear waves."""
    return math.sqrt(GRAVITY * wave_number * math.tanh(wave_number * depth))


STEEPNESS = 0.05  # k a, a the amplitude of the surface: its square / 8 is the period's error of linear theory, 0.03 %
PERIODS = 6


def water_wave(bench: Bench, wave_number: float, depth: float, spacing: float) -> tuple[DampedCosine, Double]:
    """Fit and amplitude history of a standing wave in a tank 1 m wide."""
    omega = exact_omega(wave_number, depth)
    fluid, _ = open_tank(bench, 1.0, depth, spacing, (liquid(),))
    fill(fluid, (0, 0), (1.0, depth))
    speed = STEEPNESS / wave_number * omega
    history = swing(bench, fluid, surface_mode(wave_number, depth), speed, PERIODS * 2.0 * math.pi / omega)
    return fit_damped_cosine(history[0], history[1], 2.0 * math.pi / omega), history / [[1.0], [speed]]


def standing_wave(resolution: int, bench: Bench) -> Outcome:
    """Case 13: k = pi, h = 1 m and k = 2 pi, h = 0.5 m."""
    values, traces = {}, []
    waves = ((math.pi, 1.0, "k = pi"), (2.0 * math.pi, 0.5, "k = 2 pi"))
    bench.plan(sum(SETTLING + PERIODS * 2.0 * math.pi / exact_omega(k, h) for k, h, _ in waves))
    for wave_number, depth, label in waves:
        fit, history = water_wave(bench, wave_number, depth, 1.0 / resolution)
        values |= {f"period, {label}": fit.period, f"amplitude lost a period, {label}": fit.loss}
        exact = np.cos(exact_omega(wave_number, depth) * history[0])
        traces += [trace(label, *history), trace(label, history[0], exact, "linear theory, no loss", reference=True)]
    return Outcome(values=values, traces=tuple(traces))


INTERFACE_NUMBER = 2.0 * math.pi  # 1/m
LAYER = 0.5  # m
INTERFACE_PERIODS = 2.5


def interface_roots() -> tuple[float, float]:
    """omega [1/s] of the surface and of the interfacial mode of oil over water under a free surface.

    (R + c^2) omega^4 - 2 c g k omega^2 + (1 - R) (g k)^2 = 0, R = rho_o / rho_w, c = coth(k h) of both layers (Lamb 1932, art. 231).
    """
    ratio, gk = OIL_DENSITY / WATER_DENSITY, GRAVITY * INTERFACE_NUMBER
    c = 1.0 / math.tanh(INTERFACE_NUMBER * LAYER)
    slow, fast = sorted(np.roots([ratio + c * c, -2.0 * c * gk, (1.0 - ratio) * gk**2]))
    return math.sqrt(fast), math.sqrt(slow)


def interface_mode(fluid: Fluid) -> Double:
    """Velocity of the interfacial mode at the particles (3, N), 1 where the interface rises fastest.

    Water: w = sinh(k z) / sinh(k h) cos(k x). Oil, zeta above the interface: w = (cosh k zeta + B sinh k zeta) cos(k x), where the
    free surface, omega^2 w_z = g k^2 w, gives B = (t - r) / (r t - 1), t = tanh k h, r = g k / omega^2.
    """
    k, omega = INTERFACE_NUMBER, interface_roots()[1]
    x, _, z = position(fluid)
    sh, ch = math.sinh(k * LAYER), math.cosh(k * LAYER)
    r = GRAVITY * k / omega**2
    b = (sh - r * ch) / (r * sh - ch)
    above = k * (z - LAYER)
    oil = fluid.particles.phase == 0
    w = np.where(oil, np.cosh(above) + b * np.sinh(above), np.sinh(k * z) / sh)
    u = -np.where(oil, np.sinh(above) + b * np.cosh(above), np.cosh(k * z) / sh)
    return np.stack([u * np.sin(k * x), np.zeros_like(x), w * np.cos(k * x)])


def interface_wave(resolution: int, bench: Bench) -> Outcome:
    """Case 16: oil 840 over water 1027, k = 2 pi, layers of 0.5 m, under a free surface."""
    spacing, omega = LAYER / resolution, interface_roots()[1]
    duration = INTERFACE_PERIODS * 2.0 * math.pi / omega
    bench.plan(SETTLING + duration)
    fluid, _ = open_tank(bench, 0.5, 2.0 * LAYER, spacing, oil_and_water())
    fill(fluid, (0, 0), (0.5, LAYER))
    fill(fluid, (0, LAYER), (0.5, 2.0 * LAYER), "oil")
    speed = STEEPNESS / INTERFACE_NUMBER * omega
    history = swing(bench, fluid, interface_mode, speed, duration)
    fit = fit_damped_cosine(history[0], history[1], 2.0 * math.pi / omega)
    return Outcome(
        values={"period": fit.period, "amplitude lost a period": fit.loss},
        traces=(
            trace("wave", history[0], history[1] / speed),
            trace("wave", history[0], np.cos(omega * history[0]), "linear theory, no loss", reference=True),
        ),
    )


STANDING_WAVE = Case(
    number=13,
    name="standing-wave",
    title="Standing waves",
    source="linear waves, T = 2 pi / sqrt(g k tanh k h)",
    setup="tank 1 m wide, water 1 m (k = pi) and 0.5 m (k = 2 pi) deep, inviscid, k a = 0.05, 6 periods after 1 s of rest",
    length=1.0,
    length_symbol="1 m",
    resolutions=(32, 64, 128),
    quantities=(
        Quantity(name="period, k = pi", unit="s", reference=1.13392, gate=0.003),
        Quantity(name="amplitude lost a period, k = pi", unit="1", reference=0.0, scale=1.0, gate=0.03),
        Quantity(name="period, k = 2 pi", unit="s", reference=0.80180, gate=0.003),
        Quantity(name="amplitude lost a period, k = 2 pi", unit="1", reference=0.0, scale=1.0, gate=0.03),
    ),
    panels=(
        Panel("k = pi", "t [s]", "modal velocity / the one set"),
        Panel("k = 2 pi", "t [s]", "modal velocity / the one set"),
    ),
    run=standing_wave,
    note="the two tanks are similar under Froude's law, the second has half the particles a depth. Damped cosine fitted to the velocity's "
    "projection on the mode.",
)

INTERFACE_WAVE = Case(
    number=16,
    name="interface-wave",
    title="Interfacial wave of oil over water",
    source="two-layer dispersion relation under a free surface (Lamb 1932, art. 231)",
    setup="oil 840 over water 1027, layers 0.5 m, tank 0.5 m wide, k = 2 pi, k a = 0.05, inviscid, 2.5 periods after 1 s of rest",
    length=LAYER,
    length_symbol="h",
    resolutions=(16, 32, 64),
    quantities=(
        Quantity(name="period", unit="s", reference=2.5340, gate=0.01),
        Quantity(name="amplitude lost a period", unit="1", reference=0.0, scale=1.0),
    ),
    panels=(Panel("wave", "t [s]", "modal velocity / the one set"),),
    run=interface_wave,
    note="the reference of 2.5340 s is that of a free surface above the oil; under a rigid lid it would be 2.5335 s.",
)
