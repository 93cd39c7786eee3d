"""Links of pybullet bodies as a fluid meets them: their places, motions, and common answer to impulses.

Links of one body form a tree (`joint_tree`). Constraints, point to point or fixed, may tie bodies to each other or to the world
(`joint_constraints`). A motor that keeps its joint's rate, or whose torque follows the load as a servo's does, counts as a rigid joint. A
motor that was overcome counts as an unknown force until it gives more than it did then; so does a constraint that was at its
`maxForce`. The first step shows which case holds. A motor that is overcome for the third time yields to loads, because of gains that
pybullet does not report: it and its body's other motors count as forces until it is switched off. Nothing in the client is changed, and
everything is read from it anew at each step. What motors and constraints gave is read right after the step (`read_loads`), because
`restoreState` of pybullet does not take that back.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.bullet.pybullet_import import pybullet
from coupling.bullet.shapes import require_askable
from coupling.master.saved_fields import SavedFields
from coupling.multibody.joint_constraints import Articulation, Joints, PointJoint
from coupling.multibody.joint_tree import ArticulatedTree, TreeLink, no_axes
from oilsim.backend.arrays import Array, Flags

LinkKey = tuple[int, int]  # unique id of the body and index of the link, -1 for the base

FAR = 1e6  # [m, m/s, rad/s] where numbers mean nothing any more
SPENT = 1e-3  # of a constraint's limit: how near to it the constraint gives all
MOTOR_SPENT = 1e-7  # relative change of a motor's torque in a step, whichever way, below which it gives all: where a load turns it is 1e-4
BEATEN = (
    0.1  # of the change of rate that a motor's torque makes in a step: what, against it, tells that the load is greater
)
SOFT = 3  # times that a motor is overcome, having held, before it is taken for one that yields to all loads, as with a small velocityGain
STEADY = 0.25  # [rad/s2, m/s2] of a joint up to which its motor is said to keep its rate: what iterations of the engine leave
LEARNT = (  # what a body learns of its motors and constraints
    "_rates", "_torques", "_last_torques", "_given", "_most", "_beaten", "_yielded", "_way", "_loads", "_spent",
)  # fmt: skip
OF_LINKS = 2  # kind of a body in `getDynamicsInfo`; 1 has maximal coordinates and does not tell its shape, 3 is soft
KEPT = {pybullet.JOINT_POINT2POINT: False, pybullet.JOINT_FIXED: True}  # constraints known here: do they hold the turn?


@dataclass(frozen=True, eq=False)
class LinkSystem:
    """Links of some bodies at one instant, one row for each in the order of `keys`.

    pose (L, 7) [m, 1] of the centres of mass; twist (L, 6) [m/s, rad/s]; inverse_mass (6 L, 6 L) [1/kg] joints included;
    acceleration (L, 6) [m/s2, rad/s2] by gravity and turning, joints included; is_free (L,): true for all links but held bases, which
    forces do not move.
    """

    keys: list[LinkKey]
    pose: Array
    twist: Array
    inverse_mass: Array
    acceleration: Array
    is_free: Flags


class LinkedBody(SavedFields):
    """One body of a client; ValueError if it has been removed there, if another one has its unique id, or if it cannot be read."""

    STATE = LEARNT
    LOOSE = LEARNT

    def __init__(self, client: int, body: int) -> None:
        _require_body(client, body)
        self._client, self.unique_id = client, body
        count = pybullet.getNumJoints(body, physicsClientId=client)
        self._joints = [pybullet.getJointInfo(body, n, physicsClientId=client) for n in range(count)]
        self._refuse_planar()
        self._rates = np.full((count, 3), np.nan)
        self._torques = np.full((count, 3), np.nan)  # [N, N m] of the motors in the step before the last
        self._last_torques = np.zeros((count, 3))  # [N, N m] of the motors in the last step
        self._loads: dict[int, Array] = {}  # [N, N m] of the body's constraints in the last step
        require_askable(client, body)
        self._names, self._shapes = self._told_names(), self._told_shapes()
        self._given = np.full((count, 3), np.inf)  # torques [N, N m] of motors that were overcome
        self._way = np.zeros((count, 3))  # changes of rate in the last step, of joints that turned against their motors
        self._yielded = np.zeros(count)  # how often a joint that was held was overcome since its motor is on
        self._most = np.zeros((count, 3))  # torques [N, N m] that motors have given so far
        self._beaten = np.full((count, 3), np.nan)  # torques [N, N m] of motors whose joints last turned against them
        self._spent: set[tuple[int, float]] = set()  # constraints that once gave all, and how much that was [N, N m]
        self._coordinates: list[tuple[float, ...]] = []  # of the joints at the last reading
        self._loose: list[TreeLink] = []  # at the last reading, as if no motor held a joint

    @property
    def keys(self) -> list[LinkKey]:
        """Keys of the links, base first."""
        return [(self.unique_id, link) for link in range(-1, len(self._joints))]

    @property
    def is_held(self) -> bool:
        """True if the base did not move under forces at the last reading."""
        return self._loose[0].mass == 0.0

    @property
    def resting_joints(self) -> dict[int, tuple[float, ...]]:
        """Coordinates, in [rad] and [m], of the joints whose rates were exactly 0 at the last reading, by number."""
        return {n: where for n, where in enumerate(self._coordinates) if where and not self._rates[n].any()}

    @property
    def masses(self) -> Array:
        """Masses (L,) [kg] of the links at the last reading."""
        return np.array([link.mass for link in self._loose])

    def read(self, step_size: float) -> tuple[Array, list[TreeLink]]:
        """Read poses (L, 7) [m, 1] of the centres of mass, and the links as a tree, base first; `step_size` [s] since the last call."""
        self._refuse_another()
        position, orientation, states = self._states()
        poses, twists = self._motion(position, orientation, states)
        self._refuse_lost(poses, twists)
        turns = Rotation.from_quat(poses[:, 3:]).as_matrix()
        no_joint = _axes(pybullet.JOINT_FIXED, np.zeros(3))
        self._loose = [self._link(-1, -1, poses[0], turns[0], twists[0], position, no_joint)]
        for n, (joint, state) in enumerate(zip(self._joints, states, strict=True)):
            axes = _axes(joint[2], turns[n + 1] @ joint[13])  # told in the frame of the centre of mass, not of the link
            self._loose.append(self._link(n, joint[16], poses[n + 1], turns[n + 1], twists[n + 1], state[4], axes))
        kept = [False, *self._kept_joints(step_size)]
        links = [
            replace(link, slides=no_axes(), turns=no_axes()) if held else link
            for link, held in zip(self._loose, kept, strict=True)
        ]
        return poses, links

    def holds(self, constraint: int) -> bool:
        """Tell whether a constraint is as good as rigid: it carried a force in the last step, and was never at its limit.

        One that reached its limit stays a force; otherwise it would change between the two whenever its load falls. pybullet reports 500 N
        for a constraint whose limit was never set and which bears far more; beyond 500 N it is not at its limit.
        """
        limit = float(pybullet.getConstraintInfo(constraint, physicsClientId=self._client)[10])
        load = np.abs(self._loads.get(constraint, np.zeros(1)))  # a new one has not carried anything yet
        if (np.abs(load - limit) <= SPENT * limit).any():
            self._spent.add((constraint, limit))
        return bool(load.any()) and (constraint, limit) not in self._spent

    def read_loads(self, constraints: Iterable[int]) -> None:
        """Read what the motors, and these constraints of the body, gave in the client's last step."""
        client = self._client
        self._loads = {one: np.array(pybullet.getConstraintState(one, physicsClientId=client)) for one in constraints}
        self._last_torques = np.array([_triple(state[3]) for state in self._joint_states()]).reshape(-1, 3)

    def fastest_change(self, wrenches: Array, gravity: Array, step_size: float) -> float:
        """Return the largest rate change [m/s, rad/s] by wrenches (L, 6) [N, N m] and gravity (3,) [m/s2] in a step without motors."""
        tree = ArticulatedTree(self._loose, is_fixed=self.is_held)
        return step_size * float(np.abs(tree.rate_changes(gravity, wrenches)).max(initial=0.0))

    def motion(self) -> tuple[Array, Array]:
        """Return the present poses (L, 7) [m, 1] and twists (L, 6) [m/s, rad/s] of the centres of mass."""
        return self._motion(*self._states())

    def _motion(
        self, position: Sequence[float], orientation: Sequence[float], states: Sequence[tuple]
    ) -> tuple[Array, Array]:
        poses = [(*position, *orientation), *((*state[0], *state[1]) for state in states)]
        base = np.concatenate(pybullet.getBaseVelocity(self.unique_id, physicsClientId=self._client))
        return np.array(poses), np.array([base, *(np.concatenate(state[6:8]) for state in states)])

    def _refuse_planar(self) -> None:
        """Raise ValueError for a planar joint: pybullet reports 0 for its axis, so the link's motion is unknown."""
        for index, joint in enumerate(self._joints):
            if joint[2] == pybullet.JOINT_PLANAR:
                raise ValueError(
                    f"joint {index} ({joint[1].decode()}) of body {self.unique_id} is planar, and pybullet does not report its axis, "
                    "allowed: two prismatic joints and a revolute one instead"
                )

    def _refuse_lost(self, poses: Array, twists: Array) -> None:
        if not (np.abs(poses) < FAR).all() or not (np.abs(twists) < FAR).all():
            raise ValueError(
                f"body {self.unique_id} is at {poses[0, :3].tolist()} m in the client, a link at {np.abs(twists).max():.3g} m/s or rad/s, "
                f"allowed: below {FAR:g}; pybullet's simulation is unstable, take a shorter setTimeStep"
            )

    def _refuse_another(self) -> None:
        try:
            is_known = self._told_names() == self._names and self._told_shapes() == self._shapes
        except pybullet.error as cause:
            raise ValueError(
                f"body {self.unique_id} is no longer in the client, allowed: remove_body({self.unique_id}), which takes it out of the fluid"
            ) from cause
        if not is_known:
            raise ValueError(
                f"body {self.unique_id} is not the one that was added to the fluid, but has its unique id, allowed: "
                f"remove_body({self.unique_id}), then add_body({self.unique_id})"
            )

    def _told_names(self) -> tuple[object, ...]:
        """The body's names and the number of its joints; pybullet.error if it is not there."""
        client, body = self._client, self.unique_id
        return pybullet.getBodyInfo(body, physicsClientId=client), pybullet.getNumJoints(body, physicsClientId=client)

    def _told_shapes(self) -> list[list[tuple]]:
        """The collision shapes of its links, by which a body is known; asked only of a body that has the names of one that was tried."""
        client, body = self._client, self.unique_id
        links = range(-1, pybullet.getNumJoints(body, physicsClientId=client))
        told = [pybullet.getCollisionShapeData(body, link, physicsClientId=client) for link in links]
        # the numbers of body and link, which come first, pybullet leaves unset for all but a link's first shape
        return [[shape[2:] for shape in shapes] for shapes in told]

    def _states(self) -> tuple[Sequence[float], Sequence[float], Sequence[tuple]]:
        """Return position and orientation of the base, and pybullet's states of the other links."""
        base = pybullet.getBasePositionAndOrientation(self.unique_id, physicsClientId=self._client)
        if not self._joints:
            return (*base, ())
        links = list(range(len(self._joints)))
        return (*base, pybullet.getLinkStates(self.unique_id, links, 1, 1, physicsClientId=self._client))

    def _joint_states(self) -> Sequence[tuple]:
        """Return pybullet's states of the joints."""
        if not self._joints:
            return ()
        numbers = range(len(self._joints))
        return tuple(pybullet.getJointStatesMultiDof(self.unique_id, numbers, physicsClientId=self._client))

    def _link(
        self, index: int, parent: int, pose: Array, rotation: Array, twist: Array, joint_point: Sequence[float],
        axes: tuple[Array, Array],
    ) -> TreeLink:  # fmt: skip
        mass, _, moments, *_ = pybullet.getDynamicsInfo(self.unique_id, index, physicsClientId=self._client)
        return TreeLink(
            parent=parent + 1 if index >= 0 else -1, position=pose[:3].copy(), twist=twist, mass=float(mass),
            inertia=(rotation * moments) @ rotation.T, joint_point=np.array(joint_point), slides=axes[0], turns=axes[1],
        )  # fmt: skip

    def _kept_joints(self, step_size: float) -> list[bool]:
        """List the joints that a motor held in the last step: at their rates, or with a torque that it could still change."""
        if not self._joints:
            return []
        states, torques = self._joint_states(), self._last_torques
        rates = np.array([_triple(state[1]) for state in states])
        self._coordinates = [tuple(state[0]) for state in states]
        changes = rates - self._rates
        steady = (np.abs(changes) <= STEADY * step_size).all(axis=1)
        overcome = ~steady & self._overcome(torques, changes, step_size)
        stronger = (np.abs(torques) > (1.0 + MOTOR_SPENT) * self._given).any(axis=1)
        self._given[stronger] = np.inf
        is_on = (torques != 0.0).any(axis=1)
        self._yielded = np.where(is_on, self._yielded + (overcome & np.isinf(self._given).all(axis=1)), 0)
        self._given[overcome] = np.abs(torques[overcome])
        kept = is_on & np.isinf(self._given).all(axis=1) & (self._yielded < SOFT).all()
        self._rates, self._torques = rates, torques
        return [bool(each) for each in kept]

    def _overcome(self, torques: Array, changes: Array, step_size: float) -> Flags:
        """Tell which motors are at their limit: same torque size as in the step before, or overcome by `changes` of rate (J, 3).

        A joint that slows down as ordered turns against its motor, too, but with less torque than before. A limit that was lowered shows as
        the same torque twice, and a yielding motor turns against its torque first to one side, then to the other.
        """
        size = np.abs(torques)
        spent = np.all(_equal(size, np.abs(self._torques)), axis=1, keepdims=True)
        tree = ArticulatedTree(self._loose, is_fixed=self.is_held)
        made = BEATEN * step_size * tree.mobility()[1:, None] * size
        gave_way = (torques * changes < 0.0) & (np.abs(changes) > made)
        all_it_had = (size >= (1.0 - MOTOR_SPENT) * self._most) | _equal(size, self._beaten)
        to_and_fro = changes * self._way < 0.0
        self._way = np.where(gave_way, changes, 0.0)
        self._beaten, self._most = np.where(gave_way, size, self._beaten), np.maximum(self._most, size)
        return np.any(spent | gave_way & (all_it_had | to_and_fro), axis=1)


def read_links(client: int, bodies: Iterable[LinkedBody], gravity: Array, step_size: float) -> LinkSystem:
    """Read every link of the bodies, under gravity (3,) [m/s2]; drift of constraints is corrected within `step_size` [s]."""
    keys: list[LinkKey] = []
    poses, twists, masses, accelerations, is_free = [np.zeros((0, 7))], [np.zeros((0, 6))], [], [np.zeros((0, 6))], []
    linked = list(bodies)
    for body in linked:
        pose, links = body.read(step_size)
        fixed_base = links[0].mass == 0.0
        tree = ArticulatedTree(links, is_fixed=fixed_base)
        keys += body.keys
        poses.append(pose)
        twists.append(np.array([link.twist for link in links]))
        masses.append(tree.inverse_mass())
        accelerations.append(tree.acceleration(gravity))
        is_free += [not fixed_base, *[True] * (len(links) - 1)]
    inverse_mass, first = np.zeros((6 * len(keys), 6 * len(keys))), 0
    for block in masses:
        last = first + len(block)
        inverse_mass[first:last, first:last], first = block, last
    acceleration, pose, twist = np.concatenate(accelerations), np.concatenate(poses), np.concatenate(twists)
    joints = _constraints(client, linked, {key: row for row, key in enumerate(keys)})
    if joints:
        tied = Articulation(Joints(joints, len(pose)), pose, twist, inverse_mass)
        inverse_mass, acceleration = tied.inverse_mass(), tied.acceleration(acceleration, step_size)
    return LinkSystem(keys, pose, twist, inverse_mass, acceleration, np.array(is_free, dtype=bool))


def read_loads(client: int, bodies: Iterable[LinkedBody]) -> None:
    """Let bodies read what their motors and constraints gave in the client's last step; to be called before the client is rolled back."""
    linked = list(bodies)
    constraints: dict[int, list[int]] = {body.unique_id: [] for body in linked}
    for identifier in _constraint_ids(client):
        first, _, _, _, kind, *_ = pybullet.getConstraintInfo(identifier, physicsClientId=client)
        if first in constraints and kind in KEPT:
            constraints[first].append(identifier)
    for body in linked:
        body.read_loads(constraints[body.unique_id])


def _require_body(client: int, body: int) -> None:
    """Check the unique id of a body of links, as `LinkedBody` reads them: TypeError for what is not a number, else ValueError."""
    if not isinstance(body, int | np.integer):
        raise TypeError(f"body is {body!r}, allowed: the unique id that pybullet gave it, a whole number")
    count = pybullet.getNumBodies(physicsClientId=client)
    known = [pybullet.getBodyUniqueId(index, physicsClientId=client) for index in range(count)]
    if body not in known:
        raise ValueError(
            f"body {body} is not in the client, allowed: {', '.join(map(str, known)) or 'none, because the client is empty'}"
        )
    if pybullet.getDynamicsInfo(body, -1, physicsClientId=client)[10] != OF_LINKS:
        raise ValueError(
            f"body {body} is soft or has maximal coordinates, allowed: a body loaded without useMaximalCoordinates=True"
        )


def _equal(torques: Array, others: Array) -> Flags:
    """Mark entries that are equal up to rounding."""
    return np.abs(torques - others) <= MOTOR_SPENT * torques


def _triple(numbers: Sequence[float]) -> list[float]:
    """Extend to as many numbers as a spherical joint has."""
    return [*numbers, *[0.0] * (3 - len(numbers))]


def _axes(kind: int, axis: Array) -> tuple[Array, Array]:
    """Return the axes (k, 3) along which a joint slides and about which it turns."""
    none, single = np.zeros((0, 3)), axis[None]
    if kind == pybullet.JOINT_REVOLUTE:
        return none, single
    if kind == pybullet.JOINT_PRISMATIC:
        return single, none
    if kind == pybullet.JOINT_SPHERICAL:
        return none, np.eye(3)
    return none, none


def _constraint_ids(client: int) -> list[int]:
    """List the unique ids of all constraints of a client."""
    count = pybullet.getNumConstraints(physicsClientId=client)
    return [pybullet.getConstraintUniqueId(index, physicsClientId=client) for index in range(count)]


def _constraints(client: int, linked: Iterable[LinkedBody], row_of: dict[LinkKey, int]) -> list[PointJoint]:
    """List the constraints among the links, and between them and fixed things."""
    joints, bodies = [], {body.unique_id: body for body in linked}
    for identifier in _constraint_ids(client):
        first, first_link, second, second_link, kind, _, first_point, second_point, *_ = pybullet.getConstraintInfo(
            identifier, physicsClientId=client
        )
        row, other = row_of.get((first, first_link)), row_of.get((second, second_link), -1)
        if row is None or kind not in KEPT or (other < 0 and second >= 0) or not bodies[first].holds(identifier):
            continue  # what it does comes as a force
        joints.append(PointJoint(row, other, np.array(first_point), np.array(second_point), KEPT[kind]))
    return joints
