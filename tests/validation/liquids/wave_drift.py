"""Case 32: how far a wave carries water, over depth, in a tank that repeats along the wave."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from oilsim import Fluid, FluidConfig, block, tank_walls
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace
from tests.validation.liquids.waves import exact_omega
from tests.validation.measure import mode_amplitude
from tests.validation.scenes import liquid, position, set_velocity

Double = NDArray[np.float64]

DEPTH = 1.0  # m
DEPTHS_A_RADIAN = {"k h = pi": math.pi, "k h = 1.5": 1.5}
STEEPNESS = 0.15  # k a
PERIODS, SAMPLES = 3, 20  # that are followed, and samples of a period
LAYERS = 5  # in which drift is measured


class Wave:
    """A progressive wave of linear theory over still water of DEPTH: velocities at places, displacements of the particles at rest."""

    def __init__(self, number: float) -> None:
        self.number, self.omega = number, exact_omega(number, DEPTH)
        self.amplitude, self.shallow = STEEPNESS / number, math.sinh(number * DEPTH)

    def shape(self, x: Double, z: Double, phase: float) -> Double:
        """(3, N) along and up, 1 in the surface's vertical swing; the crest is at x = phase / k [m]."""
        k, angle = self.number, self.number * x - phase
        along, up = np.cosh(k * z) * np.cos(angle), np.sinh(k * z) * np.sin(angle)
        return np.stack([along, np.zeros_like(x), up]) / self.shallow

    def stokes_drift(self, z: Double) -> Double:
        """a^2 k omega cosh(2 k z) / (2 sinh^2 k h) [m/s] at heights z [m] over the floor (Stokes 1847)."""
        k, a = self.number, self.amplitude
        return 0.5 * a**2 * k * self.omega * np.cosh(2.0 * k * z) / self.shallow**2


def tank_with_wave(bench: Bench, wave: Wave, spacing: float) -> tuple[Fluid, float]:
    """A plane tank one wave long, which repeats along it, over a floor that slips; and its length [m]."""
    length = 2.0 * math.pi / wave.number
    room = 4.0 * spacing
    config = FluidConfig(
        particle_spacing=spacing, phases=(liquid(),), dimension=2, lower=(0.0, -1.0, -room), upper=(length, 1.0, 2.0 * DEPTH),
        periodic=(True, False, False),
    )  # fmt: skip
    fluid = bench.fluid(config)
    floor = ((0, 0, 0), (length, 0, DEPTH))
    fluid.add_boundary(tank_walls(*floor, spacing, sides=("-z",), periodic=(True, False, False), dimension=2))
    x, _, z = block(*floor, spacing, 2).T
    moved = wave.amplitude * wave.shape(x, z, 0.5 * math.pi)  # a quarter period behind the velocity
    fluid.add_particles(np.column_stack([(x - moved[0]) % length, 0.0 * x, z - moved[2]]), phase="water")
    set_velocity(fluid, wave.amplitude * wave.omega * wave.shape(*position(fluid)[::2], 0.0))
    return fluid, length


def carried(bench: Bench, fluid: Fluid, wave: Wave, length: float) -> tuple[Double, Double]:
    """Drift [m/s] of each particle over PERIODS, and its mean height [m], in the order of ids."""
    period = 2.0 * math.pi / wave.omega
    last, way, height = position(fluid)[0][np.argsort(fluid.particles.id)], 0.0, 0.0
    for _ in range(PERIODS * SAMPLES):
        bench.advance(fluid, period / SAMPLES)
        x, _, z = position(fluid)[:, np.argsort(fluid.particles.id)]
        way, height = way + (x - last + 0.5 * length) % length - 0.5 * length, height + z / (PERIODS * SAMPLES)
        last = x
    return np.asarray(way) / (PERIODS * period), np.asarray(height)


def amplitude_left(fluid: Fluid, wave: Wave) -> float:
    """Amplitude of the wave over the one it began with."""
    x, _, z = position(fluid)
    parts = [
        mode_amplitude(fluid.particles.velocity.astype(np.float64), wave.shape(x, z, phase))
        for phase in (0.0, 0.5 * math.pi)
    ]
    return math.hypot(*parts) / (wave.amplitude * wave.omega)


def wave_drift(resolution: int, bench: Bench) -> Outcome:
    """Case 32: drift of both waves by fifths of the depth, over the one of theory."""
    values, traces = {}, []
    bench.plan(PERIODS * sum(2.0 * math.pi / exact_omega(number, DEPTH) for number in DEPTHS_A_RADIAN.values()))
    for label, number in DEPTHS_A_RADIAN.items():
        length = round(2.0 * math.pi / number * resolution) / resolution  # a whole number of spacings
        wave = Wave(2.0 * math.pi / length)
        fluid, length = tank_with_wave(bench, wave, DEPTH / resolution)
        before = fluid.momentum()[0]
        drift, height = carried(bench, fluid, wave, length)
        theory = wave.stokes_drift(height)
        layer = np.clip((LAYERS * height / DEPTH).astype(int), 0, LAYERS - 1)
        found, expected = (np.array([each[layer == n].mean() for n in range(LAYERS)]) for each in (drift, theory))
        values |= {
            f"drift over depth / Stokes, {label}": float(drift.mean() / theory.mean()),
            f"drift of the uppermost fifth / Stokes, {label}": float(found[-1] / expected[-1]),
            f"drift of the lowest fifth off Stokes, of the mean, {label}": float(
                (found[0] - expected[0]) / theory.mean()
            ),
            f"momentum kept, {label}": float(fluid.momentum()[0] / before),
            f"amplitude lost a period, {label}": 1.0 - amplitude_left(fluid, wave) ** (1.0 / PERIODS),
        }
        middles = (np.arange(LAYERS) + 0.5) / LAYERS
        traces += [
            trace(label, found, middles, f"{resolution} spacings", markers=True),
            trace(label, wave.stokes_drift(np.linspace(0, DEPTH)), np.linspace(0, 1), "Stokes", reference=True),
        ]
    return Outcome(values=values, traces=tuple(traces))


WAVE_DRIFT = Case(
    number=32,
    name="wave-drift",
    title="How far a wave carries water",
    source="Stokes 1847: drift a^2 k omega cosh(2 k z) / (2 sinh^2 k h), as the wave begins without a current",
    setup=f"progressive waves of k a = {STEEPNESS:g} over {DEPTH:g} m, k h = pi and 1.5, in a tank one wave long that repeats; inviscid, "
    f"slipping floor; {PERIODS} periods",
    length=DEPTH,
    length_symbol="h",
    resolutions=(16, 24, 40),
    quantities=tuple(
        quantity
        for label in DEPTHS_A_RADIAN
        for quantity in (
            Quantity(name=f"drift over depth / Stokes, {label}", unit="1", reference=1.0, gate=0.1),
            Quantity(name=f"drift of the uppermost fifth / Stokes, {label}", unit="1", reference=1.0, gate=0.1),
            Quantity(
                name=f"drift of the lowest fifth off Stokes, of the mean, {label}",
                unit="1",
                reference=0.0,
                scale=1.0,
                gate=0.1,
            ),
            Quantity(name=f"momentum kept, {label}", unit="1", reference=1.0, gate=0.05),
            Quantity(name=f"amplitude lost a period, {label}", unit="1", reference=0.0, scale=1.0),
        )
    ),
    panels=tuple(Panel(label, "drift [m/s]", f"height / depth, {label}") for label in DEPTHS_A_RADIAN),
    run=wave_drift,
    note="a wave that loses amplitude leaves its momentum to a current near the surface, where it is lost. So the uppermost fifth "
    "drifts too fast, as far as the wave is lost.",
)
