"""The legend of a recording: the text beside its scenes in the viewer."""

from __future__ import annotations

from recordings.model.exercise import BoomDescription
from recordings.model.frame import RunDescription
from recordings.model.palette import CAUSES, is_water
from recordings.model.words import cause_in_words, force_in_words


def legend(run: RunDescription) -> str:
    """Write the title, and the meaning of colours and arrows, in Markdown."""
    booms = run.exercise.booms if run.exercise else ()
    lines = [f"**{run.properties.get('title') or run.name}**"]
    if booms:
        causes = ", ".join(f"{name} *{cause_in_words(cause)}*" for cause, (name, _) in CAUSES.items())
        lines.append(f"**Oil** is dark. The colour of **lost oil** shows how it was lost: {causes}.")
        lines += [f"The line on {tension_colors(boom, len(booms) > 1)}." for boom in booms]
    elif run.oils:
        lines.append("**Oil** is dark.")
    if run.oils and any(map(is_water, run.phases)):
        lines[-1] += " **Water** is drawn as small dots."
    if run.meshes:
        lines.append(
            "Tab *Forces* shows the water's force on each body; an arrow of three body lengths is the body's whole buoyancy."
        )
    return "\n\n".join(lines)


def tension_colors(boom: BoomDescription, several: bool) -> str:
    """Say what a boom's colours mean; with several booms, each has a scale of its own."""
    name = f"boom **{boom.name}**" if several else "the **boom**"
    half, full = force_in_words(0.5 * boom.full_tension), force_in_words(boom.full_tension)
    return f"{name} shows its tension: pale without any, orange at {half}, dark red from {full} on"
