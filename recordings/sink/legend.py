"""What a recording shows, in words: the text beside its scenes in the viewer."""

from __future__ import annotations

from recordings.frame import RunDescription
from recordings.palette import CAUSES, is_water


def legend(run: RunDescription) -> str:
    """What is run, and what colours and arrows mean, in Markdown."""
    booms = run.exercise.booms if run.exercise else ()
    lines = [f"**{run.properties.get('title') or run.name}**"]
    if booms:
        causes = ", ".join(f"{name} *{cause.replace('_', ' ')}*" for cause, (name, _) in CAUSES.items())
        full = max(boom.full_tension for boom in booms)
        lines.append(f"**Oil** is dark; **lost oil** by its cause: {causes}.")
        lines.append(f"**Boom**: pale when slack, orange at {0.5 * full:.3g} N, dark red from {full:.3g} N of tension.")
    elif run.oils:
        lines.append("**Oil** is dark.")
    if run.oils and any(map(is_water, run.phases)):
        lines[-1] += " **Water** is drawn thin."
    if run.meshes:
        lines.append("Tab *Forces*: the water's force on each body, three body lengths for its whole buoyancy.")
    return "\n\n".join(lines)
