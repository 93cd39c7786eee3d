"""Case 45: a flume at full scale, in which particles alone tell at which speed, and how fast, a harbour skirt loses oil.

    python -m tests.validation.bodies.flumes.harbour_flume --oil 840 --resolution 33 [--tension] [--balanced] [--draft 0.4] [--seed 1]

runs one oil and spacing, with interfacial tension or without, in well-balanced water or not, for a skirt of any draft. Runs of two seeds
differ by rounding at their start, which tells the scatter. The current grows in steps, each held until
the flow has passed twice. Oil that passes under the skirt comes up behind it, drifts round with the water and meets the slick again, so the
pool stays, and the loss at each speed is steady. It is counted in the second passage of the water. The state is saved every five minutes
and at the end of a piece (`--minutes`): the same command goes on from there, bit for bit. Rows go into a table beside the state; `--keep`
puts them into `harbour_flume.csv` beside this file, with the rows that were measured before.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from booms.losses.liquids import ASSUMED_TENSION, FRICTION, OilOnWater, thickening
from booms.losses.rates import Closures, suction_limit
from tests.seas import shallow_sea
from tests.validation.bodies.boom_losses import drivers
from tests.validation.bodies.flumes.flume import OIL_VISCOSITY, Flume, fill_flume
from tests.validation.bodies.flumes.picture import draw, picture_file
from tests.validation.bodies.flumes.pieces import Piece, add_options, piece_of, read_options, rows_of, save, saved
from tests.validation.bodies.flumes.tables import keep, write
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
KEY = ("oil", "resolution", "tension", "balanced", "draft", "seed", "begun", "speed")  # of a row
MEASURED = Path(__file__).with_name("harbour_flume.csv")


@dataclass(frozen=True, kw_only=True)
class Row:
    """The means at one speed.

    oil [kg/m3]; resolution: spacings of draft; tension [N/m], 0 for none; balanced: 1 in well-balanced water, else 0; draft [m] of the
    skirt; seed of the first places; begun [m/s]: the speed at which the run began; speed [m/s] set, flow [m/s] found ahead; pool [m2]
    before the skirt; passed [m2/s] under it; thickness [m] at the skirt; length [m] of the slick; front [m] and friction C_f of the best
    h^2 = h_f^2 + K x (NaN for a slick that is too short); suction k: the fastest water under the foot, over the flow.
    """

    oil: float
    resolution: int
    tension: float
    balanced: int
    draft: float
    seed: int
    begun: float
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


@dataclass
class Hold:
    """A speed [m/s] that is being held since `begin` [s]: how many particles have passed, and each look at flow and profile."""

    speed: float
    begin: float
    lost: int = 0
    looks: list[tuple[float, float, float]] = field(default_factory=list)
    profiles: list[Double] = field(default_factory=list)


@dataclass(frozen=True, kw_only=True)
class Setting:
    """What a run is of: the first columns of its rows."""

    oil: float
    resolution: int
    tension: float = 0.0
    balanced: int = 0
    draft: float = FLUME.draft
    seed: int = 0

    @property
    def name(self) -> str:
        """The name of its state's file."""
        draft = "" if self.draft == FLUME.draft else f"-{self.draft:g}m"
        seed = f"-seed{self.seed}" if self.seed else ""
        return f"{self.oil:g}-{self.resolution}-{self.tension:g}{'-balanced' if self.balanced else ''}{draft}{seed}"


class Series:
    """One run, from speed to speed; `held` (N,) tells by id which oil lies before the skirt."""

    def __init__(self, bench: Bench, setting: Setting, folder: Path) -> None:
        self.bench, self.setting = bench, setting
        self.shape = replace(FLUME, draft=setting.draft)
        self.spacing = setting.draft / setting.resolution
        self.fluid, self.driving = fill_flume(
            bench, self.shape, self.spacing, setting.oil, SPEEDS[0],
            tension=setting.tension, balanced=bool(setting.balanced), seed=setting.seed,
        )  # fmt: skip
        self.held = np.zeros(self.fluid.particle_count, np.bool_)
        self.held[self.fluid.phase_ids("oil")] = True
        self.rows: list[Row] = []
        self._hold: Hold | None = None
        self._state = folder / f"{setting.name}.pickle"
        if state := saved(self._state):
            self.held, self.rows = state["held"], rows_of(state, Row, self._state)
            self.fluid.restore_state(state["fluid"])
            self._hold = Hold(**state["hold"]) if state["hold"] else None

    def run(self, speeds: Sequence[float] = SPEEDS, piece: Piece | None = None) -> bool:
        """Go through the speeds [m/s] beyond the last row until the piece is over; returns whether all are done."""
        piece = piece or Piece()
        first = self.fluid.time
        while speed := self._next(speeds):
            self._hold = self._hold or Hold(speed, self.fluid.time)
            while not (piece.is_over or self._is_held()):
                self._look()
                if piece.asks_to_save():
                    self._save()
                    piece.say(f"{speed:g} m/s: {piece.progress(self.fluid.time - first, self._left(speeds))}")
            if piece.is_over and not self._is_held():
                break
            self.rows.append(self._row(self._hold))
            self._hold = None
            self._save()
        piece.say(f"{len(self.rows)} rows; {piece.progress(self.fluid.time - first, self._left(speeds))}")
        self._save()
        self.fluid.close()
        return not self._next(speeds)

    def draw(self, path: Path) -> None:
        """Draw oil and flow as they are now into a picture at `path`."""
        speed = self._hold.speed if self._hold else self.rows[-1].speed if self.rows else SPEEDS[0]
        setting = self.setting
        tension = f"{setting.tension:g} N/m" if setting.tension else "no tension"
        draw(
            path,
            self.fluid,
            self.shape,
            speed,
            f"Oil of {setting.oil:g} kg/m³, {speed:g} m/s, {setting.resolution} spacings of draft, {tension}",
        )

    def passage(self, speed: float) -> float:
        """Time [s] in which a flow at `speed` [m/s] passes the flume."""
        return passage(speed, self.setting.draft)

    def _next(self, speeds: Sequence[float]) -> float | None:
        """The speed [m/s] that is held, or the next one; None after the last."""
        last = self.rows[-1].speed if self.rows else 0.0
        return self._hold.speed if self._hold else next((speed for speed in speeds if speed > last), None)

    def _is_held(self) -> bool:
        """Whether the flow has passed often enough at this speed."""
        return self._hold is not None and self.fluid.time - self._hold.begin >= PASSAGES * self.passage(
            self._hold.speed
        )

    def _left(self, speeds: Sequence[float]) -> float:
        """Time of flow [s] until all speeds are done."""
        speed = self._next(speeds) or math.inf
        gone = self.fluid.time - self._hold.begin if self._hold else 0.0
        return sum(PASSAGES * self.passage(other) for other in speeds if other >= speed) - gone

    def _save(self) -> None:
        """Write the state, and the rows so far."""
        hold = vars(self._hold) if self._hold else None  # plain, since classes of a command cannot be read by a case
        rows = [asdict(row) for row in self.rows]
        save(self._state, {"fluid": self.fluid.save_state(), "held": self.held, "rows": rows, "hold": hold})
        if self.rows:
            write(self._state.with_suffix(".csv"), self.rows)

    def _look(self) -> None:
        """Advance by one sample, and measure if the last passage has begun."""
        assert self._hold is not None
        hold = self._hold
        self.driving.sea = shallow_sea(self.driving.sea.description.depth, current=(hold.speed, 0.0))
        self.bench.advance(self.fluid, SAMPLE)
        gone = self._note_losses()
        if self.fluid.time - hold.begin > (PASSAGES - 1.0) * self.passage(hold.speed):
            hold.lost += gone
            hold.looks.append(self._sample())
            hold.profiles.append(self._profile())

    def _note_losses(self) -> int:
        """Bring `held` up to date; returns how many particles have passed under the skirt."""
        ids = self.fluid.phase_ids("oil").astype(np.int64)
        x = self.fluid.phase_positions("oil")[:, 0] - self.shape.skirt_place
        behind = (x > 0.5 * self.shape.draft) & self.held[ids]
        self.held[ids[behind]] = False
        self.held[ids[x < -0.1 * self.shape.draft]] = True
        return int(behind.sum())

    def _sample(self) -> tuple[float, float, float]:
        """The flow [m/s] 2 to 3.5 drafts ahead of the skirt under the slick, the pool [m2], and the fastest water [m/s] under the foot."""
        position = self.fluid.phase_positions("water").astype(np.float64)
        speed = self.fluid.phase_velocities("water")[:, 0].astype(np.float64)
        draft, foot = self.shape.draft, self.shape.level - self.shape.draft
        x, z = position[:, 0] - self.shape.skirt_place, position[:, 2]
        ahead = (x > -3.5 * draft) & (x < -2.0 * draft) & (z > draft) & (z < foot)
        beside, below = max(0.15 * draft, self.spacing), max(FOOT * draft, 2.0 * self.spacing)
        under = (np.abs(x) < beside) & (z < foot) & (z > foot - below)
        layer = ((foot - z[under]) / (2.0 * self.spacing)).astype(np.int64)
        means = np.bincount(layer, weights=speed[under]) / np.maximum(np.bincount(layer), 1)
        oil = self.fluid.phase_positions("oil")[:, 0] - self.shape.skirt_place
        pool = ((oil < 0.0) & (oil > self.shape.zone * draft - self.shape.skirt_place)).sum() * self.spacing**2
        return float(speed[ahead].mean()), float(pool), float(means.max())

    def _profile(self) -> Double:
        """Thickness [m] of the oil before the skirt in bins of `BIN` drafts, from the skirt on."""
        oil = self.shape.skirt_place - self.fluid.phase_positions("oil")[:, 0].astype(np.float64)
        width, bins = BIN * self.shape.draft, round((self.shape.skirt - self.shape.zone) / BIN)
        place = (oil[(oil > 0.0) & (oil < bins * width)] / width).astype(np.int64)
        return np.asarray(np.bincount(place, minlength=bins)[:bins] * self.spacing**2 / width)

    def _row(self, hold: Hold) -> Row:
        """The row of a speed that has been held, with front and friction of its profile."""
        flow, pool, foot = (float(mean) for mean in np.mean(hold.looks, axis=0))
        profile = np.mean(hold.profiles, axis=0)
        width, deepest = BIN * self.shape.draft, profile[:3].mean()
        thick = np.flatnonzero(profile > 0.3 * deepest)
        length = (thick[-1] + 1) * width if len(thick) else 0.0
        front = friction = math.nan
        inner = np.arange(1, len(thick) - 2)  # neither the eddy at the skirt nor the rounded head
        if len(inner) >= 4:
            x = length - (inner + 0.5) * width  # behind the front
            growth, at_front = np.polyfit(x, profile[inner] ** 2, 1)
            front = math.sqrt(max(at_front, 0.0))
            friction = growth * FRICTION / float(thickening(flow, liquids(self.setting.oil)))
        return Row(
            **vars(self.setting), begun=self.rows[0].begun if self.rows else hold.speed, speed=hold.speed, flow=flow, pool=pool,
            passed=hold.lost * self.spacing**2 / (len(hold.looks) * SAMPLE), thickness=float(deepest),
            length=float(length), front=front, friction=friction, suction=foot / flow,
        )  # fmt: skip


def passage(speed: float, draft: float) -> float:
    """Time [s] in which a flow at `speed` [m/s] passes the flume of a skirt of some draft [m]."""
    return FLUME.length * draft / speed


def first_loss(rows: list[Row]) -> float:
    """The first speed [m/s] at which more than `ONSET` of the pool passes within one passage of the flow; NaN if none does."""
    lost = [row.speed for row in rows if row.passed * passage(row.speed, row.draft) > ONSET * row.pool]
    return lost[0] if lost else math.nan


def by_closures(rows: list[Row]) -> Double:
    """The loss [m2/s] that the closures give for the pool and the flow of each row."""
    rates = [
        Closures(skirt_depth=row.draft).rates(drivers(row.flow, row.draft, np.array([row.pool])), liquids(row.oil))
        for row in rows
    ]
    return np.array([float(rate.sum()) for rate in rates])


def harbour_flume(resolution: int, bench: Bench) -> Outcome:
    """Case 45: every oil, from the beginning: a state may be of other code, or of another step."""
    span = sum(PASSAGES * passage(speed, FLUME.draft) for speed in SPEEDS)
    bench.plan(span * len(OILS))
    values, curves = dict[str, float](), list[Trace]()
    for oil in OILS:
        setting = Setting(oil=oil, resolution=resolution, tension=ASSUMED_TENSION, balanced=1)
        with TemporaryDirectory() as folder:
            series = Series(bench, setting, Path(folder))
            series.run()
        rows = series.rows
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
    setup=f"skirt of draft d = {FLUME.draft:g} m, one spacing thick, in well-balanced water {FLUME.depth:g} d deep, plane, with an "
    f"interfacial tension of {ASSUMED_TENSION:g} N/m and {FLUME.slick:g} d2 of oil before it; the current goes from {SPEEDS[0]:g} to "
    f"{SPEEDS[-1]:g} m/s in steps of 0.02, each held for {PASSAGES:g} passages of the flume; the first loss is {100 * ONSET:g} % of the "
    "pool in the second passage",
    length=FLUME.draft,
    length_symbol="d",
    resolutions=(10, 20, 33, 50),
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
    note="The command of this name runs single oils, also without tension, and in pieces that go on from a saved state. "
    "The same water meets the skirt again after one passage.",
)


def main() -> None:
    """Run one oil, spacing and tension, or a piece of that."""
    parser = argparse.ArgumentParser(description="One oil and spacing of the harbour flume.")
    add_options(parser, OILS, FOLDER)
    parser.add_argument("--speeds", type=float, nargs="+", default=SPEEDS, metavar="M/S", help="in growing order")
    parser.add_argument("--picture", type=picture_file, metavar="FILE", help="of oil and flow at the end of this piece")
    parser.add_argument("--draft", type=float, default=FLUME.draft, metavar="M", help="of the skirt")
    parser.add_argument(
        "--seed", type=int, default=0, help="of the particles' first places; 0 leaves them on their lattice"
    )
    options = read_options(parser, FLUME.draft)
    setting = Setting(
        oil=options.oil, resolution=options.resolution, tension=options.tension, balanced=int(options.balanced),
        draft=options.draft, seed=options.seed,
    )  # fmt: skip
    series = Series(Bench(threads=options.threads), setting, options.folder)
    series.run(options.speeds, piece_of(options))
    if options.picture:
        series.draw(options.picture)
    if options.keep:
        keep(MEASURED, series.rows, KEY)


if __name__ == "__main__":
    main()
