"""Cases 61 and 62: Fig. 3 and 4 of Qiu et al. (2021), oil that falls onto a calm sea, and into wind and waves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from scenarios.running.assembly import Assembly
from tests.validation.case import Bench, Case, Map, Outcome, Panel, Quantity, Trace, trace
from tests.validation.paper.runs import (
    CORRECTION,
    OILS,
    OURS,
    PAPER,
    SAMPLE,
    TANK,
    THICK,
    Scene,
    Setting,
    figure,
    follow,
    over,
)
from tests.validation.paper.shapes import Footprint, footprint, thickness

DURATION = 10.0  # [s]
MOMENTS = (1.0, 5.0, 10.0)  # [s] of the paper's figures
CELL = 0.1  # [m] of the maps
ROUND = 0.15  # [1] excess of the axis ratio of what counts as a circle
OBLONG = 0.87  # [1] width over length of what counts as an ellipse: an axis ratio of 1.15
STILL = 0.33  # [1] drift in a calm over that which counts as one
LAST = 2.0  # [s] over which a shape is averaged
SQUARE = (  # a sea as wide as it is long: the paper's is twice as long as wide, along the wind
    "tank.lower=[0, -1, 0]", "tank.upper=[4, 3, 4]", "fill.ocean.lower=[0, -1, 0]", "fill.ocean.upper=[4, 3, 0.3]",
)  # fmt: skip
WAVES = ("tank.zones.wave_maker.lower=[3, -1, 0]", "tank.zones.wave_maker.upper=[4, 3, 4]")


@dataclass(frozen=True)
class Slick:
    """The oil of one moment: its footprint, whether it is within two spacings of a side, and its thickness (rows, columns) [m] in cells."""

    footprint: Footprint
    near_side: bool
    thickness: NDArray[np.floating]
    extent: tuple[float, float, float, float]


Runs = Mapping[Scene, Sequence[Slick]]


def look(assembly: Assembly) -> Slick:
    """Look at the oil of a run from above."""
    fluid = assembly.fluid
    places, spacing = fluid.phase_positions("oil")[:, :2], fluid.config.particle_spacing
    lower, upper = np.array(fluid.config.lower[:2]), np.array(fluid.config.upper[:2])
    room = min((places - lower).min(), (upper - places).min())
    extent = (lower[0], upper[0], lower[1], upper[1])
    return Slick(
        footprint(places, 2.0 * spacing), room < 2.0 * spacing, thickness(places, spacing**3, extent, CELL), extent
    )


def calm_scenes(resolution: int) -> list[Scene]:
    """Return the runs of Fig. 3; those of oils that are as thick as γ makes them last two seconds only, and are not drawn."""
    spacing = TANK / resolution
    return [
        Scene(scenario="calm-spread", setting=setting, viscosity=factor * oil, spacing=spacing, duration=duration)
        for setting, factor, duration in ((PAPER, 1.0, DURATION), (OURS, 1.0, DURATION), (THICK, CORRECTION, 2.0))
        for oil in OILS
    ]


def calm_outcome(runs: Runs) -> Outcome:
    """Measure circles and areas until the oil comes near the tank's sides."""
    values = {}
    for setting in (PAPER, OURS, THICK):
        own = _of(runs, "calm-spread", setting)
        ends = [next((k for k, one in enumerate(run) if one.near_side), len(run)) - 1 for run in own]
        last = [run[end].footprint for run, end in zip(own, ends, strict=True)]
        areas = [run[min(ends)].footprint.area for run in own]
        values |= {
            f"time until the sides, {setting.name}": SAMPLE * min(ends),
            f"axis ratio before the sides, {setting.name}": max(one.axis_ratio for one in last),
            f"reach of its corners, {setting.name}": max(one.corner_ratio for one in last),
            f"area of a thicker oil over a thinner one's, {setting.name}": max(b / a for a, b in pairwise(areas)),
        }
    return Outcome(values=values, traces=_curves(runs, "area"), maps=_maps(runs))


def paper_calm(resolution: int, bench: Bench) -> Outcome:
    """Case 61: the paper's three oils, and oils thicker by γ, fall onto a calm sea."""
    return calm_outcome(follow(calm_scenes(resolution), bench, look))


def wind_scenes(resolution: int) -> list[Scene]:
    """Return the runs of Fig. 4 on a square sea, and for each setting the thinnest oil on the same sea in a calm, which is not drawn."""
    kinds = [("wind-drift", oil, (*SQUARE, *WAVES)) for oil in OILS] + [("calm-spread", OILS[0], SQUARE)]
    return [
        Scene(
            scenario=scenario, setting=setting, viscosity=oil, spacing=TANK / resolution, duration=DURATION, entries=entries
        )
        for setting in (PAPER, OURS)
        for scenario, oil, entries in kinds
    ]  # fmt: skip


def wind_outcome(runs: Runs) -> Outcome:
    """Measure drift with the wind, which blows along -x, and shapes."""
    values = {}
    for setting in (PAPER, OURS):
        windy, (still,) = _of(runs, "wind-drift", setting), _of(runs, "calm-spread", setting)
        ways = [float(_series(run, "drift")[-1]) for run in windy]
        calm = abs(float(_series(still, "drift")[-1]))
        values |= {
            f"drift of the thinnest oil, {setting.name}": ways[0],
            f"drift of the thickest oil, {setting.name}": ways[-1],
            f"drift in a calm over that in wind, {setting.name}": over(calm, min(ways)),
            f"drift of the thickest oil over the thinnest, {setting.name}": over(ways[-1], ways[0]),
            f"width over length along the wind, {setting.name}": _at_last(windy[0], "width_over_length"),
            f"axis ratio in wind, {setting.name}": _at_last(windy[0], "axis_ratio"),
            f"axis ratio in a calm, {setting.name}": _at_last(still, "axis_ratio"),
        }
    return Outcome(values=values, traces=_curves(runs, "drift"), maps=_maps(runs))


def paper_wind(resolution: int, bench: Bench) -> Outcome:
    """Case 62: the paper's three oils in wind and waves, and the thinnest in a calm."""
    return wind_outcome(follow(wind_scenes(resolution), bench, look))


def _of(runs: Runs, scenario: str, setting: Setting) -> list[Sequence[Slick]]:
    """Return the runs of a scenario in a setting, the thinnest oil first."""
    return [run for scene, run in runs.items() if scene.scenario == scenario and scene.setting == setting]


def _series(run: Sequence[Slick], name: str) -> NDArray[np.float64]:
    """Return a measure of the footprints of a run (T,) by name, or how far their centres have gone along -x [m]."""
    if name == "drift":
        return np.array([run[0].footprint.center[0] - one.footprint.center[0] for one in run])
    return np.array([getattr(one.footprint, name) for one in run])


def _at_last(run: Sequence[Slick], name: str) -> float:
    """Return the mean of a measure over the last `LAST` seconds of a run."""
    return float(np.mean(_series(run, name)[-round(LAST / SAMPLE) :]))


def _drawn(runs: Runs) -> Runs:
    """Return the runs with the paper's oils in the scenario that has all three."""
    of_all = next(iter(runs)).scenario
    return {scene: run for scene, run in runs.items() if scene.scenario == of_all and scene.setting != THICK}


def _curves(runs: Runs, name: str) -> tuple[Trace, ...]:
    """Draw a measure and the axis ratio over time, each setting in panels of its own."""
    return tuple(
        trace(f"{each}, {scene.setting.name}", SAMPLE * np.arange(len(run)), _series(run, each), f"{scene.viscosity:g} Pa s")
        for each in (name, "axis_ratio")
        for scene, run in _drawn(runs).items()
    )  # fmt: skip


def _panels(name: str, label: str) -> tuple[Panel, ...]:
    """Describe the panels of these curves."""
    return tuple(
        Panel(f"{kind}, {setting.name}", "t [s]", f"{text}, {setting.name}")
        for kind, text in ((name, label), ("axis_ratio", "axis ratio"))
        for setting in (PAPER, OURS)
    )


def _maps(runs: Runs) -> tuple[tuple[Map, ...], ...]:
    """Draw the thickness [mm] at the paper's moments: a row for each oil, the settings side by side."""
    rows: dict[float, list[Map]] = {oil: [] for oil in OILS}
    for scene, run in _drawn(runs).items():
        rows[scene.viscosity] += [
            Map(f"{scene.setting.name}, {scene.viscosity:g} Pa s, {moment:g} s", one.extent, 1e3 * one.thickness)
            for moment in MOMENTS
            for one in [run[: round(moment / SAMPLE) + 1][-1]]
        ]
    return tuple(tuple(row) for row in rows.values())


SOURCE = "conclusions of Qiu, Ren, Li, Tao and Zhou (2021)"
BLOCK = "a block of oil 0.5 m wide and 1 m high falls onto a sea"
PAPER_CALM = Case(
    number=61,
    name="paper-calm",
    title="Fig. 3 of Qiu et al. (2021): oil falls onto a calm sea",
    source=f"{SOURCE}, a circle, and less area the thicker the oil",
    setup=f"{BLOCK} of 4 x 2 m, 0.3 m deep: 10 s with the paper's three oils in its scheme (γ = 1e4) and in the split scheme, 2 s with "
    "oils that are 1e4 times as thick",
    length=TANK,
    length_symbol="L",
    resolutions=(50, 80, 133),
    quantities=tuple(
        quantity
        for setting in (PAPER, OURS, THICK)
        for quantity in (
            figure(f"time until the sides, {setting.name}", unit="s"),
            Quantity(name=f"axis ratio before the sides, {setting.name}", unit="1", reference=1.0, gate=ROUND),
            figure(f"reach of its corners, {setting.name}"),
            figure(f"area of a thicker oil over a thinner one's, {setting.name}", None if setting == OURS else 1.0),
        )
    ),
    panels=_panels("area", "area under oil [m²]"),
    map_label="thickness of the oil [mm]",
    own_step=True,
    run=paper_calm,
    spacings=1,
    note="the largest value of the three oils counts. In the split scheme the paper's oils spread alike, so their order is not judged. "
    "The reach of the corners is over that along the sides, 1 for a circle and 1.2 for a square. The paper has L/133.",
)
PAPER_WIND = Case(
    number=62,
    name="paper-wind",
    title="Fig. 4 of Qiu et al. (2021): oil in wind and waves, which come from the right",
    source=f"{SOURCE}, drift with wind and waves, the thinner the oil the farther, and an ellipse along the wind",
    setup=f"{BLOCK} of 4 x 4 m, 0.3 m deep, with a wind of 10 m/s and waves of 6 cm: 10 s with the paper's three oils in its scheme "
    "(γ = 1e4) and in the split scheme",
    length=TANK,
    length_symbol="L",
    resolutions=(40, 80, 133),
    quantities=tuple(
        quantity
        for setting in (PAPER, OURS)
        for quantity in (
            figure(f"drift of the thinnest oil, {setting.name}", unit="m"),
            figure(f"drift of the thickest oil, {setting.name}", unit="m"),
            figure(f"drift in a calm over that in wind, {setting.name}", STILL),
            figure(f"drift of the thickest oil over the thinnest, {setting.name}", 1.0 if setting == PAPER else None),
            figure(f"width over length along the wind, {setting.name}", OBLONG),
            figure(f"axis ratio in wind, {setting.name}"),
            figure(f"axis ratio in a calm, {setting.name}"),
        )
    ),
    panels=_panels("drift", "way with the wind [m]"),
    map_label="thickness of the oil [mm]",
    own_step=True,
    run=paper_wind,
    spacings=1,
    note="shapes are those of the thinnest oil, means of the last 2 s; one that lies across the wind or aslant is no ellipse along it. "
    "In the split scheme the paper's oils drift alike, so their order is not judged. "
    "The paper has L/133, and tells neither wind nor waves.",
)
