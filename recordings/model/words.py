"""Quantities, directions and causes as people read them: on deck, on the page of a debrief, and beside the scenes of a viewer."""

from __future__ import annotations

import math
from collections.abc import Mapping

LEADING = ("diversion", "funnel")  # deployments of booms that lead oil on: what goes past their end is not lost
GRAVITY = 9.80665  # [m/s2] standard, of the tonne as a force
_KILO_FROM = 100.0  # [N] from which a force is written in kN
_TONNES_FROM = 1000.0  # [N] from which it is written in tonnes too
_ROUNDING = 1e-9  # far below any figure that is told, far above what rounding leaves of figures about 1
CAUSE_IN_WORDS: Mapping[str, str] = {
    "entrainment": "swept under the skirt",
    "drainage": "drained under the skirt",
    "critical_accumulation": "drawn under the skirt as thick oil",
    "planing": "slipped under the leaning skirt",
    "submergence": "ran over the boom, which was under water",
    "splash_over": "splashed over the boom",
    "around_ends": "swept past the boom's end",
    "through": "passed through the boom, at a joint",
    "left_the_domain": "left the simulated water",
}
"""Words for each cause, by its name in series and summaries; they complete "oil that ..."."""


def cause_in_words(cause: str) -> str:
    """Return the words for a cause; for one that another program has recorded, its name without underscores."""
    return CAUSE_IN_WORDS.get(cause, cause.replace("_", " "))


def three_figures(number: float) -> str:
    """Write a number with three figures, never with an exponent: 0.0123, 12.3, 12,300; what rounding leaves of nothing is 0."""
    if abs(number) < _ROUNDING:
        return "0"
    if not math.isfinite(number):
        return f"{number:g}"
    digits = 2 - math.floor(math.log10(abs(number)))
    rounded = round(number, digits)
    text = f"{rounded:,.{max(0, digits)}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def volume_in_words(volume: float) -> str:
    """Write a volume [m3] with three figures: in m3, or in litres below 1 m3."""
    return f"{three_figures(volume)} m3" if volume >= 1.0 else f"{three_figures(1e3 * volume)} litres"


def force_unit(largest: float) -> tuple[float, str]:
    """Return the factor and the unit in which forces up to `largest` [N] are shown: kN, or N for small models."""
    return (1e-3, "kN") if largest >= _KILO_FROM else (1.0, "N")


def force_in_words(force: float) -> str:
    """Write a force [N] with three figures: in kN, from 1 kN on in tonnes too; of small models, below 0.1 kN, in N."""
    factor, unit = force_unit(abs(force))
    tonnes = f" ({three_figures(force / (1000.0 * GRAVITY))} t)" if abs(force) >= _TONNES_FROM else ""
    return f"{three_figures(factor * force)} {unit}{tonnes}"


def compass_course(direction: float, bearing: float = 0.5 * math.pi) -> float:
    """Return the compass course [degrees], 0 to 360, of a direction [rad] counter-clockwise from +x.

    bearing [rad] of the x axis clockwise from north: a quarter turn, east, unless a site gives another one.
    """
    return round(math.degrees(bearing - direction), 6) % 360.0


def course_in_words(direction: float, bearing: float = 0.5 * math.pi) -> str:
    """Write a direction [rad] as a compass course of three figures, such as 045."""
    return f"{round(compass_course(direction, bearing)) % 360:03d}"


def levers_in_words(thrust: float, steering: float) -> str:
    """Write thrust ahead and steering counter-clockwise, each from -1 to 1, as a helmsman does: "50 % ahead, 20 % rudder to starboard"."""
    way = "ahead" if thrust > 0.0 else "astern"
    engine = "no thrust" if thrust == 0.0 else f"{100.0 * abs(thrust):.0f} % {way}"
    side = "port" if steering > 0.0 else "starboard"
    return (
        f"{engine}, rudder amidships"
        if steering == 0.0
        else f"{engine}, {100.0 * abs(steering):.0f} % rudder to {side}"
    )
