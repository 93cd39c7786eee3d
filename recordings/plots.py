"""Which scalar series belong in one diagram, and what they are called there."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

OIL_PLOTS: Mapping[str, tuple[str, ...]] = {
    "Oil held and lost [m³]": ("oil_retained", "oil_lost"),
    "Oil lost by cause [m³]": ("oil_lost/**",),
    "Speed [m/s]": ("tow_speed", "normal_speed_held", "normal_speed_limit"),
    "Probes": ("probes/**",),
}
HANDLING_PLOTS: Mapping[str, tuple[str, ...]] = {
    "Tow tension [N]": ("tow_tension/**",),
    "Largest lean of the skirt [rad]": ("skirt_angle",),
    "Gap ratio [-]": ("gap_ratio",),
}
SOLVER_PLOTS: Mapping[str, tuple[str, ...]] = {
    "Kinetic energy [J]": ("kinetic_energy",),
    "Iterations per step": ("iterations_density", "iterations_divergence", "iterations_viscosity"),
    "Compression left by the solves [-]": ("residual_density", "residual_divergence"),
    "Time step [s]": ("time_step",),
    "Real-time factor [-]": ("real_time_factor",),
}
COUPLING_PLOTS: Mapping[str, tuple[str, ...]] = {
    "Sub-steps of the fluid in a communication step": ("coupling/sub_steps",),
    "Wall time in a communication step [s]": ("coupling/wall_seconds/**",),
    "Disagreement about the bodies' motion [m/s, rad/s]": ("coupling/residual/**",),
    "Energy: fluid, bodies, work exchanged [J]": (
        "ledger/fluid/kinetic_energy",
        "ledger/bodies/energy",
        "ledger/exchange/work",
    ),
    "Impulse exchanged [N s]": ("ledger/exchange/impulse_x", "ledger/exchange/impulse_y", "ledger/exchange/impulse_z"),
    "Residuals of the ledger [-]": ("ledger/energy_residual", "ledger/momentum_residual"),
}
USUAL_PLOTS: Mapping[str, tuple[str, ...]] = {**OIL_PLOTS, **HANDLING_PLOTS, **SOLVER_PLOTS, **COUPLING_PLOTS}


def matches(pattern: str, name: str) -> bool:
    """Whether a plot's pattern, a name or "prefix/**", asks for the series ``name``, be it that of one boom of several."""
    names = (name, name.partition("/")[2])
    if pattern.endswith("/**"):
        return any(one.startswith(pattern.removesuffix("**")) for one in names)
    return pattern in names


def plots_with_series(plots: Mapping[str, tuple[str, ...]], names: Collection[str]) -> dict[str, list[str]]:
    """The plots that have something to show, with the names of the series each shows."""
    chosen = {
        title: [name for name in names if any(matches(pattern, name) for pattern in patterns)]
        for title, patterns in (plots or USUAL_PLOTS).items()
    }
    return {title: found for title, found in chosen.items() if found}


def labels(names: Sequence[str]) -> list[str]:
    """What a legend calls some series: their names less what they have in common."""
    first, last = min(names), max(names)  # in alphabetical order, hence what these two share all share
    alike = next((place for place, pair in enumerate(zip(first, last, strict=False)) if pair[0] != pair[1]), len(first))
    start = max(first.rfind("/", 0, alike), first.rfind("_", 0, alike)) + 1
    return [name[start:].replace("_", " ") for name in names]
