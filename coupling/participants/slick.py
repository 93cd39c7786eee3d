"""A slick of parcels as a participant of a coupled run: booms are bodies of others, oil is its own.

The input `poses` holds the poses of the bodies of booms, in the order of `bodies`. Outputs: `spilled`, `afloat`, `contained`,
`stranded`, `recovered`, rows of the oil ledger in m3, and `resolved`, what of it is particles of a window; `lost`, and `lost.<cause>`, the
oil now lost by that cause; of every boom <boom> `<boom>.contained`, `<boom>.passed.<cause>`, the oil that it has lost since the start and
that has not come back, `<boom>.carried.<cause>`, what of it particles of a window carried past, `<boom>.recontained`,
what they would have carried under its skirt, and by segment
`<boom>.held_by_segment`, `<boom>.thickness`, `<boom>.normal_speed`, `<boom>.draft`, `<boom>.lean`, `<boom>.freeboard`. A step sweeps each
barrier from where the last step left it to the pose given for this one, so nothing leaks, whatever the bodies do. If the bodies make their
step before the slick, that pose is the one at the step's end; if the slick is first, its barriers lag by a step.
The slick does not act on the bodies.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from coupling.master.participant import Causality, Participant, Status, StepResult, Variable, checked_value
from coupling.participants.plan_barriers import Beach, BoomBodies
from oilsim.backend.arrays import Array
from oilsim.oil.fates import CAUSES
from oilsim.slick.barriers import Immersion
from oilsim.slick.loss_rate import LossRate, no_loss
from oilsim.slick.slick import Slick, SurfaceFlow
from oilsim.slick.spill_source import SpillSource

if TYPE_CHECKING:
    from oilsim.window.oil_exchange import OilExchange

ROWS = ("spilled", "afloat", "contained", "stranded", "recovered", "resolved")
BY_SEGMENT = {"held_by_segment": "m3", "thickness": "m", "normal_speed": "m/s"}
# [m] between foot and ground that tubes full of water close by giving way; assumed
SEALING_GAP = 0.05
IMMERSION = {"draft": "m", "lean": "rad", "freeboard": "m"}


class Surface(Protocol):
    """The surface of a sea that is still at the height `level` [m]."""

    @property
    def level(self) -> float:
        """Height [m] of the still water."""

    def rise(self, time: float) -> float:
        """Return the height [m] of the still water at `time` [s] above `level`."""

    def elevation(self, xy: Array, time: float) -> Array:
        """Return the height (N,) [m] of the surface at places (N, 2) [m] at `time` [s]."""


class FlatSurface:
    """A surface without waves, at the height 0."""

    level = 0.0

    def rise(self, time: float) -> float:
        """Return 0 [m]."""
        return 0.0

    def elevation(self, xy: Array, time: float) -> Array:
        """Return zeros (N,) [m]."""
        return np.zeros(len(xy))


class CarryingSea(NamedTuple):
    """The sea that carries a slick.

    flow: motion of floating oil; water: that of the water at the booms' depth, the same if None; surface: from which the draft of booms is
    measured.
    """

    flow: SurfaceFlow
    water: SurfaceFlow | None = None
    surface: Surface = FlatSurface()


class SlickParticipant(Participant):
    """Steps a `Slick` whose barriers named by `booms` follow bodies; see the module for its variables.

    sea: what carries the slick; loss_rate: closures; beach: its waterline is an outline of the slick, and booms that seal do so on it.
    `sources` holds the oil that runs out, and may grow between
    steps; one may lie on a body of a boom, or on one of the `carriers`. Releases and recovery are calls of
    the slick, between steps. Raises ValueError for a boom that the slick does not have, or has
    with another number of segments.
    """

    STATE = ("_slick", "sources", "_poses", "particles")

    def __init__(
        self,
        name: str,
        slick: Slick,
        sea: CarryingSea,
        *,
        booms: Sequence[BoomBodies] = (),
        loss_rate: LossRate = no_loss,
        beach: Beach | None = None,
        carriers: Sequence[str] = (),
    ) -> None:
        self.particles: OilExchange | None = None
        self.sources: list[SpillSource] = []
        self._slick, self._loss_rate = slick, loss_rate
        self._flow, self._water, self._surface = sea
        self._booms, self._beach = tuple(booms), beach
        self._rows = {boom.name: slick.barriers.rows(boom.name) for boom in booms}
        for boom in booms:
            segments = self._rows[boom.name].stop - self._rows[boom.name].start
            if segments != len(boom.bodies):
                raise ValueError(f"{name!r}: boom {boom.name!r} has {len(boom.bodies)} bodies, allowed: {segments}")
        named = [*(body for boom in booms for body in boom.bodies), *carriers]
        self.bodies = tuple(dict.fromkeys(named))
        place = {body: row for row, body in enumerate(self.bodies)}
        self._boom_rows = [np.array([place[body] for body in boom.bodies], dtype=np.int64) for boom in booms]
        self._poses: Array | None = None
        self._start = 0.0
        self._outputs: dict[str, Array] = {}
        self._read_at = -1  # changes of the slick that the outputs know of
        inputs = [Variable("poses", "m, 1", (len(self.bodies), 7), Causality.INPUT)] if self.bodies else []
        super().__init__(name, [*inputs, *self._declared_outputs()])
        self._read()

    def _declared_outputs(self) -> list[Variable]:
        names = [*ROWS, "lost", *(f"lost.{cause}" for cause in CAUSES)]
        for boom in self._booms:
            names += [f"{boom.name}.contained", f"{boom.name}.recontained"]
            names += [f"{boom.name}.{what}.{cause}" for what in ("passed", "carried") for cause in CAUSES]
        by_segment = [
            Variable(f"{boom.name}.{quantity}", unit, (len(boom.bodies),), Causality.OUTPUT)
            for boom in self._booms
            for quantity, unit in (BY_SEGMENT | IMMERSION).items()
        ]
        return [*(Variable(name, "m3", (), Causality.OUTPUT) for name in names), *by_segment]

    @property
    def slick(self) -> Slick:
        """The slick, for releases, recovery and pictures."""
        return self._slick

    @property
    def flow(self) -> SurfaceFlow:
        """The motion of floating oil, which carries the slick."""
        return self._flow

    def change_sea(self, sea: CarryingSea) -> None:
        """Let another sea carry the oil from now on."""
        self._flow, self._water, self._surface = sea

    def meet(self, particles: OilExchange, flow: SurfaceFlow) -> None:
        """Exchange oil with the particles of a window from now on; `flow` carries what stays parcels, the window's motion included.

        The water that runs against the booms remains that of the sea.
        """
        self._water = self._water or self._flow
        self.particles, self._flow = particles, flow

    def enter_initialization_mode(self, start_time: float) -> None:
        """Note the time [s] at which the barriers are first seen."""
        self._start = start_time

    def exit_initialization_mode(self) -> None:
        """Put the barriers where their bodies are; ValueError if their poses have not been set."""
        if self.bodies and self._poses is None:
            raise ValueError(f"{self.name!r}: the input 'poses' is not set, allowed: a connection to it")
        self._move_barriers(self._start)
        self._slick.barriers.settle()
        self._read()

    def observe(self) -> bool:
        """Read the outputs again if oil has been released or recovered since the last step."""
        if self._read_at != self._slick.changes:
            self._read()
        return True

    def _read(self) -> None:
        self._read_at = self._slick.changes
        oil = self._slick.oil
        self._outputs = {name: np.array(getattr(oil, name)) for name in ROWS}
        self._outputs["lost"] = np.array(oil.all_lost)
        self._outputs |= {f"lost.{cause}": np.array(volume) for cause, volume in oil.lost.items()}
        for boom, rows in self._rows.items():
            self._outputs |= {f"{boom}.{quantity}": value for quantity, value in self._of_boom(rows)}

    def get(self, name: str) -> Array:
        """Return an output, of its variable's shape () or (S,), in its unit [m3, m, m/s]; ValueError for another name."""
        if name not in self._outputs:
            raise ValueError(f"{self.name!r} has no output {name!r}, allowed: {', '.join(self._outputs)}")
        return self._outputs[name].copy()

    def _of_boom(self, rows: slice) -> Iterator[tuple[str, Array]]:
        """Yield the quantities of a boom, arrays () or (S,), by name."""
        pools, barriers = self._slick.pools, self._slick.barriers
        held = pools.volume.reshape(-1, 2)[rows]
        losses = self._slick.losses
        yield "contained", np.array(held.sum())
        yield "recontained", np.array(losses.recontained[rows].sum())
        for what, volumes in (("passed", losses.gone), ("carried", losses.carried)):
            by_cause = volumes[:, rows].sum(axis=1).tolist()
            yield from ((f"{what}.{cause}", np.array(one)) for cause, one in zip(CAUSES, by_cause, strict=True))
        yield "held_by_segment", held.sum(axis=1)
        for quantity in ("thickness", "normal_speed"):
            yield quantity, np.asarray(getattr(pools, quantity).reshape(-1, 2)[rows].max(axis=1))
        yield from ((quantity, np.array(getattr(barriers, quantity)[rows])) for quantity in IMMERSION)

    def set(self, name: str, value: Array) -> None:
        """Set the poses (N, 7) [m, 1]; the next step uses them. ValueError for the quaternion 0."""
        checked = checked_value(self.name, self.variables, name, value)
        for row in np.flatnonzero(~checked[:, 3:].any(axis=1)).tolist():
            raise ValueError(
                f"{self.name!r}: the pose of {self.bodies[row]!r} has the quaternion 0, allowed: any other"
            )
        self._poses = checked

    def do_step(self, time: float, step_size: float) -> StepResult:
        """Go from `time` to `time + step_size` [s] in one step of the slick."""
        for source in self.sources:  # first of all: a waterline that moves in this step meets the new oil, too
            source.pour(self._slick, time, step_size, self._pose_of(source.body))
        self._move_barriers(time + step_size)
        if self.particles is not None:
            relative = self._slick.relative_velocity(self._water or self._flow, time, step_size)
            self.particles.follow(self._slick, relative, time + step_size)
        self._slick.step(self._flow, time, step_size, self._loss_rate, water=self._water)
        if self.particles is not None:
            self.particles.exchange(self._slick, time + step_size)
        self._read()
        return StepResult(Status.OK, time + step_size)

    def _pose_of(self, body: str) -> Array | None:
        """Return the pose (7,) [m, 1] of a body; None for the name "", and before poses are known."""
        return None if not body or self._poses is None else self._poses[self.bodies.index(body)]

    def _move_barriers(self, time: float) -> None:
        """Tell the slick where the bodies are at `time` [s]."""
        if self._beach is not None:
            self._slick.move(self._beach.name, self._beach.outline(self._surface.rise(time)))
        if self._poses is None:
            return
        for boom, rows in zip(self._booms, self._boom_rows, strict=True):
            poses, parted = self._poses[rows], self._slick.barriers.parted[self._rows[boom.name]]
            self._slick.move(boom.name, boom.nodes(poses, parted), self._immersion(boom, poses, time))

    def _immersion(self, boom: BoomBodies, poses: Array, time: float) -> Immersion:
        """Measure how a boom with bodies at poses (S, 7) [m, 1] sits in the water at `time` [s]."""
        feet, tops = boom.feet_and_tops(poses)
        at_feet, at_tops = np.split(self._surface.elevation(np.concatenate([feet, tops])[:, :2], time), 2)
        return Immersion(
            draft=np.maximum(at_feet - feet[:, 2], 0.0),
            lean=boom.lean(poses),
            freeboard=tops[:, 2] - at_tops,
            is_submerged=tops[:, 2] < self._surface.level + self._surface.rise(time),
            is_sealed=self._is_sealed(boom, feet),
        )

    def _is_sealed(self, boom: BoomBodies, feet: Array) -> npt.ArrayLike:
        """Tell which feet (S, 3) [m] of a boom lie tight on the ground."""
        return self._beach is not None and boom.seals and feet[:, 2] - self._beach.height(feet[:, :2]) <= SEALING_GAP

    def restore_state(self, state: Any) -> None:
        """Go back to a state that `save_state` returned; errors are those of `SavedFields`."""
        super().restore_state(state)
        self._read()
