"""A window of particles (`oilsim.window`) as the fluid of a coupled run: it takes the bodies that are in it, and follows its target.

Variables are those of `coupling.participants.fluid`, of all bodies that may ever meet the window. A body's share is 1 inside, 0 in the
rim, and fades over FADE spacings at each of four points along it (`oilsim.window.window.gauss_points`). Its load is

    share times the load that the particles find, and (1 - share) times that of the formulas (`SharedEnvironment`),

which add up to one load at every place. In the solve bodies answer by S^1/2 M^-1 S^1/2, with S the shares and M^-1 the inverse mass of
all bodies together: exact for whole shares, and symmetric between them. Between different shares it should be M^-1 S; what that differs
by goes into the free acceleration, with the loads of the last steps, smoothed. The body's own motion goes into the reference coordinates,
and its load comes back, as `oilsim.window.window` has it.

A wave pushes a body along by the slope of its surface: in the reference coordinates, which lie along it, by the body's lift. A pile whose
foot is below the window has none. For it the lift of what it displaces in the window, L, is turned all the same, (R - 1) L, and the sea
is that at the middle of this part.

Where a body comes into the window, water that it displaces is taken out; where it leaves, water is put back. `water_moved` counts both.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from coupling.master.participant import Status, StepResult
from coupling.master.saved_fields import SavedFields
from coupling.multibody.constrained_mobility import Environment
from coupling.participants.fluid import FluidParticipant, added_mass
from coupling.solids.signed_distance import SignedDistance
from oilsim import BoundaryParticles, FluidError, block
from oilsim.backend.arrays import Array, Flags, Ints
from oilsim.boundaries.walls import rotation_matrix
from oilsim.core.physical_constants import GRAVITY
from oilsim.window.window import LocalMotion, Window, gauss_points, local_motion

if TYPE_CHECKING:
    from trimesh import Trimesh

    from oilsim.loads.morison import BodyLoads

Target = Callable[[Mapping[str, Array]], Array]

# [1] spacings along a body whose added mass is told at least; numerical; `added_mass` looks at no more than twice as many
OUTLINE = 16
# [d] over which the share of a point of a body goes from 0 to 1; numerical; a support of the particles
FADE = 2.75
# [d] from the middle, out into the rim, within which particles meet a body that has no share yet; numerical; two supports
APPROACH = 5.5
# [1] share of the rim's width that this takes at most; numerical; a body stays away from the sides, where the box repeats
APPROACH_SHARE = 0.5
# [d] farther out at which a body leaves again; numerical; one that hovers does not come and go
STAY = 1.0
# [d] between a body's surface and the nearest water when it comes in; numerical; as at the start of a run
CLEARANCE = 0.5
# [d] between water and water that is put back; numerical; nearer pairs would be pressed apart
ROOM = 0.7
# [1] share of the change of a load that its smoothed value follows in a step; numerical; at once, light neighbours would swing
SMOOTH = 0.1
# [s] by which two times may differ and be the same; numerical; far below any step
ROUNDING = 1e-9
# (6,) the part of a load that grows with a vertical acceleration of the sea: the weight of displaced water and its moments
HYDROSTATIC = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 0.0])


@dataclass(frozen=True, eq=False)
class WindowBody:
    """A body that may meet a window, about its centre of mass [m].

    mesh    its surface
    sample  returns the surface as particles of a spacing [m]; a hull takes seconds, and may never come near
    lift    [N] of the water that a pile displaces in the window where no water bears its foot
    middle  [m] of that part over its centre
    """

    mesh: Trimesh
    sample: Callable[[float], BoundaryParticles]
    lift: float = 0.0
    middle: float = 0.0

    def outline_spacing(self, spacing: float) -> float:
        """Return the spacing [m] at which a body far from a window of `spacing` [m] is sampled."""
        return max(spacing, float(self.mesh.extents.max()) / OUTLINE)


class Shares(SavedFields):
    """The shares (B,) of the particles in the loads of bodies, in the order of their `names`: `values` until `turn` [s], then `later`.

    What holds in a step is known when the step before ends, so the bodies' free accelerations at its start, the particles in it, and
    the formulas in it all have the same shares.
    """

    STATE = ("values", "later", "turn")
    LOOSE = ("turn",)

    def __init__(self, names: tuple[str, ...]) -> None:
        self.names = names
        self.values, self.later, self.turn = np.zeros(len(names)), np.zeros(len(names)), -np.inf

    def at(self, time: float) -> Array:
        """Return the shares (B,) [1] at `time` [s]."""
        return self.later if time >= self.turn - ROUNDING else self.values

    def begin(self, time: float) -> None:
        """Take the shares of the step that begins at `time` [s]."""
        self.values = self.at(time).copy()

    def announce(self, values: Array, turn: float) -> None:
        """Note the shares (B,) [1] of the step that begins at `turn` [s]."""
        self.later, self.turn = values, turn


class SharedEnvironment:
    """A sea that loads bodies by formulas, each with what windows leave: 1 - their shares. Its bodies have the order of `names`."""

    def __init__(self, environment: Environment, names: tuple[str, ...], shares: Sequence[Shares]) -> None:
        self.environment, self._shares = environment, shares
        self._rows = np.array([shares[0].names.index(name) for name in names], int)
        self.sea = getattr(environment, "sea", None)  # whom helmsmen and pictures ask for current and surface

    def loads(self, time: float, pose: Array, twist: Array) -> BodyLoads:
        """Return the loads on all bodies; time [s], pose (B, 7) [m, 1], twist (B, 6) [m/s, rad/s]."""
        found = self.environment.loads(time, pose, twist)
        rest = 1.0 - np.sum([one.at(time) for one in self._shares], axis=0)[self._rows]
        return type(found)(*(values * rest.reshape(-1, *(1,) * (values.ndim - 1)) for values in found))


class WindowParticipant(FluidParticipant):
    """Steps a `Window` around `target`, which gives a place (2,) [m] by the poses (7,) [m, 1] of the bodies."""

    STATE = (*FluidParticipant.STATE, "_handles", "_last", "_steady", "shares", "water_moved")

    def __init__(self, name: str, window: Window, bodies: Mapping[str, WindowBody], target: Target) -> None:
        super().__init__(name, window.fluid, dict.fromkeys(bodies, -1))
        self.window, self.shares = window, Shares(tuple(bodies))
        self.all_shares: tuple[Shares, ...] = (self.shares,)
        self.water_moved = {"out": 0, "back": 0}  # particles
        self._bodies, self._target = dict(bodies), target
        self._offsets = np.zeros((len(bodies), 4, 3))
        self._lift, self._middle = np.array([(body.lift, body.middle) for body in bodies.values()]).reshape(-1, 2).T
        # [m] of those points from the bodies' middles; of bodies not sampled yet, no less
        self._reach = np.array([np.linalg.norm(one.mesh.vertices, axis=1).max() for one in bodies.values()])
        self._reach += np.abs(self._middle)
        self._measured = np.zeros(len(bodies), bool)
        self._handles: dict[str, int] = {}
        self._steady = np.zeros((len(bodies), 6))  # the same, smoothed over some steps
        self._last = np.zeros(
            (len(bodies), 6)
        )  # loads that the particles found in the last step, in reference coordinates

    def enter_initialization_mode(self, start_time: float) -> None:
        """Start the fluid's clock."""
        self._fluid.time = start_time

    def do_step(self, time: float, step_size: float) -> StepResult:
        """Follow the target, take in and let go bodies, and advance the particles to `time + step_size` [s]."""
        pose, twist, free = (
            self._all(what, size) for what, size in (("pose", 7), ("twist", 6), ("free_acceleration", 6))
        )
        self.window.follow(self._target(dict(zip(self.shares.names, pose, strict=True))), time)
        now, later = self._sea_over(pose, twist, time, 0.0), self._sea_over(pose, twist, time, step_size)
        self.shares.begin(time)
        self._meet(pose, now, self._present(now))
        accelerating = (later.twist - now.twist) / step_size
        added = (accelerating[:, 2:3] / GRAVITY) * HYDROSTATIC * self._last
        self._fluid.time = time
        self._move(
            pose, now, _in_reference(now.turn, twist - now.twist), _in_reference(now.turn, free - accelerating), added
        )
        try:
            self._take_report(self._fluid.advance(step_size))
        except FluidError as error:
            return StepResult(Status.ERROR, time, str(error), cause=error)
        self._hand_back(twist + step_size * free, now, later, added)
        self.shares.announce(self._shares_of(later), time + step_size)
        return StepResult(Status.OK, time + step_size)

    def _all(self, what: str, size: int) -> Array:
        """Return an input of all bodies (B, size)."""
        return np.array([self._inputs[f"{name}.{what}"] for name in self._bodies]).reshape(-1, size)

    def free(self, acceleration: Array) -> None:
        """Take the free accelerations (B, 6) [m/s2, rad/s2] of all bodies."""
        for name, own in zip(self._bodies, acceleration, strict=True):
            self._inputs[f"{name}.free_acceleration"] = own

    def _sea_over(self, pose: Array, twist: Array, time: float, ahead: float) -> LocalMotion:
        """Return the sea over the bodies where they will be `ahead` [s] of `time`; of bodies far from the window, none, in its rim."""
        place, count = pose[:, :3] + ahead * twist[:, :3], len(pose)
        near = self._near(place, time + ahead)
        offsets = np.einsum("bij,bkj->bki", rotation_matrix(pose[near, 3:]), self._offsets[near])
        far = np.append(self.window.rim.center + 0.5 * np.array(self.window.rim.size), 0.0)
        whole = LocalMotion(
            np.zeros((count, 3)), np.zeros((count, 6)), np.tile(np.eye(3), (count, 1, 1)), np.tile(far, (count, 4, 1))
        )
        for every, part in zip(
            whole, local_motion(self.window.motion, place[near], offsets, time + ahead), strict=True
        ):
            every[near] = part
        return whole

    def _near(self, place: Array, time: float) -> Ints:
        """Return the rows of the bodies at `place` (B, 3) [m] that are in the window, or may be when the sea has moved them."""
        motion, along = self.window.motion, list(self.window.rim.along)
        offset = place[:, along] - (self.window.rim.center + motion.travel(time)[:2])[along]
        reach = 0.5 * np.array(self.window.rim.size)[along] + motion.farthest + self._reach[:, None]
        near = (np.abs(offset) < reach).all(1)
        near[self._met] = True
        for n in np.flatnonzero(near & ~self._measured):
            body = self._bodies[self.shares.names[n]]
            self._offsets[n] = gauss_points(body.sample(self.window.settings.spacing).position)
            self._offsets[n, :, 2] += body.middle
            self._reach[n], self._measured[n] = np.linalg.norm(self._offsets[n], axis=1).max(), True
        return np.flatnonzero(near)

    def _inward(self, now: LocalMotion) -> Array:
        """Return the ways (B, 4) [m] of the bodies' points from the rim into the middle; below 0 in the rim, and far away."""
        rim, along = self.window.rim, list(self.window.rim.along)
        inward = rim.inward(now.points.reshape(-1, 3)).reshape(-1, 4) - rim.width
        away = np.abs(now.points[..., along] - rim.center[along]) > 0.5 * np.array(rim.size)[along]
        inward[away.any(-1)] = -np.inf  # in none of the images of the box, which repeats
        return np.asarray(inward)

    def _shares_of(self, now: LocalMotion) -> Array:
        """Return every body's share (B,)."""
        return np.clip(self._inward(now) / (FADE * self.window.settings.spacing), 0.0, 1.0).mean(1)

    def _present(self, now: LocalMotion) -> Flags:
        """Mark the bodies (B,) that particles meet: a little before they have a share, so that the flow around them is there by then."""
        spacing = self.window.settings.spacing
        reach = np.full(len(self._bodies), min(APPROACH * spacing, APPROACH_SHARE * self.window.rim.width))
        reach[self._met] += STAY * spacing
        return np.asarray((self._inward(now).max(1) > -reach) | (self.shares.values > 0.0))

    def _meet(self, pose: Array, now: LocalMotion, present: Flags) -> None:
        """Give the fluid the surfaces of bodies that come in, and take away those of bodies that leave; `present` (B,)."""
        for n, (name, body) in enumerate(self._bodies.items()):
            if present[n] == (name in self._handles):
                continue
            turn = now.turn[n].T @ rotation_matrix(pose[n, 3:])
            if present[n]:
                self._take_out(body.mesh, now.rest[n], turn)
                self._handles[name] = self._fluid.add_boundary(body.sample(self.window.settings.spacing))
            else:
                self._fluid.remove_boundary(self._handles.pop(name))
                self._put_back(body.mesh, now.rest[n], turn)
                self._last[n] = self._steady[n] = 0.0

    def _take_out(self, mesh: Trimesh, rest: Array, turn: Array) -> None:
        """Remove water inside a body at `rest` (3,) [m], turned by `turn` (3, 3), or right at its surface."""
        self._fluid.finish_step()
        about = self.window.rim.about_center(self._fluid.particles.position.T) - rest
        chosen = _is_near(mesh, about @ turn, CLEARANCE * self.window.settings.spacing)
        if chosen.any():
            self._fluid.remove_particles(chosen)
            self.water_moved["out"] += int(chosen.sum())

    def _put_back(self, mesh: Trimesh, rest: Array, turn: Array) -> None:
        """Fill the place that a body leaves with water at rest, up to the level, as far as there is room."""
        spacing, config = self.window.settings.spacing, self._fluid.config
        reach = float(np.linalg.norm(mesh.vertices, axis=1).max()) + spacing
        places = block(rest - reach, rest + reach, spacing, config.dimension)
        places = places[places[:, 2] < self.window.motion.sea.description.level - 0.25 * spacing]
        places = places[_is_near(mesh, (places - rest) @ turn, 0.0)]
        here = self.window.rim.about_center(self._fluid.particles.position.T)
        if len(here) and len(places):
            places = places[KDTree(here).query(places)[0] > ROOM * spacing]
        if len(places):
            for axis in self.window.rim.along:
                size = self.window.rim.size[axis]
                places[:, axis] -= size * np.floor((places[:, axis] - config.lower[axis]) / size)
            self._fluid.add_particles(places, phase=config.phases[0].name)
            self.water_moved["back"] += len(places)

    @property
    def _met(self) -> list[int]:
        """Rows of the bodies in the window."""
        return [n for n, name in enumerate(self._bodies) if name in self._handles]

    def _move(self, pose: Array, now: LocalMotion, twist: Array, acceleration: Array, added: Array) -> None:
        """Tell the fluid how the bodies in the window move, and how they answer, in reference coordinates."""
        rows = self._met
        if not rows:
            return
        inverse_mass, share = self._inverse_mass(rows, now), np.repeat(self.shares.values[rows], 6)
        between = np.sqrt(share)[:, None] * inverse_mass * np.sqrt(share)
        steady = self._steady[rows].ravel()
        pushed = inverse_mass @ (share * (added[rows].ravel() + steady)) - between @ steady
        accelerations = acceleration[rows] + pushed.reshape(-1, 6)
        handles = [self._handles[self.shares.names[n]] for n in rows]
        for m, n in enumerate(rows):
            turn, own = now.turn[n].T @ rotation_matrix(pose[n, 3:]), slice(6 * m, 6 * m + 6)
            self._fluid.set_boundary_motion(
                handles[m], now.rest[n], Rotation.from_matrix(turn).as_quat(), twist[n, :3], twist[n, 3:], between[own, own],
                accelerations[m],
            )  # fmt: skip
        self._fluid.set_joint_inverse_mass(handles, between)

    def _inverse_mass(self, rows: list[int], now: LocalMotion) -> Array:
        """Return the common M^-1 of the bodies of these rows, along the reference axes, (6 n, 6 n) [1/kg, 1/(kg m2)]."""
        index = (6 * np.array(rows)[:, None] + np.arange(6)).ravel()
        assert self._joint_inverse_mass is not None  # it is connected wherever there are bodies
        turns = np.zeros((len(index), len(index)))
        for m, n in enumerate(rows):
            for at in (6 * m, 6 * m + 3):
                turns[at : at + 3, at : at + 3] = now.turn[n]
        matrix = turns.T @ self._joint_inverse_mass[np.ix_(index, index)] @ turns
        return np.asarray(0.5 * (matrix + matrix.T))

    def _hand_back(self, unmet: Array, now: LocalMotion, later: LocalMotion, added: Array) -> None:
        """Bring loads and predicted twists (B, 6) back into the sea; `unmet` are the twists of bodies that meet no particles."""
        wrench, predicted, met = np.zeros(unmet.shape), unmet, self._met
        for n in met:
            handle = self._handles[self.shares.names[n]]
            self._last[n] = self._fluid.boundary_wrench(handle)
            self._steady[n] += SMOOTH * (self._last[n] - self._steady[n])
            wrench[n] = self.shares.values[n] * (self._last[n] + added[n])
            predicted[n] = self._fluid.boundary_twist(handle)
        wrench = _in_sea(now.turn, wrench)
        pushed = (now.turn[met, :, 2] - (0.0, 0.0, 1.0)) * (self.shares.values * self._lift)[met, None]
        wrench[met, :3] += pushed
        wrench[met, 3:5] += self._middle[met, None] * np.stack([-pushed[:, 1], pushed[:, 0]], axis=1)
        predicted[met] = _in_sea(later.turn[met], predicted[met]) + later.twist[met]
        for n, name in enumerate(self._bodies):
            self._outputs[f"{name}.wrench"], self._outputs[f"{name}.predicted_twist"] = wrench[n], predicted[n]

    def added_mass(self, body: str) -> Array:
        """Return the mass (6, 6) [kg, kg m, kg m2] of the densest liquid that a fully submerged body would move, world frame."""
        config = self._fluid.config
        density = max(phase.rest_density for phase in config.phases)
        turn = np.kron(np.eye(2), rotation_matrix(self._inputs[f"{body}.pose"][3:]))
        spacing = self._bodies[body].outline_spacing(config.particle_spacing)
        added = added_mass(self._bodies[body].sample(spacing), spacing, config.dimension, density)
        return np.asarray(turn @ added @ turn.T)

    def restore_state(self, state: Any) -> None:
        """Go back to a state that `save_state` returned, with the bodies that were in the window then; TypeError for anything else."""
        if isinstance(state, Mapping):
            for handle in self._handles.values():
                self._fluid.remove_boundary(handle)
            for name, handle in state["handles"].items():
                surface = self._bodies[name].sample(self.window.settings.spacing)
                self._fluid.add_boundary(surface, handle)
        super().restore_state(state)


def _is_near(mesh: Trimesh, points: Array, clearance: float) -> Flags:
    """Mark the points (N, 3) [m], in a body's axes, inside its mesh or nearer to it than `clearance` [m]."""
    low, high = mesh.bounds
    near = np.asarray(((points > low - clearance) & (points < high + clearance)).all(1))
    places = np.flatnonzero(near)
    if places.size:
        near[places] = SignedDistance(mesh).phi(np.ascontiguousarray(points[places])) < clearance
    return near


def _in_reference(turn: Array, values: Array) -> Array:
    """Return R^-1 of both halves of values (B, 6), with R (B, 3, 3)."""
    return np.einsum("bji,bkj->bki", turn, values.reshape(-1, 2, 3)).reshape(-1, 6)


def _in_sea(turn: Array, values: Array) -> Array:
    """Return R of both halves of values (B, 6), with R (B, 3, 3)."""
    return np.einsum("bij,bkj->bki", turn, values.reshape(-1, 2, 3)).reshape(-1, 6)
