"""Samples of ranges: Latin hypercubes and Monte Carlo, repeatable by a seed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.stats import qmc

from scenarios.problems import Problem, ScenarioError

Method = Literal["latin-hypercube", "monte-carlo"]
METHODS: tuple[Method, ...] = ("latin-hypercube", "monte-carlo")
_ALLOWED = "key=low:high, for example tow.speed_kn=0.3:0.9"
_FIGURES = 6  # significant figures of a sampled value


@dataclass(frozen=True, kw_only=True)
class Range:
    """An entry of a scenario that takes every value from `low` to `high` with the same chance, in the unit of its key."""

    key: str
    low: float
    high: float


def parse_range(text: str) -> Range:
    """Read ``tow.speed_kn=0.3:0.9``; ScenarioError for another text, or a range that is empty."""
    key, _, span = text.partition("=")
    low, _, high = span.partition(":")
    try:
        found = Range(key=key.strip(), low=float(low), high=float(high))
    except ValueError:
        found = None
    if found is None or not found.key or not (math.isfinite(found.low) and found.low < found.high < math.inf):
        raise ScenarioError([Problem("--range", f"is {text!r}, allowed: {_ALLOWED}, low below high")], "oilsim")
    return found


def samples(ranges: Sequence[Range], count: int, method: Method, seed: int) -> list[dict[str, str]]:
    """Draw `count` points of the box of the ranges, each as texts for ``--set``, by key.

    A Latin hypercube (McKay, Beckman and Conover 1979) has one point in each of `count` equal slices of every range; Monte Carlo draws all
    points independently. The same seed gives the same points.
    """
    generator = np.random.default_rng(seed)
    if method == "latin-hypercube":
        unit = qmc.LatinHypercube(d=len(ranges), rng=generator).random(count)
    else:
        unit = generator.random((count, len(ranges)))
    low, high = (np.array([getattr(one, side) for one in ranges]) for side in ("low", "high"))
    return [
        {one.key: f"{value:.{_FIGURES}g}" for one, value in zip(ranges, point, strict=True)}
        for point in low + unit * (high - low)
    ]
