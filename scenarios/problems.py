"""The problems of a scenario: each with its path, all of them in one error."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass


@dataclass(frozen=True, order=True)
class Problem:
    """One thing that is wrong: where (``fluid.particle_spacing``) and what, value and allowed values included."""

    path: str
    text: str

    def below(self, prefix: str) -> Problem:
        """The same problem seen from one level further out."""
        return Problem(".".join(part for part in (prefix, self.path) if part), self.text)

    def __str__(self) -> str:
        return f"{self.path} {self.text}" if self.path else self.text


class ScenarioError(ValueError):
    """A scenario that cannot be run, with every problem found in it."""

    def __init__(self, problems: Iterable[Problem], source: str = "") -> None:
        """Collect ``problems`` of the file or object called ``source``; repeated ones count once."""
        self.problems = tuple(dict.fromkeys(problems))
        self.source = source
        super().__init__(self.problems, source)

    def __str__(self) -> str:
        count = len(self.problems)
        head = f"{self.source or 'scenario'}: {count} problem{'' if count == 1 else 's'}"
        return "\n".join([head, *(f"  {problem}" for problem in self.problems)])


def suggestion(word: str, allowed: Iterable[str]) -> str:
    """``, did you mean 'oil'?`` where one of the allowed words is near, else nothing."""
    near = difflib.get_close_matches(word, list(allowed), n=1, cutoff=0.6)
    return f", did you mean {near[0]!r}?" if near else ""


def unknown(word: str, allowed: Iterable[str], what: str) -> str:
    """The text for a reference or key that does not exist: ``is no phase, did you mean 'oil'? allowed: ocean, oil``."""
    words = list(allowed)
    hint = suggestion(word, words)
    return f"is no {what}{hint}{' ' if hint else ', '}allowed: {', '.join(words) if words else 'none is defined'}"


@contextmanager
def problems_of(path: str, failing: str) -> Iterator[None]:
    """Turn a refusal by what a scenario is built from into a problem at `path`: ``bodies.rock cannot be sampled: ...``."""
    try:
        yield
    except ScenarioError:
        raise
    except (ValueError, OSError) as cause:
        raise ScenarioError([Problem(path, f"{failing}: {cause}")]) from cause
