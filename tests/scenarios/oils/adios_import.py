"""Clean NOAA's ADIOS oil library into the tables that are shipped: `python -m tests.scenarios.oils.adios_import OilLib.txt`.

`OilLib.txt` (export of 20 September 2017) lies in the `data` folder of the wheel `adios-db` 1.2.7, whose licence says: "This work is the
product of the United States Government, which claims no copyright on the material", CC0 1.0. Its columns state SI units, but some rows hold
degrees Celsius, g/cm3 or a slipped digit. A value outside the limits below is refused, never mended. An oil is refused where no density or
no viscosity is left, or where its values contradict each other. `refused.csv` lists every refusal with its reason.
"""

from __future__ import annotations

import csv
import math
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from scenarios.oils import properties
from scenarios.oils.properties import API_TEMPERATURE, ZERO_CELSIUS, Measurement, OilRecord, api_density, usual_slope

TEMPERATURES = (250.0, 400.0)  # [K] laboratory temperatures that are taken; outside, the unit is doubtful
DENSITIES = (600.0, 1100.0)  # [kg/m3] from natural gasoline to bitumen
VISCOSITIES = (1e-7, 10.0)  # [m2/s] from naphtha to bitumen
TENSIONS = (1e-3, 0.06)  # [N/m] oil on water; clean alkanes have 0.05
POUR_POINTS = (190.0, 350.0)  # [K]
API_AGREEMENT = 25.0  # [kg/m3] by which density at 15 C and API gravity may differ
SLOPES = (0.0, 20000.0)  # [K] of ln(viscosity) over 1 / T; colder oil is never thinner
RISES = {
    "density": 1.002,
    "viscosity": 1.05,
}  # [-] ratio to the next lower temperature that is still a laboratory's scatter
# ln(nu / (m2/s)) at 15 C of the library's oils over their API gravity, from the smallest power; fit without those it misses by 1.5 decades
USUAL = (0.488, -0.47498, 0.0039871)
STRAYS = 3.0 * math.log(
    10.0
)  # [-] of ln(nu), that a measurement above the pour point may be off it; others are off by less than 2.8 decades
SIBLINGS_API, SIBLINGS_RATIO = (
    2.0,
    100.0,
)  # API degrees within which records of one name are one oil; its viscosities at 15 C differ by less
SHIPPED = Path(properties.__file__).parent
HEADER_LINE = 2  # [-] line of the file that names the columns, counted from 1


@dataclass
class _Cleaning:
    """What is kept and refused while the library is read."""

    oils: list[OilRecord] = field(default_factory=list)
    refused: list[tuple[str, str, str, str]] = field(default_factory=list)


def read_library(path: Path) -> tuple[list[OilRecord], list[tuple[str, str, str, str]]]:
    """Read and clean the library; return the oils, and the refusals (record, name, "oil" or "value", reason)."""
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    rows = csv.DictReader(lines[HEADER_LINE - 1 :], dialect="excel-tab")
    found = _Cleaning()
    for row in rows:
        _take({key: (value or "").strip() for key, value in row.items() if key}, found)
    _refuse_odd_siblings(found)
    return sorted(found.oils, key=lambda oil: oil.record), sorted(found.refused, key=lambda row: row[0])


def _refuse_odd_siblings(found: _Cleaning) -> None:
    """Refuse each record that is far thicker than all other records of the same oil."""
    named: dict[str, list[OilRecord]] = {}
    for oil in found.oils:
        named.setdefault(re.split(r"[,(:]", oil.name)[0].strip(), []).append(oil)
    for oil in list(found.oils):
        siblings = named[re.split(r"[,(:]", oil.name)[0].strip()]
        alike = [one for one in siblings if one is not oil and abs(one.gravity - oil.gravity) < SIBLINGS_API]
        thickest = max(alike, key=lambda one: one.kinematic_viscosity_at(15.0), default=oil)
        mine, theirs = oil.kinematic_viscosity_at(15.0), thickest.kinematic_viscosity_at(15.0)
        if mine > SIBLINGS_RATIO * theirs:
            told = f"viscosity {mine:.3g} m2/s at 15 C contradicts {theirs:.3g} of {thickest.record}, the same oil: a slipped digit or unit"
            found.oils.remove(oil)
            found.refused.append((oil.record, oil.name, "oil", told))


def _take(row: Mapping[str, str], found: _Cleaning) -> None:
    """Clean one row into an oil, or into refusals."""
    record, name = row.get("ADIOS_Oil_ID", ""), " ".join(row.get("Oil_Name", "").split())
    if not record:
        return
    reasons: list[str] = []
    oil = OilRecord(
        record=record,
        name=name,
        location=" ".join(row["Location"].split()),
        product=row["Product_Type"].lower(),
        reference=" ".join(row["Reference"].split()),
        api=_value(row["API"]),
        pour_point=_bounded(row["Pour_Point_Max_K"], POUR_POINTS, "pour point", "K", reasons),
        interfacial_tension=_tension(row, reasons),
        measurements=tuple(_measurements(row, reasons)),
    )
    fault = _fault(oil)
    found.refused += [(record, name, "oil", fault)] if fault else []
    found.refused += [(record, name, "value", reason) for reason in reasons]
    if not fault:
        found.oils.append(oil)


def _rises_when_warmed(oil: OilRecord, quantity: str, slack: float) -> bool:
    """Tell whether a mean of a quantity of the fresh oil is above `slack` times that at the next lower temperature."""
    values = oil._means(quantity)[1]
    return bool((values[1:] > slack * values[:-1]).any())


def _fault(oil: OilRecord) -> str:
    """Say why an oil is refused; empty if it is not."""
    fresh = [point for point in oil.measurements if point.evaporated == 0.0]
    if oil.api is None and not any(point.quantity == "density" for point in fresh):
        return "no density of the fresh oil"
    if oil.api is not None and not DENSITIES[0] <= api_density(oil.api) <= DENSITIES[1]:
        return f"API gravity {oil.api:g} is no oil's"
    if not any(point.quantity == "viscosity" for point in fresh):
        return "no viscosity of the fresh oil"
    density = oil.density_at(API_TEMPERATURE)
    if oil.api is not None and abs(density - api_density(oil.api)) > API_AGREEMENT:
        return f"density {density:.0f} kg/m3 at 60 F contradicts API gravity {oil.api:g} ({api_density(oil.api):.0f} kg/m3)"
    if not DENSITIES[0] <= oil.density_at(15.0) <= DENSITIES[1]:
        return f"density {oil.density_at(15.0):.0f} kg/m3 at 15 C is no oil's"
    rising = [quantity for quantity, slack in RISES.items() if _rises_when_warmed(oil, quantity, slack)]
    if rising:
        return f"{' and '.join(rising)} rises with temperature"
    strays = [point for point in fresh if point.quantity == "viscosity" and _strays(oil, point)]
    if strays:
        told = f"viscosity {strays[0].value:.3g} m2/s at {strays[0].temperature - ZERO_CELSIUS:.0f} C"
        return f"{told} contradicts API gravity {oil.gravity:.3g}: a slipped digit or unit"
    if not SLOPES[0] < oil.viscosity_slope <= SLOPES[1]:
        return f"viscosity changes with temperature as no oil's does: {oil.viscosity_slope:.0f} K of ln(viscosity) over 1/T"
    return ""


def _strays(oil: OilRecord, point: Measurement) -> bool:
    """Tell whether a viscosity is a thousand times larger or smaller than that of other oils of this gravity at its temperature."""
    at_15 = sum(factor * oil.gravity**power for power, factor in enumerate(USUAL))
    if oil.pour_point is not None and point.temperature <= oil.pour_point:
        return False  # near solid, it may have any viscosity
    colder = 1.0 / point.temperature - 1.0 / (15.0 + ZERO_CELSIUS)
    slope = usual_slope(at_15, 15.0 + ZERO_CELSIUS)
    return abs(math.log(point.value) - at_15 - slope * colder) > STRAYS


def _measurements(row: Mapping[str, str], reasons: list[str]) -> Iterator[Measurement]:
    """Yield the measurements of density and kinematic viscosity; a dynamic viscosity is divided by the density at its temperature."""
    densities = list(_points(row, "Density", "_Kg_m_3", range(1, 5), DENSITIES, "density", reasons))
    yield from densities
    kinematic = list(_points(row, "KVis", "_m_2_s", range(1, 7), VISCOSITIES, "viscosity", reasons))
    yield from kinematic
    known = {(round(point.temperature), point.evaporated) for point in kinematic}
    for point in _points(
        row, "DVis", "_kg_ms", range(1, 7), (VISCOSITIES[0] * 600, VISCOSITIES[1] * 1000), "viscosity", reasons
    ):
        if (round(point.temperature), point.evaporated) in known:
            continue  # the same sample, measured once
        near = [other for other in densities if other.evaporated == point.evaporated]
        density = min(near, key=lambda other: abs(other.temperature - point.temperature)).value if near else None
        api = _value(row["API"])
        density = density or (api_density(api) if api is not None else None)
        if density is not None:
            yield Measurement("viscosity", point.temperature, point.evaporated, float(f"{point.value / density:.10g}"))


def _points(
    row: Mapping[str, str],
    stem: str,
    unit: str,
    numbers: Sequence[int],
    limits: tuple[float, float],
    quantity: str,
    reasons: list[str],
) -> Iterator[Measurement]:
    """Yield the believable ones of a row's measurements of one kind."""
    for number in numbers:
        head = f"{stem}{number}"
        if not row[head + unit]:
            continue
        value, temperature = _value(row[head + unit]), _value(row[f"{head}_Ref_Temp_K"])
        evaporated = _value(row[f"{head}_Weathering"]) or 0.0
        told = f"{head} = {row[head + unit]} at {row[f'{head}_Ref_Temp_K'] or 'no temperature'} K"
        if value is None or not limits[0] <= value <= limits[1]:
            reasons.append(f"{told}, allowed: {limits[0]:g} to {limits[1]:g}")
        elif temperature is None or not TEMPERATURES[0] <= temperature <= TEMPERATURES[1]:
            reasons.append(f"{told}, allowed: {TEMPERATURES[0]:g} to {TEMPERATURES[1]:g} K")
        elif not 0.0 <= evaporated < 0.9:
            reasons.append(f"{told}, weathered by {evaporated:g}, allowed: 0 to 0.9")
        else:
            yield Measurement(quantity, _exact(temperature), evaporated, value)


def _tension(row: Mapping[str, str], reasons: list[str]) -> float | None:
    """Return the interfacial tension [N/m] on sea water, else on fresh water."""
    for water in ("SeaWater", "Water"):
        key = f"Oil_{water}_Interfacial_Tension_N_m"
        tension = _bounded(row[key], TENSIONS, key, "N/m", reasons)
        if tension is not None:
            return tension
    return None


def _bounded(text: str, limits: tuple[float, float], name: str, unit: str, reasons: list[str]) -> float | None:
    value = _value(text)
    if value is None or limits[0] <= value <= limits[1]:
        return value
    reasons.append(f"{name} = {text} {unit}, allowed: {limits[0]:g} to {limits[1]:g}")
    return None


def _exact(temperature: float) -> float:
    """Turn a rounded temperature [K] into the one that was meant: 273 K stands for 0 C, 273.15 K."""
    return round(temperature + 0.15, 2) if temperature == math.floor(temperature) else temperature


def _value(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def write_tables(oils: Sequence[OilRecord], refused: Sequence[tuple[str, str, str, str]], folder: Path) -> None:
    """Write `oils.csv`, `measurements.csv` and `refused.csv` into a folder."""
    heads = ("record", "name", "location", "product", "api", "pour_point", "interfacial_tension", "reference")
    _write(folder / "oils.csv", heads, ([_text(getattr(oil, head)) for head in heads] for oil in oils))
    points = (
        [oil.record, point.quantity, _text(point.temperature), _text(point.evaporated), _text(point.value)]
        for oil in oils
        for point in oil.measurements
    )
    _write(folder / "measurements.csv", ("record", "quantity", "temperature", "evaporated", "value"), points)
    _write(folder / "refused.csv", ("record", "name", "refused", "reason"), refused)


def _write(path: Path, heads: Sequence[str], rows: Iterator[list[str]] | Sequence[tuple[str, str, str, str]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(heads)
        writer.writerows(rows)


def _text(value: float | str | None) -> str:
    return "" if value is None else f"{value:.10g}" if isinstance(value, float) else value


if __name__ == "__main__":
    kept, left_out = read_library(Path(sys.argv[1]))
    write_tables(kept, left_out, SHIPPED)
    print(f"{len(kept)} oils, {len(left_out)} refusals")
