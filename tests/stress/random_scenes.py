"""Random scenarios, each from its seed, as the plain data of a scenario file.

Lengths go with the particle spacing d, times with sqrt(d / g) and speeds with U = sqrt(g H), H the tank's height, so that scenes are as
violent at every size. Densities, viscosities, sizes, steps and tolerances are drawn from far wider ranges than an exercise needs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Table = dict[str, Any]

GRAVITY = 9.81
LENGTH = 60.0  # sqrt(d / g) that a scene lasts
TRIES = 40  # places tried for a body
PAPER_SEED = 1_000_003  # added to a scene's seed for the draw of its scheme


class Dice:
    """Draws of one seed."""

    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng(seed)

    def chance(self, share: float) -> bool:
        """True in this share of the draws."""
        return bool(self.random.random() < share)

    def choice(self, *options: Any) -> Any:
        """One of the options."""
        return options[int(self.random.integers(len(options)))]

    def between(self, low: float, high: float) -> float:
        """Uniform."""
        return float(self.random.uniform(low, high))

    def scale(self, low: float, high: float) -> float:
        """Uniform in the logarithm."""
        return math.exp(self.between(math.log(low), math.log(high)))

    def vector(self, size: float) -> list[float]:
        """Of random direction, `size` long in the root of the mean square of a component."""
        return vector(self.random.normal(0.0, size, 3))

    def inside(self, size: Array, margin: float) -> Array:
        """A point of a box from the origin to `size`, `margin` off its sides."""
        return margin + self.random.uniform(size=3) * (size - 2.0 * margin)


def vector(values: Any) -> list[float]:
    """Plain floats."""
    return [float(value) for value in values]


def random_scene(seed: int) -> Table:
    """A scenario of a thousand particles or so that is sound, but for a few that `scenario_from` refuses."""
    dice = Dice(seed)
    plane = dice.chance(0.15)
    spacing = dice.scale(0.01, 0.3)
    size = dice.random.integers((10, 9, 10), (22, 16, 22)) * spacing * (2.0 if plane else 1.0)
    gravity = dice.choice(GRAVITY, GRAVITY, GRAVITY, GRAVITY, 0.0, dice.scale(0.1, 100.0))
    unit = math.sqrt(spacing / max(gravity, 1.0))
    speed = math.sqrt(max(gravity, 1.0) * size[2])  # U
    phases = {f"liquid-{n}": _liquid(dice, gravity * spacing**2) for n in range(dice.choice(1, 1, 2, 3))}
    tank = _tank(dice, size)
    tilt = dice.between(0.0, 1.0) if dice.chance(0.1) and not tank["periodic"] else 0.0
    step = min(dice.choice(0.25, 0.5, 1.0) * unit, 0.05)
    scene: Table = {
        "name": f"stress-{seed}",
        "run": {"duration": LENGTH * unit, "communication_step": step, "threads": 1, "seed": seed},
        "fluid": {
            "particle_spacing": spacing,
            "dimension": 2 if plane else 3,
            "gravity": [gravity * math.sin(tilt), 0.0, -gravity * math.cos(tilt)],
            "divergence_tolerance": dice.choice(1e-5, 1e-4),
            "maximum_time_step": dice.choice(0.01, 0.1),
            "sleep_speed": 0.1 * math.sqrt(gravity * spacing) if dice.chance(0.25) else 0.0,
        },
        "phases": phases,
        "tank": tank,
        "fill": _fill(dice, size, spacing, speed, tuple(phases)),
        "sea": _sea(dice, size, gravity, speed),
    }
    if Dice(seed + PAPER_SEED).chance(0.1):  # a stream of its own: the other draws of a seed stay as they were
        scene["fluid"] |= {"scheme": "paper", "sleep_speed": 0.0, "viscosity_correction": dice.choice(1.0, 1e4)}
    if plane:
        _flatten(scene)
    else:
        pipes, taken = _pipes(dice, size, spacing, speed, tuple(phases))
        scene |= {"emitters": pipes, "bodies": _bodies(dice, size, spacing, speed, unit, taken)}
        if gravity == GRAVITY and dice.chance(0.15):
            scene["booms"] = {"boom": _boom(dice, size, spacing)}
            # how joints answer is told once a step, in which they must not turn far
            scene["run"]["communication_step"] = min(step, 0.25 * unit)
    return scene


def _flatten(scene: Table) -> None:
    """Nothing moves along y."""
    for region in scene["fill"].values():
        if "velocity" in region:
            region["velocity"][1] = 0.0
    for weather in scene["sea"].values():
        if "direction" in weather:
            weather["direction"] = 0.0


def _liquid(dice: Dice, adhesion: float) -> Table:
    """From a tenth to five times as dense as water, from inviscid to bitumen; `adhesion` [m4/s2] of a unit of density."""
    density = dice.choice(1000.0, dice.scale(600.0, 1400.0), dice.scale(100.0, 5000.0))
    liquid = {"density": density, "dynamic_viscosity": dice.choice(0.0, 1e-3, dice.scale(1e-4, 1e3))}
    if dice.chance(0.25):
        liquid["adhesion"] = dice.scale(1e-3, 1.0) * density * max(adhesion, 1e-4)
    return liquid


def _tank(dice: Dice, size: Array) -> Table:
    periodic = [axis for axis in "xy" if dice.chance(0.15)]
    opened = ["+z"] if dice.chance(0.7) else []
    side = dice.choice("-x", "+x", "-y", "+y")
    if dice.chance(0.1) and side[1] not in periodic:
        opened.append(side)
    return {
        "lower": [0.0, 0.0, 0.0],
        "upper": vector(size),
        "open": opened,
        "periodic": periodic,
        "no_slip": dice.chance(0.3),
    }


def _fill(dice: Dice, size: Array, spacing: float, speed: float, phases: tuple[str, ...]) -> Table:
    """One to three slabs, blocks and balls, some of which move."""
    fill, depth = {}, 0.0
    for number in range(dice.choice(1, 2, 3)):
        shape = dice.choice("slab", "slab", "block", "cylinder")
        region: Table = {"phase": dice.choice(*phases), "shape": shape}
        if shape == "slab":
            top = depth + round(dice.between(0.15, 0.45) * size[2] / spacing) * spacing
            if top > size[2]:
                continue
            region |= {"bottom": depth, "top": top}
            depth = top
        elif shape == "block":
            lower = np.round(dice.random.uniform(0.0, 0.6, 3) * size / spacing) * spacing
            extent = np.round(dice.random.uniform(0.15, 0.4, 3) * size / spacing) * spacing
            region |= {"lower": vector(lower), "upper": vector(np.minimum(lower + extent, size))}
        else:
            radius = dice.between(0.12, 0.25) * float(size.min())
            region |= {"base": vector(dice.inside(size, radius)), "radius": radius, "height": radius}
        if dice.chance(0.4):
            region["velocity"] = dice.vector(speed * dice.choice(0.1, 0.3, 0.6))
        fill[f"region-{number}"] = region
    return fill


def _pipes(
    dice: Dice, size: Array, spacing: float, speed: float, phases: tuple[str, ...]
) -> tuple[Table, list[tuple[Array, float]]]:
    """No pipe or one, and the place that it takes."""
    if not dice.chance(0.15):
        return {}, []
    radius = dice.between(1.5, 3.0) * spacing
    mouth = dice.inside(size, min(radius + 4.0 * spacing, 0.45 * float(size.min())))
    pipe = {
        "phase": dice.choice(*phases), "mouth": vector(mouth), "direction": dice.vector(1.0), "radius": radius,
        "speed": speed * dice.between(0.1, 1.0), "volume": 200.0 * spacing**3,
    }  # fmt: skip
    return {"pipe": pipe}, [(mouth, radius + 4.0 * spacing)]


def _sea(dice: Dice, size: Array, gravity: float, speed: float) -> Table:
    sea = {}
    if dice.chance(0.12):
        sea["wind"] = {"speed": dice.between(0.1, 30.0), "direction": dice.between(0.0, 6.3), "gust_intensity": 0.3}
    if dice.chance(0.12):
        sea["current"] = {"speed": dice.between(0.0, 0.5) * speed, "direction": dice.between(0.0, 6.3)}
    if gravity == GRAVITY and dice.chance(0.12):
        period = 2.0 * math.pi * math.sqrt(float(size[0]) / gravity / 6.0)
        sea["waves"] = {"height": dice.between(0.005, 0.02) * float(size.min()), "period": period, "build_up": period}
    return sea


def _bodies(
    dice: Dice, size: Array, spacing: float, speed: float, unit: float, taken: list[tuple[Array, float]]
) -> Table:
    """Up to three, a fiftieth to eight times as dense as water, anywhere but in each other."""
    bodies, taken = {}, list(taken)
    for number in range(dice.choice(0, 1, 2, 3)):
        radius = dice.between(2.0, 0.3 * float(size.min()) / spacing) * spacing
        for _ in range(TRIES):
            place = dice.inside(size, radius)
            if all(np.linalg.norm(place - other) > radius + reach for other, reach in taken):
                taken.append((place, radius))
                body = _shape(dice, radius) | {"position": vector(place), "rotation": dice.vector(2.0)}
                body["no_slip"] = dice.chance(0.3)
                bodies[f"body-{number}"] = body | _motion(dice, radius, spacing, speed, unit)
                break
    return bodies


def _shape(dice: Dice, radius: float) -> Table:
    """A body within a ball."""
    edges = dice.random.uniform(0.3, 1.0, 3)
    shapes: Mapping[str, Table] = {
        "box": {"size": vector(2.0 * radius * edges / np.linalg.norm(edges))},
        "sphere": {"radius": radius},
        "cylinder": {"radius": 0.6 * radius, "height": 1.5 * radius},
        "rock": {"size": vector(1.6 * radius * edges / np.linalg.norm(edges))},
    }
    shape = dice.choice(*shapes)
    return {"shape": shape} | shapes[shape]


def _motion(dice: Dice, radius: float, spacing: float, speed: float, unit: float) -> Table:
    kind = dice.choice("free", "free", "free", "free", "fixed", "sine")
    motion: Table = {"kind": kind}
    if kind == "sine":
        period = dice.scale(3.0, 25.0) * unit
        motion |= {"direction": dice.vector(1.0), "amplitude": dice.between(0.3, 1.5) * spacing, "period": period}
    if kind != "free":
        return {"motion": motion}
    density = dice.choice(dice.scale(20.0, 200.0), dice.scale(200.0, 1200.0), dice.scale(1000.0, 8000.0))
    body: Table = {"motion": motion, "density": density}
    if dice.chance(0.4):
        body |= {"velocity": dice.vector(speed * dice.choice(0.1, 0.3, 0.6))}
    return body


def _boom(dice: Dice, size: Array, spacing: float) -> Table:
    """Slack, from side to side of the tank."""
    margin = 2.5 * spacing
    x = dice.between(0.3, 0.7) * float(size[0])
    width = float(size[1]) - 2.0 * margin
    return {
        "ends": [[x, margin], [x, margin + width]], "length": dice.between(1.1, 1.5) * width, "segments": dice.choice(3, 4, 5),
        "skirt_depth": 2.0 * spacing, "freeboard": 1.5 * spacing, "buoyancy_to_weight": dice.scale(2.0, 15.0),
    }  # fmt: skip
