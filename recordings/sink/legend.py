"""The legend of a recording: the text beside its scenes in the viewer."""

from __future__ import annotations

from recordings.frame import RunDescription
from recordings.palette import CAUSES, is_water


def legend(run: RunDescription) -> str:
    """Write the title, and the meaning of colours and arrows, in Markdown."""
    booms = run.exercise.booms if run.exercise else ()
    lines = [f"**{run.properties.get('title') or run.name}**"]
    if booms:
        causes = ", ".join(f"{name} *{cause.replace('_', ' ')}*" for cause, (name, _) in CAUSES.items())
        full = max(boom.full_tension for boom in booms)
        lines.append(f"**Oil** is dark. The colour of **lost oil** shows the cause of its loss: {causes}.")
        lines.append(
            f"The colour of the **boom** shows its tension: pale at 0 N, orange at {0.5 * full:.3g} N, dark red from {full:.3g} N on."
        )
    elif run.oils:
        lines.append("**Oil** is dark.")
    if run.oils and any(map(is_water, run.phases)):
        lines[-1] += " **Water** is drawn as small dots."
    if run.meshes:
        lines.append(
            "Tab *Forces* shows the water's force on each body; an arrow of three body lengths is the body's whole buoyancy."
        )
    return "\n\n".join(lines)
