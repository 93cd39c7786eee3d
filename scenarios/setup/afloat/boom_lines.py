"""Lines that hold the ends of booms: elastic tow lines, and reels."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from booms.boom import Boom
from booms.deployment import BoomLayout, PlacedLine, lay_along
from coupling.multibody.lines import Lines
from oilsim.backend.arrays import Array
from scenarios.schema.exercise import BoomSettings, ReelSettings, body_of
from scenarios.schema.parsing.quantity_fields import Point2
from vessels.vessel import Vessel

if TYPE_CHECKING:
    from booms.reel import Track


def strung(name: str, vessel: Vessel, segment: str, points: Array, settings: BoomSettings) -> PlacedLine:
    """Make an elastic line from a vessel to a boom's end, from and to `points` (2, 3) [m]."""
    assert settings.line_stiffness is not None
    return PlacedLine(
        name=name,
        body_a=body_of(vessel.name),
        body_b=segment,
        points=points,
        stiffness=settings.line_stiffness,
        breaking_load=settings.line_breaking_load or math.inf,
    )


def reel_name(boom: str) -> str:
    """Return the name of a reel among the lines of the world."""
    return f"reels/{boom}"


def lay_off_reel(boom: Boom, mouth: Point2, end: Point2, water_level: float, name: str) -> BoomLayout:
    """Lay a boom straight from its second end through the mouth of its reel [m], with the wound part behind the mouth.

    ValueError if its end is at the mouth, or farther from it than the boom is long.
    """
    way = np.array(end) - np.array(mouth)
    out = float(np.linalg.norm(way))
    if not 0.0 < out <= boom.length * (1.0 + 1e-9):
        raise ValueError(
            f"its end is {out:g} m from the reel's mouth, allowed: above 0 m and at most its length, {boom.length:g} m"
        )
    behind = np.linspace(boom.length, 0.0, boom.segment_count + 1)[:, None]
    return lay_along(boom, np.array(end) - behind * way / out, water_level=water_level, name=name)


def reel_line(boom: str, layout: BoomLayout, reel: ReelSettings) -> PlacedLine:
    """Return the line that stands for a reel's brake, a segment long as laid: from the boom's inner end to a point behind it."""
    inner, outer = layout.end_points
    back = (inner - outer) / layout.boom.length * layout.boom.segment_length
    return PlacedLine(
        name=reel_name(boom),
        body_a=layout.segments[0].name,
        body_b=None,
        points=np.array([inner, inner + back]),
        stiffness=reel.stiffness,
    )


def track_off_reel(layout: BoomLayout, settings: BoomSettings, first_row: int = 0) -> Track | None:
    """Return the line of a boom on a reel, None of another; first_row: of its segments among the bodies."""
    mouth = settings.ends[0]
    if settings.reel is None or isinstance(mouth, str):
        return None
    from booms.reel import track_of  # only a boom on a reel pays for the loads of a sea

    return track_of(layout, mouth, first_row)


def laid_out(layout: BoomLayout, mouth: Point2) -> float:
    """Return the length [m] of boom outside the mouth of its reel, as laid."""
    return float(np.hypot(*(layout.end_points[1][:2] - np.array(mouth))))


def paid_out(boom: str, layout: BoomLayout, mouth: Point2, lines: Lines) -> float:
    """Return the length [m] of boom that a reel has let out, with its line as long as it is now."""
    name = reel_name(boom)
    return laid_out(layout, mouth) + lines.length(name) - lines.laid_length(name)
