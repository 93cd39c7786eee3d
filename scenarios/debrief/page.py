"""The debrief page: one HTML page that needs no other file, and its pictures as PNG files beside it."""

from __future__ import annotations

import base64
import io
import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import matplotlib as mpl
import matplotlib.image
import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.figure import Figure

from booms.containment import PRACTICE_SPEED
from booms.losses.liquids import OilOnWater
from booms.losses.rates import suction_limit
from booms.scores import LossSpeeds, catenary_parameter, skirt_drag_coefficient, tow_force
from oilsim.core.physical_constants import KNOT
from recordings.model import palette
from recordings.model.appearance import tension_colors
from recordings.model.words import LEADING, cause_in_words, force_in_words, three_figures, volume_in_words
from recordings.pictures.style import STYLE
from recordings.replay.joined import JoinedReplay
from recordings.replay.recording import Replay
from scenarios.debrief.accuracy_notes import accuracy_notes
from scenarios.debrief.boom_history import BoomHistory, boom_histories
from scenarios.debrief.diagrams import DIAGRAMS, oil_diagram, probe_diagram
from scenarios.debrief.grade import DESIGN_SPEED, GROSS_SPEED, LETTERS, Grade, criteria_from, exercise_grade, grade
from scenarios.debrief.key_moments import KeyMoment, deck_text, is_technical, key_moments
from scenarios.debrief.measures import over_by_segment
from scenarios.debrief.recovery_rates import loss_curve, rate_figures, rates_diagram
from scenarios.debrief.reports import report_parts
from scenarios.debrief.slick_map import slick_map
from scenarios.schema.criteria import CriterionSettings

PAGE, REPORT = "debrief.html", "report.html"
SEGMENT_SPEEDS = (DESIGN_SPEED, PRACTICE_SPEED, GROSS_SPEED)  # [m/s], of the criteria of the same names
_DPI = 110
_DRAWN = {"oil": oil_diagram, "rates": rates_diagram, **DIAGRAMS, "loss": loss_curve}
_SQUARE = 0.7  # part of the speed through the water that is across the line between the ends; with less, a boom hangs in no catenary


@dataclass(frozen=True, kw_only=True, eq=False)
class BoomChapter:
    """The chapter of one boom: its grade, its diagrams by name as SVG text, its table of figures, and that of its segments."""

    history: BoomHistory
    grade: Grade
    diagrams: dict[str, str]
    figures: list[tuple[str, str]]
    segments: list[tuple[str, ...]]


def write_debrief(
    recording: Path, folder: Path, criteria: Mapping[str, CriterionSettings] | None = None, *, report: bool = False
) -> Path:
    """Read a recording and write its debrief into ``folder``, which is created if needed; return the page's path.

    criteria: changes and additions to those of the deployment; by default those of the recorded scenario. With `report`, `REPORT` is
    written beside it: POLREP, ICS 209, and what the operation cost.
    """
    replay = JoinedReplay(recording)
    if criteria is None and replay.run.exercise is not None:
        criteria = criteria_from(replay.run.exercise.criteria, str(recording))
    criteria = criteria or {}
    histories = boom_histories(replay)
    moments = key_moments(replay, histories)
    folder.mkdir(parents=True, exist_ok=True)
    with mpl.rc_context({**STYLE, "svg.hashsalt": "oilsim", "font.family": "DejaVu Sans"}):
        pictures = [_write_scene(moment, folder) for moment in moments]
        map_picture = _write_figure(slick_map(replay, moments), folder / "map.png")
        probes = probe_diagram(replay, moments)
        probe_picture = "" if probes is None else _write_figure(probes, folder / "probes.png")
        chapters = [_chapter(replay, history, moments, criteria, folder, len(histories) > 1) for history in histories]
    shown = {
        "recording": recording.name,
        "duration": moments[-1].time,
        "moments": list(zip(moments, pictures, strict=True)),
        "map": map_picture,
    }
    page = _rendered(
        replay,
        "page.html",
        **shown,
        probes=probe_picture,
        chapters=chapters,
        overall=exercise_grade({chapter.history.boom.name: chapter.grade for chapter in chapters}),
    )
    target = folder / PAGE
    target.write_text(page, encoding="utf-8")
    (folder / "grade.json").write_text(json.dumps(_grades(chapters), indent=1) + "\n", encoding="utf-8")
    if report:
        parts = {**shown, **report_parts(replay, moments)}
        (folder / REPORT).write_text(_rendered(replay, REPORT, **parts), encoding="utf-8")
    return target


def _rendered(replay: JoinedReplay, template: str, **parts: object) -> str:
    """Return a page of a recording, made of its own facts and these parts."""
    return (
        _environment()
        .get_template(template)
        .render(
            run=replay.run,
            end_reason=replay.end_reason,
            pieces=_pieces(replay),
            missing=replay.missing,
            repaired_from=replay.repaired_from,
            changes=_changes(replay),
            letters=LETTERS,
            rules=LossSpeeds,
            events=[replace(e, text=deck_text(replay, e)) for e in replay.events if not is_technical(e)],
            instructors_log=replay.events,  # as the program said them
            causes=[(cause_in_words(cause), palette.css(palette.cause_color(cause))) for cause in palette.CAUSES],
            boom_colors=[
                tension_colors(boom, len(replay.run.booms) > 1).replace("**", "") for boom in replay.run.booms
            ],
            notes=accuracy_notes(replay),
            **parts,
        )
    )


def _pieces(replay: JoinedReplay) -> list[str]:
    """Say where the run was continued, and with which orders."""
    told = []
    for branch in replay.branches:
        orders = [
            deck_text(replay, e) for e in replay.events if e.source == "instructor" and abs(e.time - branch.time) < 1e-6
        ]
        given = f", with the orders: {'; '.join(orders)}" if orders else ""
        told.append(f"At {branch.time:.1f} s the run was continued from {Path(branch.recording).name}{given}.")
    return told


def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("scenarios.debrief", "."), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.filters["figure"] = three_figures
    environment.filters["measured"] = _measured
    environment.filters["knots"] = _knots
    return environment


def _measured(value: float, unit: str) -> str:
    """Return a measured value with its unit; a time that was never reached is infinite."""
    return f"{three_figures(value)} {unit}" if math.isfinite(value) else "never"


def _chapter(
    replay: Replay,
    history: BoomHistory,
    moments: Sequence[KeyMoment],
    criteria: Mapping[str, CriterionSettings],
    folder: Path,
    several: bool,
) -> BoomChapter:
    prefix = f"{history.boom.name}-" if several else ""
    diagrams = {}
    for name, draw in _DRAWN.items():
        figure = draw(history, moments)
        if figure is not None:
            diagrams[name] = _write_figure(figure, folder / f"{prefix}{name}.png")
    return BoomChapter(
        history=history,
        grade=grade(history, criteria),
        diagrams=diagrams,
        figures=_figures(replay, history),
        segments=_segments(history),
    )


def _write_scene(moment: KeyMoment, folder: Path) -> str:
    """Write a key moment's picture; return it as a data URL."""
    path = folder / f"moment-{moment.number}.png"
    matplotlib.image.imsave(path, np.ascontiguousarray(moment.image))
    return "data:image/png;base64," + base64.b64encode(path.read_bytes()).decode("ascii")


def _write_figure(figure: Figure, path: Path) -> str:
    """Write a figure as PNG; return it as SVG text, without the XML declaration."""
    figure.savefig(path, dpi=_DPI)
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None})
    svg = text.getvalue()
    return svg[svg.index("<svg") :]


def _figures(replay: Replay, history: BoomHistory) -> list[tuple[str, str]]:
    """List the figures of a boom for the table."""
    oil = {name: float(volume[-1]) for name, volume in history.oil.items()}
    led_on = oil.get("lost/around_ends", 0.0) if history.boom.deployment in LEADING else None
    rows = [
        ("Oil held at the end", volume_in_words(oil["contained"])),
        *([] if led_on is None else [("Led on past the boom's end", volume_in_words(led_on))]),
        ("Oil lost at the end", volume_in_words(oil["lost"] - (led_on or 0.0))),
        *(
            (f"&nbsp;&nbsp;{cause_in_words(cause)}", volume_in_words(float(v[-1])))
            for cause, v in history.causes.items()
            if led_on is None or cause != "around_ends"
        ),
        ("&nbsp;&nbsp;carried out by closures (modelled); the rest is resolved", volume_in_words(oil["lost_modelled"])),
        ("Gone past the boom in all, again after coming round a sea that repeats", volume_in_words(oil["passed"])),
        ("Lost and re-contained, in total", volume_in_words(oil["recontained"])),
        ("Not met by the boom", volume_in_words(oil["afloat"])),
        *((words, volume_in_words(volume)) for words, volume in _of_the_run(replay) if volume > 0.0),
        ("Tow speed at the first loss (net 0.5 % of the oil, for 5 s)", _knots(history.losses.first)),
        ("Tow speed at gross loss (net 10 % of the oil a minute, mean over 12 s)", _knots(history.losses.gross)),
        (
            f"Highest speed normal to the boom that lasted {history.boom.hold_time:.2g} s",
            _knots(float(history.held_peak.max())),
        ),
    ]
    return [*rows, *rate_figures(history), *_rules_of_thumb(replay, history)]


def _of_the_run(replay: Replay) -> Iterator[tuple[str, float]]:
    """Yield rows of the run's oil ledger at its end, in words and m3; none for a run without oil."""
    rows = {
        "stranded": "Stranded",
        "recovered": "Recovered by skimmers",
        "left_the_domain": "Left the simulated water without being lost by a boom",
    }
    for row, words in rows.items():
        if (series := replay.scalars.get(f"oil/{row}")) is not None:
            yield f"{words}, of all oil of the run", float(series.value[-1])
    for name in replay.run.exercise.areas if replay.run.exercise is not None else ():
        yield f"Most oil in the area {name}", float(np.max(replay.scalars[f"areas/{name}/oil"].value, initial=0.0))


def _segments(history: BoomHistory) -> list[tuple[str, ...]]:
    """List each segment: its place along the boom, the highest speed normal to it, and the time over each of `SEGMENT_SPEEDS`."""
    if not history.settled.any():
        return []
    highest, over = over_by_segment(history, SEGMENT_SPEEDS)
    length = history.boom.length / len(highest)
    return [
        (
            f"{k}",
            f"{k * length:.1f} to {(k + 1) * length:.1f} m",
            _knots(float(highest[k])),
            *(f"{share:.0f} %" for share in over[k]),
        )
        for k in range(len(highest))
    ]


def _rules_of_thumb(replay: Replay, history: BoomHistory) -> list[tuple[str, str]]:
    """List what rules of thumb give for the same tow, beside the measured values."""
    boom = history.boom
    oils = [phase.rest_density for phase in replay.run.phases if phase.is_oil]
    waters = [phase.rest_density for phase in replay.run.phases if not phase.is_oil]
    rows = []
    if oils and waters and max(oils) < max(waters):
        heaviest = OilOnWater(oil_density=max(oils), water_density=max(waters))
        limit = float(suction_limit(boom.skirt_depth, heaviest))
        rows.append(
            ("Speed at which an upright skirt of this depth sucks the slick's front under (closure)", _knots(limit))
        )
    return rows + (_tension_rows(history, max(waters)) if waters and history.tow_tension else [])


def _tension_rows(history: BoomHistory, density: float) -> list[tuple[str, str]]:
    """List the mean tension by the rule of thumb, with its area and speed, beside the recorded one, once the boom is settled.

    In a catenary, the tension at each end is 26 A V^2 with the area A = skirt depth x radius of the apex; V is the speed through the water
    across the line between the ends, since the boom feels no other.
    """
    boom, settled = history.boom, history.settled
    mean = np.mean([tension[settled].mean() for tension in history.tow_tension.values()])
    recorded = ("Mean tension at an end, as recorded", force_in_words(float(mean)))
    gap = float(history.gap_ratio[settled].mean())
    across, whole = (speeds[settled] for speeds in history.through_water)
    speed = float(np.sqrt(np.mean(across**2)))  # the force grows with the square of the speed
    rule = "Mean tension at an end by the rule of thumb 26 A V²"
    if speed < _SQUARE * float(np.sqrt(np.mean(whole**2))):
        return [(rule, "does not apply: the boom does not lie square to the water's way"), recorded]
    if not 0.0 < gap < 1.0 or speed == 0.0:
        return [recorded]
    force, _ = tow_force(
        boom.length, gap, boom.skirt_depth, speed, drag_coefficient=skirt_drag_coefficient(), density=density
    )
    calm, _ = tow_force(
        boom.length,
        gap,
        boom.skirt_depth,
        float(across.mean()),
        drag_coefficient=skirt_drag_coefficient(),
        density=density,
    )
    waves = []
    if history.in_waves and calm > 0.0:
        more = f"{three_figures(float(mean) / calm)} times it was recorded"
        reason = "the orbital velocity of waves adds its mean square to V²"
        waves = [("The same at the mean speed, as in calm water", f"{force_in_words(calm)}; {more}: {reason}")]
    radius = catenary_parameter(boom.length, gap)
    area = f"A = {boom.skirt_depth:g} m of skirt × {three_figures(radius)} m, the radius of the apex at a gap ratio of {gap:.2f}"
    return [(f"{rule}, with {area} = {three_figures(radius * boom.skirt_depth)} m², and V = {speed / KNOT:.2f} kn across "
             "the line between the ends", force_in_words(force)), *waves, recorded]  # fmt: skip


def _changes(replay: Replay) -> str:
    """Return the changes to the scenario that were made for this run; the number of threads changes no result."""
    return re.sub(r"run\.threads=\d+ ?", "", str(replay.run.properties.get("overrides", ""))).strip()


def _grades(chapters: Sequence[BoomChapter]) -> dict[str, Any]:
    return {
        chapter.history.boom.name: {
            "grade": chapter.grade.letter or None,
            "share": chapter.grade.share if chapter.grade.letter else None,
            "capped_by": chapter.grade.capped_by,
            "first_loss_kn": _in_knots(chapter.history.losses.first),
            "gross_loss_kn": _in_knots(chapter.history.losses.gross),
            "findings": {
                finding.criterion.key: {
                    "value": finding.value if finding.value is None or math.isfinite(finding.value) else None,
                    "verdict": finding.verdict,
                    "unit": finding.criterion.unit,
                    "good": finding.criterion.good,
                    "acceptable": finding.criterion.acceptable,
                    "weight": finding.criterion.weight,
                }
                for finding in chapter.grade.findings
            },
        }
        for chapter in chapters
    }


def _in_knots(speed: float | None) -> float | None:
    return None if speed is None else speed / KNOT


def _knots(speed: float | None) -> str:
    return "not reached" if speed is None else f"{speed / KNOT:.2f} kn"
