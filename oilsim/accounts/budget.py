"""Energy and momentum accounts of a watched fluid: every change by a stage of a step is booked under the stage's cause.

Sums are taken in float64 before and after each stage. Potential energy and momentum are linear in the quantities that a stage changes, so
that differences are the stage's own changes. Kinetic energy is not linear. With the kicks dv_k of one step and its first and last velocity

    change of sum m v^2 / 2 = sum_k W_k,   W_k = sum m (v_first + v_last) / 2 . dv_k,

each W_k being the work of k's force along the mean velocity. This shares m dv_k . dv_l equally between k and l and does not depend on their
order: gravity's kick and the pressure that stops it do no work on water at rest, where differences of kinetic energy would report
m (g dt)^2 / 2 a step for each. In the same way a body of twists V_first and V_last receives the work P_k . (V_first + V_last) / 2 with the
impulse P_k, which is the change of its own kinetic energy. See `ledger` for the causes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.accounts.diagnostics import Energy
from oilsim.accounts.ledger import CAUSES, Change, Compression, Ledger
from oilsim.backend.arrays import Array, Real
from oilsim.backend.jit import FAST
from oilsim.backend.thread_team import BLOCK, Team, block_count
from oilsim.boundaries.walls import Walls
from oilsim.core.config import FluidConfig
from oilsim.core.state import FluidState, places_of
from oilsim.gradients.relaxation_time import squared_shear_rate

# Causes by stage: stages that change positions alone, stages that add, remove or swap particles (a step lies between them), and stages that
# change velocities.
MOVES = {"advection": "gravity", "wrap": "periodic"}
EXCHANGES = {"emitters": "emitters", "outflow": "outflow", "swaps": "swaps"}
KICKS = {
    "gravity": "gravity", "density": "positions", "forcing": "forcing", "adhesion": "adhesion", "tension": "tension",
    "viscosity": "viscosity", "divergence": "pressure", "contact": "contact", "rotation": "rotation", "sleep": "sleep",
}  # fmt: skip
STAGES = MOVES | EXCHANGES | KICKS


@njit(**FAST)
def sum_totals(begin, end, position, velocity, phase, mass, gravity, sums):
    """Fill block sums (blocks, 8) of m v^2 / 2 and -m g . x [J], m v [N s] and m x cross v [N m s], in float64.

    position, velocity (3, N) [m, m/s]; phase (N,) uint8; mass (phases,) of a particle [kg]; gravity (3,) [m/s2].
    """
    for block in range(begin // BLOCK, (end + BLOCK - 1) // BLOCK):
        kinetic = potential = px = py = pz = lx = ly = lz = 0.0
        for i in range(block * BLOCK, min((block + 1) * BLOCK, end)):
            m = mass[phase[i]]
            x, y, z = np.float64(position[0, i]), np.float64(position[1, i]), np.float64(position[2, i])
            u, v, w = np.float64(velocity[0, i]), np.float64(velocity[1, i]), np.float64(velocity[2, i])
            kinetic += 0.5 * m * (u * u + v * v + w * w)
            potential -= m * (gravity[0] * x + gravity[1] * y + gravity[2] * z)
            px += m * u
            py += m * v
            pz += m * w
            lx += m * (y * w - z * v)
            ly += m * (z * u - x * w)
            lz += m * (x * v - y * u)
        sums[block, 0], sums[block, 1], sums[block, 2], sums[block, 3] = kinetic, potential, px, py
        sums[block, 4], sums[block, 5], sums[block, 6], sums[block, 7] = pz, lx, ly, lz


@njit(**FAST)
def sum_work(begin, end, first, last, before, after, phase, mass, sums):
    """Fill block sums (blocks,) of m (v_first + v_last) / 2 . (v_after - v_before) [J], in float64 (see the module's docstring).

    first, last, before, after (3, N): velocities [m/s]; phase (N,) uint8; mass (phases,) of a particle [kg].
    """
    for block in range(begin // BLOCK, (end + BLOCK - 1) // BLOCK):
        work = 0.0
        for i in range(block * BLOCK, min((block + 1) * BLOCK, end)):
            along = 0.0
            for axis in range(3):
                mean = 0.5 * (np.float64(first[axis, i]) + np.float64(last[axis, i]))
                along += mean * (np.float64(after[axis, i]) - np.float64(before[axis, i]))
            work += mass[phase[i]] * along
        sums[block] = work


@njit(**FAST)
def sum_strain(begin, end, field, phase, mass, sums):
    """Fill block sums (blocks,) of m 2 S:S [kg/s2], S = (G + G^T) / 2, in float64.

    field (N, 16) as from `particle_sums`; phase (N,) uint8; mass (phases,) of a particle [kg].
    """
    for block in range(begin // BLOCK, (end + BLOCK - 1) // BLOCK):
        strain = 0.0
        for i in range(block * BLOCK, min((block + 1) * BLOCK, end)):
            strain += mass[phase[i]] * np.float64(squared_shear_rate(field, i))
        sums[block] = strain


class Kick(NamedTuple):
    """Velocities (3, N) [m/s] before and after a stage, and the impulses (bodies, 6) [N s, N m s] that bodies received in it."""

    cause: str
    before: Real
    after: Real
    impulse: Array


class Budget:
    """Accounts of the latest advance, `last`, and of all advances since the fluid is watched, `total`; None before the first.

    The fluid calls `open`, for every stage `enter` and `leave`, within the split scheme's density stage `add_strain`, and at last `close`.
    A step that ends between two advances lies between `open` and `suspend`, and counts for the later one. The state is only read. Within a
    step the velocities around every kick are kept, 24 bytes a particle each.
    """

    def __init__(self, config: FluidConfig, team: Team, state: FluidState, walls: Walls) -> None:
        self.last: Ledger | None = None
        self.total: Ledger | None = None
        self._team, self._state, self._walls = team, state, walls
        self._mass = config.rest_volume * np.array([phase.rest_density for phase in config.phases])
        self._gravity = np.array(config.gravity, np.float64)
        self._filters = config.scheme == "split"
        self.begin_anew()

    def begin_anew(self) -> None:
        """Start from the present state, after it was replaced by another one."""
        self._kicks: list[Kick] = []
        self._first, self._twist = self._state.velocity.copy(), self._twists()
        self._clear()

    def _clear(self) -> None:
        self._parts: dict[str, Change] = {}
        self._strain, self._earlier = 0.0, np.zeros(8)

    def open(self) -> None:
        """Begin to account: an advance begins, or a step that ends before it does."""
        self._start = self._totals() - self._earlier

    def suspend(self) -> None:
        """Ignore all changes of the fluid until `open`."""
        self._earlier = self._totals() - self._start

    def enter(self, stage: str) -> None:
        """Take the sums at the beginning of a stage."""
        if stage in STAGES:
            if stage == "outflow":
                self._settle()
            self._before, self._received = self._totals(), self._impulses()
            if stage in KICKS:
                self._velocity = self._state.velocity.copy()
        elif stage == "search":
            self._id = self._state.id

    def leave(self, stage: str) -> None:
        """Record the changes of a stage that has ended under its cause."""
        if stage == "search":
            self._follow_order()
        if stage not in STAGES:
            return
        change = self._totals() - self._before
        impulse = self._impulses() - self._received
        part = Change(
            kinetic=0.0 if stage in KICKS else float(change[0]),
            potential=float(change[1]),
            momentum=change[2:],
            impulse_on_bodies=self._about_origin(impulse),
        )
        if stage in KICKS:
            part -= self._keep(stage, impulse)
        self._add(STAGES[stage], part)
        if stage == "emitters":
            self._first, self._twist = self._state.velocity.copy(), self._twists()

    def add_strain(self, field: Real, time_step: float) -> None:
        """Add the strain of a step of `time_step` [s], by the velocity gradients that `particle_sums` leaves in `field` (N, 16)."""
        count = self._state.awake
        sums = np.zeros(block_count(count))
        self._team.run(sum_strain, count, field, self._state.phase, self._mass, sums)
        self._strain += time_step * float(np.add.reduce(sums))

    def close(self, duration: float, compression: Real, near: NDArray[np.uint8] | None) -> Ledger:
        """Return the ledger of an advance of `duration` [s] that has ended.

        compression (N,) [1] and near (N,) uint8 as the density stage leaves them; near is None in the paper's scheme.
        """
        totals = self._totals()
        change = totals - self._start
        ledger = Ledger(
            duration=duration,
            energy=Energy(float(totals[0]), float(totals[1])),
            momentum=totals[2:],
            change=Change(kinetic=float(change[0]), potential=float(change[1]), momentum=change[2:]),
            parts={cause: self._parts[cause] for cause in CAUSES if cause in self._parts},
            strain=self._strain,
            compression=Compression(
                mean=float(compression.mean(dtype=np.float64)) if compression.size else 0.0,
                least=float(compression.min(initial=0.0)),
                largest=float(compression.max(initial=0.0)),
                near_surface=None if near is None else int(np.count_nonzero(near)),
            ),
        )
        self.last = ledger
        self.total = ledger if self.total is None else self.total + ledger
        self._clear()
        return ledger

    def _add(self, cause: str, part: Change) -> None:
        self._parts[cause] = self._parts.get(cause, Change()) + part

    def _keep(self, stage: str, impulse: Array) -> Change:
        """Keep a stage's kick, and return the change that counts as the filter's: velocities in the split scheme's density stage."""
        after = self._state.velocity.copy()
        filters = self._filters and stage == "density"
        self._kicks.append(Kick("smoothing" if filters else KICKS[stage], self._velocity, after, impulse))
        if not filters:
            return Change()
        filtered = Change(momentum=self._totals(after - self._velocity)[2:])
        self._add("smoothing", filtered)
        return filtered

    def _totals(self, velocity: Real | None = None) -> Array:
        """Return the sums of `sum_totals` over all particles (8,), with their own velocities or others (3, N) [m/s]."""
        state = self._state
        sums = np.zeros((block_count(state.count), 8))
        velocity = state.velocity if velocity is None else velocity
        self._team.run(sum_totals, state.count, state.position, velocity, state.phase, self._mass, self._gravity, sums)
        return np.asarray(np.add.reduce(sums, axis=0))

    def _settle(self) -> None:
        """Record the work of all kicks of a step whose last velocities the state holds now."""
        state = self._state
        twist = 0.5 * (self._twist + self._twists())
        sums = np.zeros(block_count(state.count))
        for kick in self._kicks:
            self._team.run(
                sum_work,
                state.count,
                self._first,
                state.velocity,
                kick.before,
                kick.after,
                state.phase,
                self._mass,
                sums,
            )
            self._add(
                kick.cause,
                Change(kinetic=float(np.add.reduce(sums)), work_on_bodies=float((kick.impulse * twist).sum())),
            )
        self._kicks.clear()

    def _follow_order(self) -> None:
        """Bring the velocities kept of this step into the order in which the search has put the particles."""
        if self._id is self._state.id:
            return
        order = places_of(self._state.id, self._id)
        self._first = self._first[:, order]
        self._kicks = [kick._replace(before=kick.before[:, order], after=kick.after[:, order]) for kick in self._kicks]

    def _impulses(self) -> Array:
        """Return the impulses (bodies, 6) [N s, N m s] about the bodies' centres of mass since the advance began."""
        return np.array([body.impulse for body in self._walls.moving.values()], np.float64).reshape(-1, 6)

    def _twists(self) -> Array:
        return self._walls.twists()

    def _about_origin(self, impulse: Array) -> Array:
        """Return the sum (6,) over the bodies of impulses (bodies, 6) [N s, N m s], their moments taken about the origin."""
        result = impulse.sum(axis=0)
        for body, received in zip(self._walls.moving.values(), impulse, strict=True):
            result[3:] += np.cross(body.position, received[:3])
        return result
