"""Small tables of measured rows, one dataclass a table, that several runs add to."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, get_type_hints

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Row = TypeVar("Row", bound="DataclassInstance")


def write(path: Path, rows: Sequence[Row]) -> None:
    """Write a table of the rows, of one dataclass of numbers, below a header of its fields; five digits."""
    path.parent.mkdir(parents=True, exist_ok=True)
    names = [field.name for field in fields(rows[0])]
    with path.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        writer.writerows([f"{getattr(row, name):.5g}" for name in names] for row in rows)


def read(path: Path, kind: type[Row]) -> list[Row]:
    """Return the rows of a table as `kind`; none where there is no table."""
    if not path.exists():
        return []
    kinds = get_type_hints(kind)
    with path.open(newline="") as file:
        return [kind(**{name: kinds[name](text) for name, text in line.items()}) for line in csv.DictReader(file)]


def keep(path: Path, rows: Sequence[Row], key: Sequence[str]) -> None:
    """Put rows into a table, in order of their key; they replace rows of the same key (names of fields)."""

    def place(row: Row) -> tuple[Any, ...]:
        return tuple(float(f"{getattr(row, name):.5g}") for name in key)

    if rows:
        merged = {place(row): row for row in [*read(path, type(rows[0])), *rows]}
        write(path, [merged[at] for at in sorted(merged)])
