"""The sea of a scenario, from its settings and its files of winds and currents."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from oilsim.sea import (
    CurrentProfile,
    FlowTable,
    JonswapWaves,
    KaimalGusts,
    LangmuirCells,
    RegularWaves,
    SeaDescription,
    SteadyFlow,
    TidalFlow,
    WindField,
)
from oilsim.sea.flows import Flow, heading
from oilsim.sea.regular_waves import wave_number
from oilsim.sea.stream import StreamTable
from scenarios.schema.run_settings import RunSettings, SiteSettings
from scenarios.schema.sea import (
    FileSeaCurrent,
    FileSeaWind,
    RegularSeaWaves,
    SeaCurrent,
    SeaWaves,
    SeaWind,
    SteadySeaCurrent,
    TidalSeaCurrent,
)
from scenarios.setup.at_sea.flow_columns import FlowFileError
from scenarios.setup.at_sea.flow_files import Kind, read_flow, start_of
from scenarios.setup.at_sea.flow_maps import read_stream
from scenarios.spec.resolve import RunSpec, SeaSpec
from scenarios.text.problems import Problem, ScenarioError

if TYPE_CHECKING:
    from oilsim.sea import Sea

Built = TypeVar("Built")

DEEP = 100.0  # [1] 2 k h from which on waves do not feel the ground; numerical; sinh has no larger value that counts


def build_sea(
    settings: SeaSpec,
    liquid: RunSpec,
) -> Sea:
    """Build the sea of a run with its depth and level, of the run's water and under its gravity. Reads its files.

    Raises ScenarioError with every problem: of files, of their times, and of waves that cannot be.
    """
    from oilsim.sea import Sea  # its kernels take time to import

    problems, run, site = list[Problem](), liquid.run, liquid.site
    gravity = math.hypot(*liquid.fluid.gravity)
    current, stream = _current(settings.current, run, site, problems)
    wind = _wind(settings.wind, run, site, problems)
    waves = None if settings.waves is None else _waves(settings.waves, run.seed)
    build_up = 0.0 if settings.waves is None else settings.waves.build_up
    plain: dict[str, Any] = {"depth": settings.depth, "level": settings.level, "gravity": gravity}
    parts: dict[str, Any] = {"current": current, "waves": waves, "build_up": build_up}
    if gravity == 0.0:
        if waves is not None or not liquid.in_tank:
            problems.append(Problem("fluid.gravity", "is 0, allowed with waves, and without particles: above 0"))
    elif current is not None or settings.current is None or waves is None or waves.seen_from == "water":
        # only of a period seen from the ground the length depends on the current
        _kept("sea.waves", lambda: Sea(SeaDescription(**plain, **parts)), problems)
    if not problems:
        problems += together(
            SeaDescription(tide=settings.tide, **plain, **parts),
            run.duration,
            in_tank=liquid.in_tank,
        )
    if problems:
        raise ScenarioError(problems)
    cells = settings.langmuir
    return Sea(
        SeaDescription(
            density=liquid.water_density,
            wind=wind,
            langmuir=None if cells is None else LangmuirCells(**_values(cells), seed=run.seed),
            diffusivity=settings.diffusivity,
            tide=settings.tide,
            stream=stream,
            **plain,
            **parts,
        )
    )


def together(sea: SeaDescription, duration: float, *, in_tank: bool) -> Iterator[Problem]:
    """Yield the contradictions between tide, depth, waves and current of a sea within the `duration` [s] of a run.

    The water keeps some depth; waves stand at low water, too; a stream of formulas, beyond particles of a tank, is slower than the long
    waves of its depth; and the energy of the waves gets ahead against it, at the group speed c / 2 (1 + 2 k h / sinh 2 k h).
    """
    from oilsim.sea import Sea

    if sea.tide is not None and sea.tide.turns[-1][0] < duration:
        yield Problem(
            "sea.tide.turns",
            f"ends at {sea.tide.turns[-1][0]:g} s, allowed: {duration:g} s, the end of the run, or later",
        )
        return
    lowest = 0.0 if sea.tide is None else sea.tide.lowest(duration)
    depth = sea.depth + lowest
    if not depth > 0.0:
        yield Problem(
            "sea.tide", f"falls by {-lowest:g} m within the run, allowed: less than the depth, {sea.depth:g} m"
        )
        return
    if lowest < 0.0 and sea.waves is not None:
        problems = list[Problem]()
        _kept("sea.waves", lambda: Sea(replace(sea, depth=depth, tide=None)), problems)
        yield from (Problem(one.path, f"at low water, {one.text}") for one in problems)
    if sea.current is None or in_tank or sea.gravity == 0.0:
        return
    flow = sea.current.flow
    fastest, critical = flow.fastest(), math.sqrt(sea.gravity * depth)
    if not fastest < critical:
        text = f"reaches {fastest:.4g} m/s, allowed: below {critical:.4g} m/s, the speed of long waves in water of {depth:g} m"
        yield Problem("sea.current", text)
    if isinstance(flow, SteadyFlow) and sea.waves is not None:
        yield from _against(sea, flow)


def _against(sea: SeaDescription, flow: SteadyFlow) -> Iterator[Problem]:
    """Yield a problem if a current sweeps the energy of the waves, of a spectrum at its peak, back."""
    waves = sea.waves
    if waves is None or waves.seen_from == "ground":  # which a current that blocks them refuses
        return
    period = waves.period if isinstance(waves, RegularWaves) else waves.peak_period
    number = wave_number(period, sea.depth, sea.gravity)
    twice = 2.0 * number * sea.depth
    group = math.pi / (period * number) * (1.0 + (twice / math.sinh(twice) if twice < DEEP else 0.0))
    along = float(flow.velocity(0.0) @ heading(waves.direction))
    if along <= -group:
        text = (
            f"of {period:g} s run at {group:.4g} m/s against a current of {-along:.4g} m/s, allowed: a slower current"
        )
        yield Problem("sea.waves", f"{text}, which their energy comes up against")


def _values(section: Any, *left_out: str) -> dict[str, Any]:
    """Return the fields of a section by name."""
    return {item.name: getattr(section, item.name) for item in fields(section) if item.name not in left_out}


def _kept(path: str, make: Callable[[], Built], problems: list[Problem]) -> Built | None:
    """Call `make`; note what it refuses as a problem at `path`."""
    try:
        return make()
    except ValueError as error:
        problems.append(Problem(path, str(error).split(": ", 1)[-1]))
        return None


def _waves(settings: SeaWaves, seed: int) -> RegularWaves | JonswapWaves:
    if isinstance(settings, RegularSeaWaves):
        return RegularWaves(**_values(settings, "build_up"))
    return JonswapWaves(**_values(settings, "build_up"), seed=seed)


def _current(
    given: SeaCurrent | None, run: RunSettings, site: SiteSettings | None, problems: list[Problem]
) -> tuple[CurrentProfile | None, StreamTable | None]:
    """Build the current, and how it differs from place to place; None without one, or with a problem."""
    if given is None:
        return None, None
    flow: Flow | None
    stream = None
    if isinstance(given, FileSeaCurrent):
        flow, stream = _table(given, "current", run, site, problems)
    else:
        kind = SteadyFlow if isinstance(given, SteadySeaCurrent) else TidalFlow
        assert isinstance(given, SteadySeaCurrent | TidalSeaCurrent)
        flow = kind(**_values(given, "shear_exponent"))
    return None if flow is None else CurrentProfile(flow=flow, shear_exponent=given.shear_exponent), stream


def _wind(
    given: SeaWind | None, run: RunSettings, site: SiteSettings | None, problems: list[Problem]
) -> WindField | None:
    """Build the wind; None without one, or with a problem."""
    if given is None:
        return None
    flow: Flow | None
    if isinstance(given, FileSeaWind):
        flow, _ = _table(given, "wind", run, site, problems)
    else:
        flow = SteadyFlow(speed=given.speed, direction=given.direction)
    if flow is None:
        return None
    gusts = None
    if given.gust_intensity > 0.0 and flow.mean().any():  # a calm carries none
        gusts = KaimalGusts(intensity=given.gust_intensity, seed=run.seed)
    found = flow
    return _kept("sea.wind", lambda: WindField(flow=found, gusts=gusts), problems)


def _table(
    given: FileSeaCurrent | FileSeaWind,
    kind: Kind,
    run: RunSettings,
    site: SiteSettings | None,
    problems: list[Problem],
) -> tuple[FlowTable | None, StreamTable | None]:
    """Read a file, which must hold the whole time of the run, and what of it differs from place to place; None with a problem."""
    path, file, end = f"sea.{kind}.file", Path(given.file), run.duration
    bearing = (site or SiteSettings(latitude=0.0, longitude=0.0)).bearing
    try:
        stream = read_stream(file, site, end) if kind == "current" and file.suffix.lower() == ".nc" else None
        if stream is not None:
            return FlowTable(stream.time, stream.at_origin()), stream
        table = read_flow(file, kind, start=start_of(site), bearing=bearing)
    except ValueError as error:
        texts = error.texts if isinstance(error, FlowFileError) else [str(error)]
        problems += [Problem(path, f"{file.name}: {text.removeprefix('flow table: ')}") for text in texts]
        return None, None
    first, last = float(table.time[0]), float(table.time[-1])
    if first > 0.0 or last < end:
        text = f"holds the times from {first:g} to {last:g} s, allowed: a file that holds the run, from 0 to {end:g} s"
        problems.append(Problem(path, f"{file.name}: {text}"))
        return None, None
    return table, None
