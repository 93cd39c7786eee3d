"""The resolution of a window: `spacing = "live"` or `"fine"` becomes numbers before a run begins, and what comes of them is told.

A window is sized by the draft of the boom, vessel or deepest skirt that it follows: SIDES drafts wide and DEPTH drafts deep. "live" has as
many particles to the draft, from COARSE to FINE, as this machine computes in real time, by its speed measured on a small window. "fine"
has FINE in a window INNER_SIDES drafts wide, and half as many in an outer one of SIDES. The run then has numbers, so that it can be
repeated elsewhere.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from oilsim import Phase
from oilsim.sea import Sea, SeaDescription
from oilsim.window.settings import WindowSettings, fluid_steps
from oilsim.window.window import Window
from scenarios.schema.window import OuterWindow, WindowTable, problem_of
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import Problem, ScenarioError

# [drafts] across a window; tuned; the pool and wake of an apex in its middle half, waves of ten drafts end in its rim
SIDES = 21.0
# [drafts] of a window's depth; tuned; 16 m and 2 m for a skirt of 0.75 m
DEPTH = 2.7
# [1] particles to the draft of a fine window; tuned; twice as many cost twelve times as much
FINE = 8.0
# [drafts] across the window of fine particles; tuned; the pool at an apex in its middle
INNER_SIDES = 10.0
# [1] particles to the draft at least; numerical; fewer do not show a skirt
COARSE = 3.0
# [1] spacings that are tried from FINE to COARSE; numerical; a twentieth of the difference apart
TRIALS = 21
# [1] of real time that a live window may take; numerical; the rest is for recording and splashes
SHARE = 0.8
# [s] of one processor for each body and communication step; measured; see `scenarios.setup.cost`
BODY_SECONDS = 3.2e-4
# [1] particles along each side of the window by which speed is measured; numerical; more than a processor's caches hold
ACROSS = 32
# [1] layers of it; numerical; those of a window of 2 m at 0.25 m
LAYERS = 8
# [1] steps of it that are measured; numerical; a quarter of a second
STEPS = 8
# [m/s] at which its water swirls at first; numerical; that of a boom's wake
SWIRL = 0.1


def chosen(scenario: Scenario, window: WindowTable) -> WindowTable:
    """Return a window with numbers for its size, depth and spacing; ScenarioError where no draft tells a size."""
    if window.spacing is None:
        return window
    draft = _draft(scenario, window)
    if window.spacing == "fine" and window.size is None and window.depth is None and window.outer is None:
        around = OuterWindow(spacing=2.0 * draft / FINE, size=(SIDES * draft, SIDES * draft))
        inner = (INNER_SIDES * draft, INNER_SIDES * draft)
        return replace(window, spacing=draft / FINE, size=inner, depth=DEPTH * draft, outer=around)
    sized = replace(
        window,
        size=(SIDES * draft, SIDES * draft) if window.size is None else window.size,
        depth=DEPTH * draft if window.depth is None else window.depth,
    )
    if isinstance(window.spacing, float):
        return sized
    if window.spacing == "fine":
        return replace(sized, spacing=draft / FINE)
    try:
        found = live_spacing(scenario, sized, draft, seconds_per_particle_step(scenario.run.threads))
    except ValueError as error:
        raise ScenarioError([problem_of(error).below("window")], scenario.name) from error
    return replace(sized, spacing=found)


def _draft(scenario: Scenario, window: WindowTable) -> float:
    """Return the draft [m] of what the window follows: of a boom's skirt, a vessel, or the deepest skirt of all."""
    if window.target in scenario.booms:
        return scenario.booms[str(window.target)].skirt_depth
    if window.target in scenario.vessels:
        return scenario.vessels[str(window.target)].draft
    skirts = [boom.skirt_depth for boom in scenario.booms.values()]
    if not skirts:
        text = f"is {window.spacing!r}, allowed without a boom or vessel: none; give size, depth and fluid.particle_spacing"
        raise ScenarioError([Problem("window.spacing", text)], scenario.name)
    return max(skirts)


def live_spacing(scenario: Scenario, window: WindowTable, draft: float, speed: float) -> float:
    """Return the finest spacing [m] that runs in real time, or the coarsest that shows the draft [m].

    speed [s] of the machine for a particle and step.
    """
    spacings = [float(one) for one in draft / np.linspace(FINE, COARSE, TRIALS)]
    trials = ((one, replace(window, spacing=one).boxes(scenario.fluid)) for one in spacings)
    return next((one for one, boxes in trials if _load(scenario, boxes, speed) <= SHARE), spacings[-1])


def _load(scenario: Scenario, boxes: Sequence[WindowSettings], speed: float) -> float:
    """Return the time [s] that a simulated second takes if no water sleeps, at a `speed` [s] of each particle and step."""
    step, gravity = scenario.run.communication_step, scenario.fluid.gravity
    moving = len(scenario.vessels) + sum(boom.segments for boom in scenario.booms.values())
    moved = sum(one.particle_count * fluid_steps(one, gravity, step) for one in boxes)
    return (moved * speed + len(boxes) * moving * BODY_SECONDS) / step


@cache
def seconds_per_particle_step(threads: int | None) -> float:
    """Measure the time [s] that a particle of a window takes for a step on this machine."""
    settings = WindowSettings(size=(ACROSS * 0.25, ACROSS * 0.25), depth=LAYERS * 0.25, spacing=0.25)
    water = Phase(name="water", rest_density=1027.0, dynamic_viscosity=1e-3)
    window = Window(settings, Sea(SeaDescription(depth=30.0)), (water,), threads)
    try:
        x, y, _ = window.fluid.particles.position
        side = 0.5 * math.pi / settings.size[0]
        swirl = SWIRL * np.stack([np.sin(side * x) * np.cos(side * y), -np.cos(side * x) * np.sin(side * y), 0.0 * x])
        window.fluid.set_velocities(swirl)
        step = settings.longest_time_step(window.motion.sea.description.gravity)
        window.fluid.advance(2.0 * step)
        begin = time.perf_counter()
        report = window.fluid.advance(STEPS * step)
        return (time.perf_counter() - begin) / (window.fluid.particle_count * max(1, report.sub_steps))
    finally:
        window.fluid.close()
