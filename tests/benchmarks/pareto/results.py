"""What is run and what comes out of it: a `Variant` of a solver's settings becomes a `Row` of cost and errors."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from tests.benchmarks.pareto.measures import Sample
from tests.benchmarks.pareto.scenes import Scene


@dataclass(frozen=True, kw_only=True)
class Family:
    """Settings varied together: one curve of points.

    settings      each a set of the solver's own options, in addition to its defaults
    spacings      at which of the scene's spacings they are run
    scenes        where the family says something; empty means everywhere
    """

    name: str
    settings: Sequence[Mapping[str, Any]]
    spacings: Literal["every", "reference", "finest"] = "reference"
    scenes: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Variant:
    """One run: the solver, the family it belongs to, particle spacing [m] and the solver's options."""

    solver: str
    family: str
    spacing: float
    options: Mapping[str, Any] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """What tells this run from the others of its scene."""
        options = [f"{key.replace('_', ' ')} {value}" for key, value in self.options.items()]
        return ", ".join([f"d {self.spacing:.4g} m", *options])


@dataclass(frozen=True, kw_only=True)
class Row:
    """The outcome of a run.

    wall_per_second       wall seconds a simulated second, the median over communication steps
    wall_per_second_mean  the same, total over total
    errors                by measure; empty when the run failed, and `note` says why
    """

    scene: str
    solver: str
    family: str
    label: str
    particle_count: int = 0
    wall_per_second: float | None = None
    wall_per_second_mean: float | None = None
    errors: Mapping[str, float] = field(default_factory=dict)
    note: str = ""


def points(rows: Iterable[Row], solver: str, measure: str) -> list[tuple[float, float]]:
    """(wall seconds a simulated second, error) of the solver's runs that have the measure."""
    mine = (row for row in rows if row.solver == solver and measure in row.errors)
    return [(row.wall_per_second, row.errors[measure]) for row in mine if row.wall_per_second is not None]


def variants(solver: str, families: Iterable[Family], scene: Scene, quick: bool) -> list[Variant]:
    """The runs of a solver on a scene; a quick benchmark takes the two coarsest spacings and one setting of each family."""
    every = scene.spacings[:2] if quick else scene.spacings
    spacings = {"every": every, "reference": (scene.reference,), "finest": every[-1:]}
    return [
        Variant(solver=solver, family=family.name, spacing=spacing, options=options)
        for family in families
        if not family.scenes or scene.name in family.scenes
        for options in (family.settings[:1] if quick else family.settings)
        for spacing in spacings[family.spacings]
    ]


def outcome(scene: Scene, variant: Variant, samples: Sequence[Sample], seconds: Sequence[float]) -> dict[str, Any]:
    """Cost and errors of a run as the fields of a `Row`; `seconds` is the wall time of each communication step."""
    simulated = np.diff([0.0] + [sample.time for sample in samples])
    lost = len(scene.particles(variant.spacing)) - len(samples[-1].position)
    errors = {name: float(measure(samples, variant.spacing)) for name, measure in scene.measures.items()}
    unfit = [name for name, error in errors.items() if not math.isfinite(error)]
    notes = [f"{lost} particles lost"] * bool(lost) + [f"no {name}: the flow is gone" for name in unfit]
    return {
        "note": ", ".join(notes),
        "particle_count": len(samples[-1].position),
        "wall_per_second": float(np.median(np.asarray(seconds) / simulated)),
        "wall_per_second_mean": float(np.sum(seconds) / np.sum(simulated)),
        "errors": {name: error for name, error in errors.items() if name not in unfit},
    }


def failure(scene: Scene, variant: Variant, note: str) -> Row:
    """A run without a result."""
    return Row(scene=scene.name, solver=variant.solver, family=variant.family, label=variant.label, note=note)
