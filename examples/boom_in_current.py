"""A boom at its moorings in a current hangs as a catenary: its pull follows from drag and shape."""

import numpy as np
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

# a load q cos^2 of the angle to the stream bends the boom into a catenary: T = q a, sinh(w / 2a) / (w / 2a) = L / w
x = brentq(lambda x: np.sinh(x) / x - 1.0 / gap, 0.1, 20.0)
theory = 0.5 * 1027.0 * DRAG * SKIRT * SPEED**2 * gap * LENGTH / (2.0 * x)
print(f"tension of the boom: {tension:.1f} N; catenary without friction: {theory:.1f} N within {0.2 * theory:.1f} N")
assert abs(tension - theory) < 0.2 * theory
