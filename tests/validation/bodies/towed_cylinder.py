"""Case 22: the drag of a cylinder towed slowly across its axis, whose wake is steady: C_d of Navier and Stokes' equations in the plane.

Viscous stress makes a third of it and pressure the rest, so that both must be right on a curved, sticking surface that moves. The liquid
fills its channel and has no weight. Its sides slip; at 24 and 16 diameters' height the drag is 3 and 5 % greater.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from oilsim import block
from tests.validation.bodies.towing import BEATS, towed
from tests.validation.bodies.towing_motion import TowingMotion
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace
from tests.validation.rigid import disc
from tests.validation.scenes import closed_channel, liquid

Double = NDArray[np.float64]

DIAMETER, SPEED, DENSITY = 0.25, 0.5, 1000.0  # m, m/s, kg/m3
STEADY = {20: 2.045, 40: 1.522}  # C_d by Reynolds number (Dennis and Chang 1970)
ROOM, HEIGHT = 6.0, 40.0  # D: before the cylinder at the start and at the end; of the channel
RISE, COUNTED, TRAVEL = 2.0, 25.0, 35.0  # D: travelled while the speed rises, before the mean begins, in all


def drag(bench: Bench, spacing: float, reynolds_number: float) -> tuple[Double, Double]:
    """Travel [D] and drag [N/m] at the samples."""
    lower = np.array([-ROOM * DIAMETER, -1.0, -0.5 * HEIGHT * DIAMETER])
    upper = np.array([(TRAVEL + ROOM) * DIAMETER, 1.0, 0.5 * HEIGHT * DIAMETER])
    phase = liquid(DENSITY, kinematic_viscosity=SPEED * DIAMETER / reynolds_number)
    fluid = closed_channel(bench, lower, upper, spacing, phase, DIAMETER / (SPEED * BEATS))
    points = block(lower, upper, spacing, 2)
    fluid.add_particles(points[np.hypot(points[:, 0], points[:, 2]) > 0.5 * DIAMETER], phase=phase.name)
    cylinder = fluid.add_boundary(replace(disc(0.5 * DIAMETER, spacing), no_slip=True))
    motion = TowingMotion(position=(0.0, 0.0, 0.0), velocity=(SPEED, 0.0, 0.0), rise_time=2.0 * RISE * DIAMETER / SPEED)
    return towed(bench, fluid, cylinder, motion, TRAVEL, DIAMETER)


def towed_cylinder(resolution: int, bench: Bench) -> Outcome:
    """Case 22: the cylinder at both Reynolds numbers."""
    bench.plan((TRAVEL + RISE) * DIAMETER / SPEED * len(STEADY))
    values, traces = {}, []
    for number, expected in STEADY.items():
        places, forces = drag(bench, DIAMETER / resolution, number)
        found = forces / (0.5 * DENSITY * SPEED**2 * DIAMETER)
        values[f"drag coefficient at Re {number}"] = float(found[places > COUNTED].mean())
        smooth = np.convolve(found, np.full(BEATS, 1.0 / BEATS), mode="valid")
        traces.append(trace("drag", places[BEATS - 1 :], smooth, f"Re {number}"))
        traces.append(trace("drag", (COUNTED, TRAVEL), (expected, expected), reference=True))
    return Outcome(values=values, traces=tuple(traces))


TOWED_CYLINDER = Case(
    number=22,
    name="towed-cylinder",
    title="Drag of a cylinder with a steady wake",
    source="C_d of steady plane flow in an endless liquid (Dennis and Chang 1970)",
    setup=f"cylinder of diameter D across a closed channel {HEIGHT:g} D high with sides that slip, plane, without weight; "
    f"mean over {COUNTED:g} D to {TRAVEL:g} D of travel",
    length=DIAMETER,
    length_symbol="D",
    resolutions=(4, 6, 8),
    quantities=tuple(
        Quantity(name=f"drag coefficient at Re {number}", unit="1", reference=expected, gate=0.03)
        for number, expected in STEADY.items()
    ),
    panels=(Panel("drag", "travel / D", "C_d, mean over D", y_range=(1.0, 3.0)),),
    run=towed_cylinder,
    note="nothing is corrected for the channel's sides.",
)
