"""Case 47: current and waves through the rim of a window, in the plane.

The window stays at its place while the sea goes by. Regular waves of two lengths run either way, one longer than the window; the height
at five gauges, the run of their phase and the wave that comes back (two gauges, Goda and Suzuki 1976) are those of the particles. Then a
JONSWAP sea, by the power of bands from its longest waves down to 8 spacings; a current; and ten minutes of the regular wave, after which
the mean level counts. No water sleeps, so that the particles have to keep what the sea has.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from oilsim import Phase
from oilsim.core.config import SHORTEST_WAVE
from oilsim.sea import CurrentProfile, JonswapWaves, RegularWaves, Sea, SeaDescription, SteadyFlow
from oilsim.window.settings import WindowSettings
from oilsim.window.window import Window
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, Trace, trace

Double = NDArray[np.float64]

SIZE, WATER, SEA = 6.0, 0.6, 20.0  # m: of the window, its water, and the sea's depth
HEIGHT, PERIODS = 0.1, (1.4, 2.4)  # m; s: waves of 3.1 and 9.0 m
WAVES_SEEN, SAMPLES = 6, 40  # waves of each run that count, and samples of each
SPEED, MINUTES = 0.5, 10.0  # m/s of the current; min of the long run
SIGNIFICANT, PEAK = 0.1, 2.0  # m, s of the JONSWAP sea
SERIES, STEP, BANDS = 160.0, 0.1, 5  # s: of its record and of a sample; bands of its spectrum
GAUGES = np.array([-2.6, -0.55, 0.0, 0.55, 2.6])  # m


class Gauged(NamedTuple):
    """A run: its window, times (n,) [s] and surface (n, gauges) [m] by the uppermost particles."""

    window: Window
    times: Double
    surface: Double


def gauged(description: SeaDescription, spacing: float, bench: Bench, duration: float, step: float) -> Gauged:
    """Run a window in a sea and read its gauges."""
    settings = WindowSettings(size=(SIZE, SIZE), depth=WATER, spacing=spacing, dimension=2)
    water = (Phase(name="water", rest_density=1027.0, dynamic_viscosity=1e-3),)
    window = Window(settings, Sea(description), water, bench.threads)
    times, surface = [], []
    for index in range(round(duration / step)):
        report = window.fluid.advance(step)
        bench.count(step, report.sub_steps, window.fluid.particle_count)
        now = (index + 1) * step
        top = window.places(now)[window.fluid.particles.position[2] > -spacing]
        order = np.argsort(top[:, 0])
        shift = window.motion.travel(now)[0]
        times.append(now)
        surface.append(np.interp(GAUGES + shift, top[order, 0], top[order, 2]))
    window.fluid.close()
    return Gauged(window, np.array(times), np.array(surface))


def regular(period: float, toward: float, spacing: float, bench: Bench) -> tuple[dict[str, float], Gauged]:
    """Height over the sea's, period over the sea's and reflection of a regular wave that runs toward `toward` [rad]."""
    sea = SeaDescription(depth=SEA, waves=RegularWaves(height=HEIGHT, period=period, direction=toward))
    run = gauged(sea, spacing, bench, WAVES_SEEN * period, period / SAMPLES)
    number = float(run.window.motion.sea.components.wave_number[0])
    omega, along = 2.0 * math.pi / period, number * math.cos(toward)
    # the first harmonic of each gauge, and of each wave by itself; the uppermost particles lie half a spacing deep
    turned = run.surface * np.exp(1j * omega * run.times)[:, None]
    first = 2.0 * turned.mean(axis=0) / (0.5 * HEIGHT * math.exp(-0.5 * number * spacing))
    waves = turned.reshape(WAVES_SEEN, SAMPLES, -1).mean(axis=1)
    drift = float(
        np.polyfit(np.arange(WAVES_SEEN), np.unwrap(np.angle(waves[:, 2])), 1)[0]
    )  # [rad] a wave, 0 for the sea's period
    near, far, way = first[1], first[3], float(GAUGES[3] - GAUGES[1])
    back, forth = (abs(near * np.exp(sign * 1j * along * way) - far) for sign in (1.0, -1.0))
    figures = {
        "height": float(np.abs(first).mean()),
        "period": 1.0 + drift / (2.0 * math.pi),
        "reflection": 100.0 * float(min(back, forth) / max(back, forth)),
    }
    return figures, run


def jonswap(spacing: float, bench: Bench) -> tuple[float, tuple[Trace, ...]]:
    """Largest deviation of a band's power from the sea's at the same gauges, in per cent, and both spectra."""
    waves = JonswapWaves(significant_height=SIGNIFICANT, peak_period=PEAK, seed=3)
    run = gauged(SeaDescription(depth=SEA, waves=waves), spacing, bench, SERIES, STEP)
    sea = run.window.motion.sea
    places = np.column_stack([GAUGES, np.zeros(len(GAUGES))])
    asked = np.array([sea.elevation(places, now) for now in run.times])
    frequency = np.fft.rfftfreq(len(run.times), STEP)
    powers = [np.abs(np.fft.rfft(one - one.mean(0), axis=0) ** 2).mean(1) for one in (run.surface, asked)]
    number = (2.0 * math.pi * frequency) ** 2 / 9.81
    powers[0] = powers[0] * np.exp(number * spacing)  # at the surface, half a spacing higher
    shortest = math.sqrt(9.81 / (2.0 * math.pi * SHORTEST_WAVE * spacing))
    edges = np.linspace(0.7 / PEAK, min(shortest, 2.0 / PEAK), BANDS + 1)
    inside = [(frequency >= low) & (frequency < high) for low, high in pairwise(edges)]
    apart = [abs(powers[0][band].sum() / powers[1][band].sum() - 1.0) for band in inside]
    seen = (frequency > 0.2 / PEAK) & (frequency < 2.5 / PEAK)
    spectra = tuple(
        trace("spectrum", frequency[seen], power[seen] / powers[1].max(), label, reference=is_sea)
        for power, label, is_sea in zip(powers, ("particles", "sea"), (False, True), strict=True)
    )
    return 100.0 * max(apart), spectra


def window_rim(resolution: int, bench: Bench) -> Outcome:
    """Case 47: all runs."""
    spacing = WATER / resolution
    bench.plan(2.0 * WAVES_SEEN * sum(PERIODS) + SERIES + 60.0 * MINUTES + 20.0)
    values: dict[str, float] = {}
    traces: list[Trace] = []
    for period in PERIODS:
        for toward, word in ((0.0, "with x"), (math.pi, "against x")):
            figures, run = regular(period, toward, spacing, bench)
            values |= {f"{name} of the wave of {period:g} s {word}": value for name, value in figures.items()}
            if toward == 0.0:
                traces.append(trace("gauge", run.times, run.surface[:, 2], f"{period:g} s"))
    values["largest deviation of a band's power"], spectra = jonswap(spacing, bench)
    current = SeaDescription(depth=SEA, current=CurrentProfile(flow=SteadyFlow(speed=SPEED)))
    run = gauged(current, spacing, bench, 20.0, 0.5)
    velocity = run.window.velocities(20.0)[:, 0]
    values["speed of the current"], values["its scatter"] = float(velocity.mean()), float(velocity.std())
    long = SeaDescription(depth=SEA, waves=RegularWaves(height=HEIGHT, period=PERIODS[0]))
    run = gauged(long, spacing, bench, 60.0 * MINUTES, 5.0)
    level = run.window.fluid.particles.position[2].mean() + 0.5 * round(WATER / spacing) * spacing
    values["mean level after ten minutes"] = float(level / spacing)
    return Outcome(values=values, traces=(*traces, *spectra))


def _of_wave(name: str, unit: str, reference: float, gate: float) -> tuple[Quantity, ...]:
    return tuple(
        Quantity(
            name=f"{name} of the wave of {period:g} s {word}", unit=unit, reference=reference, scale=1.0, gate=gate
        )
        for period in PERIODS
        for word in ("with x", "against x")
    )


WINDOW_RIM = Case(
    number=47,
    name="window-rim",
    title="Current and waves through a window",
    source="the sea's own formulas: linear waves in Lagrange's variables (Gerstner 1804; Lamb 1932, sec. 251)",
    setup=f"a window of {SIZE:g} m and D = {WATER:g} m of water in a plane, in a sea {SEA:g} m deep: waves of {HEIGHT:g} m and "
    f"{PERIODS[0]:g} and {PERIODS[1]:g} s either way, {WAVES_SEEN} of each; a JONSWAP sea of {SIGNIFICANT:g} m and {PEAK:g} s for "
    f"{SERIES:g} s; a current of {SPEED:g} m/s for 20 s; ten minutes of the shorter wave",
    length=WATER,
    length_symbol="D",
    resolutions=(4, 6, 8),
    quantities=(
        *_of_wave("height", "of the sea's", 1.0, 0.03),
        *_of_wave("period", "of the sea's", 1.0, 0.01),
        *_of_wave("reflection", "%", 0.0, 5.0),
        Quantity(name="largest deviation of a band's power", unit="%", reference=0.0, scale=1.0, gate=10.0),
        Quantity(name="speed of the current", unit="m/s", reference=SPEED, gate=0.005),
        Quantity(name="its scatter", unit="m/s", reference=0.0, scale=SPEED, gate=0.005),
        Quantity(name="mean level after ten minutes", unit="d", reference=0.0, scale=1.0, gate=0.05),
    ),
    panels=(
        Panel("gauge", "t [s]", "surface in the middle [m]"),
        Panel("spectrum", "frequency [Hz]", "power over the sea's largest [1]"),
    ),
    own_step=True,
    run=window_rim,
    spacings=1,
    note="particles carry only what differs from the sea, so these runs show what they add by themselves: noise, and the error of the map.",
)
