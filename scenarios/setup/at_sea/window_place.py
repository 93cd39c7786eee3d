"""The places of windows among fixed bodies: one that meets no water is refused, and a body that reaches beyond one is told of."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from coupling.solids.signed_distance import SignedDistance
from oilsim.window.settings import WindowSettings
from scenarios.problems import Problem, ScenarioError
from scenarios.schema.exercise import body_of, segment_names
from scenarios.schema.parsing.quantity_fields import Point2
from scenarios.schema.window import window_place
from scenarios.setup.at_sea.window import middle_of
from scenarios.setup.resolve import RunSpec
from scenarios.setup.solids.placed_solids import Solid

Array = NDArray[np.float64]

# [1] columns of water along each side of a window that are looked at; numerical
COLUMNS = 16


def require_water(scenario: RunSpec, solids: Sequence[Solid], level: float) -> tuple[str, ...]:
    """Say which fixed bodies reach beyond a window, which cannot meet them; ScenarioError for windows that lie inside one whole.

    level [m] of the still water.
    """
    fixed = [solid for solid in solids if solid.motion == "fixed" and solid.wetted]
    problems, told = list[Problem](), list[str]()
    for name, table in scenario.window.items() if fixed else ():
        place, settings = window_place(name, scenario.window), table.settings(scenario.fluid)
        middle = _middle(scenario, table.target, solids)
        for body, share, is_beyond in _overlaps(fixed, settings, middle, level):
            if share == 1.0:
                text = f"puts all of the window inside body {body!r}, where no water is, allowed: a place in the water"
                problems.append(Problem(f"{place}.target", text))
            elif is_beyond:
                told.append(
                    f"{place}: body {body!r} reaches beyond it, so its water flows through that body;"
                    f" {place}.size must hold all of a fixed body, or the window must be clear of it"
                )
    if problems:
        raise ScenarioError(problems, scenario.name)
    return tuple(told)


def _middle(scenario: RunSpec, target: str | Point2, solids: Sequence[Solid]) -> Array:
    """Return the place (2,) [m] of a window's middle at the start."""
    if not isinstance(target, str):
        return np.array(target)
    names = [body_of(target) if target in scenario.vessels else target]
    if target in scenario.booms:
        names = middle_of(segment_names(target, scenario.booms[target].segments))
    return np.mean([solid.placed.position[:2] for solid in solids if solid.name in names], axis=0)


def _overlaps(
    fixed: Sequence[Solid], settings: WindowSettings, middle: Array, level: float
) -> Iterator[tuple[str, float, bool]]:
    """Yield each fixed body in a window around `middle` (2,) [m], the share of the window inside it, and whether it reaches beyond."""
    size = np.array(settings.whole_size)
    lines = [middle[axis] + size[axis] * ((np.arange(COLUMNS) + 0.5) / COLUMNS - 0.5) for axis in (0, 1)]
    heights = level - settings.depth * (np.arange(4) + 0.5) / 4.0
    points = np.stack(np.meshgrid(*lines, heights, indexing="ij"), -1).reshape(-1, 3)
    for solid in fixed:
        low, high = solid.world_mesh().bounds[:, :2]
        turn = Rotation.from_quat(solid.placed.orientation)
        own = np.ascontiguousarray(turn.inv().apply(points - solid.placed.position))
        share = float((SignedDistance(solid.placed.mesh).phi(own) < 0.0).mean())
        if share > 0.0:
            yield solid.name, share, bool((low < middle - 0.5 * size).any() or (high > middle + 0.5 * size).any())
