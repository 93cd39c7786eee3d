"""The problems of a scenario: each with its path, all of them in one error; and the codes with which the command ends."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache

# exit codes of the `oilsim` command: done, failed (the recording up to then is kept), bad input, and Ctrl-C as shells count it
DONE, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
# Keys that had other names, and where their values are written now; * stands for any name; the longest that fits counts.
MOVED = {
    "forcing": "sea",
    "forcing.wind.gustiness": "sea.wind.gust_intensity",
    "forcing.waves.level": "sea.level",
    **{
        f"forcing.{kind}.{key}": f"tank.zones.NAME.{key}"
        for kind in ("waves", "current")
        for key in ("lower", "upper", "relaxation_time", "edge")
    },
    "window.detail": "window.spacing",
    "sea.turbulence": "sea.diffusivity",
    "sea.turbulence.diffusivity": "sea.diffusivity",
}
# Keys, and words as values of a key, that have no successor, and what is allowed in their place.
REMOVED = {
    "run.detail": "fidelity = 'live', 'fine' or 'none' (--fidelity); a [tank], a [window] or neither says what there is",
    **dict.fromkeys(
        (
            "forcing.wind.gust_time", "forcing.wind.drag_coefficient", "sea.turbulence.stretch", "sea.waves.phase", "sea.waves.phase_deg",
            "sea.wind.drift_layer", "sea.wind.deflection", "sea.wind.deflection_deg", "bodies.*.angular_velocity",
            "bodies.*.angular_velocity_deg",
        ),
        "without it",
    ),
    **dict.fromkeys(
        (
            "fluid.density_tolerance", "fluid.viscosity_tolerance", "fluid.density_iterations", "fluid.divergence_iterations",
            "fluid.viscosity_iterations",
        ),
        "divergence_tolerance, or FluidConfig in Python",
    ),
    "fluid.explicit_viscosity": "without it, or FluidConfig in Python",
    "fluid.cfl": "maximum_time_step, or FluidConfig in Python",
    "fill.*.shape=sphere": "shape = 'block', 'slab' or 'cylinder'",
    "fill.*.inside": "without it: hollows of bodies stay dry",
    "fill.*.axis": "without it: cylinders stand upright",
    "sea.waves.theory": "without it: waves are linear",
    "sea.waves.stretching": "without it: heights are stretched up to the surface (Wheeler)",
    "sea.waves.highest_frequency": "without it: spectra end at 4.5 / peak_period",
    "sea.waves.count": "without it: a spectrum has 100 components",
    **dict.fromkeys(
        ("sea.current.longest_gap", "sea.wind.longest_gap"), "without it: rows at most 2.5 times their usual interval apart"
    ),
    "sea.wind.highest_frequency": "without it: gusts reach 1 Hz",
    **dict.fromkeys(("sea.langmuir.convergence", "sea.langmuir.jet"), "without it: 0.01 of the wind's speed"),
    **dict.fromkeys((f"bodies.*.shape={shape}" for shape in ("polygon", "capsule", "wigley")), "shape = 'mesh' with a file"),
    "bodies.*.motion.release": "without it: free bodies are free from the start",
    **dict.fromkeys(
        (f"bodies.*.motion.kind={kind}" for kind in ("ramp", "table", "rotation")), "kind = 'free', 'fixed' or 'sine'"
    ),
    "booms.*.seed": "without it: losses fall due in the same order in each run",
    **dict.fromkeys(("recording.water_every", "recording.surface_rate"), "frame_rate"),
    "recording.checkpoints_kept": "checkpoint_interval; 100 are kept",
}  # fmt: skip


_FORMER = (*MOVED, *REMOVED)


def moved(path: str) -> str:
    """Say what has become of a key that had another name, or is no more; empty for one that never was.

    A word that was a value is asked for behind its key, ``bodies.pole.shape=capsule``.
    """
    parts = _parts(path)
    old = [key for key in _FORMER if key.startswith(parts[0]) and _begins_with(parts, _parts(key))]
    if not old:
        return ""
    longest = max(old, key=len)
    if longest in REMOVED:
        return f"is no more, allowed: {REMOVED[longest]}"
    return f"is now {'.'.join([MOVED[longest], *parts[longest.count('.') + 1 :]])}"


@lru_cache(maxsize=4096)
def _parts(key: str) -> list[str]:
    return re.split(r"\.|(?==)", key)


def _begins_with(parts: list[str], key: list[str]) -> bool:
    return len(parts) >= len(key) and all(one in ("*", part) for one, part in zip(key, parts, strict=False))


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
