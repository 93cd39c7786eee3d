"""Run time against error on small scenes, this solver beside SPlisHSPlasH where that is installed.

    python -m tests.benchmarks.pareto [--quick] [--scenes column dam ...] [--output pareto-report]

Prints a table and writes pareto.json and pareto.png. Runs of the solvers alternate, so that a machine's other load meets all of
them. A whole run takes five to ten minutes on two cores.

How to read it: errors are magnitudes of one run each, so a point far below its neighbours may be an error on its way through 0,
not a good setting; on a shared machine wall times differ by up to a factor of two from run to run.
"""

from __future__ import annotations

import argparse
import dataclasses
import itertools
import json
import os
import platform
from collections.abc import Iterator, Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import track
from rich.table import Table

from tests.benchmarks.pareto import ours, splishsplash
from tests.benchmarks.pareto.measures import pareto_front
from tests.benchmarks.pareto.plot import draw
from tests.benchmarks.pareto.results import Row, Variant, points, variants
from tests.benchmarks.pareto.scenes import SCENES, Scene

LEFT = ("solver", "family", "settings")
RUN = {ours.NAME: ours.run, splishsplash.NAME: splishsplash.run}


def arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="two coarse spacings, one setting a family")
    parser.add_argument("--scenes", nargs="+", choices=tuple(SCENES), default=tuple(SCENES), metavar="SCENE")
    parser.add_argument("--output", type=Path, default=Path("pareto-report"), help="folder for picture and numbers")
    return parser.parse_args()


def alternating(scenes: Sequence[Scene], quick: bool, competitor: bool) -> list[tuple[Scene, Variant]]:
    """All runs; within a scene one of each solver in turn."""

    def turns(scene: Scene) -> Iterator[Variant]:
        lists = [variants(ours.NAME, ours.FAMILIES, scene, quick)]
        if competitor:
            theirs = variants(splishsplash.NAME, splishsplash.FAMILIES, scene, quick)
            lists.append(theirs[:1] if scene.periodic else theirs)  # one row says that it cannot
        for turn in itertools.zip_longest(*lists):
            yield from (variant for variant in turn if variant is not None)

    return [(scene, variant) for scene in scenes for variant in turns(scene)]


def _cells(row: Row, measures: Sequence[str], here: Sequence[Row]) -> list[str]:
    """The errors of a row, each with a star where it lies on the front of its solver's rows."""
    cells = []
    for name in measures:
        if name not in row.errors:
            cells.append("")
            continue
        front = pareto_front(points(here, row.solver, name))
        best = (row.wall_per_second, row.errors[name]) in front
        cells.append(f"{row.errors[name]:.2g}{' *' if best else '  '}")
    return cells


def scene_table(rows: Sequence[Row], title: str) -> Table:
    """The rows of one scene, solver by solver."""
    measures = list(dict.fromkeys(name for row in rows for name in row.errors))
    table = Table(title=f"{title} (* on the solver's Pareto front)")
    for column in LEFT:
        table.add_column(column)
    for column in ("particles", "wall s / simulated s", *measures):
        table.add_column(column, justify="right")
    table.add_column("note")
    for row in sorted(rows, key=lambda row: row.solver):
        cost = "" if row.wall_per_second is None else f"{row.wall_per_second:.3g}"
        count = str(row.particle_count or "")
        table.add_row(row.solver, row.family, row.label, count, cost, *_cells(row, measures, rows), row.note)
    return table


def write(rows: Sequence[Row], titles: dict[str, str], left_out: str, folder: Path) -> None:
    """Write pareto.json and pareto.png."""
    folder.mkdir(parents=True, exist_ok=True)
    report = {
        "cpu_count": len(os.sched_getaffinity(0)),
        "python": platform.python_version(),
        "left_out": left_out,
        "rows": [dataclasses.asdict(row) for row in rows],
    }
    (folder / "pareto.json").write_text(json.dumps(report, indent=1) + "\n")
    if any(row.errors for row in rows):
        draw(rows, titles, folder / "pareto.png")


def main() -> None:
    """Run, print, draw."""
    options = arguments()
    console = Console(width=170)
    reason = splishsplash.locate()[1]
    if reason:
        console.print(f"{splishsplash.NAME} is left out: {reason}", markup=False)
    scenes = [SCENES[name]() for name in options.scenes]
    runs = alternating(scenes, options.quick, competitor=not reason)
    rows = [RUN[variant.solver](scene, variant) for scene, variant in track(runs, "running", console=console)]
    titles = {scene.name: scene.title for scene in scenes}
    for name, title in titles.items():
        console.print(scene_table([row for row in rows if row.scene == name], title))
    write(rows, titles, reason, options.output)
    console.print(f"written: pareto.json, pareto.png in {options.output}")


if __name__ == "__main__":
    main()
