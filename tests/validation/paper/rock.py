"""Case 63: Fig. 5 of Qiu et al. (2021), oil that a pipe pours over a rock."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from scenarios.running.assembly import Assembly
from tests.validation.case import Bench, Case, Map, Outcome, Panel, trace
from tests.validation.paper.runs import CORRECTION, OILS, OURS, PAPER, SAMPLE, THICK, Scene, figure, follow
from tests.validation.paper.shapes import covered, thickness

HEIGHT = 0.3  # [m] of the rock above the pool
DURATION = 30.0  # [s]
MOMENTS = (10.0, 15.0, 20.0, 25.0)  # [s]
CELL = 0.025  # [m] of the maps
SIDE = (-0.5, 0.5, 0.0, 0.8)  # [m] range of x and z that they show
ROCK_POINTS = 20_000  # on the rock's surface
ABOVE_POOL = 0.1  # [m] height on the rock from which oil counts as hanging on it; the pool of all oil is 5 cm deep
DRAINED = 5.0  # [s] after the last oil has left the pipe
BARE = 0.95  # [1] share of the rock from which on it does not count as coated


@dataclass(frozen=True)
class Poured:
    """The oil of one moment: its particles, the share of the rock that it leaves bare, its volume over area seen along y [m].

    outline: of the rock (n, 2) [m], seen the same way
    """

    particles: int
    bare: float
    thickness: NDArray[np.floating]
    outline: NDArray[np.floating]


def look(assembly: Assembly) -> Poured:
    """Look at the oil of a run, and at the rock."""
    oil, spacing = assembly.fluid.phase_positions("oil"), assembly.fluid.config.particle_spacing
    mesh = assembly.controls.present_meshes()["rock"]
    surface = trimesh.sample.sample_surface(mesh, ROCK_POINTS, seed=0)[0]
    corners = mesh.vertices[:, ::2]
    return Poured(
        len(oil),
        1.0 - covered(oil, surface, 1.5 * spacing, ABOVE_POOL),
        thickness(oil[:, ::2], spacing**3, SIDE, CELL),
        corners[ConvexHull(corners).vertices],
    )


def scenes(resolution: int) -> list[Scene]:
    """Return the runs of Fig. 5: the paper's setting, its oil in the split scheme, and an oil that is as thick as γ makes it."""
    poured = OILS[1]
    kinds = ((PAPER, poured), (OURS, poured), (THICK, CORRECTION * poured))
    return [
        Scene(scenario="rock-coating", setting=setting, viscosity=oil, spacing=HEIGHT / resolution, duration=DURATION)
        for setting, oil in kinds
    ]


def outcome(runs: Mapping[Scene, Sequence[Poured]]) -> Outcome:
    """Measure what of the rock is bare after the last oil has left the pipe."""
    values, traces, rows = {}, [], []
    for scene, run in runs.items():
        name = scene.setting.name
        end = int(np.argmax([one.particles for one in run]))
        after = run[end : end + round(DRAINED / SAMPLE) + 1]
        values |= {
            f"last oil leaves the pipe, {name}": SAMPLE * end,
            f"bare share of the rock at least, {name}": min(one.bare for one in run),
            f"bare share of the rock {DRAINED:g} s after the last oil, {name}": after[-1].bare,
        }
        traces.append(trace("covered", SAMPLE * np.arange(len(run)), [100.0 * (1.0 - one.bare) for one in run], name))
        rows.append(
            tuple(
                Map(f"{name}, {scene.viscosity:g} Pa s, {moment:g} s", SIDE, 1e3 * one.thickness, one.outline)
                for moment in MOMENTS
                for one in [run[: round(moment / SAMPLE) + 1][-1]]
            )
        )
    return Outcome(values=values, traces=tuple(traces), maps=tuple(rows))


def paper_rock(resolution: int, bench: Bench) -> Outcome:
    """Case 63: oil pours over a rock in the paper's setting and in ours, and one as thick as the paper's setting makes it."""
    return outcome(follow(scenes(resolution), bench, look))


PAPER_ROCK = Case(
    number=63,
    name="paper-rock",
    title="Fig. 5 of Qiu et al. (2021): oil pours over a rock",
    source="conclusion of Qiu, Ren, Li, Tao and Zhou (2021), oil coats the rock and stays on it",
    setup="a pipe pours 25 litres of oil over a rock that is 0.3 m higher than the pool: the paper's scheme (γ = 1e4) and the "
    "split scheme with the paper's oil, the split scheme with an oil that is 1e4 times as thick; 30 s",
    length=HEIGHT,
    length_symbol="H",
    resolutions=(10,),
    quantities=tuple(
        quantity
        for setting in (PAPER, OURS, THICK)
        for quantity in (
            figure(f"last oil leaves the pipe, {setting.name}", unit="s"),
            figure(f"bare share of the rock at least, {setting.name}"),
            figure(
                f"bare share of the rock {DRAINED:g} s after the last oil, {setting.name}",
                None if setting == OURS else BARE,
            ),
        )
    ),
    panels=(Panel("covered", "t [s]", "rock's surface above the pool under oil [%]", y_range=(0.0, 100.0)),),
    map_label="oil along the line of sight [mm]",
    own_step=True,
    run=paper_rock,
    spacings=1,
    note="a film of the paper's oil as given is a hundredth of a particle thick, so the split scheme is not judged with it. The rock's "
    "outline is its convex hull.",
)
