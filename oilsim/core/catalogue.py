"""A catalogue: equipment by name, each figure with its source, and `assumed` where it has none.

The figures stand in a TOML file, a table for each entry.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from types import MappingProxyType
from typing import Any, TypeVar


@dataclass(frozen=True, kw_only=True)
class CatalogueEntry:
    """An entry; a subclass adds the figures, None where one is not known.

    title: what it is; source: where the figures are from; assumed: names of those that are usual ones or follow from a rule.
    """

    name: str
    title: str
    source: str
    assumed: tuple[str, ...] = ()


Entry = TypeVar("Entry", bound=CatalogueEntry)


def read_catalogue(package: str, entry: type[Entry], **parts: type) -> Mapping[str, Entry]:
    """Read the entries of the `catalogue.toml` of a package, by name; `parts` are the classes of tables within an entry, by key."""

    def made(name: str, table: dict[str, Any]) -> Entry:
        inner = {key: part(**table[key]) for key, part in parts.items() if key in table}
        return entry(name=name, **(table | inner | {"assumed": tuple(table.get("assumed", ()))}))

    tables = tomllib.loads(files(package).joinpath("catalogue.toml").read_text(encoding="utf-8"))
    return MappingProxyType({name: made(name, table) for name, table in tables.items()})
