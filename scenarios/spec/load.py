"""Loading of scenario files: found by name or path, changed by overrides, read strictly; all problems are reported at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields
from importlib import resources
from pathlib import Path
from typing import Any, get_args

from scenarios.schema.parsing.compass import without_compass
from scenarios.schema.parsing.overrides import merged, parse_override, with_override
from scenarios.schema.parsing.quantity_fields import field_kinds
from scenarios.schema.parsing.structuring import COMPASS, structure
from scenarios.schema.tables import NAMED_TABLES, Parts
from scenarios.spec.scenario import Scenario, problems_of
from scenarios.text.problems import Problem, ScenarioError, suggestion, unknown
from scenarios.text.toml import read_toml_file

CHOICES = {"fidelity": "fidelities", "level": "levels"}  # tables of the changes of each
LEVELS = ("easy", "hard")  # beside the scenario as it stands, which is "normal"


@dataclass(frozen=True, kw_only=True)
class LoadedScenario:
    """A scenario, and the text and path of its file."""

    scenario: Scenario
    text: str
    path: Path


def library_paths() -> dict[str, Path]:
    """List the shipped scenarios by name."""
    folder = Path(str(resources.files("scenarios.library")))
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def find_scenario(source: str | Path) -> Path:
    """Find the file of a path or of a shipped scenario's name; ScenarioError if there is none."""
    path = Path(source)
    shipped = library_paths()
    if path.suffix != ".toml" and str(source) in shipped:
        return shipped[str(source)]
    if path.is_file():
        return path
    hint = suggestion(str(source), shipped) or ","
    if path.is_dir():
        raise ScenarioError(
            [Problem(f"scenario {str(source)!r}", "is a folder, allowed: a .toml file in it")], "oilsim"
        )
    text = f"is neither a file nor a shipped scenario{hint} allowed: a .toml file, {', '.join(shipped)}"
    raise ScenarioError([Problem(f"scenario {str(source)!r}", text)], "oilsim")


def load_scenario(source: str | Path, *, overrides: Sequence[str] = (), demo: bool = False) -> LoadedScenario:
    """Read, change and check a scenario.

    `overrides` are texts such as ``phases.oil.dynamic_viscosity=0.1``; `demo` applies the file's [demo] table first. Raises ScenarioError
    with every problem found.
    """
    path = find_scenario(source)
    try:
        text, data = read_toml_file(path)
    except OSError as cause:
        raise ScenarioError([Problem("", f"cannot be read: {cause.strerror or cause}")], str(path)) from cause
    except ValueError as cause:
        raise ScenarioError([Problem("", f"cannot be read: {cause}")], str(path)) from cause
    if demo and "demo" not in data:
        raise ScenarioError(
            [Problem("demo", "is missing, but --demo asks for it; allowed: a table [demo], or a call without --demo")],
            str(path),
        )
    try:
        scenario = scenario_from(_changed(data, overrides, demo), folder=path.parent)
    except ScenarioError as error:
        found = _without_newcomers(error.problems, data, overrides)
        raise ScenarioError([*found, *_variant_problems(data, path, demo)], str(path)) from error
    problems = _variant_problems(data, path, demo)
    if problems:
        raise ScenarioError(problems, str(path))
    return LoadedScenario(scenario=scenario, text=text, path=path)


def scenario_from(data: Mapping[str, Any], folder: Path | None = None) -> Scenario:
    """Build a scenario from plain data; relative mesh files are searched in `folder`. ScenarioError with every problem found."""
    scenario, parts, problems = _read(data, folder)
    if parts.injects:
        from scenarios.controls.order_checks import inject_problems  # only such a file pays for the signals of a run

        problems += inject_problems(parts)
    return _sound(scenario, problems)


def changed_scenario(data: Mapping[str, Any]) -> Scenario:
    """Build a scenario that a run's orders have changed: as `scenario_from`, but injects are as they were at the start."""
    scenario, _, problems = _read(data)
    return _sound(scenario, problems)


def _sound(scenario: Scenario | None, problems: list[Problem]) -> Scenario:
    if scenario is None or problems:
        raise ScenarioError(problems)
    return scenario


def _read(data: Mapping[str, Any], folder: Path | None = None) -> tuple[Scenario | None, Parts, list[Problem]]:
    """Read plain data: the scenario if all is well with its tables, those that could be read, and the problems."""
    data, misread = without_compass(_with_paths(data, folder or Path.cwd()))
    sound, problems = _structured(data)
    unread = [_field_of(fault) for fault in misread]
    problems = misread + [one for one in problems if one.path not in unread]
    names = {table: tuple(data[table]) if isinstance(data.get(table), Mapping) else () for table in NAMED_TABLES}
    tables = {name: sound[name] for name in Parts.__dataclass_fields__ if name in sound}
    parts = Parts(names=names, given=frozenset(data), **tables)
    if problems:
        return None, parts, [*problems, *problems_of(parts)]
    try:
        return Scenario(**sound), parts, []
    except ScenarioError as error:
        return None, parts, list(error.problems)


def _without_newcomers(problems: Sequence[Problem], data: Mapping[str, Any], overrides: Sequence[str]) -> list[Problem]:
    """Say once that --set names an entry that the file does not have, in the place of all that a new entry would lack."""
    levels = data.get("levels")
    variants = [data, data.get("demo"), *(levels.values() if isinstance(levels, Mapping) else ())]
    left = list(problems)
    for override in overrides:
        table, name, *rest = [*override.partition("=")[0].split("."), "", ""]
        place = f"{table}.{name}"
        there = [one[table] for one in variants if isinstance(one, Mapping) and isinstance(one.get(table), Mapping)]
        known = list(dict.fromkeys(entry for entries in there for entry in entries))
        lacks = [one for one in left if one.path.startswith(f"{place}.") and one.text.startswith("is missing")]
        if table in NAMED_TABLES and any(rest) and name not in known and lacks:
            one = Problem(
                f"--set {override.partition('=')[0]}",
                f"names {name!r}, which {unknown(name, known, f'entry of {table}')}",
            )
            left = [one, *(other for other in left if not other.path.startswith(f"{place}."))]
    return left


def _field_of(problem: Problem) -> str:
    """Return the path of the field that a compass course would give, which is not missing for itself."""
    table, _, key = problem.path.rpartition(".")
    return f"{table}.{COMPASS[key]}"


def _changed(data: dict[str, Any], overrides: Sequence[str], demo: bool) -> dict[str, Any]:
    """Apply the [demo] table and then the overrides to the data; those of fidelities and levels before one of these is chosen."""
    if demo and isinstance(data.get("demo"), Mapping):
        data = merged(data, data["demo"])
    problems: list[Problem] = []
    changes: list[tuple[tuple[str, ...], Any]] = []
    for override in overrides:
        try:
            changes.append(parse_override(override))
        except ScenarioError as error:
            problems.extend(error.problems)
    of_choices = [change for change in changes if change[0][0] in CHOICES.values()]
    data = _overridden(data, of_choices, problems)
    for choice in CHOICES:
        data = _chosen(data, choice, [value for keys, value in changes if keys == (choice,)])
    data = _overridden(data, [change for change in changes if change not in of_choices], problems)
    if problems:
        raise ScenarioError(problems)
    return data


def _overridden(
    data: dict[str, Any], changes: Sequence[tuple[tuple[str, ...], Any]], problems: list[Problem]
) -> dict[str, Any]:
    """Return the data with changes made; those that cannot be are added to `problems`."""
    for keys, value in changes:
        try:
            data = with_override(data, keys, value)
        except ScenarioError as error:
            problems.extend(error.problems)
    return data


def _chosen(data: dict[str, Any], choice: str, named: Sequence[Any]) -> dict[str, Any]:
    """Apply the changes of the level or fidelity that an override, or else the data, names; ScenarioError for a level that it lacks."""
    table = CHOICES[choice]
    name, changes = [data.get(choice), *named][-1], data.get(table, {})
    if not isinstance(name, str) or not isinstance(changes, Mapping):
        return data  # a wrong one is found among the fields
    if name not in changes and choice == "level" and name in LEVELS:
        text = f"is {name!r}, allowed in this scenario: {', '.join(['normal', *changes])}"
        raise ScenarioError([Problem(choice, text)])
    return merged(data, changes[name]) if isinstance(changes.get(name), Mapping) else data


def _variant_problems(data: Mapping[str, Any], path: Path, demo: bool) -> list[Problem]:
    """Find what is wrong with the changes that the file holds for its demo and its levels."""
    return [*_demo_problems(data, path, demo), *_level_problems(data, path.parent)]


def _level_problems(data: Mapping[str, Any], folder: Path) -> list[Problem]:
    """Find what is wrong with the changes of the levels, of a scenario that is right without them."""
    levels = data.get("levels")
    if not isinstance(levels, Mapping):
        return []
    found, plain = list[Problem](), _all_problems(data, folder)
    for level, changes in levels.items():
        if level not in LEVELS or not isinstance(changes, Mapping):
            found.append(Problem(f"levels.{level}", f"is no level, allowed: tables {' and '.join(LEVELS)}"))
            continue
        changed = _all_problems(merged(data, changes), folder)
        found += [problem.below(f"levels.{level}") for problem in changed if problem not in plain]
    return found


def _demo_problems(data: Mapping[str, Any], path: Path, applied: bool) -> list[Problem]:
    """Find what the [demo] table makes wrong of a scenario that is right without it."""
    demo = data.get("demo")
    if applied or not isinstance(demo, Mapping):
        return []
    plain = _all_problems(data, path.parent)
    return [problem.below("demo") for problem in _all_problems(merged(data, demo), path.parent) if problem not in plain]


def _all_problems(data: Mapping[str, Any], folder: Path) -> tuple[Problem, ...]:
    try:
        scenario_from(data, folder)
    except ScenarioError as error:
        return error.problems
    return ()


def _structured(data: Mapping[str, Any]) -> tuple[dict[str, Any], list[Problem]]:
    """Structure the fields of a scenario, named entries one by one; return the valid fields and the problems of the others."""
    kinds = field_kinds(Scenario)
    sound: dict[str, Any] = {}
    problems: list[Problem] = []
    for item in fields(Scenario):
        if item.name not in data:
            if item.default is MISSING and item.default_factory is MISSING:
                problems.append(Problem(item.name, "is missing; it must be given"))
        elif item.name in NAMED_TABLES:
            sound[item.name] = _entries(item.name, data[item.name], get_args(kinds[item.name])[1], problems)
        else:
            _keep(sound, problems, item.name, data[item.name], kinds[item.name])
    for key in data:
        if key not in kinds:
            hint = suggestion(key, kinds) or ","
            problems.append(
                Problem(key, f"is unknown{hint} allowed: {', '.join(item.name for item in fields(Scenario))}")
            )
    return sound, problems


def _entries(table: str, data: Any, kind: Any, problems: list[Problem]) -> dict[str, Any]:
    """Structure the entries of a table of named things; return the valid ones."""
    sound: dict[str, Any] = {}
    if not isinstance(data, Mapping):
        problems.append(Problem(table, f"is {data!r}, allowed: tables [{table}.NAME]"))
        return sound
    for name, entry in data.items():
        try:
            sound[name] = structure(entry, kind)
        except ScenarioError as error:
            problems.extend(problem.below(f"{table}.{name}") for problem in error.problems)
    return sound


def _keep(sound: dict[str, Any], problems: list[Problem], name: str, data: Any, kind: Any) -> None:
    try:
        sound[name] = structure(data, kind)
    except ScenarioError as error:
        problems.extend(problem.below(name) for problem in error.problems)


def _with_paths(data: Mapping[str, Any], folder: Path) -> Mapping[str, Any]:
    """Make the paths of mesh files, FMUs, land, areas, a chart, and files of winds and currents absolute."""
    return files_replaced(data, lambda table, name, file: str(folder.absolute() / file))


def files_replaced(data: Mapping[str, Any], replace: Callable[[str, str, str], str]) -> dict[str, Any]:
    """Copy the data with `replace(table, name, file)` for every file that an entry of a table names."""
    result = dict(data)
    for table in ("bodies", "fmus", "sea", "land", "areas", "site"):
        entries = data.get(table)
        if isinstance(entries, Mapping):
            result[table] = {
                name: {**entry, "file": replace(table, name, entry["file"])}
                if isinstance(entry, Mapping) and isinstance(entry.get("file"), str) and entry["file"]
                else entry
                for name, entry in entries.items()
            }
    return result
