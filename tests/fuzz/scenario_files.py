"""Scenario files with values, types and texts that nobody wants."""

from __future__ import annotations

import random
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from scenarios.cli import main

LIBRARY = Path(__file__).parents[2] / "scenarios" / "library"
EXTREMES = (
    "0", "-0.0", "-1", "1", "3", "1e-323", "1e-300", "1e-30", "1e-12", "1e-6", "1e3", "1e6", "1e9", "1e12", "-1e12", "1e30", "1e300",
    "-1e300", "1.7e308", "nan", "inf", "-inf", "2147483648", "18446744073709551616", "1" + "0" * 400,
)  # fmt: skip
OTHERS = (
    "true", "false", '""', '"x"', '"../../etc/passwd"', '"' + "x" * 300 + '"', '"\\u0000"', "[]", "{}", "[1]", "[1, 2, 3]", "[[1], [2]]",
    "[nan, nan, nan]", "1979-05-27", "12:00:00", "{ kind = 1 }", "{ a = { a = { a = 1 } } }", "[1e12, 1e12, 1e12]",
    "[-1e9, -1e9, -1e9]", "[1e-300, 1e-300, 1e-300]",
)  # fmt: skip


def paths_of(data: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Every entry that is not a table, with its path; the entries of lists, too."""
    items = data.items() if isinstance(data, Mapping) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        name = f"{path}.{key}" if path else str(key)
        if not isinstance(value, Mapping):
            yield name, value
        yield from paths_of(value, name)


def damaged(text: str, chance: random.Random) -> str:
    """A text with pieces lost, doubled, moved and made up."""
    for _ in range(chance.randint(1, 4)):
        first, length = chance.randrange(len(text) + 1), chance.choice((1, 1, 4, 30))
        piece = text[first : first + length]
        made = "".join(chr(chance.choice((0, 9, 10, 34, 39, 91, 93, 123, 125, 46, 61, 233, 0x1F600))) for _ in range(3))
        new = chance.choice(("", piece + piece, made, chance.choice(EXTREMES), chance.choice(OTHERS), piece[::-1]))
        text = text[:first] + new + text[first + length :]
    return text


def check_of(seed: int) -> list[str]:
    """The command line of a trial: changes of single values of a scenario of the library; needs no file."""
    chance = random.Random(seed)
    file = chance.choice(sorted(LIBRARY.glob("*.toml")))
    paths = [path for path, _ in paths_of(tomllib.loads(file.read_text(encoding="utf-8")))]
    arguments = ["check", file.stem]
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        path = chance.choice(paths)
        if chance.random() < 0.1:
            path = path[:-1] or "x"
        value = chance.choice(EXTREMES if chance.random() < 0.75 else OTHERS)
        arguments += ["--set", f"{path}={value}"]
    return arguments


def scenario_trial(seed: int) -> int:
    """Check a scenario whose values, or whose text, are spoiled."""
    chance = random.Random(seed)
    if chance.random() < 0.7:
        return main(check_of(seed))
    text = chance.choice(sorted(LIBRARY.glob("*.toml"))).read_text(encoding="utf-8")
    file = Path("spoiled.toml")
    file.write_bytes(damaged(text, chance).encode("utf-8" if chance.random() < 0.9 else "utf-16"))
    try:
        return main(["check", str(file)])
    finally:
        file.unlink()
