"""Case 59: pressure beside edges, where a jet along a floor meets a wall, and a box as high as the jet is thick.

Both flows are steady and free of weight, and potential theory knows them: the floor is the plane of symmetry of a jet that
meets a plate square to itself (free streamlines, Kirchhoff 1869; Milne-Thomson, Theoretical Hydrodynamics, chapter 11). With the complex
velocity nu = u - i v in units of the jet's speed, the jet's thickness h, and outlets at nu = exp(+- i beta),

    dz/dnu = (4 h / pi) (1 / (nu^2 + 1) - (nu^2 + 1 - 2 cos^2 beta) / ((nu^2 + 1)^2 - (2 nu cos beta)^2)),

and p = (1 - |nu|^2) rho U^2 / 2. On the plate nu is real and runs from 0 in the corner to 1 at its edge. An endless wall has beta = 0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.optimize import brentq

from oilsim import BoundaryParticles, FluidConfig, tank_walls
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace
from tests.validation.scenes import fill, liquid

Double = NDArray[np.float64]

JET, SPEED = 1.0, 1.0  # m, m/s: thickness and speed of the jet
LENGTH = 12.0  # h, of the jet at the start
STEADY, END = 5.0, 9.0  # h / U, from which on the flow is steady, and the end of the run
READING = 0.02  # h / U between readings
SKY = 14.0  # h, the domain's height: nothing reaches it
NEAR = 3.0  # spacings from an edge
PLACES = (0.5, 1.0, 2.0, 3.0, 4.0, 6.0)  # spacings from an edge, of the curves
WALL, BOX = "endless wall", "box as high as the jet"


@dataclass(frozen=True)
class Plate:
    """The exact pressure on a plate; height [h] of the plate, infinite for an endless wall, and the angle beta [rad] of its outlet."""

    height: float
    beta: float

    def slope(self, speed: float) -> float:
        """Height over the corner for each unit of speed on the plate, dz/dnu [h]."""
        cosine, square = math.cos(self.beta), speed * speed + 1.0
        outlets = (4.0 * square - 8.0 * cosine**2) / (square**2 - (2.0 * cosine * speed) ** 2)
        return (4.0 / square - outlets) / math.pi

    def height_of(self, speed: float) -> float:
        """Height over the corner [h] at which the liquid has this speed [U]."""
        if self.beta == 0.0:
            return 4.0 / math.pi * (math.atanh(speed) + math.atan(speed))
        return float(quad(self.slope, 0.0, speed)[0])

    def pressure(self, height: float) -> float:
        """Pressure over rho U^2 / 2 at a height [h]."""
        if height >= self.height:
            return 0.0
        fastest = 1.0 - 1e-12 if self.beta == 0.0 else 1.0
        return 1.0 - brentq(lambda speed: self.height_of(speed) - height, 0.0, fastest) ** 2


def plate_of(height: float) -> Plate:
    """The plate of a height [h]."""
    if math.isinf(height):
        return Plate(height, 0.0)
    beta = brentq(lambda beta: Plate(height, beta).height_of(1.0) - height, 1e-3, 0.5 * math.pi - 1e-3)
    return Plate(height, float(beta))


def standing_box(height: float, spacing: float) -> BoundaryParticles:
    """The outer two layers of a box 0 < x < 1, 0 < z < height [m] that stands on a floor."""
    x, z = ((np.arange(round(side / spacing)) + 0.5) * spacing for side in (1.0, height))
    place = np.stack(np.meshgrid(x, [0.0], z, indexing="ij"), axis=-1).reshape(-1, 3)
    depth = np.minimum(np.minimum(place[:, 0], 1.0 - place[:, 0]), height - place[:, 2])
    place = place[depth < 2.0 * spacing]
    count = len(place)
    return BoundaryParticles(
        name="box", position=place, volume=np.full(count, spacing**2), area=np.full(count, spacing)
    )


def readings(bench: Bench, spacing: float, plate: Plate, places: Double) -> Double:
    """Mean steady pressure over rho U^2 / 2 at places (n, 3) [m]."""
    room, open_above = 4.0 * spacing, math.isinf(plate.height)
    far = LENGTH + 3.0
    right = 0.0 if open_above else 4.0
    fluid = bench.fluid(
        FluidConfig(
            particle_spacing=spacing, phases=(liquid(),), dimension=2, gravity=(0.0, 0.0, 0.0), lower=(-far, -1.0, -room),
            upper=(right + room, 1.0, SKY),
        )
    )  # fmt: skip
    sides = ("-z", "+x") if open_above else ("-z",)
    fluid.add_boundary(tank_walls((-far, 0, 0), (right, 0, SKY), spacing, sides=sides, dimension=2))
    if not open_above:
        fluid.add_boundary(standing_box(plate.height, spacing))
    count = len(fill(fluid, (-LENGTH, 0), (0, JET)))
    fluid.set_velocities(np.tile([[SPEED], [0.0], [0.0]], count))
    rows = []
    for step in range(round(END / READING)):
        bench.advance(fluid, READING)
        if (step + 1) * READING > STEADY:
            rows.append(fluid.pressure_at(places))
    return np.mean(rows, axis=0) / (0.5 * 1000.0 * SPEED**2)


def corner_jet(resolution: int, bench: Bench) -> Outcome:
    """Case 59: readings 3 spacings from the floor on both plates, and 3 spacings below the box's upper edge, over theory."""
    spacing, values, traces = JET / resolution, {}, []
    bench.plan(2.0 * END)
    for name, height in ((WALL, math.inf), (BOX, JET)):
        plate = plate_of(height)
        heights = [place * spacing for place in PLACES]
        if plate.height < math.inf:
            heights += [
                height - place * spacing for place in reversed(PLACES) if height - place * spacing > heights[-1]
            ]
        found = readings(bench, spacing, plate, np.array([(0.0, 0.0, z) for z in heights]))
        exact = np.array([plate.pressure(z) for z in heights])
        values[f"pressure / theory, {NEAR:g} spacings over the floor, {name}"] = _at(
            NEAR * spacing, heights, found / exact
        )
        if plate.height < math.inf:
            values[f"pressure / theory, {NEAR:g} spacings below the edge, {name}"] = _at(
                height - NEAR * spacing, heights, found / exact
            )
        traces += [
            trace(name, heights, found, f"{resolution} spacings", markers=True),
            trace(name, heights, exact, "theory", reference=True),
        ]
    return Outcome(values=values, traces=tuple(traces))


def _at(height: float, heights: list[float], values: Double) -> float:
    return float(values[np.argmin(np.abs(np.array(heights) - height))])


CORNER_JET = Case(
    number=59,
    name="corner-jet",
    title="Pressure beside edges: a jet along a floor meets a wall and a box",
    source="free streamlines (Kirchhoff 1869; Milne-Thomson, Theoretical Hydrodynamics)",
    setup=f"jet h = {JET:g} m thick, {SPEED:g} m/s, without weight or viscosity, slipping walls, plane; "
    f"mean from {STEADY:g} to {END:g} h/U",
    length=JET,
    length_symbol="h",
    resolutions=(8, 16, 32),
    quantities=(
        *(
            Quantity(
                name=f"pressure / theory, {NEAR:g} spacings over the floor, {name}", unit="1", reference=1.0, gate=0.07
            )
            for name in (WALL, BOX)
        ),
        Quantity(
            name=f"pressure / theory, {NEAR:g} spacings below the edge, {BOX}", unit="1", reference=1.0, gate=0.07
        ),
    ),
    panels=tuple(Panel(name, "z / h", f"2 p / (rho U^2), {name}") for name in (WALL, BOX)),
    run=corner_jet,
    note="readings by Fluid.pressure_at on the wall. Nearer than 2 spacings to the box's upper edge they are too small: theory falls to 0 "
    "there like the root of the distance.",
)
