"""The runs of a sweep: every combination of the values that some entries take, or a sample of the ranges of some."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from rich.progress import track
from scipy.stats import qmc

from scenarios.running.plan import Plan
from scenarios.spec.load import load_scenario
from scenarios.text.problems import Problem, ScenarioError
from scenarios.text.terminal import terminal
from scenarios.text.toml import read_toml

Method = Literal["latin-hypercube", "monte-carlo"]
_RANGE = "key=low:high, for example tow.speed_kn=0.3:0.9"
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
        raise ScenarioError([Problem("--range", f"is {text!r}, allowed: {_RANGE}, low below high")], "oilsim")
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


_ALLOWED = "key=value,value,... for example tow.speed_kn=0.3,0.5,0.7"
MOST_RUNS = 100_000  # of a sweep: each leaves files of its own
MANY_RUNS = 1_000  # from which a sweep is refused at its first fault, since looking for all takes minutes
_NAME_LETTERS = 80  # of a combination in a file's name


@dataclass(frozen=True, kw_only=True)
class Variation:
    """An entry of a scenario and its values, written as in ``--set``."""

    key: str
    values: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Variant:
    """One run of a sweep.

    values: the value of each varied entry, by key; plan: the run to make; source: the scenario's file.
    """

    values: dict[str, str]
    plan: Plan
    source: Path

    @property
    def title(self) -> str:
        """The varied entries in words: ``tow.speed_kn=0.5, phases.oil.density=900``."""
        return ", ".join(f"{key}={value}" for key, value in self.values.items())

    @property
    def name(self) -> str:
        """The name of its files; another scenario, or another length, makes another name."""
        course = f"{self.plan.fingerprint(0)} {self.plan.scenario.run.duration!r} {self.title}"
        readable = re.sub(r"[^\w.=+-]+", "_", self.title)[:_NAME_LETTERS]
        return f"{readable}-{hashlib.sha256(course.encode()).hexdigest()[:8]}"


def parse_variation(text: str) -> Variation:
    """Read ``tow.speed_kn=0.3,0.5``; values are TOML, and bare words are text.

    Raises ScenarioError if there is no value, or one value twice.
    """
    key, equals, listed = text.partition("=")
    values = _values(listed)
    if not (equals and key.strip() and values and all(values)):
        raise ScenarioError([Problem("--vary", f"is {text!r}, allowed: {_ALLOWED}")], "oilsim")
    twice = sorted(value for value, count in Counter(values).items() if count > 1)
    if twice:
        raise ScenarioError(
            [Problem(f"--vary {key}", f"has the value {', '.join(twice)} twice, allowed: each value once")], "oilsim"
        )
    return Variation(key=key.strip(), values=values)


def variants(
    source: str | Path,
    variations: Sequence[Variation],
    *,
    overrides: tuple[str, ...] = (),
    demo: bool = False,
    samples: Sequence[Mapping[str, str]] = ({},),
) -> list[Variant]:
    """Build all combinations, each with every sample of other entries; the last entry varies fastest, the samples faster.

    Raises ScenarioError with everything that is wrong in any combination, before anything is run; of more than `MANY_RUNS`, with what is
    wrong in the first that is refused. Shows how far the look has come.
    """
    keys = [variation.key for variation in variations] + list(samples[0])
    twice = sorted({key for key in keys if keys.count(key) > 1})
    if twice:
        raise ScenarioError(
            [
                Problem(f"--vary {key}", "is given twice, allowed: once, with all its values or one range")
                for key in twice
            ],
            "oilsim",
        )
    count = require_few([len(variation.values) for variation in variations], len(samples))
    found: list[Variant] = []
    problems: list[Problem] = []
    where = ""
    grid = itertools.product(*(variation.values for variation in variations))
    looked = track(
        itertools.product(grid, samples),
        "looking at the runs",
        total=count,
        console=terminal(stderr=True),
        transient=True,
    )
    for combination, sample in looked:
        if problems and count > MANY_RUNS:
            break
        values = dict(zip(keys, combination, strict=False)) | dict(sample)
        settings = (*overrides, *(f"{key}={value}" for key, value in values.items()))
        try:
            loaded = load_scenario(source, overrides=settings, demo=demo)
        except ScenarioError as error:
            problems.extend(error.problems)
            where = error.source
            continue
        plan = Plan(scenario=loaded.scenario, text=loaded.text, overrides=settings)
        found.append(Variant(values=values, plan=plan, source=loaded.path))
    if problems:
        raise ScenarioError(problems, where)
    return found


def require_few(values: Sequence[int], samples: int) -> int:
    """Return the number of runs of a sweep, by how many values each entry takes; ScenarioError for more than `MOST_RUNS`."""
    count = math.prod(values) * samples
    if count > MOST_RUNS:
        raise ScenarioError([Problem("the sweep", f"has {count:,} runs, allowed: up to {MOST_RUNS:,}")], "oilsim")
    return count


def _values(listed: str) -> tuple[str, ...]:
    """Split the values at their commas and write them as TOML; values that are not TOML stay as they are."""
    try:
        values: list[Any] = read_toml(f"values = [{listed}]")["values"]
        return tuple(json.dumps(value) for value in values)  # which TOML reads alike
    except (ValueError, TypeError):
        return tuple(value.strip() for value in listed.split(","))
