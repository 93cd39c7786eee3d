"""Orders of an instructor in the words of the deck: ``tow.speed=0.36`` is "tow at 0.70 kn"."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from scipy.constants import knot

from recordings.words import course_in_words, three_figures
from scenarios.schema.structuring import COMPASS, SUFFIXES

_PREFIX = "orders "
_COURSES = ("tow.heading", "forcing.wind.direction", "forcing.current.direction")


def order_in_words(text: str, bearing: float) -> str:
    """Return the text of an instructor's event in words; `bearing` [rad] of the x axis, clockwise from north."""
    if not text.startswith(_PREFIX):
        return text
    return "; ".join(_in_words(setting, bearing) for setting in text.removeprefix(_PREFIX).split(" "))


def _in_words(setting: str, bearing: float) -> str:
    """Return one setting, ``key=value``, in words; as it is if it is none of the usual orders."""
    key, _, written = setting.partition("=")
    path, _, name = key.rpartition(".")
    try:
        value = float(written)
    except ValueError:
        vessel = key.removeprefix("vessels.").removesuffix(".legs")
        return f"a new course for {vessel}" if key == f"vessels.{vessel}.legs" else setting
    if name in COMPASS:
        turned = value + (180.0 if name == "from_compass" else 0.0)
        key, value = f"{path}.{COMPASS[name]}", bearing - math.radians(turned)
    for suffix, (_, factor) in SUFFIXES.items():
        if key.endswith(suffix):
            key, value = key.removesuffix(suffix), factor * value
    if key in _COURSES:
        toward, origin = course_in_words(value, bearing), course_in_words(value + math.pi, bearing)
        return {"tow": f"tow heading {toward}", "wind": f"wind from {origin}", "current": f"current towards {toward}"}[
            key.split(".")[-2]
        ]
    for end, write in _WORDS.items():
        if key == end or (end == "emitters.*.speed" and key.startswith("emitters.") and key.endswith(".speed")):
            return write(value, key)
    return setting


_WORDS: Mapping[str, Callable[[float, str], str]] = {
    "tow.speed": lambda value, _: f"tow at {value / knot:.2f} kn",
    "forcing.wind.speed": lambda value, _: f"wind {three_figures(value / knot)} kn",
    "forcing.wind.gustiness": lambda value, _: f"gusts of {three_figures(100.0 * value)} % of the wind",
    "forcing.current.speed": lambda value, _: f"current {value / knot:.2f} kn",
    "forcing.waves.height": lambda value, _: f"waves {three_figures(value)} m high",
    "emitters.*.speed": lambda value, key: (
        f"pipe {key.split('.')[1]} {'shut' if value == 0.0 else f'at {three_figures(value)} m/s'}"
    ),
}
