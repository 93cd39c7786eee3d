"""Case 64: Fig. 6 of Qiu et al. (2021), the wall time of single steps in the scene of Fig. 2."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence

import numpy as np

from tests.validation.case import Bench, Case, Outcome, Panel, trace
from tests.validation.paper.runs import OILS, OURS, PAPER, TANK, Scene, Setting, figure

STEP = 0.01  # [s] the paper's, held by its scheme
DURATION = 1.5  # [s]
SAVED = 0.05  # [1] least saving of a step's time that counts
HELD = (*PAPER.entries, f"fluid.minimum_time_step={STEP}", f"fluid.maximum_time_step={STEP}")
PLAIN = Setting("DFPBF (ω = 0)", (*HELD, "fluid.relaxation=0"))
RELAXED = Setting("rDFPBF (ω = 0.1)", (*HELD, "fluid.relaxation=0.1"))
SETTINGS = (PLAIN, RELAXED, OURS)

Times = Mapping[tuple[Setting, float], Sequence[float]]  # wall times of steps [ms] by setting and viscosity


def timed_in_turn(scenes: Sequence[Scene], bench: Bench) -> Times:
    """Run scenes from their begin on, `STEP` by `STEP` in turn, and take the wall time of every step [ms].

    So work of others on the machine slows all alike.
    """
    fluids = [scene.build(bench.threads).fluid for scene in scenes]
    for fluid in fluids:
        fluid.advance(1e-4)  # compiles
    taken: list[list[float]] = [[] for _ in fluids]
    spent = [0.0] * len(fluids)
    for _ in range(round(DURATION / STEP)):
        for each, fluid in enumerate(fluids):
            begin = time.perf_counter()
            report = bench.advance(fluid, STEP)
            spent[each] += 1e3 * (time.perf_counter() - begin)
            if report.sub_steps:  # ours may end none within 10 ms
                taken[each] += [spent[each] / report.sub_steps] * report.sub_steps
                spent[each] = 0.0
    for fluid in fluids:
        fluid.close()
    return {(scene.setting, scene.viscosity): times for scene, times in zip(scenes, taken, strict=True)}


def outcome(times: Times) -> Outcome:
    """Compare the schemes and the oils."""
    thin, thick = OILS[:2]
    # step by step, each with the one that was taken next to it
    ratios = [float(np.median(np.divide(times[RELAXED, oil], times[PLAIN, oil]))) for oil in (thin, thick)]
    values = {"a relaxed step over a plain one, median": max(ratios)}
    for setting in SETTINGS:
        both = [float(np.sum(times[setting, oil])) for oil in (thin, thick)]
        values[f"steps with the thicker oil over those with the thinner, {setting.name}"] = both[1] / both[0]
        values[f"wall time of a simulated second, {setting.name}"] = 1e-3 * sum(both) / (2.0 * DURATION)
    traces = [trace(f"{oil:g}", np.arange(len(taken)), taken, setting.name) for (setting, oil), taken in times.items()]
    return Outcome(values=values, traces=tuple(traces))


def paper_timing(resolution: int, bench: Bench) -> Outcome:
    """Case 64: steps of both of the paper's schemes and of ours, with two of its oils."""
    scenes = [
        Scene(scenario="calm-spread", setting=setting, viscosity=oil, spacing=TANK / resolution, duration=DURATION)
        for oil in OILS[:2]
        for setting in SETTINGS
    ]
    bench.plan(len(scenes) * DURATION)
    return outcome(timed_in_turn(scenes, bench))


PAPER_TIMING = Case(
    number=64,
    name="paper-timing",
    title="Fig. 6 of Qiu et al. (2021): wall time of steps",
    source="conclusion of Qiu, Ren, Li, Tao and Zhou (2021), relaxation makes steps 15 % cheaper",
    setup=f"the first {DURATION:g} s of paper-calm with two of its oils, with the paper's scheme in steps of 10 ms without and with "
    "relaxation, and with the split scheme in its own steps; they take turns, 10 ms at a time",
    length=TANK,
    length_symbol="L",
    resolutions=(62, 133),
    quantities=(
        figure("a relaxed step over a plain one, median", 1.0 - SAVED),
        *(
            quantity
            for setting in SETTINGS
            for quantity in (
                figure(f"steps with the thicker oil over those with the thinner, {setting.name}"),
                figure(f"wall time of a simulated second, {setting.name}", unit="s"),
            )
        ),
    ),
    panels=tuple(Panel(f"{oil:g}", "step", f"ms a step, {oil:g} Pa s", log_y=True) for oil in OILS[:2]),
    own_step=True,
    run=paper_timing,
    spacings=1,
    note="the larger ratio of both oils counts. The paper has L/133, eight cores, 438 to 539 s of wall time a simulated second, "
    "and 4 to 5 % more time with the thicker oil.",
)
