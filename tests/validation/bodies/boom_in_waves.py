"""Case 10: a jointed boom a twentieth as dense as water, towed in U shape through head waves for a minute.

Two vessels hold the ends against a current, which is towing seen from the boom. The sea repeats along the tow; before the bows
a zone renews current and waves. The float is sized so that the boom weighs a twentieth of the water that it could displace, with a
skirt as thick as the spacing, the thinnest that parts the water.
"""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from booms.deployment import BoomLayout
from coupling.master.body_exchange import BodyExchange, Scheme
from coupling.master.errors import CoSimulationError
from scenarios.running.assembly import Assembly, build
from scenarios.schema.exercise import BoomSettings, TowSettings, VesselSettings
from scenarios.schema.liquid import FluidSettings, PhaseSettings, SlabFill, Tank, ZoneSettings
from scenarios.schema.sea import RegularSeaWaves, SeaSettings, SteadySeaCurrent
from scenarios.spec.scenario import RunSettings, Scenario
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace

Double = NDArray[np.float64]

SEGMENT, SEGMENTS = 0.75, 60  # m: length of a segment, and how many
RATIO = 0.05  # density of the boom over the water's
SKIRT = 0.5  # m, its depth
GAP = 0.3 * SEGMENTS * SEGMENT  # m between the ends
SPEED, DURATION, STEP = 0.5, 60.0, 0.02  # m/s through the water, s, s
WAVE_HEIGHT, WAVE_PERIOD = 0.4, 3.0  # m, s
DEPTH, LENGTH, WIDTH = 1.5, 36.0, GAP + 7.5  # m: the water, and the basin
BOW = 29.0  # m: x of the vessels' midships; the zone begins before their bows
AFLOAT = 2.0  # s: after the start, which is sudden, figures count
VESSEL = {"length": 5.0, "beam": 2.4, "draft": 0.6, "depth": 1.5}
PATIENCE = 2.0  # s in which a lagged exchange must have blown up
GATE = 0.005  # of a segment: how far a joint may open


def scenario(spacing: float, threads: int | None) -> Scenario:
    """The exercise at a particle spacing [m]."""
    zone = ZoneSettings(lower=(BOW + 0.5 * VESSEL["length"], 0.0, 0.0), upper=(LENGTH, WIDTH, 2.0 * DEPTH))
    sides = {"port": 0.5 * (WIDTH + GAP), "starboard": 0.5 * (WIDTH - GAP)}
    return Scenario(
        name="boom-in-waves",
        run=RunSettings(duration=DURATION, communication_step=STEP, threads=threads),
        fluid=FluidSettings(particle_spacing=spacing, maximum_time_step=STEP),
        phases={"water": PhaseSettings(density=1027.0, dynamic_viscosity=1.05e-3)},
        tank=Tank(
            lower=(0.0, 0.0, 0.0),
            upper=(LENGTH, WIDTH, 2.0 * DEPTH),
            periodic=("x",),
            open=("+z",),
            zones={"inlet": zone},
        ),
        fill={"water": SlabFill(phase="water", bottom=0.0, top=DEPTH, velocity=(-SPEED, 0.0, 0.0))},
        sea=SeaSettings(
            waves=RegularSeaWaves(height=WAVE_HEIGHT, period=WAVE_PERIOD, direction=math.pi, build_up=WAVE_PERIOD),
            current=SteadySeaCurrent(speed=SPEED, direction=math.pi),
        ),
        tow=TowSettings(speed=0.0, heading=0.0),
        vessels={
            name: VesselSettings(position=(BOW, y), bollard_pull=8e3, yaw_moment=1e4, side_thrust=2e3, **VESSEL)
            for name, y in sides.items()
        },
        booms={
            "main": BoomSettings(
                ends=("port", "starboard"),
                length=SEGMENTS * SEGMENT,
                segments=SEGMENTS,
                skirt_depth=SKIRT,
                skirt_thickness=spacing,
                freeboard=4.0 * math.sqrt(spacing),  # the float's area goes with the skirt's
                buoyancy_to_weight=1.0 / RATIO,
                ballast_fraction=0.8,
                tow_line=2.0,
                line_stiffness=1e5,
            )
        },
    )


class BoomGauge:
    """Reads, step by step, how far joints have opened, how far the skirt leans and what the ends carry."""

    def __init__(self, assembly: Assembly) -> None:
        assert assembly.world is not None
        self._world, self._layout = assembly.world, assembly.fleet.booms["main"]
        self._tensions = assembly.fleet.tensions_of("main").values()
        self.gap: list[float] = []
        self.lean: list[float] = []
        self.tension: list[float] = []

    def read(self) -> None:
        """Take the figures of this instant: share of a segment, rad, N."""
        poses = np.array([self._world.pose(segment.name) for segment in self._layout.segments])
        self.gap.append(widest_joint(self._layout, poses))
        x, y = poses[:, 3], poses[:, 4]
        self.lean.append(float(np.arccos(1.0 - 2.0 * (x * x + y * y)).max()))
        self.tension.append(float(np.mean([self._world.tension(name) for name in self._tensions])))


def widest_joint(layout: BoomLayout, poses: Double) -> float:
    """Largest distance of two ends that a joint holds together, over a segment's length; poses (S, 7)."""
    ends = _rotated(poses[:, 3:], layout.segment.joint_points) + poses[:, None, :3]
    return float(np.linalg.norm(ends[1:, 0] - ends[:-1, 1], axis=1).max()) / layout.boom.segment_length


def _rotated(orientation: Double, points: Double) -> Double:
    """Points (K, 3) turned by each of the quaternions (S, 4) xyzw: (S, K, 3)."""
    axis, real = orientation[:, None, :3], orientation[:, None, 3:]
    across = 2.0 * np.cross(axis, points[None])
    return points + real * across + np.cross(axis, across)


def end_of_lagged(spacing: float, threads: int | None) -> float:
    """When the ledger ends the same exercise [s], if the boom gets the water's forces a step late; nan if it does not within PATIENCE.

    It has to name a segment or a vessel, and the energy that the exchange has made; any other error is a fault of the run.
    """
    assembly = build(scenario(spacing, threads))
    late = [replace(interface, scheme=Scheme.EXPLICIT) for interface in assembly.exchange.interfaces]
    apart = tuple(link for link in assembly.connections if not link.source_variable.endswith("inverse_mass"))
    simulation = replace(assembly, exchange=BodyExchange(late), connections=apart).co_simulation()
    simulation.initialize()
    try:
        for _ in range(round(PATIENCE / STEP)):
            simulation.step()
    except CoSimulationError as ended:
        if not re.match(r"body '(boom/main|vessels)/[^']+': the exchange has created ", ended.message):
            raise
        return ended.time
    return math.nan


def boom_in_waves(resolution: int, bench: Bench) -> Outcome:
    """Case 10: the boom for a minute, and with a lagged exchange."""
    lagged = end_of_lagged(SEGMENT / resolution, bench.threads)
    assembly = build(scenario(SEGMENT / resolution, bench.threads))
    simulation, gauge = assembly.co_simulation(), BoomGauge(assembly)
    bench.plan(DURATION)
    simulation.initialize()
    levels = []
    for _ in range(round(DURATION / STEP)):
        simulation.step()
        report = assembly.report()
        assert report is not None
        bench.count(STEP, report.sub_steps, assembly.fluid.particle_count)
        gauge.read()
        levels.append(surface(assembly))
    simulation.terminate()
    ledger, seconds = assembly.ledger, STEP * (1.0 + np.arange(len(gauge.gap)))
    late = seconds > AFLOAT
    gap, lean, level = 100.0 * np.array(gauge.gap), np.degrees(gauge.lean), np.array(levels)
    return Outcome(
        values={
            "widest joint": float(gap.max()),
            "momentum lost between fluid and bodies": ledger.momentum_residual,
            "energy made between fluid and bodies": ledger.energy_residual,
            "lagged exchange is ended by name": lagged,
            "largest lean": float(lean[late].max()),
            "wave height at the bows": float(np.sqrt(8.0) * level[late].std()),
            "mean tension": float(np.mean(np.array(gauge.tension)[late])),
        },
        traces=(
            trace("joints", seconds, gap, "widest of 59"),
            trace("joints", (0.0, DURATION), (100.0 * GATE, 100.0 * GATE), "gate", reference=True),
            trace("lean", seconds, lean, "most leaning of 60"),
            trace("tension", seconds, gauge.tension, "mean of both ends"),
            trace("waves", seconds, level - level.mean()),
        ),
    )


def surface(assembly: Assembly) -> float:
    """Height [m] of the water between the vessels, under the middle of the gap."""
    return float(assembly.fluid.surface_height_at([(BOW, 0.5 * WIDTH)])[0])


BOOM_IN_WAVES = Case(
    number=10,
    name="boom-in-waves",
    title="A boom a twentieth as dense as water, towed through waves for a minute",
    source="joints hold: of 60 segments none parts from the next; what the water gives the boom takes; forces a step late blow up",
    setup=f"60 segments of length l = {SEGMENT:g} m in a U whose gap is 0.3 of the boom, a skirt 0.5 m deep, towed on elastic lines by two "
    f"free vessels at {SPEED:g} m/s through head waves of {WAVE_HEIGHT:g} m and {WAVE_PERIOD:g} s in water {DEPTH:g} m deep, 60 s",
    length=SEGMENT,
    length_symbol="l",
    resolutions=(2, 3, 4),
    quantities=(
        Quantity(name="widest joint", unit="% of l", reference=0.0, scale=1.0, gate=100.0 * GATE),
        Quantity(name="momentum lost between fluid and bodies", unit="1", reference=0.0, scale=1.0, gate=1e-6),
        Quantity(name="energy made between fluid and bodies", unit="1", reference=0.0, scale=1.0, gate=0.01),
        Quantity(name="lagged exchange is ended by name", unit="s", reference=0.0, scale=1.0, gate=PATIENCE),
        Quantity(name="largest lean", unit="deg", reference=0.0, scale=1.0),
        Quantity(name="wave height at the bows", unit="m", reference=WAVE_HEIGHT),
        Quantity(name="mean tension", unit="N", reference=0.0, scale=1.0),
    ),
    panels=(
        Panel("joints", "t [s]", "opening / l [%]", log_y=True),
        Panel("lean", "t [s]", "lean of the skirt [deg]"),
        Panel("tension", "t [s]", "tension [N]"),
        Panel("waves", "t [s]", "water between the bows [m]"),
    ),
    own_step=True,
    run=boom_in_waves,
    spacings=1,
    note="towed by a current against held vessels; the skirt is as thick as the spacing and the float sized for the weight, so "
    "that the boom's section depends on the spacing, and lean and tension with it.",
)
