"""The entity paths of a recording, for the writer and the reader alike."""

from __future__ import annotations

FLUID = "fluid"
LOST = "lost"
BOUNDARY = "boundary"
OUTLINES = "outlines"
METRICS = "metrics"
PROBES = "probes"
FORCES = "forces"
EVENTS = "events"
LEGEND = "legend"
SURFACE = "sea/surface"
NAMES = "names"
EQUIPMENT = "equipment"
BODIES = "bodies"
MOTIONS = "motions"
VESSELS = "vessels"
BOOM = "boom"
BODY_GROUPS = (VESSELS, BOOM, BODIES)

TIMELINE_TIME = "sim_time"
TIMELINE_FRAME = "frame"

_HULL = "hull"


def _path(*parts: str) -> str:
    """Join parts to an entity path; ValueError for an empty part, which Rerun would read as something else."""
    path = "/".join(parts)
    if any(not part for part in path.split("/")):
        raise ValueError(f"entity path {path!r} has an empty part, allowed: names joined by single slashes")
    return path


def phase(name: str) -> str:
    """Return the path of a phase's particles."""
    return _path(FLUID, name)


def sizes(particles: str) -> str:
    """Return the path of the volumes and widths of the parcels at a path; they are logged whenever one changes."""
    return _path(particles, "sizes")


def fates(particles: str) -> str:
    """Return the path of the fates of the oil at a path; they are logged whenever one changes."""
    return _path(particles, "fates")


def ids(particles: str) -> str:
    """Return the path of the ids of the particles at a path; they are logged whenever the set of ids changes."""
    return _path(particles, "ids")


def motion_names() -> str:
    """Return the path of the names of the bodies whose motions are recorded; they are logged whenever they change."""
    return _path(MOTIONS, "names")


def lost(cause: str) -> str:
    """Return the path of the oil particles that booms lost by one cause; they are at their phase's path as well."""
    return _path(LOST, cause)


def boundary(name: str) -> str:
    """Return the path of static boundary particles."""
    return _path(BOUNDARY, name)


def outline(name: str) -> str:
    """Return the path of the box around static boundary particles."""
    return _path(OUTLINES, name)


def body(name: str) -> str:
    """Return the path of a body; the name gives its group: ``vessels/port`` is at ``vessels/port/hull``."""
    group, _, rest = name.partition("/")
    if group == VESSELS and rest:
        return _path(VESSELS, rest, _HULL)
    if group in BODY_GROUPS and rest:
        return _path(group, rest)
    return _path(BODIES, name)


def body_group(name: str) -> str:
    """Return the group of a body by its name: vessels, boom or bodies."""
    group, _, rest = name.partition("/")
    return group if group in BODY_GROUPS and rest else BODIES


def segments(parent: str, shape: int) -> str:
    """Return the path of the segments of one of a boom's shapes, counted from 0; ``parent`` is what their names begin with."""
    return _path(parent, "segments" if shape == 0 else f"segments-{shape + 1}")


def tension(segments: str) -> str:
    """Return the path of the lines that show the tension of the segments at a path."""
    return _path(segments, "tension")


def label(name: str) -> str:
    """Return the path of the label at a body."""
    return f"{body(name)}/name"


def boom_label(name: str) -> str:
    """Return the path of the name over a boom."""
    return _path(NAMES, name)


def force(drawn: str) -> str:
    """Return the path of the arrows that show the fluid's force on the bodies that are drawn at a path."""
    return _path(FORCES, drawn)


def scalar(name: str) -> str:
    """Return the path of a scalar series: its name, below ``metrics`` unless it is already below metrics or probes."""
    root = name.partition("/")[0]
    return _path(name) if root in (METRICS, PROBES) else _path(METRICS, name)


def scalar_name(path: str) -> str:
    """Return the name of the series at ``path``: the inverse of `scalar`."""
    return path.strip("/").removeprefix(f"{METRICS}/")
