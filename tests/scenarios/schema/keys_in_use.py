"""Which keys of scenario files the shipped exercises, the guides and their commands use, section by section."""

from __future__ import annotations

import re
import tomllib
import types
from collections.abc import Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, Union, get_args, get_origin

from scenarios.schema.parsing.overrides import parse_override, with_override
from scenarios.schema.parsing.quantity_fields import Section, field_kinds
from scenarios.schema.parsing.structuring import spellings
from scenarios.spec.load import library_paths
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import ScenarioError

ROOT = Path(__file__).parents[3]
VARIANTS = ("fidelities", "levels")  # tables of changes, by name
ORDER = re.compile(
    r"(?:--set |order \S+ |^|[\"'(,: ])'?([a-z]\w*(?:\.[\w-]+)+)=(\"[^\"]*\"|\[[^]]*\]|\{[^}]*\}|[^\s'\",;)]+)",
    re.MULTILINE,
)
Key = tuple[str, str]  # the class that declares a field, and the field


def _key(kind: type, name: str) -> Key:
    """The key of a field at the first class that declares it, which may be one of the core's."""
    return next(one for one in kind.__mro__ if name in vars(one).get("__annotations__", {})).__name__, name


def keys_of_schema() -> set[Key]:
    """All keys that a file may have."""

    def sections(kind: type[Section]) -> Iterator[type[Section]]:
        yield kind
        for child in kind.__subclasses__():
            yield from sections(child)

    kinds = {
        kind
        for kind in sections(Section)
        if kind.__module__.startswith(("scenarios.schema", "scenarios.spec.scenario"))
    }
    return {_key(kind, item.name) for kind in kinds for item in fields(kind)}


def _given(kind: Any, value: Any) -> Iterator[Key]:
    """Yield the keys that a value of a file gives; what does not fit its kind gives none."""
    parts = [part for part in get_args(kind) if part is not types.NoneType]
    if get_origin(kind) in (Union, types.UnionType):
        sections = [part for part in parts if isinstance(part, type) and issubclass(part, Section)]
        if len(parts) == 1:
            yield from _given(parts[0], value)
        elif sections and sections[0].TAG is not None:
            tag = (
                value
                if isinstance(value, str)
                else value.get(sections[0].TAG[0])
                if isinstance(value, Mapping)
                else None
            )
            chosen = [one for one in sections if one.TAG is not None and (one.TAG[1] == tag if tag else one.USUAL)]
            for one in chosen:
                yield from _given(one, value)
    elif get_origin(kind) is tuple and isinstance(value, list):
        for entry in value:
            yield from _given(parts[0], entry)
    elif isinstance(get_origin(kind), type) and issubclass(get_origin(kind), Mapping) and isinstance(value, Mapping):
        for entry in value.values():
            yield from _given(parts[1], entry)
    elif isinstance(kind, type) and issubclass(kind, Section) and isinstance(value, Mapping):
        for key, entry in value.items():
            name = next((one for one in spellings(key) if one in field_kinds(kind)), None)
            if name is not None:
                yield _key(kind, name)
                yield from _given(field_kinds(kind)[name], entry)


def _merged(data: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Apply changes that are nested like the file."""
    both = {
        key: _merged(data[key], value)
        for key, value in changes.items()
        if isinstance(value, Mapping) and isinstance(data.get(key), Mapping)
    }
    return {**data, **changes, **both}


def keys_used_by(text: str, also: str = "") -> set[Key]:
    """The keys that a file gives, in its variants too, and the orders in its texts and in `also`."""
    data = tomllib.loads(text)
    changes = [one for table in VARIANTS for one in data.get(table, {}).values()] + [data.get("demo", {})]
    found = {key for one in [data, *(_merged(data, change) for change in changes)] for key in _given(Scenario, one)}
    driven = [signal for fmu in data.get("fmus", {}).values() for signal in fmu.get("outputs", {}).values()]
    for key, value in [*ORDER.findall(text + "\n" + also), *((signal, "1.0") for signal in driven)]:
        try:
            found |= set(_given(Scenario, with_override(data, *parse_override(f"{key}={value}"))))
        except ScenarioError:
            continue
    return found


def shipped() -> set[Key]:
    """The keys that the shipped exercises use."""
    return {key for path in library_paths().values() for key in keys_used_by(path.read_text(encoding="utf-8"))}


OPTIONS = {
    "--level": ("Scenario", "level"),
    "--fidelity": ("Scenario", "fidelity"),
    "--threads": ("RunSettings", "threads"),
}


def documented() -> set[Key]:
    """The keys that the guides, the models' pages and the first scenario of the page on the format use."""
    found = {key for path in (ROOT / "docs").rglob("*.toml") for key in keys_used_by(path.read_text(encoding="utf-8"))}
    for page in (ROOT / "docs").rglob("*.md"):
        text = page.read_text(encoding="utf-8")
        for block in re.findall(r"^```toml[^\n]*\n(.*?)^```$", text, re.DOTALL | re.MULTILINE):
            found |= keys_used_by(block)
        commands = "\n".join(re.findall(r"^```sh[^\n]*\n(.*?)^```$", text, re.DOTALL | re.MULTILINE))
        found |= keys_used_by("", commands) | {key for option, key in OPTIONS.items() if f"{option} " in text}
    return found
