"""Case 60: a boom afloat in a flume, by particles alone, in calm water, in long waves and in chop.

A float carries a skirt with ballast at its foot. The boom surges, heaves and pitches, and a soft spring at half its draft holds it, as the
sag of a long boom does. Waves that are long beside its own periods carry it along, so that it meets little more than the current; in chop
it stays behind the water and rocks. Each speed is held for two passages of the flume, as in case 45, and the first one at which the boom
loses oil ends a run.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from oilsim import BoundaryParticles, Fluid
from oilsim.sea import RegularWaves
from tests.seas import shallow_sea
from tests.validation.bodies.flumes.flume import Flume, fill_flume
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace
from tests.validation.rigid import Body
from tests.validation.scenes import GRAVITY, WATER_DENSITY

Double = NDArray[np.float64]

FLUME = Flume(draft=0.2, depth=5.0, length=26.0, skirt=20.0, zone=10.0, slick=0.8)
WIDTH, BELOW, ABOVE = 0.1, 0.08, 0.12  # m: breadth of the float, its depth and height about the waterline
WEIGHT = 1.1  # of the water that the boom displaces: particles of a thin skirt displace more than their volume
PARTS = ((0.22, 0.02), (0.13, -0.14), (0.65, -0.19))  # of the mass, and where [m]: float, skirt, ballast
STIFFNESS, DAMPING = (
    90.0,
    8.0,
)  # N/m, N s/m of the mooring of a metre: its period in surge is several periods of the waves
SEAS = {
    "calm": (0.0, 0.0),
    "long": (0.2, 6.0),
    "chop": (0.1, 0.8),
}  # height and length of the waves [m]; periods of 2.2 and 0.7 s
SPEEDS = tuple(round(0.20 + 0.04 * k, 2) for k in range(9))  # m/s
STEP, LOOK, BUILD_UP = 0.01, 0.1, 3.0  # s: of the exchange, between looks at the oil, in which waves grow
ONSET = 0.05  # of the pool in a passage: the first loss, a few particles at the coarsest spacing


@dataclass(frozen=True)
class Boom:
    """A boom as particles of one spacing [m]; points (n, 2) [m] along x and z about the waterline."""

    spacing: float

    @property
    def points(self) -> Double:
        """The lattice that fills float and skirt, (n, 2)."""
        columns = round(WIDTH / self.spacing)
        heights = np.arange(-FLUME.draft + 0.5 * self.spacing, ABOVE, self.spacing)
        across = (np.arange(columns) - 0.5 * (columns - 1)) * self.spacing
        rows = [(across if z > -BELOW else across[columns // 2 :][:1], z) for z in heights]
        return np.concatenate([np.column_stack([x, np.full(len(x), z)]) for x, z in rows])

    @property
    def mass(self) -> float:
        """Mass of a metre [kg]."""
        return WEIGHT * WATER_DENSITY * float((self.points[:, 1] < 0.0).sum()) * self.spacing**2

    @property
    def centre(self) -> float:
        """Height of the centre of mass over the waterline [m]."""
        return sum(share * z for share, z in PARTS)

    @property
    def inertia(self) -> float:
        """Moment of inertia of a metre about the centre of mass [kg m2]: three parts at their places, the float with its own."""
        own = PARTS[0][0] * (WIDTH**2 + (BELOW + ABOVE) ** 2) / 12.0
        return self.mass * (own + sum(share * (z - self.centre) ** 2 for share, z in PARTS))

    def boundary(self) -> BoundaryParticles:
        """The boom's wall particles, about its centre of mass."""
        x, z = self.points.T
        faces = 4 - (np.abs(self.points[:, None] - self.points[None]).sum(axis=2) < 1.01 * self.spacing).sum(axis=1) + 1
        position, volume = np.column_stack([x, np.zeros_like(x), z - self.centre]), np.full(len(x), self.spacing**2)
        return BoundaryParticles(
            name="boom", position=position, volume=volume, area=faces * self.spacing, displaced=np.column_stack([position, volume])
        )  # fmt: skip

    def leaves(self, points: Double) -> NDArray[np.bool_]:
        """Tell which of points (n, 3) [m], about the waterline, lie outside."""
        x, z, gap = np.abs(points[:, 0]), points[:, 2], 0.25 * self.spacing
        float_ = (x < 0.5 * WIDTH + gap) & (z > -BELOW)
        return ~(float_ | ((x < 0.5 * self.spacing + gap) & (z > -FLUME.draft)))


class Run:
    """A boom in one sea."""

    def __init__(self, bench: Bench, resolution: int, sea: str) -> None:
        self._bench, spacing = bench, FLUME.draft / resolution
        self._boom = Boom(spacing)
        self.body: Body
        self.fluid, self._driving = fill_flume(
            bench, FLUME, spacing, 900.0, SPEEDS[0], tension=0.02, balanced=True, hang=self._hang
        )
        self._waves = waves_of(*SEAS[sea])
        self._held = np.zeros(self.fluid.particle_count, np.bool_)
        self._held[self.fluid.phase_ids("oil")] = True
        self.rest = self.body.position.copy()

    def lost(self, speed: float) -> float:
        """Hold a current [m/s] for two passages; return the share of the pool that passed under or over the boom in the second."""
        passage, begin = FLUME.length * FLUME.draft / speed, self.fluid.time
        gone, pools = 0, list[int]()
        while self.fluid.time - begin < 2.0 * passage:
            self._driving.sea = shallow_sea(FLUME.level, current=(speed, 0.0), waves=self._grown())
            for _ in range(round(LOOK / STEP)):
                self.body.advance(self._bench, STEP, self.mooring())
            passed, pool = self._look()
            if self.fluid.time - begin > passage:
                gone += passed
                pools.append(pool)
        return gone / max(float(np.mean(pools)), 1.0)

    def _grown(self) -> RegularWaves | None:
        """The waves, as high as they are by now."""
        share = min(1.0, (self.fluid.time + LOOK) / BUILD_UP)
        return replace(self._waves, height=share * self._waves.height) if self._waves else None

    def _hang(self, fluid: Fluid, points: Double) -> NDArray[np.bool_]:
        boom, waterline = self._boom, np.array([FLUME.skirt_place, 0.0, FLUME.level])
        self.body = Body(
            fluid, boom.boundary(), boom.mass, np.diag([0.0, 1.0 / boom.inertia, 0.0]), waterline + boom.centre * np.array([0.0, 0.0, 1.0]),
            np.array([1.0, 0.0, 1.0, 0.0, 1.0, 0.0]),
        )  # fmt: skip
        return boom.leaves(points - waterline)

    def mooring(self) -> Double:
        """The wrench (6,) of a spring at half the draft, on a metre [N, N m]."""
        arm = self.body.rotation @ [0.0, 0.0, -0.5 * FLUME.draft - self._boom.centre]
        away = self.body.position[0] + arm[0] - self.rest[0]
        pull = -STIFFNESS * away - DAMPING * (self.body.twist[0] + self.body.twist[4] * arm[2])
        return np.array([pull, 0.0, 0.0, 0.0, arm[2] * pull, 0.0])

    def _look(self) -> tuple[int, int]:
        """How many particles of oil have passed since the last look, and how many the boom holds."""
        ids = self.fluid.phase_ids("oil").astype(np.int64)
        behind = (self.fluid.phase_positions("oil")[:, 0] - self.body.position[0]) / FLUME.draft
        passed = (behind > 0.5) & (behind < 4.0) & self._held[ids]
        self._held[ids[passed]] = False
        self._held[ids[(behind < -0.35) & (behind > -8.0)]] = True
        return int(passed.sum()), int(((behind < 0.0) & (behind > -8.0)).sum())


def waves_of(height: float, length: float) -> RegularWaves | None:
    """Waves of a height and length [m] over the depth of the flume; None where they have no height."""
    if not height:
        return None
    number = 2.0 * math.pi / length
    rate = math.sqrt(GRAVITY * number * math.tanh(number * FLUME.level))
    return RegularWaves(height=height, period=2.0 * math.pi / rate)


def floating_boom(resolution: int, bench: Bench) -> Outcome:
    """Find the first loss in each sea."""
    bench.plan(len(SEAS) * sum(2.0 * FLUME.length * FLUME.draft / speed for speed in SPEEDS))
    values, curves = dict[str, float](), []
    for sea in SEAS:
        run, shares = Run(bench, resolution, sea), list[float]()
        while not (shares and shares[-1] > ONSET) and len(shares) < len(SPEEDS):
            shares.append(run.lost(SPEEDS[len(shares)]))
        values[sea] = SPEEDS[len(shares) - 1] if shares[-1] > ONSET else math.nan
        curves.append(trace("loss", SPEEDS[: len(shares)], [100.0 * share for share in shares], sea, markers=True))
        run.fluid.close()
    figures = {f"first loss, {sea}": speed for sea, speed in values.items()}
    figures |= {f"first loss, {sea} over calm": values[sea] / values["calm"] for sea in ("long", "chop")}
    return Outcome(values=figures, traces=tuple(curves))


FLOATING_BOOM = Case(
    number=60,
    name="floating-boom",
    title="First loss of a boom afloat, in calm water, long waves and chop, by particles alone",
    source="practice: 0.31 to 0.51 m/s; waves 30 times as long as high are ridden as calm water, chop of 8 times loses earlier "
    "(Bitting 1999)",
    setup=f"boom of draft d = {FLUME.draft:g} m with a float {WIDTH:g} m wide, free to surge, heave and pitch on a spring of "
    f"{STIFFNESS:g} N/m a metre, oil of 900 kg/m3; waves of 0.2 x 6 m and 0.1 x 0.8 m; the current grows from "
    f"{SPEEDS[0]:g} m/s in steps of 0.04, each held for two passages",
    length=FLUME.draft,
    length_symbol="d",
    resolutions=(10, 20),
    quantities=(
        Quantity(name="first loss, calm", unit="m/s", reference=0.41, gate=0.25),
        Quantity(name="first loss, long", unit="m/s", reference=0.41, gate=0.25),
        Quantity(name="first loss, chop", unit="m/s", reference=0.41),
        Quantity(name="first loss, long over calm", unit="1", reference=1.0, gate=0.15),
        Quantity(name="first loss, chop over calm", unit="1", reference=0.5, gate=0.7),
    ),
    panels=(Panel("loss", "speed [m/s]", "share of the pool lost in a passage [%]"),),
    run=floating_boom,
    spacings=1,
    note="long waves reach the boom lower than they are asked for, since the zone is a third of their length; one spring stands for the "
    "sag of a whole boom",
)
