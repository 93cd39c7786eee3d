"""Case 2: oil over water at rest. Pressure, thickness, mixing, and how high an oil pool floats."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from oilsim import Fluid, solid_box
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace
from tests.validation.liquids.hydrostatics import DURATION, LAST, settle
from tests.validation.measure import profile_value, steady_value
from tests.validation.scenes import (
    GRAVITY,
    OIL_DENSITY,
    SAMPLE,
    WATER_DENSITY,
    fill,
    oil_and_water,
    open_tank,
    position,
)

WIDTH, OIL_DEPTH, WATER_DEPTH = 0.5, 0.25, 0.5  # m


def layer_boundaries(fluid: Fluid, spacing: float) -> tuple[float, float]:
    """Heights [m] of interface and free surface from the layers' centres of mass: a flat layer's top is at twice its centre."""
    z = position(fluid)[2]
    water, oil = z[fluid.particles.phase == 1], z[fluid.particles.phase == 0]
    interface = 2.0 * float(water.mean())
    return interface, interface + 2.0 * (float(oil.mean()) - interface)


def inverted_share(fluid: Fluid, spacing: float) -> float:
    """Share of particles that lie more than one and a half spacings on the wrong side of the filled interface."""
    z = position(fluid)[2] - WATER_DEPTH
    wrong = np.where(fluid.particles.phase == 0, -z, z) > 1.5 * spacing
    return float(wrong.mean())


# a pool of oil behind a skirt, open to the water outside below: lengths in halves of the water's depth
ARM = SKIRT = GAP = 0.5 * WATER_DEPTH  # m: width of both arms and of the skirt, height of the passage below it
REDUCED = 1.0 - OIL_DENSITY / WATER_DENSITY
POOL_RUN, POOL_MEAN = 9.0, 6.0  # s: the mean covers about four swings


def pool(bench: Bench, spacing: float) -> Fluid:
    """Oil over water in the left arm, water in the right arm up to the level that balances it, a skirt between them."""
    fluid, _ = open_tank(bench, 2.0 * ARM + SKIRT, OIL_DEPTH + WATER_DEPTH, spacing, oil_and_water())
    height = 1.4 * (OIL_DEPTH + WATER_DEPTH) - GAP
    skirt = solid_box((SKIRT, 0.0, height), spacing, dimension=2, name="skirt")
    center = np.array([ARM + 0.5 * SKIRT, 0.0, GAP + 0.5 * height])
    fluid.add_boundary(replace(skirt, position=skirt.position + center))
    fill(fluid, (0, GAP), (ARM, WATER_DEPTH))
    fill(fluid, (0, WATER_DEPTH), (ARM, WATER_DEPTH + OIL_DEPTH), "oil")
    fill(fluid, (0, 0), (2.0 * ARM + SKIRT, GAP))
    layers = round((WATER_DEPTH + OIL_DEPTH * (1.0 - REDUCED) - GAP) / spacing)
    fill(fluid, (ARM + SKIRT, GAP), (2.0 * ARM + SKIRT, GAP + layers * spacing))
    return fluid


def pool_levels(bench: Bench, spacing: float) -> np.ndarray:
    """Time [s] and the oil's surface above the water's, over the oil's thickness (2, n); levels from the arms' areas."""
    fluid = pool(bench, spacing)
    area = spacing**2 / ARM
    rows = []
    for step in range(round(POOL_RUN / SAMPLE)):
        bench.advance(fluid, SAMPLE)
        x, _, z = position(fluid)
        above = np.clip((z - GAP) / spacing + 0.5, 0.0, 1.0)  # share of each particle that is above the passage
        left = x < ARM + 0.5 * SKIRT
        rows.append(((step + 1) * SAMPLE, area * float(above[left].sum() - above[~left].sum()) / OIL_DEPTH))
    return np.array(rows).T


def two_layers(resolution: int, bench: Bench) -> Outcome:
    """Case 2: oil over water at rest for 10 s."""
    spacing = WATER_DEPTH / resolution
    bench.plan(DURATION + POOL_RUN)
    fluid, _ = open_tank(bench, WIDTH, OIL_DEPTH + WATER_DEPTH, spacing, oil_and_water())
    fill(fluid, (0, 0), (WIDTH, WATER_DEPTH))
    fill(fluid, (0, WATER_DEPTH), (WIDTH, WATER_DEPTH + OIL_DEPTH), "oil")
    scale = math.sqrt(GRAVITY * (OIL_DEPTH + WATER_DEPTH))
    speeds, pressure, profile = settle(bench, fluid, WIDTH, spacing, scale)
    interface, surface = layer_boundaries(fluid, spacing)
    # p = g (rho_o h_o + rho_w h_w) at the floor
    expected = GRAVITY * (OIL_DENSITY * OIL_DEPTH + WATER_DENSITY * (WATER_DEPTH - spacing))
    oil = profile[0] > WATER_DEPTH  # one side of the kink
    jump = profile_value(profile[0][oil], profile[1][oil], WATER_DEPTH, 0.15, 1)
    levels = pool_levels(bench, spacing)
    freeboard = steady_value(levels[1, levels[0] > POOL_RUN - POOL_MEAN])
    z = np.array([0.0, WATER_DEPTH, WATER_DEPTH + OIL_DEPTH])
    exact = GRAVITY * np.array([OIL_DENSITY * OIL_DEPTH + WATER_DENSITY * WATER_DEPTH, OIL_DENSITY * OIL_DEPTH, 0.0])
    return Outcome(
        values={
            "bottom pressure / g (rho_o h_o + rho_w h_w)": pressure / expected,
            "interface pressure / rho_o g h_o": jump / (GRAVITY * OIL_DENSITY * OIL_DEPTH),
            "oil thickness error / d": (surface - interface - OIL_DEPTH) / spacing,
            "inverted particles": inverted_share(fluid, spacing),
            "oil freeboard / thickness": freeboard,
            "rms speed / sqrt(g H)": float(speeds[-round(LAST / SAMPLE) :].mean()),
        },
        traces=(
            trace("pressure", profile[1] / 1000.0, profile[0]),
            trace("pressure", exact / 1000.0, z, "g (rho_o h_o + rho_w h_w)", reference=True),
            trace("levels", *levels),
            trace("levels", (0.0, POOL_RUN), (REDUCED, REDUCED), "1 - rho_o / rho_w", reference=True),
            trace("motion", SAMPLE * (1 + np.arange(len(speeds))), np.maximum(speeds, 1e-9)),
        ),
    )


TWO_LAYERS = Case(
    number=2,
    name="two-layers",
    title="Oil over water at rest",
    source="hydrostatics, p = g (rho_o h_o + rho_w h_w)",
    setup="0.25 m of oil (840) over 0.5 m of water (1027), 0.5 m wide, inviscid, at rest for 10 s; the same oil in one arm "
    "of a U-shaped tank, water in the other, 9 s",
    length=WATER_DEPTH,
    length_symbol="h_w",
    resolutions=(12, 24, 48),
    quantities=(
        Quantity(name="bottom pressure / g (rho_o h_o + rho_w h_w)", unit="1", reference=1.0, gate=0.005),
        Quantity(name="interface pressure / rho_o g h_o", unit="1", reference=1.0),
        Quantity(name="oil thickness error / d", unit="1", reference=0.0, scale=1.0, gate=0.5),
        Quantity(name="inverted particles", unit="1", reference=0.0, scale=1.0, gate=0.0),
        Quantity(name="oil freeboard / thickness", unit="1", reference=1.0 - OIL_DENSITY / WATER_DENSITY, gate=0.005),
        Quantity(name="rms speed / sqrt(g H)", unit="1", reference=0.0, scale=1.0),
    ),
    panels=(
        Panel("pressure", "p [kPa]", "z [m]"),
        Panel("levels", "t [s]", "freeboard / oil thickness"),
        Panel("motion", "t [s]", "rms speed / sqrt(g H)", log_y=True),
    ),
    run=two_layers,
    note="inverted: more than 1.5 spacings on the wrong side of the interface. The U-shaped tank starts within half a spacing of its "
    "balance and swings; the mean is over the last 6 s, under a Hann window.",
)
