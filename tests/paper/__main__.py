"""Draw the figures of Qiu et al. 2021 again, and test the paper's conclusions.

    python -m tests.paper [--figures 3,4,5,6] [--finer 1.0] [--steps 150] [--output FOLDER]

Writes a picture for each figure, and paper.md and paper.json with what was measured. The runs of the figures 3 to 5 take one thread each,
as many at a time as there are cores; the steps of figure 6 are timed alone, with all cores. The exit status is 1 if a conclusion that is
known to hold does not, or the other way round.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from pathlib import Path

from tests.paper import conclusions, figures, runs
from tests.paper.conclusions import Verdict
from tests.paper.scenes import Scene, Track, follow
from tests.paper.timing import STEP, Timing, schemes, timed_in_turn

FIGURES = (3, 4, 5, 6)
SCENES: dict[int, Callable[[float], list[Scene]]] = {3: runs.calm, 4: runs.wind, 5: runs.rock}
WORDS = {True: "holds", False: "does not hold", None: "-"}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run what the command line asks for; returns the exit status."""
    options = parse(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    begin = time.perf_counter()
    chosen = {number: SCENES[number](options.finer) for number in options.figures if number in SCENES}
    tracks = follow_all([scene for scenes in chosen.values() for scene in scenes])
    verdicts: list[Verdict] = []
    for number, scenes in chosen.items():
        verdicts += finish(number, [tracks[scene] for scene in scenes], options.output)
    if 6 in options.figures:
        verdicts += finish_timing(options.steps, options.output)
    write(verdicts, list(tracks.values()), time.perf_counter() - begin, options.output)
    return 1 if any(one.is_surprise for one in verdicts) else 0


def parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.paper", description="Draw the paper's figures again.")
    parser.add_argument(
        "--figures",
        type=lambda text: [int(one) for one in text.split(",")],
        default=list(FIGURES),
        metavar="N[,N...]",
        help="which figures, of 3, 4, 5, 6 (default: all)",
    )
    parser.add_argument("--finer", type=float, default=1.0, help="divides the spacings of figures 3 to 5 (default: 1)")
    parser.add_argument("--steps", type=int, default=150, metavar="N", help="steps of 10 ms to time (default: 150)")
    parser.add_argument("--output", type=Path, default=Path("paper-report"), help="folder (default: paper-report)")
    options = parser.parse_args(arguments)
    if not set(options.figures) <= set(FIGURES):
        parser.error(f"--figures is {options.figures}, allowed: 3, 4, 5, 6")
    if not 0.5 <= options.finer <= 4.0:
        parser.error(f"--finer is {options.finer}, allowed: 0.5 to 4")
    if options.steps < 1:
        parser.error(f"--steps is {options.steps}, allowed: 1 or more")
    return options


def follow_all(scenes: Sequence[Scene]) -> dict[Scene, Track]:
    """Follow runs in processes of their own, those that take longest first."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(max(1, len(os.sched_getaffinity(0))), mp_context=context) as pool:
        waiting = {pool.submit(follow, scene): scene for scene in sorted(scenes, key=_cost, reverse=True)}
        found = {}
        for future in as_completed(waiting):
            track = found[waiting[future]] = future.result()
            print(f"{track.scene.label}: {track.particles} particles, {track.wall:.0f} s", flush=True)
    return found


def _cost(scene: Scene) -> float:
    """Guess a run's relative cost: the paper's scheme takes twice as long."""
    return scene.duration * (2.0 if "fluid.scheme=paper" in scene.setting.entries else 1.0)


def finish(number: int, tracks: Sequence[Track], output: Path) -> list[Verdict]:
    """Draw one of the figures 3 to 5, and judge it."""
    picture = output / f"paper-figure-{number}.jpg"
    drawn = [track for track in tracks if track.scene.moments]
    if number == 5:
        figures.draw_rock(drawn, picture, "Fig. 5 again: oil pours over a rock")
        return list(conclusions.coating(tracks))
    if number == 3:
        curves = [("area", "area under oil [m²]"), ("axis_ratio", "axis ratio")]
        figures.draw_spreading(drawn, picture, "Fig. 3 again: oil falls onto a calm sea", curves)
        return list(conclusions.spreading(tracks))
    curves = [("drift", "way with the wind [m]"), ("axis_ratio", "axis ratio")]
    figures.draw_spreading(drawn, picture, "Fig. 4 again: oil in wind and waves, which come from the right", curves)
    return list(conclusions.drifting(tracks))


def finish_timing(steps: int, output: Path) -> list[Verdict]:
    """Time the schemes in turn, draw Fig. 6 and judge it."""
    threads = len(os.sched_getaffinity(0))
    timings: list[Timing] = []
    for viscosity in runs.OILS[:2]:
        for timing in timed_in_turn(schemes(), viscosity, steps * STEP, threads):
            timings.append(timing)
            print(f"{timing.name}, {viscosity:g} Pa s: {timing.a_second:.1f} s a simulated second", flush=True)
    title = f"Fig. 6 again: wall time of steps, {timings[0].particles} particles, {threads} threads"
    figures.draw_timing(timings, output / "paper-figure-6.jpg", title)
    return list(conclusions.costs(timings))


def write(verdicts: Sequence[Verdict], tracks: Sequence[Track], wall: float, output: Path) -> None:
    """Print and write the table of conclusions."""
    rows = ["| figure | conclusion | setting | measured | |", "|---|---|---|---|---|"]
    rows += [_row(one) for one in verdicts]
    print("\n".join(rows))
    print(f"{wall / 60.0:.1f} minutes; report: {output / 'paper.md'}")
    (output / "paper.md").write_text("\n".join(rows) + "\n", encoding="utf-8")
    told = {
        "wall_minutes": wall / 60.0,
        "conclusions": [asdict(one) for one in verdicts],
        "runs": [
            {
                "run": track.scene.label, "particles": track.particles, "lost": track.lost, "wall_s": track.wall, "time_s": track.times,
                "footprints": [None if one is None else asdict(one) for one in track.footprints],
                "coatings": [asdict(one) for one in track.coatings],
            }
            for track in tracks
        ],
    }  # fmt: skip
    (output / "paper.json").write_text(
        json.dumps(told, indent=1, default=lambda value: value.tolist()) + "\n", encoding="utf-8"
    )


def _row(one: Verdict) -> str:
    """Write a conclusion as a row of the table."""
    word = WORDS[one.holds] + (", UNEXPECTED" if one.is_surprise else "")
    return f"| {one.figure} | {one.statement} | {one.setting} | {one.measured} | {word} |"


if __name__ == "__main__":
    sys.exit(main())
