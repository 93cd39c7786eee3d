"""Sections that take what a scenario does not state from an entry of a catalogue."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass
from typing import Any, ClassVar

from oilsim.core.catalogue import CatalogueEntry
from scenarios.schema.parsing.quantity_fields import Section
from scenarios.text.problems import Problem, ScenarioError, unknown


@dataclass(frozen=True, kw_only=True)
class CatalogueSection(Section):
    """A section whose field KEY may name an entry of CATALOGUE, which gives the fields of USUAL_VALUES that are None.

    USUAL_VALUES are those of a section without an entry, or whose entry has none; MISSING is one that must be stated then.
    """

    KEY: ClassVar[str]
    CATALOGUE: ClassVar[Callable[[], Mapping[str, CatalogueEntry]]]
    USUAL_VALUES: ClassVar[Mapping[str, Any]]

    def __post_init__(self) -> None:
        """Take what is not stated from the catalogue, then check everything; ScenarioError with every problem."""
        named, entries = getattr(self, self.KEY), type(self).CATALOGUE()
        entry = entries.get(named) if isinstance(named, str) else None
        found = []
        if named is not None and entry is None:
            found.append(
                Problem(self.KEY, f"is {named!r}, which {unknown(str(named), entries, f'{self.KEY} of the catalogue')}")
            )
        open_fields = [name for name in self.USUAL_VALUES if getattr(self, name) is None]
        for name in open_fields:
            given = getattr(entry, name, None)
            object.__setattr__(self, name, self.USUAL_VALUES[name] if given is None else given)
        lacking = [name for name in open_fields if getattr(self, name) is MISSING]
        if not found:
            other = (
                f", or {self.KEY} = a name of the catalogue"
                if entry is None
                else f": {named!r} of the catalogue has none"
            )
            found += [Problem(name, f"is missing, allowed: a value{other}") for name in lacking]
        try:
            super().__post_init__()
        except ScenarioError as error:
            found += [problem for problem in error.problems if problem.path not in (self.KEY, *lacking)]
        if found:
            raise ScenarioError(found, type(self).__name__)
