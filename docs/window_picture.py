"""Draw a slick that comes into a window as parcels and becomes particles before a boom: ``python docs/window_picture.py``.

Runs `u-sweep` in a sea with a window of particles at the boom's apex, and writes `docs/pictures/window-slick.png`: the plan at four times,
with the boom, the window and its rim, parcels as grey and lost parcels as red spots, particles of oil as squares of their true size.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from oilsim.slick.parcels import NONE, ParcelState
from scenarios.build import Assembly, build
from scenarios.load import load_scenario

TIMES = (0.0, 3.5, 7.0, 12.25)  # s
STEP, SPACING = 0.035, 0.1  # s, m
SETTINGS = (
    "run.detail=window",
    f"run.communication_step={STEP}",
    f"fluid.particle_spacing={SPACING}",
    "fluid.sleep_speed=0.02",
    'window={target="main", size=[3.4, 3.4], depth=0.6, rim=0.6}',
    "fill.slick.lower=[2.4, 2.0, 0.4]",
    "fill.slick.upper=[3.4, 3.0, 0.66]",
    "tow.start=3.5",
)


def draw(axes: Axes, assembly: Assembly, time: float) -> None:
    """Draw the plan at `time` [s]."""
    slick, participant = assembly.slick, assembly.fluid_participant
    assert slick is not None and assembly.world is not None
    window, parcels = participant.window, slick.slick.parcels  # type: ignore[attr-defined]
    fates = parcels.fates()
    middle = window.rim.center + window.motion.travel(time)[:2]
    size, rim = np.array(window.rim.size), window.rim.width
    for inset, dashes in ((0.0, "-"), (rim, ":")):
        axes.add_patch(
            Rectangle(
                tuple(middle - 0.5 * size + inset), *(size - 2.0 * inset), fill=False, ls=dashes, ec="tab:blue", lw=1.0
            )
        )
    drifting = np.isin(parcels.state, (ParcelState.AFLOAT, ParcelState.HELD, ParcelState.LOST))
    for lost, color in ((False, "0.35"), (True, "tab:red")):
        own = drifting & ((fates == ParcelState.LOST) == lost)
        axes.scatter(*parcels.position[own].T, s=3.0, c=color, lw=0.0)
        resolved = (parcels.state == ParcelState.RESOLVED) & ((parcels.cause != NONE) == lost)
        for x, y in parcels.position[resolved] - 0.5 * SPACING:
            axes.add_patch(
                Rectangle((x, y), SPACING, SPACING, fc="tab:red" if lost else "tab:brown", ec="0.2", lw=0.2, alpha=0.8)
            )
    barriers = slick.slick.barriers
    for start, end in zip(barriers.start, barriers.end, strict=True):
        axes.plot(*np.array([start, end]).T, color="tab:orange", lw=2.0)
    account = slick.slick.account
    litres = (
        f"{1e3 * account.resolved:.0f} of {1e3 * account.released:.0f} l are particles, {1e3 * account.lost:.1f} l lost"
    )
    axes.set_title(f"{time:.3g} s: {litres}", fontsize=9)
    axes.set_aspect("equal")
    axes.set_xlim(0.2, 5.6)
    axes.set_ylim(0.4, 4.6)


def main() -> None:
    """Run and draw."""
    assembly = build(load_scenario("u-sweep", overrides=SETTINGS).scenario)
    simulation = assembly.co_simulation()
    simulation.initialize()
    figure, grid = plt.subplots(2, 2, figsize=(11.0, 8.6), constrained_layout=True)
    for axes, until in zip(grid.flat, TIMES, strict=True):
        simulation.run(until)
        draw(axes, assembly, until)
    simulation.terminate()
    for axes in grid[:, 0]:
        axes.set_ylabel("y [m]")
    for axes in grid[1]:
        axes.set_xlabel("x [m]")
    figure.suptitle(
        "grey: parcels; brown: oil particles; red: lost; orange: boom; blue: window, dotted: its rim", fontsize=10
    )
    figure.savefig(Path(__file__).parent / "pictures" / "window-slick.png", dpi=90)


if __name__ == "__main__":
    main()
