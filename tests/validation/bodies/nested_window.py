"""Case 65: a window in an outer one of twice the spacing, against its own particles everywhere and against the window alone.

A U of rigid plates is towed along its axis, and only its apex lies in the window; its load is that on the four plates in the middle.
Then a cylinder heaves in a plane, and its wave goes out through the window's rim: its height in the window, and the wave that comes
back, by the fit of two waves to five gauges.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from coupling.solids.surface_sampling import boundary_particles
from oilsim import BoundaryParticles, Phase
from oilsim.sea import Sea, SeaDescription
from oilsim.sea.regular_waves import wave_number
from oilsim.window.settings import WindowSettings
from oilsim.window.water_motion import WaterMotion
from oilsim.window.window import Window
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace
from tests.validation.rigid import disc

Double = NDArray[np.float64]

WATER = Phase(name="water", rest_density=1027.0, dynamic_viscosity=1.05e-3)
STILL = Sea(SeaDescription(depth=30.0))
SPEED, START = 0.3, 4.0  # m/s; s until it is reached
RADIUS, PLATES, THICK, DRAFT = 3.0, 16, 0.2, 0.4  # m: of the U, its plates, their thickness and draft
WHOLE, APEX, APEX_AT, DEPTH = (
    14.0,
    5.0,
    -2.4,
    1.2,
)  # m: windows around all and at the apex, whose middle lies behind that of the U
TOW, COUNTED, STEP = 16.0, 8.0, 0.1  # s: of the tow, of its end that counts, between readings
MIDDLE = slice(6, 10)  # plates
CYLINDER, HEAVE, PERIOD = 0.3, 0.06, 1.4  # m: radius, amplitude; s: a wave of 2.88 m
FLUME, INSIDE, WAVE_DEPTH = 24.0, 10.0, 0.8  # m: of the windows in the plane
WAVES, LAST, SAMPLES = 7, 3, 40  # waves, those that count, and readings of each
GAUGES = np.array([1.0, 1.3, 1.6, 1.9, 2.2])  # m, in the middle of the smaller window
COLUMNS = 2  # of a spacing, to either side of a gauge, whose uppermost particles count
WAYS = ("everywhere", "nested", "alone")


class Body:
    """A surface and the way [m] that it has gone, along an axis, at a time [s]; turned by an angle [rad] about the vertical."""

    def __init__(
        self, surface: BoundaryParticles, place: Double, way: Callable[[float], Double], angle: float = 0.0
    ) -> None:
        self.surface, self.place, self.way = surface, place, way
        self.turn = Rotation.from_euler("z", angle)


class Driven:
    """A window whose bodies move as they are told, in an outer one that has bodies of its own. Its middle goes `follows` their way."""

    def __init__(
        self, settings: WindowSettings, middle: Double, bench: Bench, bodies: list[Body], outer: Driven | None = None
    ) -> None:
        around = None if outer is None else WaterMotion(outer.window, whole=True)
        self.window = Window(settings, STILL, (WATER,), bench.threads, around)
        self.bench, self.outer, self.bodies, self.middle, self.time = bench, outer, bodies, middle, 0.0
        self.handles = [self.window.fluid.add_boundary(body.surface) for body in bodies]

    def step(self, step: float) -> None:
        """Go on by a step [s]."""
        if self.outer is not None and self.window.around is not None:
            self.outer.step(step)
            self.window.around.measure(self.time + step)
        fluid = self.window.fluid
        self.window.follow(self.middle + self.bodies[0].way(self.time)[:2], self.time)
        for body, handle in zip(self.bodies, self.handles, strict=True):
            now, later = body.way(self.time), body.way(self.time + step)
            fluid.set_boundary_motion(handle, body.place + now, body.turn.as_quat(), (later - now) / step, np.zeros(3))
        report = fluid.advance(step)
        self.bench.count(step, report.sub_steps, fluid.particle_count)
        self.time += step


def towed(time: float) -> Double:
    """Way (3,) [m] of the U."""
    return np.array([SPEED * (time - 0.5 * START if time > START else 0.5 * time**2 / START), 0.0, 0.0])


def heaving(time: float) -> Double:
    """Way (3,) [m] of the cylinder."""
    return np.array([0.0, 0.0, -HEAVE * math.sin(2.0 * math.pi * time / PERIOD) * min(1.0, time / PERIOD)])


def apex(spacing: float, size: float, bench: Bench, outer: Driven | None = None) -> Driven:
    """A window with the plates of the U that lie in it."""
    width = math.pi * RADIUS / PLATES
    surface = boundary_particles("plate", trimesh.creation.box((THICK, width, 2.0 * DRAFT)), spacing)
    middle = np.array([APEX_AT if size < WHOLE else 0.0, 0.0])
    angles = 0.5 * math.pi + (np.arange(PLATES) + 0.5) * math.pi / PLATES
    places = RADIUS * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(PLATES)])
    inside = (np.abs(places[:, :2] - middle) + 0.5 < 0.5 * size).all(1)
    bodies = [Body(surface, places[n], towed, angles[n]) for n in np.flatnonzero(inside)]
    settings = WindowSettings(size=(size, size), depth=DEPTH, spacing=spacing, solver={"divergence_tolerance": 1e-3})
    one = Driven(settings, middle, bench, bodies, outer)
    water = one.window.rim.about_center(one.window.fluid.particles.position.T)
    half = 0.5 * np.array([THICK, width, 2.0 * DRAFT]) + 0.5 * spacing
    covered = [(np.abs(body.turn.inv().apply(water - body.place)) < half).all(1) for body in bodies]
    one.window.fluid.remove_particles(np.any(covered, axis=0))
    return one


def flume(spacing: float, size: float, bench: Bench, outer: Driven | None = None) -> Driven:
    """A window in a plane with the cylinder."""
    settings = WindowSettings(size=(size, size), depth=WAVE_DEPTH, spacing=spacing, dimension=2)
    one = Driven(settings, np.zeros(2), bench, [Body(disc(CYLINDER, spacing), np.zeros(3), heaving)], outer)
    x, _, z = one.window.fluid.particles.position
    one.window.fluid.remove_particles(np.hypot(x, z) < CYLINDER + 0.5 * spacing)
    return one


def ways(
    make: Callable[..., Driven], spacing: float, whole: float, part: float, bench: Bench
) -> Iterator[tuple[str, Driven]]:
    """Yield the fine particles everywhere, in a window in an outer one, and in that window alone."""
    yield "everywhere", make(spacing, whole, bench)
    yield "nested", make(spacing, part, bench, make(2.0 * spacing, whole, bench))
    yield "alone", make(spacing, part, bench)


def pull(driven: Driven) -> Double:
    """Load (T,) [N] on the plates in the middle of the U, against its way, every `STEP`."""
    found = []
    first = (PLATES - len(driven.handles)) // 2
    for _ in range(round(TOW / STEP)):
        driven.step(STEP)
        plates = driven.handles[MIDDLE.start - first : MIDDLE.stop - first]
        found.append(-sum(float(driven.window.fluid.boundary_wrench(handle)[0]) for handle in plates))
    return np.array(found)


def surface_at(window: Window, place: float) -> float:
    """Height [m] of the surface at a place [m] of a plane window: the mean of the uppermost particles of the columns beside it."""
    x, _, z = window.fluid.particles.position
    column = np.floor((x - place) / window.settings.spacing)
    tops = [z[column == one].max() for one in range(-COLUMNS, COLUMNS) if (column == one).any()]
    return float(np.mean(tops)) + 0.5 * window.settings.spacing


def waves(driven: Driven) -> tuple[float, float, Double]:
    """Height of the wave that goes out and of that which comes back [m], and the surface in the middle gauge over the end (T,) [m]."""
    found = []
    for _ in range(WAVES * SAMPLES):
        driven.step(PERIOD / SAMPLES)
        found.append([surface_at(driven.window, place) for place in GAUGES])
    surface = np.array(found)[-LAST * SAMPLES :]
    turned = 2.0 * np.exp(2j * math.pi * np.arange(len(surface)) / SAMPLES) @ surface / len(surface)
    number = wave_number(PERIOD, WAVE_DEPTH)
    both = np.column_stack([np.exp(1j * number * GAUGES), np.exp(-1j * number * GAUGES)])
    height = 2.0 * np.abs(np.linalg.lstsq(both, turned, rcond=None)[0])
    return float(height.max()), float(height.min()), surface[:, len(GAUGES) // 2]


def nested_window(resolution: int, bench: Bench) -> Outcome:
    """Case 65: the load on the apex, and the wave through the rim."""
    spacing, traces = DRAFT / resolution, []
    bench.plan(4.0 * (TOW + WAVES * PERIOD))
    drag = 0.5 * WATER.rest_density * SPEED**2 * (MIDDLE.stop - MIDDLE.start) * math.pi * RADIUS / PLATES * DRAFT
    loads, heights, values = {}, {}, dict[str, float]()
    for name, one in ways(apex, spacing, WHOLE, APEX, bench):
        load = pull(one)
        loads[name] = float(load[-round(COUNTED / STEP) :].mean())
        traces.append(trace("load", STEP * (1.0 + np.arange(len(load))), load, name))
    for name, one in ways(flume, 0.5 * spacing, FLUME, INSIDE, bench):
        forth, back, surface = waves(one)
        heights[name], values[f"wave that comes back, {name}"] = forth, back / forth
        traces.append(trace("wave", PERIOD / SAMPLES * np.arange(len(surface)), surface, name))
    values |= {f"load, {name}": loads[name] / drag for name in WAYS}
    values |= {f"load beyond that everywhere, {name}": (loads[name] - loads["everywhere"]) / drag for name in WAYS[1:]}
    values |= {f"height, {name}": heights[name] / heights["everywhere"] for name in WAYS[1:]}
    return Outcome(values=values, traces=tuple(traces))


NESTED_WINDOW = Case(
    number=65,
    name="nested-window",
    title="A window in an outer one of twice the spacing",
    source="the fine particles everywhere; ρ U²/2 times the wetted area of the four plates is the scale of loads",
    setup=f"a U of {PLATES} rigid plates on a half circle of {RADIUS:g} m, {DRAFT:g} m deep, towed at {SPEED:g} m/s for {TOW:g} s, in"
    f" windows of {WHOLE:g} m and of {APEX:g} m on its apex; a cylinder of {2 * CYLINDER:g} m that heaves by {HEAVE:g} m every"
    f" {PERIOD:g} s in windows of {FLUME:g} and {INSIDE:g} m in a plane, with particles half as large",
    length=DRAFT,
    length_symbol="s",
    resolutions=(4, 6),
    quantities=(
        *(Quantity(name=f"load, {name}", unit="1", reference=math.nan) for name in WAYS),
        Quantity(name="load beyond that everywhere, nested", unit="1", reference=0.0, scale=1.0, gate=0.25),
        Quantity(name="load beyond that everywhere, alone", unit="1", reference=math.nan),
        Quantity(name="height, nested", unit="1", reference=1.0, gate=0.05),
        Quantity(name="height, alone", unit="1", reference=1.0),
        *(
            Quantity(name=f"wave that comes back, {name}", unit="1", reference=0.0, scale=1.0, gate=gate)
            for name, gate in zip(WAYS, (None, 0.01, None), strict=True)
        ),
    ),
    panels=(
        Panel("load", "t [s]", "load on the apex [N]"),
        Panel("wave", "t [s]", "surface 1.6 m from the cylinder [m]"),
    ),
    own_step=True,
    run=nested_window,
    spacings=1,
    note="a wave that leaves through a rim comes back in part, with an outer window as without: the sides repeat, so the water at one must"
    " move as that at the other",
)
