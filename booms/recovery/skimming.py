"""A skimmer as a participant of a run: it follows a vessel or a boom, and takes parcels of the slick.

Inputs: the `<body>.pose` (7,) [m, 1] and `<body>.twist` (6,) [m/s, rad/s] of the body that carries it. It steps after the slick. Outputs:
`encountered`, `oil`, `water`, `decanted`, `offloaded`, `aboard` [m3], `rate` [m3/s] of oil over the last step.
"""

from __future__ import annotations

import numpy as np

from booms.recovery.skimmer import Skimmer, SkimmerDesign
from coupling.master.participant import Causality, Participant, Status, StepResult, Variable, checked_value
from coupling.participants.slick import SlickParticipant
from oilsim.backend.arrays import Array, Ints
from oilsim.loads.body_axes import rotation_matrices
from oilsim.slick.merging import rows_within
from oilsim.slick.parcels import ParcelState

POOL = 40.0  # [m] around a skimmer in which it looks for its pool; assumed: the pocket of a sweep
MOVING = 0.5  # [m/s] at which a skimmer is moved along what carries it; assumed: by hand lines, or slewed by a crane
SUMS = ("encountered", "oil", "water", "decanted", "offloaded")
OUTPUTS = {**dict.fromkeys((*SUMS, "aboard"), "m3"), "rate": "m3/s"}


class SkimmingParticipant(Participant):
    """A skimmer `offset` (3,) [m] from the centre of `body`, along its axes; without a body, `offset` is its place in the world.

    An order of place sets `target` (3,) [m], to which the mouth moves at `MOVING`, and works on its way.
    """

    STATE = ("skimmer", "offset", "_pose", "_twist", "_told_full", "_met")
    LOOSE = ("_met",)

    def __init__(
        self, name: str, design: SkimmerDesign, slick: SlickParticipant, *, body: str | None, offset: Array
    ) -> None:
        self._slick, self.body = slick, body
        self.offset = np.array(offset, np.float64)
        self.target = self.offset
        self.skimmer = Skimmer(design)
        self._rate = 0.0
        self._met = np.zeros(0, np.int64)  # ids of the parcels that have come to its mouth
        self._told: list[str] = []
        self._told_full = False
        self._pose, self._twist = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]), np.zeros(6)
        inputs = [] if body is None else [
            Variable(f"{body}.pose", "m, 1", (7,), Causality.INPUT),
            Variable(f"{body}.twist", "m/s, rad/s", (6,), Causality.INPUT),
        ]  # fmt: skip
        outputs = [Variable(output, unit, (), Causality.OUTPUT) for output, unit in OUTPUTS.items()]
        super().__init__(name, [*inputs, *outputs])

    @property
    def short_name(self) -> str:
        """Name of the skimmer in its scenario."""
        return self.name.removeprefix("skimmers/")

    @property
    def place_series(self) -> tuple[str, str]:
        """Names of the series of the place [m] of its mouth."""
        return f"{self.name}/x", f"{self.name}/y"

    @property
    def mouth(self) -> tuple[float, float]:
        """Place [m] of the middle of its mouth, in plan."""
        turned = (rotation_matrices(self._pose[None, 3:])[0] @ self.offset) + self._pose[:3]
        return float(turned[0]), float(turned[1])

    def distance_to_pool(self) -> float | None:
        """Return the distance [m] of the mouth from the middle of the oil that booms hold within `POOL` of it; None without such oil."""
        parcels, mouth = self._slick.slick.parcels, np.array(self.mouth)
        held = parcels.state == ParcelState.HELD
        places, volumes = parcels.position[held], parcels.volume[held]
        near = np.linalg.norm(places - mouth, axis=1) < POOL
        if not near.any():
            return None
        return float(np.linalg.norm(np.average(places[near], axis=0, weights=volumes[near]) - mouth))

    def get(self, name: str) -> Array:
        """Return an output, an array (), in its unit; ValueError for another name."""
        skimmer = self.skimmer
        if name in SUMS:
            return np.array(getattr(skimmer.account, name))
        values = {"aboard": skimmer.oil_aboard + skimmer.water_aboard, "rate": self._rate}
        if name not in values:
            raise ValueError(f"{self.name!r} has no output {name!r}, allowed: {', '.join(OUTPUTS)}")
        return np.array(values[name])

    def set(self, name: str, value: Array) -> None:
        """Set the pose or the twist of the body that carries it."""
        checked = checked_value(self.name, self.variables, name, value)
        if name.endswith(".pose"):
            self._pose = checked
        else:
            self._twist = checked

    def do_step(self, time: float, step_size: float) -> StepResult:
        """Take oil from `time` to `time + step_size` [s]."""
        self._move(step_size)
        skimmer, slick, mouth = self.skimmer, self._slick.slick, self.mouth
        was_ashore = skimmer.ashore_until is not None
        skimmer.begin(time, step_size)
        if was_ashore and skimmer.ashore_until is None:
            self._told.append("its storage is empty again, and it goes on")
            self._told_full = False
        radius = 0.5 * skimmer.design.swath
        volume, density = slick.oil_within(mouth, radius)
        flow = self._slick.flow.surface_velocity(np.array([mouth]), time)[0]
        speed = float(np.linalg.norm(flow - self._twist[:2]))
        if skimmer.works:
            self._meet(rows_within(slick.parcels, mouth, radius))
        wanted = skimmer.wanted(volume, density, speed, step_size)
        taken = slick.recover(mouth, radius, wanted) if wanted > 0.0 else 0.0
        if taken > 0.0 and skimmer.account.oil == 0.0:
            self._told.append("takes its first oil")
        skimmer.take(taken, time + step_size, step_size)
        self._rate = taken / step_size
        if skimmer.is_full and not self._told_full:
            self._tell_full()
        if taken > 0.0:
            self._slick.observe()
        return StepResult(Status.OK, time + step_size)

    def _move(self, duration: float) -> None:
        """Move towards the ordered place for `duration` [s]."""
        way = self.target - self.offset
        far = float(np.linalg.norm(way))
        if far > 0.0:
            self.offset = self.offset + way * min(1.0, MOVING * duration / far)

    def _meet(self, rows: Ints) -> None:
        """Count the oil of parcels of rows (M,) that come to the mouth for the first time."""
        parcels = self._slick.slick.parcels
        new = rows[~np.isin(parcels.id[rows], self._met)]
        if len(new):
            self.skimmer.account.encountered += float(parcels.volume[new].sum())
            self._met = np.union1d(self._met, parcels.id[new])

    def _tell_full(self) -> None:
        design, self._told_full = self.skimmer.design, True
        after = f"it is emptied within {design.offload_time:.0f} s" if design.offload_time > 0.0 else "it stops"
        self._told.append(f"its storage of {design.storage:g} m3 is full: {after}")

    def series(self) -> dict[str, float]:
        """Return sums [m3], rate [m3/s] and place [m] by the names of their series, ``skimmers/NAME/oil`` and so on."""
        sums = {f"{self.name}/{output}": float(self.get(output)) for output in OUTPUTS}
        sums |= dict(zip(self.place_series, self.mouth, strict=True))
        off_oil = self.distance_to_pool()
        return sums if off_oil is None else sums | {f"{self.name}/off_oil": off_oil}

    def summary(self) -> dict[str, float | None]:
        """Return the sums [m3], and the figures of ASTM F631 and F2709."""
        return {f"{sum_}_m3": float(self.get(sum_)) for sum_ in (*SUMS, "aboard")} | self.skimmer.figures()

    def take_notices(self) -> list[str]:
        """Return and forget what has happened since the last call."""
        told, self._told = self._told, []
        return told
