"""Case 53: the boom of case 34 in a current, by particles everywhere, in windows of several places and sizes, and by formulas.

The true comparison of a window is particles everywhere, at the same spacing: formulas know no flow around the U. The window lies on the
apex, then 1 m farther upstream, then in an outer one of twice the spacing, then it is a third larger, and as large around the whole U, as
deep as the basin.
"""

from __future__ import annotations

from dataclasses import replace

from scenarios.schema.window import OuterWindow
from scenarios.spec.scenario import Scenario
from tests.validation.bodies.without_particles import (
    APEX,
    DEPTH,
    DURATION,
    LENGTH,
    SEGMENTS,
    SKIRT,
    SPEED,
    WIDTH,
    WINDOW,
    bare,
    boom_scene,
    in_window,
    shape_apart,
    towed,
)
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace

LARGER = 4.0 / 3.0  # [1] size of the larger window over that of the others
AROUND = 9.35  # [m] x of the middle of the U
PLACES = ("on the apex", "1 m upstream", "in an outer one", "a third larger", "around the U")


def scenes(spacing: float, threads: int | None) -> dict[str, Scenario]:
    """The scene by the way in which it is computed."""
    whole = boom_scene(spacing, threads, 0.0)
    apex = in_window(whole)
    assert apex.window is not None
    larger = replace(apex.window, size=(LARGER * WINDOW, LARGER * WINDOW), rim=0.25 * WINDOW)
    around = replace(larger, target=(AROUND, 0.5 * WIDTH), depth=DEPTH)
    nested = replace(apex.window, outer=OuterWindow(size=(2.0 * WINDOW, 2.0 * WINDOW), spacing=2.0 * spacing))
    windows = (apex, in_window(whole, 1.0), *(replace(apex, window=one) for one in (nested, larger, around)))
    return {"everywhere": whole, "formulas": bare(whole)} | dict(zip(PLACES, windows, strict=True))


def window_agreement(resolution: int, bench: Bench) -> Outcome:
    """Case 53: seven ways to compute one scene."""
    bench.plan(7.0 * DURATION)
    found = {name: towed(scene, bench) for name, scene in scenes(SKIRT / resolution, bench.threads).items()}
    whole, values = found["everywhere"], {}
    for name in ("formulas", *PLACES):
        values[f"tension, {name}"] = float(found[name].tension.mean() / whole.tension.mean())
        values[f"shape, {name}"] = shape_apart(whole, found[name])
    lines = (trace("shape", *one.line.mean(axis=0).T, name) for name, one in found.items())
    return Outcome(values=values, traces=tuple(lines))


WINDOW_AGREEMENT = Case(
    number=53,
    name="window-agreement",
    title="A boom in a current in windows of several places and sizes",
    source="the particle fluid itself, everywhere; gates of 5 % for the tension and 2 % of the length for the shape",
    setup=f"a boom of {LENGTH:g} m in {SEGMENTS} segments between fixed ends in a current of {SPEED:g} m/s, windows of {WINDOW:g} m "
    f"around x = {APEX:g} m",
    length=SKIRT,
    length_symbol="s",
    resolutions=(3, 4),
    quantities=(
        Quantity(name="tension, formulas", unit="of that everywhere", reference=1.0),
        Quantity(name="shape, formulas", unit="% of the length", reference=0.0, scale=1.0),
        *(
            quantity
            for place in PLACES
            for quantity in (
                Quantity(name=f"tension, {place}", unit="of that everywhere", reference=1.0, gate=0.05),
                Quantity(name=f"shape, {place}", unit="% of the length", reference=0.0, scale=1.0, gate=2.0),
            )
        ),
    ),
    panels=(Panel("shape", "x [m]", "y [m], mean line"),),
    own_step=True,
    run=window_agreement,
    spacings=1,
    note="particles everywhere have a basin 9 m wide, of which the U blocks 60 %; windows and formulas have the open sea.",
)
