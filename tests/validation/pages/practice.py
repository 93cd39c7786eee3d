"""Answers of the project's own formulas and of its tables of runs to what practice tells of booms and skimmers, for made parts of pages."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Iterable
from itertools import groupby
from pathlib import Path

import numpy as np
from scipy.constants import knot

from booms.boom import catalogue
from booms.deployment import catenary_chain
from booms.loads import freeboard_drag, skirt_drag
from booms.losses.liquids import OilOnWater
from booms.losses.rates import SUCTION, Closures, accumulation_speed, onset_speed, suction_limit
from booms.recovery.skimmer import daily_capacity, thin_share
from booms.scores import catenary_parameter, tow_force
from oilsim.core.physical_constants import GRAVITY
from oilsim.drops.drift import terminal_speed
from tests.validation.bodies import boom_losses
from tests.validation.bodies.flumes.harbour_flume import MEASURED, Row, first_loss, passage
from tests.validation.bodies.flumes.tables import read
from tests.validation.bodies.without_particles import LENGTH
from tests.validation.scenes import WATER_DENSITY
from tests.validation.windows import u_tension

SHOWN = [round(0.28 + 0.02 * k, 2) for k in range(12)]  # m/s: columns of the harbour flume
EXACT = Path(__file__).parents[2] / "booms" / "data" / "boom_catenary.csv"


def oil_of(density: float, viscosity: float = 1e-5) -> OilOnWater:
    """An oil [kg/m3, m2/s] with the tension that is assumed where none is known, on sea water."""
    return OilOnWater(oil_density=density, water_density=WATER_DENSITY, kinematic_viscosity=viscosity)


def joined(values: Iterable[float], form: str = ".2f") -> str:
    """Write numbers with commas between them."""
    return ", ".join(f"{value:{form}}" for value in values)


def first_losses(pools: list[float], draft: float = 0.4, orbital: float = 0.0) -> str:
    """Speed of the first loss [m/s] by the closures in a tow that grows by 0.1 kn a minute, oil of 900 kg/m3, for pools [m2]."""
    speeds, lost, _ = boom_losses.ramp(Closures(skirt_depth=draft), oil_of(900.0), np.array(pools), 4.0, orbital)
    return joined(boom_losses.first_beyond(speeds, column, boom_losses.FIRST) for column in lost.T)


def flume_rows() -> list[list[Row]]:
    """The runs of the harbour flume on record, each from slow to fast."""
    rows = read(MEASURED, Row)
    return [
        sorted(group, key=lambda row: row.speed)
        for _, group in groupby(rows, key=lambda row: (row.oil, row.draft, row.resolution, row.seed))
    ]


def share(row: Row) -> str:
    """Share of the pool [%] that passes in one passage of the water; nothing where no pool is left."""
    if row.pool == 0.0:
        return ""
    percent = 100.0 * row.passed * passage(row.speed, row.draft) / row.pool
    return f"{percent:.0f}" if percent >= 10.0 else f"{percent:.2g}"


def found_first(rows: list[Row]) -> str:
    """The first loss [m/s] of a run, or that its speeds have none."""
    found = first_loss(rows)
    return f"{found:.2f}" if math.isfinite(found) else f"above {rows[-1].speed:.2f}"


def harbour_flume() -> str:
    """Table of what passes the skirt of the harbour flume, by oil, draft, spacing and speed."""
    text = (
        f"\n\n| oil, draft, spacing | {' | '.join(map(str, SHOWN))} m/s | first loss |\n|{'---|' * (len(SHOWN) + 2)}\n"
    )
    for rows in flume_rows():
        one, shares = rows[0], {row.speed: share(row) for row in rows}
        if one.seed == 0:
            name = f"{one.oil:g} kg/m³, {one.draft:g} m, {1e3 * one.draft / one.resolution:.2g} mm"
            text += f"| {name} | {' | '.join(shares.get(speed, '') for speed in SHOWN)} | **{found_first(rows)}** |\n"
    return text + "\n"


def scatter() -> str:
    """Write the shares [%] of the pool that runs of the harbour flume lose which differ by their first places only."""
    by_setting: dict[tuple[float, float, int, float], list[str]] = {}
    for row in read(MEASURED, Row):
        by_setting.setdefault((row.oil, row.draft, row.resolution, row.speed), []).append(share(row))
    return "; ".join(
        f"{', '.join(shares)} % at {1e3 * draft / resolution:.2g} mm and {speed:g} m/s"
        for (_, draft, resolution, speed), shares in by_setting.items()
        if len(shares) > 1
    )


def first_by_particles() -> str:
    """First loss of the harbour skirt by oil and spacing, from 20 spacings of draft on."""
    runs = [rows for rows in flume_rows() if rows[0].draft == 0.2 and rows[0].seed == 0 and rows[0].resolution >= 20]
    told = []
    for oil, group in groupby(runs, key=lambda rows: rows[0].oil):
        own = list(group)
        spacings = joined((200.0 / rows[0].resolution for rows in own), ".2g")
        told.append(f"{oil:g} kg/m³ {', '.join(map(found_first, own))} m/s at {spacings} mm")
    return "; ".join(told)


def suction() -> str:
    """Least and greatest of the medians of the suction in the harbour flume, over its runs of 20 spacings and more."""
    found = [np.median([row.suction for row in rows]) for rows in flume_rows() if rows[0].resolution >= 20]
    return f"{min(found):.2f} to {max(found):.2f} (formula {SUCTION:.2f})"


def u_pulls(draft: float, resolution: int) -> str:
    """Pull of an end of a U of particles over that of its segments, one by one, at each gap on record."""
    with Path(u_tension.__file__).with_suffix(".csv").open(encoding="utf-8") as file:
        rows = [{key: float(text) for key, text in row.items()} for row in csv.DictReader(file)]
    found = [row for row in rows if (row["draft"], row["resolution"]) == (draft, resolution)]
    drag = {"drag_coefficient": skirt_drag(WATER_DENSITY), "density": WATER_DENSITY}
    return "; ".join(
        f"gap {row['gap']:g}: {row['tension'] / tow_force(LENGTH, row['gap'], draft, u_tension.SPEED, **drag)[0]:.2f}"
        for row in found
    )


def catenary_errors() -> str:
    """Largest difference of tension and sag from the exact catenary over the gaps of its table; the sag of a chain of 40 links."""
    exact = np.genfromtxt(EXACT, delimiter=",", comments="#")
    exact = exact[np.isfinite(exact[:, 0])]
    tension = max(abs(catenary_parameter(1.0, gap) / value - 1.0) for gap, value, *_ in exact)
    sag = max(abs(-catenary_chain(40, gap)[:, 1].min() - value) for gap, _, value, *_ in exact)
    return f"tension {100 * tension:.1g} %, sag {100 * sag:.1g} % of the length"


def navy_drag() -> str:
    """Drag of a square metre of skirt at one knot, and of freeboard in 40 kn of wind [kgf]."""
    skirt = 0.5 * 1025.0 * skirt_drag(1025.0) * knot**2 / 9.80665
    wind = 0.5 * 1.225 * freeboard_drag() * (40.0 * knot) ** 2 / 9.80665
    return f"{skirt:.3g}, {wind:.3g}"


def fast_system() -> str:
    """Tow speed [kn] at which the pocket of the catalogue's fast system meets the onset of an oil of 900 kg/m3."""
    pocket = catalogue()["current-buster-6"].pocket
    assert pocket is not None
    return f"{onset_speed(oil_of(900.0)) / pocket.speed_ratio / knot:.1f}"


def angles() -> str:
    """Angles [degrees] to the stream at which an oil of 900 kg/m3 meets its onset, at 1, 1.5, 2 and 3 kn."""
    onset = onset_speed(oil_of(900.0)) / knot
    return joined((math.degrees(math.asin(min(1.0, onset / speed))) for speed in (1.0, 1.5, 2.0, 3.0)), ".0f")


def drop_rise() -> str:
    """Speed [mm/s] of drops of 2, 5 and 10 mm of an oil of 900 kg/m3."""
    difference = WATER_DENSITY - 900.0
    speeds = [terminal_speed(size, WATER_DENSITY, 1e-3, difference, 0.02, GRAVITY) for size in (0.002, 0.005, 0.010)]
    return joined((1e3 * speed for speed in speeds), ".0f")


OILS = (840.0, 900.0, 950.0)  # kg/m3
ANSWERS: dict[str, Callable[[], str]] = {
    "harbour flume": harbour_flume,
    "harbour flume, scatter": scatter,
    "first loss by particles": first_by_particles,
    "suction by particles": suction,
    "onset by formula": lambda: joined(onset_speed(oil_of(oil)) for oil in OILS),
    "suction limit by formula": lambda: joined(float(suction_limit(0.2, oil_of(oil))) for oil in OILS),
    "onset of thick oil": lambda: f"{accumulation_speed(oil_of(950.0, 5e-3)):.2f}",
    "first loss by draft": lambda: ", ".join(first_losses([0.2], draft) for draft in (0.2, 0.4, 0.6, 1.1)),
    "first loss by pool": lambda: first_losses([0.05, 0.2, 0.5, 1.0]),
    "first loss by swing": lambda: ", ".join(first_losses([0.2], orbital=one) for one in (0.0, 0.05, 0.1, 0.2)),
    "pull of a U, 0.30 m": lambda: u_pulls(0.3, 3),
    "pull of a U, 0.45 m": lambda: u_pulls(0.45, 4),
    "catenary": catenary_errors,
    "drag of the Navy's rule": navy_drag,
    "thin oil": lambda: joined((100.0 * thin_share(one) for one in (0.006, 0.0127, 0.05, 0.075)), ".0f"),
    "daily capacity": lambda: f"{daily_capacity(1.0 / 86400.0):.2g}",
    "fast system": fast_system,
    "angles": angles,
    "rise of drops": drop_rise,
}
