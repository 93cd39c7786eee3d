"""`oilsim list | new`: the shipped exercises and their briefs, and a copy of one with comments."""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import TYPE_CHECKING

from scenarios.running.output_paths import unwritable
from scenarios.text.problems import DONE, Problem, ScenarioError

if TYPE_CHECKING:
    from rich.console import Console

    from scenarios.spec.load import LoadedScenario
    from scenarios.spec.scenario import Scenario


LABORATORY = "laboratory"  # group of scenarios that are no exercises


def register_list(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser("list", help="list the shipped exercises and scenarios, or show a brief")
    parser.add_argument("scenario", nargs="?", metavar="NAME-or-FILE", help="show the trainee's brief of this exercise")
    parser.add_argument("--notes", action="store_true", help="with a name: show the instructor's notes, too")
    parser.set_defaults(command=_list)


def _list(options: argparse.Namespace) -> int:
    from scenarios.commands.options import require_used
    from scenarios.spec.load import load_scenario
    from scenarios.text.terminal import terminal

    require_used(options, {"notes": ("scenario",)})
    if options.scenario is not None:
        _show(terminal(), load_scenario(options.scenario).scenario, notes=options.notes)
        return DONE
    _list_scenarios(terminal())
    return DONE


def _show(console: Console, scenario: Scenario, *, notes: bool) -> None:
    """Print the brief of an exercise, and the instructor's notes."""
    from rich.text import Text

    from scenarios.text.terminal import flowing

    console.print(Text.assemble((scenario.name, "bold"), f": {scenario.title}"))
    exercise = scenario.exercise
    if exercise is None:
        console.print(flowing(scenario.text), highlight=False, markup=False)
        return
    parts = [("Learning goal", exercise.goal), ("Brief", exercise.brief)]
    for title, text in [*parts, *([("Instructor's notes", exercise.notes)] if notes else [])]:
        console.print(Text(f"\n{title}", style="bold"))
        console.print(flowing(text), highlight=False, markup=False)


def _list_scenarios(console: Console) -> None:
    from rich.table import Table
    from rich.text import Text

    from scenarios.spec.load import library_paths, load_scenario

    groups: dict[str, list[Scenario]] = {}
    for name in library_paths():
        scenario = load_scenario(name).scenario
        groups.setdefault(LABORATORY if scenario.exercise is None else scenario.exercise.group, []).append(scenario)
    console.print(
        Text.assemble(("Scenarios", "bold"), " (run one: oilsim run NAME; its brief: oilsim list NAME; a copy to change: oilsim new NAME)")
    )  # fmt: skip
    for group in sorted(groups, key=lambda one: (one == LABORATORY, one)):
        table = Table("name", "content", "levels", "simulated", title=group, title_justify="left")
        for scenario in groups[group]:
            levels = ", ".join(scenario.levels)
            table.add_row(scenario.name, scenario.title, levels, f"{scenario.run.duration:g} s")
        console.print(table)


# The comment on a table, by its name; tables of named things share the comment of the first one.
COMMENTS = {
    "exercise": "what the exercise is for: `oilsim list FILE` shows goal and brief, `--notes` the notes, too",
    "run": "length of the exercise [s]",
    "fluid": "size of the particles [m], where a run has some",
    "phases": "the liquids; `oilsim oils WORD` finds oils, and temperature is that of the water [degrees C]",
    "fill": "oil on the water at the start: corners [m] of a block; its thickness is upper z less lower z",
    "emitters": "pipes and leaks that pour oil; speed [m/s] times the area of the mouth is the rate",
    "tank": "a box with walls, full of particles",
    "sea": "depth [m], current, wind and waves; they go to direction_deg from +x; or use toward_compass and from_compass",
    "shore": "a straight shore of one slope: where its waterline is, and which way is out to sea",
    "areas": "sensitive areas, as an intake or a reed bed: corners [m], or a GeoJSON file; the oil in them is told",
    "land": "land and shoals of your own harbour: corners [m], or a GeoJSON file; the stream runs along them",
    "site": "where the exercise lies on Earth, and a chart to show under plan and map",
    "tow": "orders to all vessels without legs of their own: speed over the ground, heading, and when they get under way [s]",
    "vessels": "vessels: size and place [m], bollard pull [N], or vessel = a name of `oilsim vessels`; legs = [...] are its own orders",
    "booms": "booms: ends are vessels or fixed points; boom = a name of `oilsim booms`; other keys change what the catalogue says",
    "moorings": "mooring legs from booms, vessels and bodies down to anchors",
    "ties": "lines between two joints of booms: cross bridles, lines across an open apex, and with `reach` lines that the crew makes fast",
    "skimmers": "skimmers: nameplate [m3/h], swath [m], storage [m3], or skimmer = a name of `oilsim skimmers` for what it has of them",
    "injects": "what happens to the crew: at a time [s], on a condition, or on the instructor's order; see the page Orders",
    "criteria": "how it is graded: limits and weight of each criterion, and why; the debrief shows the keys",
    "prices": "what the operation costs: `oilsim debrief RECORDING --report` counts it",
    "fidelities": "particles that the exercise offers: `oilsim run FILE --fidelity fine`",
    "levels": "changes of the easy and the hard variant: `oilsim run FILE --level hard`",
    "camera": "where pictures are taken from, and at [m]",
    "recording": "frames a simulated second",
    "demo": "changes that make a run short: `oilsim run FILE --demo`",
    "window": "a box of particles that follows a boom, a vessel or a body; with rims for walls",
    "bodies": "rocks, hulks and other bodies",
}


def register_new(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser("new", help="copy a shipped exercise, with comments, for you to change")
    parser.add_argument("scenario", metavar="EXERCISE", help="name of a shipped scenario, or a .toml file")
    parser.add_argument(
        "--to", type=Path, metavar="FILE.toml", help="file to write (default: my-NAME.toml in the current folder)"
    )
    parser.set_defaults(command=_new)


def _new(options: argparse.Namespace) -> int:
    from scenarios.spec.load import load_scenario

    loaded = load_scenario(options.scenario)
    path = options.to or Path(f"my-{loaded.scenario.name}.toml")
    problems = []
    if path.suffix != ".toml" or not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]*", path.stem):
        text = f"is {str(path)!r}, allowed: a name of letters, digits, '-' and '_' that ends with .toml"
        problems.append(Problem("--to", text))
    if path.exists():
        problems.append(Problem("--to", f"is {str(path)!r}, which is there already; allowed: another name"))
    else:
        problems += unwritable({"--to": path}, {})
    files = _files_beside(loaded, path.parent)
    for file in (one for one in files if one.exists()):
        problems.append(Problem("--to", f"would write {str(file)!r}, which is there already; allowed: another folder"))
    if problems:
        raise ScenarioError(problems, "oilsim")
    path.write_text(commented(loaded.text, path.stem), encoding="utf-8")
    for file, source in files.items():
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(source.read_bytes())
    print(f"{', with '.join(map(str, (path, *files)))}: change it, then: oilsim check {path}; oilsim run {path}")
    return DONE


def _files_beside(loaded: LoadedScenario, folder: Path) -> dict[Path, Path]:
    """Return where the files that a scenario names by relative paths are to be in a folder, with what to copy there."""
    from scenarios.spec.load import files_replaced
    from scenarios.text.toml import read_toml

    files: dict[Path, Path] = {}

    def noted(table: str, name: str, file: str) -> str:
        files[folder / file] = loaded.path.parent / file
        return file

    files_replaced(read_toml(loaded.text), noted)
    return {file: source for file, source in files.items() if source.is_file() and source.absolute() != file.absolute()}


def commented(text: str, name: str) -> str:
    """Return a scenario's file under another name, with a comment before the first table of each kind."""
    told, lines = set[str](), list[str]()
    is_inside = False  # a text of several lines
    for line in text.splitlines():
        found = None if is_inside else re.match(r"\[+([A-Za-z]+)", line)
        table = found.group(1) if found else ""
        if table in COMMENTS and table not in told:
            told.add(table)
            lines.append(f"# {COMMENTS[table]}")
        if not is_inside and re.match(r"name\s*=", line) and not told:
            line = f'name = "{name}"'
        is_inside ^= line.count('"""') % 2 == 1
        lines.append(line)
    return "\n".join(lines) + "\n"
