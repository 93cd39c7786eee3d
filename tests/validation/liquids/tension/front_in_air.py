"""Case 57: the front of a small dam break under air, whose surface has tension; beside it the front of a free surface."""

from __future__ import annotations

import math

from oilsim import Fluid, FluidConfig, Phase, tank_walls
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace
from tests.validation.liquids.dam_break import EXPERIMENTS, FRONT_END, WATER, follow_front, front_history
from tests.validation.liquids.tension.drop_in_air import AIR
from tests.validation.liquids.tension.drops import SHORTEST
from tests.validation.measure import best_time_shift
from tests.validation.scenes import GRAVITY, fill, read_table

EXPERIMENT = EXPERIMENTS["Martin and Moyce, a = 1.125 in"]
HEIGHT = 2.5  # a, of the tank: the column is 2 a high


def covered_column(bench: Bench, resolution: int, air: Phase) -> Fluid:
    """A column of water, `resolution` spacings wide, in a closed tank full of air."""
    base, spacing = EXPERIMENT.base, EXPERIMENT.base / resolution
    length, height, room = EXPERIMENT.length * base, HEIGHT * base, 4.0 * spacing
    config = FluidConfig(
        particle_spacing=spacing, phases=(WATER, air), dimension=2, lower=(-room, -1.0, -room),
        upper=(length + room, 1.0, height + room), minimum_time_step=SHORTEST,
    )  # fmt: skip
    fluid = bench.fluid(config)
    walls = tank_walls(
        (0, 0, 0), (length, 0, height), spacing, sides=("-x", "+x", "-z", "+z"), dimension=2, no_slip=True
    )
    fluid.add_boundary(walls)
    fill(fluid, (0.0, 0.0), (base, 2.0 * base))
    fill(fluid, (base, 0.0), (length, 2.0 * base), air.name)
    fill(fluid, (0.0, 2.0 * base), (length, height), air.name)
    return fluid


def front_in_air(resolution: int, bench: Bench) -> Outcome:
    """Case 57: rms difference from the experiment, after one shift in time, with tension and without."""
    bench.plan(2.0 * FRONT_END * math.sqrt(EXPERIMENT.base / (2.0 * GRAVITY)))
    fluid = covered_column(bench, resolution, AIR)
    histories = {"in air": follow_front(bench, fluid, EXPERIMENT)}
    fluid.close()
    histories["free surface"] = front_history(bench, EXPERIMENT, EXPERIMENT.base / resolution)
    time, front = read_table(EXPERIMENT.file)
    values, traces = dict[str, float](), []
    for name, history in histories.items():
        inside = front <= history[1].max()
        shifted = best_time_shift(*history, time[inside], front[inside], 1.0)
        values |= {f"rms, {name}": shifted.rms, f"shift, {name}": shifted.shift}
        traces.append(trace("front", *history, name))
        traces.append(
            trace("front", time - shifted.shift, front, f"measured, shifted to {name}", reference=True, markers=True)
        )
    return Outcome(values=values, traces=tuple(traces))


FRONT_IN_AIR = Case(
    number=57,
    name="front-in-air",
    title="Dam break of a column of 28.6 mm, front on a dry floor, with surface tension",
    source="Martin and Moyce 1952, a = 1.125 in",
    setup=f"column of water 28.6 mm wide and twice as high, nu 1e-6 m2/s, in a closed tank of 8 a x {HEIGHT:g} a full of air of "
    f"{AIR.rest_density:g} kg/m3, {AIR.dynamic_viscosity:g} Pa s and {AIR.interfacial_tension:g} N/m, no-slip walls, contact angle 90 "
    "degrees, plane; beside it the same column with a free surface, as in case 14",
    length=EXPERIMENT.base,
    length_symbol="a",
    resolutions=(16, 32, 48),
    spacings=2,
    quantities=(
        Quantity(name="rms, in air", unit="1", reference=0.0, scale=1.0, gate=0.03),
        Quantity(name="shift, in air", unit="1", reference=0.0, scale=1.0),
        Quantity(name="rms, free surface", unit="1", reference=0.0, scale=1.0),
        Quantity(name="shift, free surface", unit="1", reference=0.0, scale=1.0),
    ),
    panels=(Panel("front", "t sqrt(2 g / a)", "front / a"),),
    run=front_in_air,
    note="rms of the relative difference after the best shift in time. Most of the gain over the free surface is the air's: without "
    "tension it is as good within the scatter of runs, half a per cent at 16 spacings.",
)
