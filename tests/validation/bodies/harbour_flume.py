"""Case 45: a flume at full scale, in which particles alone tell at which speed, and how fast, a harbour skirt loses oil.

    python -m tests.validation.bodies.harbour_flume --oil 840 --resolution 33 [--every 3] [--folder FOLDER] [--threads N]

runs one oil and spacing. The current grows in steps, each held until the flow has passed twice. Oil that passes under the skirt comes up
behind it, drifts round with the water and meets the slick again, so the pool stays, and the loss at each speed is steady. It is counted in
the second passage of the water. Each speed ends with a row in `FOLDER/rows.csv` and a saved state: a run that was ended goes on from its
last speed. The rows that were measured stand in `harbour_flume.csv` beside this file.
"""

from __future__ import annotations

import argparse
import csv
import math
import pickle
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from booms.losses.drainage import suction_limit
from booms.losses.liquids import OilOnWater
from booms.losses.rates import Closures
from booms.losses.slick import thickening
from tests.validation.bodies.boom_losses import drivers
from tests.validation.bodies.flume import OIL_VISCOSITY, Flume, fill_flume
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, Trace, trace
from tests.validation.scenes import WATER_DENSITY

Double = NDArray[np.float64]

FLUME = Flume(draft=0.2, depth=5.0, length=8.0, skirt=5.5)
OILS = (840.0, 900.0, 950.0)  # kg/m3
SPEEDS = tuple(round(0.20 + 0.02 * k, 2) for k in range(16))  # m/s
PASSAGES = 2.0  # of the flume by the flow, at each speed; the second one counts
SAMPLE = 0.1  # s
ONSET = 0.02  # of the pool, lost in one passage: the first loss
FOOT = 0.3  # d below the foot, where the fastest water is looked for
BIN = 0.1  # d: of the slick's profile
FOLDER = Path("validation-report/harbour-flume")
MEASURED = Path(__file__).with_name("harbour_flume.csv")


@dataclass(frozen=True, kw_only=True)
class Row:
    """The means at one speed.

    oil [kg/m3]; resolution: spacings of draft; speed [m/s] set, flow [m/s] found ahead; pool [m2] before the skirt; passed [m2/s] under it;
    thickness [m] at the skirt; length [m] of the slick; front [m] and friction C_f of the best h^2 = h_f^2 + K x (NaN for a slick that is
    too short); suction k: the fastest water under the foot, over the flow.
    """

    oil: float
    resolution: int
    speed: float
    flow: float
    pool: float
    passed: float
    thickness: float
    length: float
    front: float
    friction: float
    suction: float


def liquids(oil_density: float) -> OilOnWater:
    """The oil of the flume on its water."""
    return OilOnWater(
        oil_density=oil_density, water_density=WATER_DENSITY, kinematic_viscosity=OIL_VISCOSITY / oil_density
    )


class Series:
    """One oil and spacing, from speed to speed; `held` (N,) tells by id which oil lies before the skirt."""

    def __init__(self, bench: Bench, oil_density: float, resolution: int, folder: Path) -> None:
        self.bench, self.oil, self.resolution, self.folder = bench, oil_density, resolution, folder
        self.spacing = FLUME.draft / resolution
        self.fluid, self.current = fill_flume(bench, FLUME, self.spacing, oil_density, SPEEDS[0])
        self.held = np.zeros(self.fluid.particle_count, np.bool_)
        self.held[self.fluid.phase_ids("oil")] = True
        self.done = 0
        folder.mkdir(parents=True, exist_ok=True)
        if self._state.exists():
            saved = pickle.loads(self._state.read_bytes())  # our own file, of the run before
            self.fluid.restore_state(saved["fluid"])
            self.held, self.done = saved["held"], saved["done"]

    @property
    def _state(self) -> Path:
        return self.folder / f"state-{self.oil:g}-{self.resolution}.pickle"

    def run(self, every: int = 1) -> None:
        """Go through the speeds that are left, or through each `every`-th one."""
        while self.done < len(SPEEDS):
            row = self._hold(SPEEDS[self.done])
            self.done += every
            saved = {"fluid": self.fluid.save_state(), "held": self.held, "done": self.done}
            self._state.write_bytes(pickle.dumps(saved))
            append(self.folder / "rows.csv", row)
        self.fluid.close()

    def _hold(self, speed: float) -> Row:
        """Hold a speed [m/s] for the passages, and measure during the last one."""
        self.current.velocity = (speed, 0.0, 0.0)
        passage = FLUME.length * FLUME.draft / speed
        begin, lost, samples, profiles = self.fluid.time, 0, [], []
        while self.fluid.time - begin < PASSAGES * passage:
            self.bench.advance(self.fluid, SAMPLE)
            gone = self._note_losses()
            if self.fluid.time - begin > (PASSAGES - 1.0) * passage:
                lost += gone
                samples.append(self._sample())
                profiles.append(self._profile())
        flow, pool, foot = np.mean(samples, axis=0)
        rate = lost * self.spacing**2 / (len(samples) * SAMPLE)
        return self._row(speed, float(flow), float(pool), rate, float(foot), np.mean(profiles, axis=0))

    def _note_losses(self) -> int:
        """Bring `held` up to date; returns how many particles have passed under the skirt."""
        ids = self.fluid.phase_ids("oil").astype(np.int64)
        x = self.fluid.phase_positions("oil")[:, 0] - FLUME.skirt_place
        behind = (x > 0.5 * FLUME.draft) & self.held[ids]
        self.held[ids[behind]] = False
        self.held[ids[x < -0.1 * FLUME.draft]] = True
        return int(behind.sum())

    def _sample(self) -> tuple[float, float, float]:
        """The flow [m/s] 2 to 3.5 drafts ahead of the skirt under the slick, the pool [m2], and the fastest water [m/s] under the foot."""
        position = self.fluid.phase_positions("water").astype(np.float64)
        speed = self.fluid.phase_velocities("water")[:, 0].astype(np.float64)
        draft, foot = FLUME.draft, FLUME.level - FLUME.draft
        x, z = position[:, 0] - FLUME.skirt_place, position[:, 2]
        ahead = (x > -3.5 * draft) & (x < -2.0 * draft) & (z > draft) & (z < foot)
        beside, below = max(0.15 * draft, self.spacing), max(FOOT * draft, 2.0 * self.spacing)
        under = (np.abs(x) < beside) & (z < foot) & (z > foot - below)
        layer = ((foot - z[under]) / (2.0 * self.spacing)).astype(np.int64)
        means = np.bincount(layer, weights=speed[under]) / np.maximum(np.bincount(layer), 1)
        oil = self.fluid.phase_positions("oil")[:, 0] - FLUME.skirt_place
        pool = ((oil < 0.0) & (oil > FLUME.zone * draft - FLUME.skirt_place)).sum() * self.spacing**2
        return float(speed[ahead].mean()), float(pool), float(means.max())

    def _profile(self) -> Double:
        """Thickness [m] of the oil before the skirt in bins of `BIN` drafts, from the skirt on."""
        oil = FLUME.skirt_place - self.fluid.phase_positions("oil")[:, 0].astype(np.float64)
        width, bins = BIN * FLUME.draft, round((FLUME.skirt - FLUME.zone) / BIN)
        place = (oil[(oil > 0.0) & (oil < bins * width)] / width).astype(np.int64)
        return np.asarray(np.bincount(place, minlength=bins)[:bins] * self.spacing**2 / width)

    def _row(self, speed: float, flow: float, pool: float, rate: float, foot: float, profile: Double) -> Row:
        """The row of a speed, with front and friction of the profile (n,) [m]."""
        width, deepest = BIN * FLUME.draft, profile[:3].mean()
        thick = np.flatnonzero(profile > 0.3 * deepest)
        length = (thick[-1] + 1) * width if len(thick) else 0.0
        front = friction = math.nan
        inner = np.arange(1, len(thick) - 2)  # neither the eddy at the skirt nor the rounded head
        if len(inner) >= 4:
            x = length - (inner + 0.5) * width  # behind the front
            growth, at_front = np.polyfit(x, profile[inner] ** 2, 1)
            front = math.sqrt(max(at_front, 0.0))
            friction = growth / float(thickening(flow, liquids(self.oil), 1.0))
        return Row(
            oil=self.oil, resolution=self.resolution, speed=speed, flow=flow, pool=pool, passed=rate,
            thickness=float(deepest), length=float(length), front=front, friction=friction, suction=foot / flow,
        )  # fmt: skip


def append(path: Path, row: Row) -> None:
    """Add a row to a table, which begins with its header; five digits."""
    begins = not path.exists()
    with path.open("a", newline="") as file:
        writer = csv.writer(file)
        if begins:
            writer.writerow(field.name for field in fields(Row))
        writer.writerow(f"{getattr(row, field.name):.5g}" for field in fields(Row))


def read(path: Path) -> list[Row]:
    """The rows of a table, in order of oil and speed; none where there is no table."""
    if not path.exists():
        return []
    with path.open(newline="") as file:
        rows = [
            Row(**{name: int(text) if name == "resolution" else float(text) for name, text in line.items()})
            for line in csv.DictReader(file)
        ]
    return sorted(rows, key=lambda row: (row.oil, row.resolution, row.speed))


def first_loss(rows: list[Row]) -> float:
    """The first speed [m/s] at which more than `ONSET` of the pool passes within one passage of the flow; NaN if none does."""
    lost = [row.speed for row in rows if row.passed * FLUME.length * FLUME.draft / row.speed > ONSET * row.pool]
    return lost[0] if lost else math.nan


def by_closures(rows: list[Row]) -> Double:
    """The loss [m2/s] that the closures give for the pool and the flow of each row."""
    closures = Closures(skirt_depth=FLUME.draft)
    rates = [closures.rates(drivers(row.flow, FLUME.draft, np.array([row.pool])), liquids(row.oil)) for row in rows]
    return np.array([float(rate.sum()) for rate in rates])


def harbour_flume(resolution: int, bench: Bench) -> Outcome:
    """Case 45: every oil; what an earlier run has measured is not run again."""
    span = sum(PASSAGES * FLUME.length * FLUME.draft / speed for speed in SPEEDS)
    bench.plan(span * len(OILS))
    values, curves = dict[str, float](), list[Trace]()
    for oil in OILS:
        Series(bench, oil, resolution, FOLDER).run()
        rows = [row for row in read(FOLDER / "rows.csv") if row.oil == oil and row.resolution == resolution]
        found, name = first_loss(rows), f"{oil:g} kg/m3"
        values |= {
            f"first loss, {name}": found,
            f"first loss over the suction limit, {name}": found / float(suction_limit(FLUME.draft, liquids(oil))),
            f"suction k, {name}": float(np.median([row.suction for row in rows])),
            f"friction, {name}": float(np.nanmedian([row.friction for row in rows])),
        }
        speeds = [row.speed for row in rows]
        curves += [
            trace("loss", speeds, [3600.0 * row.passed for row in rows], name, markers=True),
            trace("loss", speeds, 3600.0 * by_closures(rows), f"closures, {name}", reference=True),
        ]
    return Outcome(values=values, traces=tuple(curves))


HARBOUR_FLUME = Case(
    number=45,
    name="harbour-flume",
    title="Loss over speed of a harbour skirt at full scale, by particles alone",
    source="practice: first loss at 0.31 to 0.51 m/s; suction round a plate's foot: k = 1.41; friction of slicks: 0.003 to 0.016",
    setup=f"skirt of draft d = {FLUME.draft:g} m, one spacing thick, in water {FLUME.depth:g} d deep, plane, without interfacial tension, "
    f"with {FLUME.slick:g} d2 of oil before it; the current goes from {SPEEDS[0]:g} to {SPEEDS[-1]:g} m/s in steps of 0.02, each held "
    f"for {PASSAGES:g} passages of the flume; the first loss is {100 * ONSET:g} % of the pool in the second passage",
    length=FLUME.draft,
    length_symbol="d",
    resolutions=(10, 16, 33, 50),
    quantities=tuple(
        quantity
        for name in [f"{oil:g} kg/m3" for oil in OILS]
        for quantity in (
            Quantity(name=f"first loss, {name}", unit="m/s", reference=0.41),
            Quantity(name=f"first loss over the suction limit, {name}", unit="1", reference=1.0),
            Quantity(name=f"suction k, {name}", unit="1", reference=math.sqrt(2.0)),
            Quantity(name=f"friction, {name}", unit="1", reference=0.005),
        )
    ),
    panels=(Panel("loss", "speed [m/s]", "loss [m3/h per metre of front]"),),
    run=harbour_flume,
    spacings=1,
    note="resumable: each speed ends with a row and a saved state in validation-report/harbour-flume. Waves on the slick's underside have "
    "no shortest length here, as particles have no interfacial tension. The same water meets the skirt again after one passage.",
)


def main() -> None:
    """Run one oil and spacing."""
    parser = argparse.ArgumentParser(description="One oil and spacing of the harbour flume.")
    parser.add_argument("--oil", type=float, choices=OILS, required=True, help="density [kg/m3]")
    parser.add_argument("--resolution", type=int, required=True, help="spacings of draft")
    parser.add_argument("--every", type=int, default=1, help="take each n-th speed only")
    parser.add_argument("--folder", type=Path, default=FOLDER, help="of table and saved states")
    parser.add_argument("--threads", type=int, default=None, help="threads; default all cores")
    options = parser.parse_args()
    Series(Bench(threads=options.threads), options.oil, options.resolution, options.folder).run(options.every)


if __name__ == "__main__":
    main()
