"""The problems of a scenario: each with its path, all of them in one error; and the codes with which the command ends."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

# exit codes of the `oilsim` command: done, failed (the recording up to then is kept), bad input, and Ctrl-C as shells count it
DONE, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130


@dataclass(frozen=True, order=True)
class Problem:
    """One problem: its place (``fluid.particle_spacing``), and a text with the value and the allowed values."""

    path: str
    text: str

    def below(self, prefix: str) -> Problem:
        """Return the same problem with a prefix to its path."""
        return Problem(".".join(part for part in (prefix, self.path) if part), self.text)

    def __str__(self) -> str:
        return f"{self.path} {self.text}" if self.path else self.text


class ScenarioError(ValueError):
    """An error for a scenario that cannot be run, with every problem found in it."""

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
    """Suggest the nearest allowed word, as ``, did you mean 'oil'?``, or two that are equally near; empty if none is near."""
    near = difflib.get_close_matches(word, list(dict.fromkeys(allowed)), n=3, cutoff=0.6)
    nearness = [difflib.SequenceMatcher(a=one, b=word).ratio() for one in near]
    equal = [one for one, ratio in zip(near, nearness, strict=True) if ratio == nearness[0]]
    words = sorted(equal) if len(equal) == 2 else near[:1]  # of more that are alike, one is as good as another
    return f", did you mean {' or '.join(map(repr, words))}?" if words else ""


def unknown(word: str, allowed: Iterable[str], what: str) -> str:
    """Write the text for an unknown reference or key: ``is no phase, did you mean 'oil'? allowed: ocean, oil``."""
    words = list(allowed)
    hint = suggestion(word, words)
    return f"is no {what}{hint}{' ' if hint else ', '}allowed: {', '.join(words) if words else 'none is defined'}"


@contextmanager
def problems_of(path: str, failing: str) -> Iterator[None]:
    """Turn ValueError and OSError into a ScenarioError with a problem at `path`: ``bodies.rock cannot be sampled: ...``."""
    try:
        yield
    except ScenarioError:
        raise
    except (ValueError, OSError) as cause:
        raise ScenarioError([Problem(path, f"{failing}: {reason_of(cause)}")]) from cause


def reason_of(cause: Exception) -> str:
    """Say why a file could not be read or a part be made, without the number that the system gives its errors."""
    if isinstance(cause, OSError) and cause.strerror:
        return f"{cause.filename}: {cause.strerror}" if cause.filename else cause.strerror
    return str(cause)
