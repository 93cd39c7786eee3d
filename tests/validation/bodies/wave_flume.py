"""Case 56: how far waves carry water, over depth, in a closed flume between a piston and a sponge.

No water leaves a closed flume, so a current flows back against the drift of the waves. Its theory here is the uniform one, -mean u_s: the
liquid has no viscosity and the floor slips, so no boundary layer feeds vorticity into the current. The profile of Longuet-Higgins (1953)
is that of a viscous liquid after so long a time that vorticity has diffused over the depth, from the floor and from the surface.

A wave that loses amplitude gives its momentum to the water where it loses it, near the surface, while a slope of the mean level pushes back
over the whole depth. `Train.driven` is the drift that follows from the measured loss.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from coupling.multibody.prescribed_motion import UPRIGHT, OscillatingMotion
from coupling.testkit.tanks import wave_maker
from oilsim import Fluid, FluidConfig, block, solid_box, tank_walls
from oilsim.sea import Zone
from tests.seas import current_in
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace
from tests.validation.liquids.wave_drift import DEPTH, DEPTHS_A_RADIAN, LAYERS, STEEPNESS, Wave
from tests.validation.scenes import GRAVITY, disturb, liquid, position, velocity

Double = NDArray[np.float64]

WATER, SPONGE = 3.0, 1.5  # wave lengths: of the water before the sponge, of the sponge, which rises over the first one
SPONGE_TIME = 0.3  # periods: its time constant
ARRIVAL, COUNTED, RAMP = 10, 8, 2  # periods before drift is measured, while it is, and in which the stroke grows
SAMPLES = 20  # a period
OFF_LATTICE = 0.2  # spacings by which particles begin off their lattice: waves that melt it lose more
GAUGED = (
    -0.7,
    -0.3,
    0.3,
    0.7,
)  # wave lengths from the middle of the water: of the lengths over which the amplitude is measured
PISTON, HEADROOM = 4.0, 1.5  # spacings: its thickness; depths: its height


@dataclass(frozen=True)
class Train:
    """Waves that lose amplitude along a flume, as they are in its middle.

    amplitude [m]; loss [1/m]: rate at which the amplitude falls along the flume; shed [m2/s]: momentum over density that an area of the
    water has got from them so far
    """

    wave: Wave
    amplitude: float
    loss: float
    shed: float

    @property
    def mean_stokes(self) -> float:
        """Mean of Stokes' drift over depth [m/s]."""
        return self.amplitude**2 * self.wave.omega / (2.0 * math.tanh(self.wave.number * DEPTH) * DEPTH)

    def drift(self, z: Double) -> Double:
        """Stokes' drift less its mean over depth [m/s], at heights z [m] over the floor."""
        return (self.amplitude / self.wave.amplitude) ** 2 * self.wave.stokes_drift(z) - self.mean_stokes

    @property
    def driven(self) -> float:
        """Speed [m/s] of the uppermost fifth if it gets all that the waves shed, and a slope of the level pulls the whole depth back."""
        return self.shed / DEPTH * (LAYERS - 1)


def group_speed(wave: Wave) -> float:
    """Speed [m/s] at which the energy of a wave travels."""
    kh = wave.number * DEPTH
    return wave.omega / wave.number * (0.5 + kh / math.sinh(2.0 * kh))


def train(wave: Wave, places: Double, amplitudes: Double) -> Train:
    """Tell the waves from their amplitudes (n, gauges) [m], all samples of a run, at `places` (gauges,) [m] from the middle.

    Their momentum m = g a^2 / 2 c goes with groups. So an area gets -(dm/dt + c_g dm/dx), summed up from the start.
    """
    counted = slice(-COUNTED * SAMPLES, None)
    slope, middle = np.polyfit(places, np.log(amplitudes[counted].mean(axis=0)), 1)
    momentum = 0.5 * GRAVITY * amplitudes**2 * wave.number / wave.omega
    passed = np.cumsum(momentum, axis=0) * 2.0 * math.pi / wave.omega / SAMPLES
    shed = -momentum.mean(axis=1) - group_speed(wave) * np.polyfit(places, passed.T, 1)[0]
    return Train(wave, math.exp(middle), -float(slope), float(shed[counted].mean()))


class Flume:
    """A plane flume with still water, a piston on the left, which makes `wave`, and a sponge before the wall on the right."""

    def __init__(self, bench: Bench, wave: Wave, spacing: float) -> None:
        self.bench, self.length, self.period = bench, 2.0 * math.pi / wave.number, 2.0 * math.pi / wave.omega
        stroke, tall = wave.amplitude / wave_maker(self.period, DEPTH), HEADROOM * DEPTH
        back = -(math.ceil(stroke / spacing) + PISTON + 1.0) * spacing
        end = round((WATER + SPONGE) * self.length / spacing) * spacing
        room = 4.0 * spacing
        config = FluidConfig(
            particle_spacing=spacing, phases=(liquid(),), dimension=2, lower=(back - room, -1.0, -room),
            upper=(end + room, 1.0, 2.0 * DEPTH),
        )  # fmt: skip
        self.fluid = bench.fluid(config)
        self.fluid.add_boundary(tank_walls((back, 0, 0), (end, 0, tall), spacing, sides=("+x", "-z"), dimension=2))
        self.motion = OscillatingMotion(
            position=(-0.5 * PISTON * spacing, 0.0, 0.5 * tall), direction=(1.0, 0.0, 0.0), amplitude=stroke, period=self.period,
            ramp_time=RAMP * self.period,
        )  # fmt: skip
        self.piston = self.fluid.add_boundary(solid_box((PISTON * spacing, 0.0, tall), spacing, dimension=2))
        self.fluid.add_particles(block((0, 0, 0), (end, 0, DEPTH), spacing, 2), phase="water")
        disturb(self.fluid, OFF_LATTICE * spacing, seed=0)
        far, calm = 2.0 * self.length, SPONGE_TIME * self.period  # a zone that goes on past the wall is full there
        start = WATER * self.length
        zone = Zone((start, -far, -room), (end + far, far, 2.0 * DEPTH), calm, edge=self.length)
        self.fluid.add_forcing(current_in(zone, (0.0, 0.0), DEPTH))
        self.samples = 0

    def advance(self) -> None:
        """Go on by a sample. The piston goes its way between two of them at an even speed."""
        step = self.period / SAMPLES
        now, then = (np.asarray(self.motion.at((self.samples + n) * step).position) for n in (0, 1))
        self.fluid.set_boundary_motion(self.piston, now, UPRIGHT, (then - now) / step, (0.0, 0.0, 0.0))
        self.bench.advance(self.fluid, step)
        self.samples += 1

    def places(self) -> Double:
        """Positions (3, N) [m] in the order of ids."""
        return position(self.fluid)[:, np.argsort(self.fluid.particles.id)]


def amplitude_about(fluid: Fluid, wave: Wave, middle: float) -> float:
    """Amplitude [m] of the wave that goes to the right, over one of its lengths about `middle` [m], beside one that comes back."""
    x, _, z = position(fluid)
    near = np.abs(x - middle) < math.pi / wave.number
    x, z, moved = x[near], z[near], velocity(fluid)[:, near]
    there = [wave.shape(x, z, phase) for phase in (0.0, 0.5 * math.pi)]
    back = [shape * np.array([[1.0], [1.0], [-1.0]]) for shape in there]
    parts = np.linalg.lstsq(np.stack([each.ravel() for each in there + back], axis=1), moved.ravel(), rcond=None)[0]
    return math.hypot(*parts[:2]) / wave.omega


def carried(flume: Flume, wave: Wave) -> tuple[Double, Double, Train]:
    """Drift [m/s] and mean height [m] of the particles of the middle, a wave long, and the waves there."""
    begin, mean, amplitudes, middle = flume.places(), 0.0, [], 0.5 * WATER * flume.length
    for n in range((ARRIVAL + COUNTED) * SAMPLES):
        if n == ARRIVAL * SAMPLES:
            begin, mean = flume.places(), 0.0
        flume.advance()
        mean = mean + flume.places()
        amplitudes.append([amplitude_about(flume.fluid, wave, middle + share * flume.length) for share in GAUGED])
    drift = (flume.places()[0] - begin[0]) / (COUNTED * flume.period)
    x, _, z = np.asarray(mean) / (COUNTED * SAMPLES)
    inside = np.abs(x - middle) < 0.5 * flume.length
    return drift[inside], z[inside], train(wave, np.array(GAUGED) * flume.length, np.array(amplitudes))


def wave_flume(resolution: int, bench: Bench) -> Outcome:
    """Case 56: drift in the middle by fifths of the depth, beside the one of theory."""
    values, traces = {}, []
    waves = {label: Wave(number) for label, number in DEPTHS_A_RADIAN.items()}
    bench.plan((ARRIVAL + COUNTED) * sum(2.0 * math.pi / wave.omega for wave in waves.values()))
    for label, wave in waves.items():
        flume = Flume(bench, wave, DEPTH / resolution)
        drift, height, waves_there = carried(flume, wave)
        layer = np.clip((LAYERS * height / DEPTH).astype(int), 0, LAYERS - 1)
        theory = waves_there.drift(height)
        found, expected = (np.array([each[layer == n].mean() for n in range(LAYERS)]) for each in (drift, theory))
        values |= {
            f"drift of the uppermost fifth / theory, {label}": float(found[-1] / expected[-1]),
            f"the same / theory and what lost waves drive, {label}": float(
                found[-1] / (expected[-1] + waves_there.driven)
            ),
            f"drift of the lowest fifth off theory, of mean Stokes, {label}": float(found[0] - expected[0])
            / waves_there.mean_stokes,
            f"drift over depth / mean Stokes, {label}": float(drift.mean()) / waves_there.mean_stokes,
            f"amplitude in the middle / linear theory, {label}": waves_there.amplitude / wave.amplitude,
            f"amplitude lost a wave length, {label}": -math.expm1(-waves_there.loss * flume.length),
        }
        heights = np.linspace(0, DEPTH)
        traces += [
            trace(label, found, (np.arange(LAYERS) + 0.5) / LAYERS, f"{resolution} spacings", markers=True),
            trace(label, waves_there.drift(heights), heights / DEPTH, "Stokes less its mean", reference=True),
        ]
    return Outcome(values=values, traces=tuple(traces))


WAVE_FLUME = Case(
    number=56,
    name="wave-flume",
    title="How far waves carry water in a closed flume",
    source="Stokes 1847: drift of the measured amplitude, less its mean over depth: no water leaves a closed flume, and without "
    "viscosity the current that flows back is uniform",
    setup=f"piston waves of k a = {STEEPNESS:g} over {DEPTH:g} m, k h = pi and 1.5, in a plane flume {WATER + SPONGE:g} waves long, of "
    f"which the last {SPONGE:g} are a sponge; inviscid, slipping floor; particles of the middle,"
    f" from {ARRIVAL} to {ARRIVAL + COUNTED} periods",
    length=DEPTH,
    length_symbol="h",
    resolutions=(16, 20, 32),
    spacings=2,
    quantities=tuple(
        quantity
        for label in DEPTHS_A_RADIAN
        for quantity in (
            Quantity(name=f"drift of the uppermost fifth / theory, {label}", unit="1", reference=1.0, gate=0.1),
            Quantity(name=f"the same / theory and what lost waves drive, {label}", unit="1", reference=1.0),
            Quantity(
                name=f"drift of the lowest fifth off theory, of mean Stokes, {label}",
                unit="1",
                reference=0.0,
                scale=1.0,
                gate=0.1,
            ),
            Quantity(name=f"drift over depth / mean Stokes, {label}", unit="1", reference=0.0, scale=1.0, gate=0.1),
            Quantity(name=f"amplitude in the middle / linear theory, {label}", unit="1", reference=1.0),
            Quantity(name=f"amplitude lost a wave length, {label}", unit="1", reference=0.0, scale=1.0),
        )
    ),
    panels=tuple(Panel(label, "drift [m/s]", f"height / depth, {label}") for label in DEPTHS_A_RADIAN),
    run=wave_flume,
    note="a wave that loses amplitude leaves its momentum to a current near the surface. The long wave drives more than that at any "
    "spacing and step; why is not known.",
)
