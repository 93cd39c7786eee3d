"""Which scalar series belong in one diagram, and what they are called there."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

OIL_PLOTS: Mapping[str, tuple[str, ...]] = {
    "Oil held and lost [m³]": ("oil_retained", "oil_lost"),
    "Oil lost by cause [m³]": ("oil_lost/**",),
    "Speed [m/s]": ("tow_speed", "normal_speed_held", "normal_speed_limit"),
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
    "Particles asleep": ("particles_asleep",),
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
    "Energy made by the exchange [J]": ("ledger/exchange/energy_made",),
    "Residuals of the ledger [-]": (
        "ledger/energy_residual",
        "ledger/momentum_residual",
        "ledger/exchange/energy_residual",
        "ledger/exchange/momentum_residual",
    ),
}
_AXES = ("x", "y", "z")
_ANGLES = ("roll_deg", "pitch_deg", "yaw_deg")


def probe_plots(names: Collection[str]) -> dict[str, tuple[str, ...]]:
    """A diagram for each quantity of each probe among the series ``names``, since their units differ."""
    found: dict[str, tuple[str, ...]] = {}
    for name in names:
        root, _, place = name.partition("/")
        if root == "probes":
            probe, _, component = place.partition("/")
            quantity = _quantity(component, of_body=f"probes/{probe}/{_ANGLES[0]}" in names)
            title = f"Probe {probe}{quantity}"
            found[title] = (*found.get(title, ()), name)
    return found


def _quantity(component: str, *, of_body: bool) -> str:
    """What a probe's component is one of."""
    if component in _AXES:
        return ": position [m]" if of_body else ": velocity [m/s]"
    if component in _ANGLES:
        return ": angles [deg]"
    units = {"force": ": force [N]", "torque": ": torque [N m]"}
    return units.get(component.partition("_")[0], "")


def usual_plots(names: Collection[str]) -> dict[str, dict[str, tuple[str, ...]]]:
    """By subject, the diagrams that a run with the series ``names`` may have."""
    return {
        "Oil": dict(OIL_PLOTS),
        "Probes": probe_plots(names),
        "Handling": dict(HANDLING_PLOTS),
        "Solver": dict(SOLVER_PLOTS),
        "Coupling": dict(COUPLING_PLOTS),
    }


def matches(pattern: str, name: str) -> bool:
    """Whether a plot's pattern, a name or "prefix/**", asks for the series ``name``, be it that of one boom of several."""
    names = (name, name.partition("/")[2])
    if pattern.endswith("/**"):
        return any(one.startswith(pattern.removesuffix("**")) for one in names)
    return pattern in names


def plots_with_series(plots: Mapping[str, tuple[str, ...]], names: Collection[str]) -> dict[str, list[str]]:
    """A run's own plots, and the usual ones of what those do not show, with the names of the series each shows."""
    own = _with_series(plots, names)
    rest = [name for name in names if not any(name in found for found in own.values())]
    usual = {title: patterns for subject in usual_plots(rest).values() for title, patterns in subject.items()}
    return own | _with_series(usual, rest)


def _with_series(plots: Mapping[str, tuple[str, ...]], names: Collection[str]) -> dict[str, list[str]]:
    chosen = {
        title: [name for name in names if any(matches(pattern, name) for pattern in patterns)]
        for title, patterns in plots.items()
    }
    return {title: found for title, found in chosen.items() if found}


def labels(names: Sequence[str]) -> list[str]:
    """What a legend calls some series: their names less what they have in common."""
    first, last = min(names), max(names)  # in alphabetical order, hence what these two share all share
    alike = next((place for place, pair in enumerate(zip(first, last, strict=False)) if pair[0] != pair[1]), len(first))
    start = max(first.rfind("/", 0, alike), first.rfind("_", 0, alike)) + 1
    return [name[start:].replace("_", " ") for name in names]
