"""Structuring: plain data, as read from a file, becomes the dataclasses of a scenario; every fault is reported at its path.

Nothing is guessed: a number in quotes is not a number (`type_checks`), and an unknown key is refused. A key for a speed
may end in ``_kn`` and one for an angle in ``_deg``. Their values are converted to SI here, and no other module meets the suffixes.
"""

from __future__ import annotations

import math
import re
import types
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, Union, get_args, get_origin

from cattrs import Converter
from cattrs.errors import (
    AttributeValidationNote,
    BaseValidationError,
    ForbiddenExtraKeysError,
    IterableValidationNote,
)
from cattrs.gen import make_dict_structure_fn, override

from oilsim.core.physical_constants import DEGREE, KNOT
from oilsim.core.quantity import Quantity, quantities
from scenarios.schema.parsing.quantity_fields import Section, faulty_entry
from scenarios.schema.parsing.type_checks import Misfit, shape_of, taken
from scenarios.text.problems import Problem, ScenarioError, suggestion

SUFFIXES: Mapping[str, tuple[str, float]] = {"_kn": ("m/s", KNOT), "_deg": ("rad", DEGREE)}
COMPASS: Mapping[str, str] = {"heading_compass": "heading", "from_compass": "direction", "toward_compass": "direction"}
"""Keys of compass courses, and the fields that they give; `scenarios.schema.parsing.compass` converts them."""


@dataclass(frozen=True)
class _Suffixed:
    """A value that was written with a unit suffix, and the factor that converts it to SI."""

    value: Any
    key: str
    factor: float


def structure(data: object, kind: Any) -> Any:
    """Structure `data` as a `kind`; ScenarioError with every problem at once."""
    try:
        return _CONVERTER.structure(data, kind)
    except Exception as error:
        raise ScenarioError(_problems(error)) from error


def as_data(value: Any) -> Any:
    """Turn a section into plain data, with tags and without fields that are None: the inverse of `structure`."""
    if is_dataclass(value) and not isinstance(value, type):
        own = getattr(value, "TAG", None)
        tag = dict([own]) if own else {}
        stated = {item.name: getattr(value, item.name) for item in fields(value)}
        return tag | {name: as_data(entry) for name, entry in stated.items() if entry is not None}
    if isinstance(value, Mapping):
        return {key: as_data(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [as_data(entry) for entry in value]
    return value


def spellings(key: str) -> tuple[str, ...]:
    """List all keys that mean the same field: ``speed_kn`` gives speed, speed_kn and speed_deg; compass courses are among them."""
    base = next((key.removesuffix(suffix) for suffix in SUFFIXES if key.endswith(suffix)), COMPASS.get(key, key))
    return (base, *(base + suffix for suffix in SUFFIXES), *(name for name, field in COMPASS.items() if field == base))


def _problems(error: BaseException, path: tuple[str, ...] = ()) -> Iterator[Problem]:
    """Yield the leaves of cattrs' tree of errors, each with its path."""
    if isinstance(error, BaseValidationError):
        for inner in error.exceptions:
            step = next(_steps(inner), None)
            yield from _problems(inner, path if step is None else (*path, step))
    elif isinstance(error, ScenarioError):
        yield from (problem.below(".".join(path)) for problem in error.problems)
    elif isinstance(error, ForbiddenExtraKeysError):
        allowed = _written_names(error.cl)
        for key in sorted(error.extra_fields):
            hint = suggestion(key, [name for names in allowed for name in names]) or ","
            listed = ", ".join(" or ".join(names) for names in allowed)
            yield Problem(".".join((*path, key)), f"is unknown{hint} allowed: {listed}")
    elif isinstance(error, KeyError):
        yield Problem(".".join(path), "is missing; it must be given")
    elif isinstance(error, Misfit):
        place = (*path[:-1], error.key) if error.key else path
        yield Problem(".".join((*place, *error.path)), error.text)
    else:
        yield from (problem.below(".".join(path)) for problem in _of_class(str(error)))


def _steps(error: BaseException) -> Iterator[str]:
    """Yield the key or index at which an error arose, from the notes that cattrs attaches to it."""
    for note in getattr(error, "__notes__", ()):
        if isinstance(note, AttributeValidationNote):
            yield note.name
        elif isinstance(note, IterableValidationNote):
            yield str(note.index)


def keys_of(section: Any, name: str) -> list[str]:
    """List the keys by which a field of a section may be given: ``speed`` and ``speed_kn``, or a ``heading`` and ``heading_compass``."""
    limits = quantities(section).get(name)
    keys = [name]
    if limits is not None:
        keys += [name + suffix for suffix, (unit, _) in SUFFIXES.items() if limits.unit in (unit, f"{unit}/s")]
    compass = getattr(section, "COMPASS", None)
    return [*keys, compass] if compass is not None and COMPASS[compass] == name else keys


def _written_names(section: Any) -> list[list[str]]:
    """List the keys of a section as they may be written, the tag first."""
    names = [keys_of(section, item.name) for item in fields(section)]
    return [[section.TAG[0]], *names] if getattr(section, "TAG", None) else names


def _tables(value: Any, kind: Any) -> tuple[Any, ...]:
    """Convert a list of tables of one section."""
    if not isinstance(value, list | tuple):
        raise Misfit(f"is {value!r}, allowed: a list of tables")
    section = get_args(kind)[0]
    return tuple(_CONVERTER.structure(list(value), list[section]))  # type: ignore[valid-type]


def _scaled(value: Any, factor: float) -> Any:
    if isinstance(value, list | tuple):
        return [_scaled(part, factor) for part in value]
    return value * factor if isinstance(value, int | float) and not isinstance(value, bool) else value


def _quantity_hook(limits: Quantity) -> Callable[[Any, Any], Any]:
    def hook(given: Any, kind: Any) -> Any:
        suffixed = given if isinstance(given, _Suffixed) else _Suffixed(given, "", 1.0)
        value = _scaled(suffixed.value, suffixed.factor) if suffixed.key else given
        try:
            result = taken(value, kind)
        except Misfit as cause:
            written = _in_unit_of(suffixed.key, limits, suffixed.factor) if suffixed.key else limits
            text = f"is {suffixed.value!r}, allowed: {shape_of(kind)}, {written.allowed}"
            raise Misfit(text, key=suffixed.key) from cause
        found = faulty_entry(limits, result)
        if found is None:
            return result
        steps, fault = found
        if suffixed.key:
            number, allowed = _entry_at(suffixed.value, steps), fault.partition("allowed: ")[2]
            if allowed == limits.allowed:
                allowed = _in_unit_of(suffixed.key, limits, suffixed.factor).allowed
            fault = f"is {number!r}, allowed: {allowed}"
        raise Misfit(fault, steps, suffixed.key)

    return hook


def _entry_at(value: Any, steps: Sequence[str]) -> Any:
    for step in steps:
        value = value[int(step)]
    return value


def _in_unit_of(key: str, limits: Quantity, factor: float) -> Quantity:
    """Return limits in the unit in which a key is written, with four figures at the most, and none that would be refused."""
    unit = next(suffix for suffix in SUFFIXES if key.endswith(suffix)).removeprefix("_")
    per = "/s" if limits.unit.endswith("rad/s") else ""

    def rounded(limit: float | None, away: Callable[[float], int]) -> float | None:
        if limit is None or limit == 0.0:
            return limit
        digit = 10.0 ** (3 - math.floor(math.log10(abs(limit / factor))))
        return away(limit / factor * digit) / digit

    return replace(
        limits,
        unit=unit + per,
        above=rounded(limits.above, lambda one: math.ceil(one - 1e-6)),
        at_least=rounded(limits.at_least, lambda one: math.ceil(one - 1e-6)),
        below=rounded(limits.below, lambda one: math.floor(one + 1e-6)),
        at_most=rounded(limits.at_most, lambda one: math.floor(one + 1e-6)),
    )


def _in_si_units(section: type[Section], data: Mapping[str, Any]) -> dict[str, Any]:
    """Rename suffixed keys to their fields, and note how they were written."""
    known = quantities(section)
    result = dict(data)
    for key in data:
        for suffix, (unit, factor) in SUFFIXES.items():
            base = key.removesuffix(suffix)
            if base == key or base not in known or known[base].unit not in (unit, f"{unit}/s"):
                continue
            if base in data:
                raise ScenarioError([Problem(key, f"is given beside {base}, allowed: one of the two")])
            result[base] = _Suffixed(result.pop(key), key, factor)
    return result


def _section_factory(section: type[Section], converter: Converter) -> Callable[[Any, Any], Any]:
    hooks: Any = {name: override(struct_hook=_quantity_hook(limits)) for name, limits in quantities(section).items()}
    generated = make_dict_structure_fn(section, converter, _cattrs_forbid_extra_keys=True, **hooks)

    def hook(data: Any, _: Any) -> Any:
        if not isinstance(data, Mapping):
            raise Misfit(f"is {data!r}, allowed: a table")
        return generated(_in_si_units(section, data), section)

    return hook


def _of_class(told: str) -> Iterator[Problem]:
    """Yield the problems that a class of another package has with its values: ``drive: count is 3, allowed: ...; spacing ...``."""
    faults = re.fullmatch(r"[a-z ]+: (\w+ (?:is|has|holds) .*)", told)
    for fault in faults[1].split("; ") if faults else (f" {told}",):
        name, _, text = fault.partition(" ")
        yield Problem(name, text)


def _is_plain(kind: Any) -> bool:
    """Tell whether a type contains no section, at any depth."""
    return not _is_section(kind) and all(part is Ellipsis or _is_plain(part) for part in get_args(kind))


def _is_list_of_sections(kind: Any) -> bool:
    return get_origin(kind) is tuple and _is_section(get_args(kind)[0])


def _is_section(kind: Any) -> bool:
    """Tell whether a type is a table of a file: a section, or a class of another package that declares its quantities."""
    return isinstance(kind, type) and (issubclass(kind, Section) or (is_dataclass(kind) and bool(quantities(kind))))


def _members(union: Any) -> tuple[Any, ...]:
    """Return the types of a union; a table that may be left out is None then, and never in a file."""
    parts = get_args(union) if get_origin(union) in (Union, types.UnionType) else ()
    return tuple(part for part in parts if part is not types.NoneType)


def _is_tagged_union(kind: Any) -> bool:
    members = _members(kind)
    return bool(members) and all(_is_section(member) and getattr(member, "TAG", None) for member in members)


def _tagged_factory(union: Any, converter: Converter) -> Callable[[Any, Any], Any]:
    """Choose a table's class by its tag, as in shape = "box"; a bare word is a table with only the tag, and one without is the usual."""
    by_tag = {member.TAG[1]: member for member in _members(union)}
    key = _members(union)[0].TAG[0]
    allowed = ", ".join(repr(tag) for tag in by_tag)
    usual = next((tag for tag, member in by_tag.items() if member.USUAL), None)

    def hook(data: Any, _: Any) -> Any:
        table = {key: data} if isinstance(data, str) else data
        if not isinstance(table, Mapping):
            raise Misfit(f"is {data!r}, allowed: a table with {key} = one of {allowed}")
        tag = table.get(key, usual)
        if isinstance(data, str) and data not in by_tag:
            hint = suggestion(data, by_tag) or ","
            raise Misfit(f"is {data!r}{hint} allowed: a table with {key} = one of {allowed}")
        if tag is None:
            raise ScenarioError([Problem(key, f"is missing, allowed: {allowed}")])
        if not isinstance(tag, str) or tag not in by_tag:
            hint = suggestion(tag, by_tag) if isinstance(tag, str) else ""
            raise ScenarioError([Problem(key, f"is {tag!r}{hint or ','} allowed: {allowed}")])
        return converter.structure({k: v for k, v in table.items() if k != key}, by_tag[tag])

    return hook


def _strict_converter() -> Converter:
    converter = Converter(detailed_validation=True, forbid_extra_keys=True)
    for kind in (bool, int, float, str):  # for which cattrs has hooks of its own
        converter.register_structure_hook(kind, taken)
    converter.register_structure_hook_func(_is_plain, taken)
    converter.register_structure_hook_func(_is_list_of_sections, _tables)
    converter.register_structure_hook_factory(_is_section, _section_factory)
    converter.register_structure_hook_factory(_is_tagged_union, _tagged_factory)
    return converter


_CONVERTER = _strict_converter()
