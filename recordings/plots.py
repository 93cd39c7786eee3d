"""Which scalar series belong in one diagram."""

from __future__ import annotations

from collections.abc import Collection, Mapping

USUAL_PLOTS: Mapping[str, tuple[str, ...]] = {
    "Oil [m³]": ("oil_inside", "oil_outside", "oil_lost"),
    "Oil lost by cause [m³]": ("oil_lost/**",),
    "Tow tension [N]": ("tow_tension/**",),
    "Probes": ("probes/**",),
    "Kinetic energy [J]": ("kinetic_energy",),
    "Iterations per step": ("iterations_density", "iterations_divergence", "iterations_viscosity"),
    "Density error [-]": ("density_error",),
    "Time step [s]": ("time_step",),
    "Real-time factor [-]": ("real_time_factor",),
}
WORKINGS = frozenset(list(USUAL_PLOTS)[4:])  # how the solver did, not what happened in the exercise


def matches(pattern: str, name: str) -> bool:
    """Whether a plot's pattern, a name or "prefix/**", asks for the series ``name``."""
    if pattern.endswith("/**"):
        return name.startswith(pattern.removesuffix("**"))
    return name == pattern


def plots_with_series(plots: Mapping[str, tuple[str, ...]], names: Collection[str]) -> dict[str, list[str]]:
    """The plots that have something to show, with the names of the series each shows."""
    chosen = {
        title: [name for name in names if any(matches(pattern, name) for pattern in patterns)]
        for title, patterns in (plots or USUAL_PLOTS).items()
    }
    return {title: found for title, found in chosen.items() if found}
