"""Diagrams: which scalar series share one, and their labels in it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

OIL_PLOTS: Mapping[str, tuple[str, ...]] = {
    "Oil held and lost [m³]": ("oil_contained", "oil_lost", "oil_lost_modelled"),
    "Oil lost by cause [m³]": ("oil_lost/**",),
    "Speed [m/s]": ("tow_speed", "normal_speed_held", "normal_speed_limit"),
}
HANDLING_PLOTS: Mapping[str, tuple[str, ...]] = {
    "Tow tension [N]": ("tow_tension/**",),
    "Tension [N]": ("tension/**",),
    "Largest lean of the skirt [rad]": ("skirt_angle",),
    "Gap ratio [-]": ("gap_ratio",),
}
SOLVER_PLOTS: Mapping[str, tuple[str, ...]] = {
    "Kinetic energy [J]": ("kinetic_energy",),
    "Iterations per step": ("iterations_density", "iterations_divergence", "iterations_viscosity"),
    "Compression after the solves [-]": ("residual_density", "residual_divergence"),
    "Time step [s]": ("time_step",),
    "Real-time factor [-]": ("real_time_factor",),
    "Particles asleep": ("particles_asleep",),
}
COUPLING_PLOTS: Mapping[str, tuple[str, ...]] = {
    "Sub-steps of the fluid in a communication step": ("coupling/sub_steps",),
    "Wall time in a communication step [s]": ("coupling/wall_seconds/**",),
    "Residual of the bodies' motion between fluid and bodies [m/s, rad/s]": ("coupling/residual/**",),
    "Energy: fluid, bodies, work exchanged [J]": (
        "ledger/fluid/kinetic_energy",
        "ledger/bodies/energy",
        "ledger/exchange/work",
    ),
    "Impulse exchanged [N s]": ("ledger/exchange/impulse_x", "ledger/exchange/impulse_y", "ledger/exchange/impulse_z"),
    "Energy that the exchange does not explain [J]": ("ledger/exchange/energy_unexplained",),
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
    """Choose a diagram for each quantity of each probe among the series ``names``, because their units differ."""
    found: dict[str, tuple[str, ...]] = {}
    for name in names:
        root, _, place = name.partition("/")
        if root == "probes":
            probe, _, component = place.partition("/")
            quantity = _quantity(component, of_body=f"probes/{probe}/{_ANGLES[0]}" in names)
            title = f"Probe {probe}{quantity}"
            found[title] = (*found.get(title, ()), name)
    return found


def skimmer_plots(names: Collection[str]) -> dict[str, tuple[str, ...]]:
    """Choose the diagrams of skimmers among the series ``names``: volumes taken so far, and the rate at which they take oil."""
    found = {
        "Oil and water that skimmers took [m³]": ("oil", "water"),
        "Recovery rate of skimmers [m³/s]": ("rate",),
    }
    return {
        title: tuple(name for name in names if name.startswith("skimmers/") and name.rpartition("/")[2] in kinds)
        for title, kinds in found.items()
    }


def _quantity(component: str, *, of_body: bool) -> str:
    """Name the quantity that a probe's component belongs to."""
    if component in _AXES:
        return ": position [m]" if of_body else ": velocity [m/s]"
    if component in _ANGLES:
        return ": angles [deg]"
    units = {"force": ": force [N]", "torque": ": torque [N m]"}
    return units.get(component.partition("_")[0], "")


def usual_plots(names: Collection[str]) -> dict[str, dict[str, tuple[str, ...]]]:
    """List, by subject, the diagrams that a run with the series ``names`` may have."""
    return {
        "Oil": {**OIL_PLOTS, **skimmer_plots(names)},
        "Probes": probe_plots(names),
        "Handling": dict(HANDLING_PLOTS),
        "Solver": dict(SOLVER_PLOTS),
        "Coupling": dict(COUPLING_PLOTS),
    }


def matches(pattern: str, name: str) -> bool:
    """Tell whether a plot's pattern, a name or "prefix/**", matches the series ``name``, also that of one of several booms."""
    names = (name, name.partition("/")[2])
    if pattern.endswith("/**"):
        return any(one.startswith(pattern.removesuffix("**")) for one in names)
    return pattern in names


def plots_with_series(plots: Mapping[str, tuple[str, ...]], names: Collection[str]) -> dict[str, list[str]]:
    """Choose the run's own diagrams, and the usual ones for the series that those do not show, with their series' names."""
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
    """Shorten the names of some series for a legend: leave out their common beginning."""
    if len(names) == 1:
        return [names[0].rpartition("/")[2].replace("_", " ")]
    first, last = min(names), max(names)  # in alphabetical order, so all names share what these two share
    alike = next((place for place, pair in enumerate(zip(first, last, strict=False)) if pair[0] != pair[1]), len(first))
    start = max(first.rfind("/", 0, alike), first.rfind("_", 0, alike)) + 1
    return [name[start:].replace("_", " ") for name in names]
