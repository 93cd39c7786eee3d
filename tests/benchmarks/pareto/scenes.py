"""The scenes: geometry, liquid and what is measured, with nothing that belongs to one solver. SI units, z up.

| scene    | quantity | reference |
|---|---|---|
| column   | pressure at a tenth of the depth; rms speed | rho g z; 0 |
| dam      | front of a collapsing column | Martin and Moyce (1952) |
| shear    | viscosity of an inviscid shear wave, periodic | 0 |
| vortices | viscosity of an inviscid Taylor-Green cell between frictionless walls | 0 |
| viscous  | the same cell with a set viscosity | exp(-2 nu k^2 t) |
| box      | draft of a floating box | Archimedes |
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from oilsim import block
from tests.benchmarks.pareto.measures import (
    GRAVITY,
    Double,
    Sample,
    dam_front_error,
    mode_viscosity,
    pressure_error,
    rms_speed,
    surface_level,
)

Vector = tuple[float, float, float]
Samples = Sequence[Sample]
DENSITY = 1000.0  # kg/m3


@dataclass(frozen=True, kw_only=True)
class Body:
    """A free box: edge lengths [m], density [kg/m3], initial centre [m]."""

    size: Vector
    density: float
    center: Vector

    @property
    def mass(self) -> float:
        """Mass [kg]."""
        return self.density * math.prod(self.size)


@dataclass(frozen=True, kw_only=True)
class Scene:
    """One scene at any spacing.

    lower, upper         inside of the tank, or the domain where it is periodic [m]
    fill                 upper corner of the block of liquid that stands on `lower` [m]
    spacings             particle spacings [m], coarse to fine; `reference` is the one at which other settings are varied
    duration, interval   simulated time and time between samples [s]
    kinematic_viscosity  [m2/s]
    velocity             initial velocity (N, 3) [m/s] at positions (N, 3) [m]
    disorder             standard deviation of the first positions about their lattice, in spacings: on an exact lattice rows
                         of particles slide past each other and no error shows
    probes               where pressure is read (K, 3) [m]
    measures             error by name, from the samples and the spacing [m]
    """

    name: str
    title: str
    lower: Vector
    upper: Vector
    fill: Vector
    spacings: tuple[float, ...]
    reference: float
    duration: float
    measures: Mapping[str, Callable[[Samples, float], float]]
    interval: float = 0.02
    dimension: int = 2
    open_top: bool = True
    periodic: bool = False
    gravity: float = GRAVITY
    kinematic_viscosity: float = 0.0
    velocity: Callable[[Double], Double] = np.zeros_like
    probes: Sequence[Vector] = field(default_factory=tuple)
    disorder: float = 0.0
    body: Body | None = None

    def particles(self, spacing: float) -> Double:
        """Lattice of the liquid's particles (N, 3) [m], without what the body displaces."""
        points = block(self.lower, self.fill, spacing, self.dimension)
        if self.disorder:
            shift = np.random.default_rng(0).normal(0.0, self.disorder * spacing, points.shape)
            shift[:, 1] *= self.dimension == 3
            points = np.clip(points + shift, self.lower, self.fill)
        if self.body is None:
            return points
        beside = np.abs(points - self.body.center) > 0.5 * np.array(self.body.size) + 0.49 * spacing
        return points[beside.any(axis=1)]


def column() -> Scene:
    """Water at rest, 1 m deep."""
    depth, width, height = 1.0, 1.0, 0.1
    expected = DENSITY * GRAVITY * (depth - height)
    return Scene(
        name="column", title="still column", lower=(0.0, 0.0, 0.0), upper=(width, 0.0, 1.5), fill=(width, 0.0, depth),
        spacings=(0.1, 0.05, 0.025, 1 / 60), reference=0.05, duration=4.0,
        probes=tuple((share * width, 0.0, height) for share in (0.25, 0.5, 0.75)),
        measures={
            "pressure error": lambda samples, d: pressure_error(samples, expected),
            "rms speed / sqrt(g H)": lambda samples, d: rms_speed(samples) / math.sqrt(GRAVITY * depth),
        },
    )  # fmt: skip


def dam() -> Scene:
    """A column twice as high as wide collapses; compared until the front has run five widths."""
    width, limit = 0.5, 6.0
    return Scene(
        name="dam", title="dam break", lower=(0.0, 0.0, 0.0), upper=(9.0 * width, 0.0, 1.5), fill=(width, 0.0, 2.0 * width),
        spacings=(0.05, 0.025, 0.0125), reference=0.025, duration=0.96, interval=0.01,
        measures={"front error (RMS)": lambda samples, d: dam_front_error(samples, width, d, limit)},
    )  # fmt: skip


def shear() -> Scene:
    """u_x = U sin(2 pi z) in a periodic square of 1 m, no viscosity."""
    speed, k = 0.5, 2.0 * math.pi

    def wave(position: Double) -> Double:
        return np.sin(k * position[:, 2:]) * (speed, 0.0, 0.0)

    return Scene(
        name="shear", title="shear wave, inviscid", lower=(0.0, 0.0, 0.0), upper=(1.0, 0.0, 1.0), fill=(1.0, 0.0, 1.0),
        spacings=(0.1, 0.05, 0.025), reference=0.05, duration=2.0, open_top=False, periodic=True, gravity=0.0,
        velocity=wave, disorder=0.1,
        measures={"numerical viscosity / (U L)": lambda samples, d: abs(_viscosity(samples, wave, k**2)) / speed},
    )  # fmt: skip


def _cell(speed: float) -> Callable[[Double], Double]:
    """One Taylor-Green cell that fills a square of 1 m: no flow through its sides, no shear on them."""

    def cell(position: Double) -> Double:
        x, _, z = math.pi * position.T
        still = np.zeros_like(x)
        return speed * np.stack([np.sin(x) * np.cos(z), still, -np.cos(x) * np.sin(z)], axis=1)

    return cell


def _viscosity(samples: Samples, mode: Callable[[Double], Double], wave_number_squared: float) -> float:
    return mode_viscosity(samples, [mode(sample.position) for sample in samples], wave_number_squared)


def vortices(name: str = "vortices", viscosity: float = 0.0) -> Scene:
    """A Taylor-Green cell in a closed square of 1 m: inviscid, or of a set kinematic viscosity [m2/s]."""
    speed, k_squared = 0.5, 2.0 * math.pi**2
    cell = _cell(speed)

    def relative(samples: Samples, spacing: float) -> float:
        return abs(_viscosity(samples, cell, k_squared) / viscosity - 1.0)

    def numerical(samples: Samples, spacing: float) -> float:
        return abs(_viscosity(samples, cell, k_squared)) / speed

    return Scene(
        name=name, title=f"vortex cell, nu {viscosity:g} m2/s" if viscosity else "vortex cell, inviscid",
        lower=(0.0, 0.0, 0.0), upper=(1.0, 0.0, 1.0), fill=(1.0, 0.0, 1.0), spacings=(0.1, 0.05, 0.025), reference=0.05,
        duration=2.0, open_top=False, gravity=0.0, kinematic_viscosity=viscosity, velocity=cell,
        measures={"viscosity error": relative} if viscosity else {"numerical viscosity / (U L)": numerical},
    )  # fmt: skip


def floating_box() -> Scene:
    """A flat box of half the water's density, which floats upright; draft under the level beside it."""
    body = Body(size=(0.4, 0.4, 0.2), density=0.5 * DENSITY, center=(0.0, 0.0, 0.4))
    archimedes = body.size[2] * body.density / DENSITY

    def draft_error(samples: Samples, spacing: float) -> float:
        drafts = []
        for sample in samples[len(samples) // 2 :]:
            away = (np.abs(sample.position[:, :2]) > 0.5 * body.size[0] + spacing).any(axis=1)
            level = surface_level(sample.position[away], spacing)
            drafts.append(level - sample.body_height + 0.5 * body.size[2])
        return abs(float(np.mean(drafts)) / archimedes - 1.0)

    return Scene(
        name="box", title="floating box", lower=(-0.4, -0.4, 0.0), upper=(0.4, 0.4, 0.7), fill=(0.4, 0.4, 0.4), dimension=3,
        spacings=(1 / 15, 0.05, 0.04), reference=0.05, duration=2.4, interval=0.02, body=body,
        measures={"draft error": draft_error},
    )  # fmt: skip


SCENES: Mapping[str, Callable[[], Scene]] = {
    "column": column,
    "dam": dam,
    "shear": shear,
    "vortices": vortices,
    "viscous": lambda: vortices("viscous", 0.01),
    "box": floating_box,
}
