"""A boom at its moorings in a current hangs as the load on it says: its pull follows from drag, standing water and shape."""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from recordings import Recorder, draw_picture
from scenarios import ScenarioRun

SPEED, LENGTH, SKIRT, DRAG = 0.2, 130.0, 0.5, 1.88  # m/s, m, m, and the drag coefficient of a skirt

with ScenarioRun("anchored-containment", f"sea.current.speed={SPEED}", "sea.wind.speed=0") as run:
    run.watch(Recorder("boom_in_current.rrd", 2.0))
    run.run(30.0)
    readings = run.readings()
draw_picture("boom_in_current.rrd", "boom_in_current.png")

tension = np.mean([readings.one_series(f"tow_tension/end-{n}").value[-50:].mean() for n in (0, 1)])
gap = readings.one_series("gap_ratio").value[-1]  # from end to end, over the length


def half_gap(tension):
    """Way across the current [m] from the apex to an end: tension x curvature = load, by drag and by water that stands in the U."""

    def bend(_, state):
        angle, across = state
        held = min(1.0, 20.0 * SKIRT / max(2.0 * across, 1e-9))
        load = 0.5 * 1027.0 * SKIRT * SPEED**2 * (DRAG * np.cos(angle) ** 2 + held * np.sin(angle) ** 2)
        return load / tension, np.cos(angle)

    return solve_ivp(bend, (0.0, 0.5 * LENGTH), (0.0, 0.0), rtol=1e-6).y[1, -1]


theory = brentq(lambda tension: half_gap(tension) - 0.5 * gap * LENGTH, 10.0, 1e4)
print(f"tension of the boom: {tension:.1f} N; of its shape: {theory:.1f} N within {0.1 * theory:.1f} N")
assert abs(tension - theory) < 0.1 * theory
