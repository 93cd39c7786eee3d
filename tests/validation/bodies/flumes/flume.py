"""A plane flume with a skirt that holds oil in a current, for cases 23, 45 and 60.

The flume repeats along x. A zone at its beginning renews the current, the skirt hangs towards its end.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from oilsim import Fluid, FluidConfig, Phase, block, solid_box, tank_walls
from oilsim.sea import SeaForcing, Zone
from tests.seas import current_in
from tests.validation.case import Bench
from tests.validation.scenes import GRAVITY, WATER_DENSITY

Double = NDArray[np.float64]

OIL_VISCOSITY, WATER_VISCOSITY = 0.01, 1.05e-3  # Pa s
Hang = Callable[[Fluid, Double], NDArray[np.bool_]]  # adds a boom, and tells which of points (n, 3) [m] it leaves

SHAKE = 1e-6  # spacings
RENEWAL = 0.3  # s: the time in which the zone renews the current


@dataclass(frozen=True, kw_only=True)
class Flume:
    """Sizes of a flume; all but the draft are in drafts.

    draft      [m] d of the skirt
    depth      of the water
    length     of the flume
    skirt      its place along x
    freeboard  how far the skirt stands out of the water
    zone       length of the zone that renews the current
    slick      [d2] area of the oil
    film       its thickness at the start
    """

    draft: float
    depth: float
    length: float
    skirt: float
    freeboard: float = 0.8
    zone: float = 1.8
    slick: float = 0.3
    film: float = 0.15

    @property
    def skirt_place(self) -> float:
        """Place of the skirt along x [m]."""
        return self.skirt * self.draft

    @property
    def level(self) -> float:
        """Height of the still water over the floor [m]."""
        return self.depth * self.draft

    def period(self, spacing: float) -> float:
        """Length of the flume [m], a whole number of spacings."""
        return spacing * round(self.length * self.draft / spacing)


def unit_of_speed(oil_density: float, draft: float) -> float:
    """V = sqrt(g Delta d) [m/s]."""
    return math.sqrt(GRAVITY * (1.0 - oil_density / WATER_DENSITY) * draft)


def fill_flume(
    bench: Bench,
    shape: Flume,
    spacing: float,
    oil_density: float,
    speed: float,
    lean: float = 0.0,
    tension: float = 0.0,
    balanced: bool = False,
    seed: int = 0,
    hang: Hang | None = None,
) -> tuple[Fluid, SeaForcing]:
    """Fill the flume, in motion at `speed` [m/s], and return it with the sea that drives it.

    lean: of the skirt, back [rad]; tension: between oil and water [N/m], 0 for none; balanced: whether the water is well balanced, as in
    windows; seed: by which particles are moved at the start, by `SHAKE`; 0 for none; hang: puts another boom in the skirt's place.
    """
    draft, depth, length = shape.draft, shape.level, shape.period(spacing)
    phases = (
        Phase(name="water", rest_density=WATER_DENSITY, dynamic_viscosity=WATER_VISCOSITY),
        Phase(name="oil", rest_density=oil_density, dynamic_viscosity=OIL_VISCOSITY, interfacial_tension=tension),
    )
    config = FluidConfig(
        particle_spacing=spacing, phases=phases, dimension=2, lower=(0.0, -1.0, -4.0 * spacing),
        upper=(length, 1.0, depth + 2.0 * draft), periodic=(True, False, False), maximum_time_step=0.02,
        well_balanced=balanced,
    )  # fmt: skip
    fluid = bench.fluid(config)
    fluid.add_boundary(
        tank_walls((0, 0, 0), (length, 0, depth), spacing, sides=("-z",), periodic=(True, False, False), dimension=2)
    )
    points = block((0, 0, 0), (length, 0, depth), spacing, 2)
    points = points[hang(fluid, points) if hang else _beside_skirt(fluid, shape, points, lean)]
    if seed:
        points[:, ::2] += SHAKE * spacing * np.random.default_rng(seed).uniform(-1.0, 1.0, points[:, ::2].shape)
    x = points[:, 0] - shape.skirt_place
    oil = (x < 0.0) & (x > -shape.slick / shape.film * draft) & (points[:, 2] > depth - shape.film * draft)
    for phase, chosen in (("water", ~oil), ("oil", oil)):
        fluid.add_particles(points[chosen], phase=phase, velocity=(speed, 0.0, 0.0))
    zone = Zone((0.0, -1.0, -draft), (shape.zone * draft, 1.0, depth + 2.0 * draft), RENEWAL)
    driving = current_in(zone, (speed, 0.0), depth)
    fluid.add_forcing(driving)
    return fluid, driving


def _beside_skirt(fluid: Fluid, shape: Flume, points: Double, lean: float) -> NDArray[np.bool_]:
    """Hang the skirt into the flume, turned about the waterline by `lean` [rad], and tell which of points (n, 3) [m] it leaves."""
    spacing, draft = fluid.config.particle_spacing, shape.draft
    along = np.array([math.sin(lean), 0.0, -math.cos(lean)])
    waterline = np.array([shape.skirt_place, 0.0, shape.level])
    skirt = solid_box((spacing, 0.0, (1.0 + shape.freeboard) * draft), spacing, dimension=2, name="skirt")
    centre = waterline + 0.5 * (1.0 - shape.freeboard) * draft * along
    turn = (0.0, math.sin(-0.5 * lean), 0.0, math.cos(0.5 * lean))
    fluid.set_boundary_motion(fluid.add_boundary(skirt), centre, turn, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    down = (points - waterline) @ along
    aside = np.linalg.norm(points - waterline - down[:, None] * along, axis=1)
    return (aside > 0.75 * spacing) | (down > draft)
