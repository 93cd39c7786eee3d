"""Plane drops without weight in another fluid that fills a box: the exact rate at which they swing, and what a run of one measures."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root
from scipy.special import ive, kve

from coupling.testkit.body_checks import fit_damped_cosine
from oilsim import Fluid, FluidConfig, Phase
from tests.validation.case import Bench, Trace, trace
from tests.validation.scenes import position, velocity

Double = NDArray[np.float64]

BOX = 6.0  # R, side of the box
RESTING, DISORDER, SEED = 2.5, 0.1, 1  # capillary times, d
STRETCH, SWINGS = 0.05, 2.0  # of the drop's axes, periods
SHORTEST = 1e-6  # s; the lighter of two fluids swings fast


@dataclass(frozen=True)
class Drop:
    """A drop of `inner` in `outer`, `radius` [m]; one of the two has the tension of the interface."""

    inner: Phase
    outer: Phase
    radius: float

    @property
    def tension(self) -> float:
        """Tension of the interface [N/m]."""
        return abs(self.inner.interfacial_tension - self.outer.interfacial_tension)

    @property
    def capillary_time(self) -> float:
        """Time [s] sqrt((rho_1 + rho_2) R^3 / sigma)."""
        return math.sqrt((self.inner.rest_density + self.outer.rest_density) * self.radius**3 / self.tension)

    def fluid(self, bench: Bench, resolution: int, stretch: float, disorder: float) -> Fluid:
        """The drop, `resolution` spacings of radius, in a box that repeats; its axes differ from the radius by `stretch` [1]."""
        cells = round(BOX * resolution)
        spacing, half = BOX * self.radius / cells, 0.5 * BOX * self.radius
        config = FluidConfig(
            particle_spacing=spacing, phases=(self.outer, self.inner), dimension=2, lower=(-half, -1.0, -half), upper=(half, 1.0, half),
            periodic=(True, False, True), gravity=(0.0, 0.0, 0.0), minimum_time_step=SHORTEST,
        )  # fmt: skip
        fluid = bench.fluid(config)
        axis = (np.arange(cells) + 0.5) * spacing - half
        x, z = (grid.ravel() for grid in np.meshgrid(axis, axis, indexing="ij"))
        points = np.stack([x, np.zeros_like(x), z], axis=1)
        points[:, ::2] += np.random.default_rng(SEED).normal(0.0, disorder * spacing, (len(x), 2))
        inside = np.hypot(points[:, 0] / (1.0 + stretch), points[:, 2] * (1.0 + stretch)) < self.radius
        fluid.add_particles(points[inside], phase=self.inner.name)
        fluid.add_particles(points[~inside], phase=self.outer.name)
        return fluid

    def swinging(self, mode: int) -> complex:
        """Rate s [1/s] at which the drop swings in `mode`, exact for small swings in unbounded fluid.

        The stream function is A r^n + B I_n(q_1 r) inside and C r^-n + D K_n(q_2 r) outside, q^2 = rho s / mu. Velocities and the shear
        stress are continuous, and the normal stress jumps by sigma (n^2 - 1) / R^2 times the interface's way (after Prosperetti 1980,
        in the plane). Without viscosity it is s^2 = -n (n^2 - 1) sigma / ((rho_1 + rho_2) R^3) (Lamb 1932, art. 275).
        """
        inertia = self.inner.rest_density + self.outer.rest_density
        inviscid = math.sqrt(mode * (mode**2 - 1) * self.tension / (inertia * self.radius**3))

        def excess(parts: Double) -> list[float]:
            determinant = np.linalg.det(self._conditions(mode, complex(*parts) * inviscid))
            return [determinant.real, determinant.imag]

        return complex(*root(excess, [-0.03, 1.0], tol=1e-13).x) * inviscid

    def _conditions(self, n: int, s: complex) -> NDArray[np.complex128]:
        """The four conditions at the interface for A R^n, B I_n, C R^-n and D K_n, each row divided by its largest entry."""
        inner, outer, size = self.inner, self.outer, self.radius
        thick, thin = inner.dynamic_viscosity, outer.dynamic_viscosity
        x, y = (size * np.sqrt(s * each.rest_density / each.dynamic_viscosity) for each in (inner, outer))
        slopes = np.array(
            [n, n + x * ive(n + 1, x) / ive(n, x), -n, -n - y * kve(n - 1, y) / kve(n, y)]
        )  # R psi' / psi
        bends = np.array([n * n, x * x + n * n, n * n, y * y + n * n]) - slopes  # R^2 psi'' / psi, by Bessel's equation
        shear = np.array([thick, thick, -thin, -thin]) * (slopes - bends - n * n)
        pull = self.tension * (n * n - 1) / (size * s)
        normal = np.zeros(4, complex)
        normal[:2] = n * (2.0 * (thin - thick) * (slopes[:2] - 1.0) - pull)
        normal[[0, 2]] -= s * size**2 * np.array([inner.rest_density, outer.rest_density])
        rows = np.array([[1.0, 1.0, -1.0, -1.0], slopes * (1.0, 1.0, -1.0, -1.0), shear, normal])
        return rows / np.abs(rows).max(axis=1, keepdims=True)


def jump(fluid: Fluid, radius: float) -> float:
    """Mean pressure [Pa] inside a drop less that outside, 4 spacings from its edge."""
    place = position(fluid).T
    distance, room = np.hypot(place[:, 0], place[:, 2]), 4.0 * fluid.config.particle_spacing
    inside, outside = place[distance < radius - room], place[distance > radius + room]
    return float(fluid.pressure_at(inside).mean() - fluid.pressure_at(outside[::8]).mean())


def rest(bench: Bench, drop: Drop, resolution: int) -> tuple[float, float, float]:
    """Pressure jump over sigma / R, and fastest particle of the drop and of what is around it over sigma / mu, at rest.

    All are means of the last two fifths; mu is the drop's.
    """
    fluid = drop.fluid(bench, resolution, 0.0, DISORDER)
    jumps, speeds = [], []
    for step in range(25):
        bench.advance(fluid, 0.04 * RESTING * drop.capillary_time)
        if step >= 15:
            own = fluid.particles.phase == fluid.config.phase_index(drop.inner.name)
            speed = np.sqrt(np.square(velocity(fluid)).sum(axis=0))
            jumps.append(jump(fluid, drop.radius))
            speeds.append((speed[own].max(), speed[~own].max()))
    radius = math.sqrt(np.count_nonzero(own) * fluid.config.rest_volume / math.pi)
    fluid.close()
    inner, outer = np.mean(speeds, axis=0) * drop.inner.dynamic_viscosity / drop.tension
    return float(np.mean(jumps)) * radius / drop.tension, float(inner), float(outer)


def swing(bench: Bench, drop: Drop, resolution: int) -> tuple[dict[str, float], tuple[Trace, ...]]:
    """Period and decay over theory of a drop that is let go as an ellipse, with its flattening (<x^2> - <z^2>) / (<x^2> + <z^2>)."""
    fluid = drop.fluid(bench, resolution, STRETCH, 0.0)
    theory = drop.swinging(2)
    period = 2.0 * math.pi / theory.imag
    rows = []
    for _ in range(round(30 * SWINGS)):
        bench.advance(fluid, period / 30.0)
        liquid = fluid.phase_positions(drop.inner.name).astype(np.float64)
        across, high = liquid[:, 0].var(), liquid[:, 2].var()
        rows.append((fluid.time, (across - high) / (across + high)))
    fluid.close()
    time, flattening = np.array(rows).T
    fit = fit_damped_cosine(time, flattening, period)
    exact = flattening[0] / (np.exp(theory.real * time[0]) * np.cos(theory.imag * time[0]))
    exact = exact * np.exp(theory.real * time) * np.cos(theory.imag * time)
    values = {"period over theory": fit.period / period, "decay over theory": fit.rate / -theory.real}
    return values, (
        trace("swing", time / period, flattening),
        trace("swing", time / period, exact, "theory", reference=True),
    )
