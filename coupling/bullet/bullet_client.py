"""A pybullet client of our own, in which those of pybullet's defaults that spoil physics are corrected.

Damping is 0. Inertia is that of the body, not of its bounding box. Bodies do not fall asleep. Joints do not yield. Pairs are ordered, so
that a step can be repeated. pybullet's axes of a body are the principal ones; those of its mesh are turned against them.
"""

from __future__ import annotations

import tempfile
import weakref
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from coupling.bullet.engine_state import essence, rebuilt
from coupling.bullet.pybullet_import import pybullet
from coupling.multibody.prescribed_motion import Motion, Vector
from coupling.multibody.rotations import turned
from coupling.solids.bodies import MassProperties, convex_vertices
from oilsim.backend.arrays import Array

UNCLIPPED = 1e9  # [m/s, rad/s]; pybullet's limit of 100, applied before joints act, makes jointed bodies lose momentum
UNYIELDING_MASS = 1e12  # [kg], mass of a body on a prescribed motion, which joints and contacts do not move
UNYIELDING_FORCE = 1e15  # [N], limit of a joint; pybullet's own limit is 120 kN at 240 Hz
FREE_GROUP, HELD_GROUP = 1, 2  # collision groups: held bodies do not collide with each other


@dataclass(frozen=True, eq=False)
class BulletBody:
    """A body of the client, with the rotation from its principal axes to its mesh's, and its inverse as a quaternion (4,)."""

    unique_id: int
    principal_axes: Rotation
    to_mesh: Array  # the inverse rotation as a quaternion


class BulletClient:
    """A client without a window; quantities are of centres of mass, in the world frame, in SI units."""

    def __init__(self, gravity: Vector, solver_iterations: int) -> None:
        self._client: int = pybullet.connect(pybullet.DIRECT)
        self._own: bytes | None = None  # a file of the bodies as they are now, for `restore`
        self._hulls: dict[int, tuple[trimesh.Trimesh, Array]] = {}  # of meshes by id; a boom's segments share one
        self._release = weakref.finalize(self, _disconnect, self._client)  # with this object at the latest, and once
        self._call(pybullet.setGravity, *gravity)
        self._call(
            pybullet.setPhysicsEngineParameter,
            deterministicOverlappingPairs=1,
            numSolverIterations=solver_iterations,
            numSubSteps=0,
            enableFileCaching=0,  # caching would keep every restored state, and identify states by name only
        )

    def add_body(
        self, mesh: trimesh.Trimesh, properties: MassProperties, *, is_free: bool, is_prescribed: bool, contact: bool, friction: float
    ) -> BulletBody:  # fmt: skip
        """Add a body that is free, prescribed along a motion, or fixed; `mesh` is about its centre of mass. Friction coefficient [-]."""
        moments, axes = properties.principal_axes()
        shape = self._collision_shape(mesh, axes, is_free=is_free) if contact else -1
        mass = properties.mass if is_free else UNYIELDING_MASS if is_prescribed else 0.0
        turn = Rotation.from_matrix(axes)
        self._own = None
        body = BulletBody(self._call(pybullet.createMultiBody, mass, shape), turn, turn.inv().as_quat())
        self._call(
            pybullet.changeDynamics,
            body.unique_id,
            -1,
            mass=mass,  # before the inertia, which it would overwrite
            localInertiaDiagonal=(moments if is_free else np.full(3, mass)).tolist(),
            linearDamping=0.0,
            angularDamping=0.0,
            jointDamping=0.0,
            maxJointVelocity=UNCLIPPED,
            lateralFriction=friction,
            activationState=pybullet.ACTIVATION_STATE_DISABLE_SLEEPING,
        )
        group, mask = (FREE_GROUP, FREE_GROUP | HELD_GROUP) if is_free else (HELD_GROUP, FREE_GROUP)
        self._call(pybullet.setCollisionFilterGroupMask, body.unique_id, -1, group, mask)
        return body

    def add_half_space(self, point: Vector, normal: Vector, friction: float) -> None:
        """Fill the space behind a plane through `point` [m]; `normal` points out of it. It stops bodies of any speed."""
        self._own = None
        shape = self._call(pybullet.createCollisionShape, pybullet.GEOM_PLANE, planeNormal=normal)
        unique_id = self._call(pybullet.createMultiBody, 0.0, shape, -1, point)
        self._call(pybullet.changeDynamics, unique_id, -1, lateralFriction=friction)
        self._call(pybullet.setCollisionFilterGroupMask, unique_id, -1, HELD_GROUP, FREE_GROUP)

    def add_joint(self, first: BulletBody, first_point: Array, second: BulletBody | None, second_point: Array) -> int:
        """Join a point of two bodies, or of one and the world; points (3,) [m] along the bodies' own axes. Return the joint's handle."""
        pivots = [first.principal_axes.inv().apply(first_point).tolist()]
        pivots.append((second_point if second is None else second.principal_axes.inv().apply(second_point)).tolist())
        second_id = -1 if second is None else second.unique_id
        kind, axis = pybullet.JOINT_POINT2POINT, [0.0, 0.0, 0.0]
        joint: int = self._call(
            pybullet.createConstraint, first.unique_id, -1, second_id, -1, kind, axis, *pivots
        )  # fmt: skip
        self._call(pybullet.changeConstraint, joint, maxForce=UNYIELDING_FORCE)
        if second is not None:
            self._call(pybullet.setCollisionFilterPair, first.unique_id, second_id, -1, -1, 0)
        return joint

    def remove_joint(self, joint: int) -> None:
        """Remove a joint by its handle; its bodies still do not collide with each other."""
        self._call(pybullet.removeConstraint, joint)

    def joint_forces(self, joints: Iterable[int]) -> Array:
        """Return the forces (J, 3) [N] of joints on their first bodies in the last step."""
        forces = [self._call(pybullet.getConstraintState, joint)[:3] for joint in joints]
        return -np.array(forces).reshape(-1, 3)

    def place(self, body: BulletBody, motion: Motion) -> None:
        """Put a body where `motion` says; pybullet stops a body that it places, so the velocity is set after it."""
        orientation = (Rotation.from_quat(motion.orientation) * body.principal_axes).as_quat()
        self._call(pybullet.resetBasePositionAndOrientation, body.unique_id, motion.position, orientation)
        self.set_velocities([body], np.concatenate([motion.linear_velocity, motion.angular_velocity])[None])

    def set_velocities(self, bodies: Sequence[BulletBody], twists: Array) -> None:
        """Set the twists (B, 6) [m/s, rad/s] of bodies."""
        for body, twist in zip(bodies, twists.tolist(), strict=True):
            self._call(pybullet.resetBaseVelocity, body.unique_id, twist[:3], twist[3:])

    def step(self, duration: float) -> None:
        """Make one step of the engine, `duration` [s]."""
        self._call(pybullet.setTimeStep, duration)
        self._call(pybullet.stepSimulation)

    def read(self, bodies: Sequence[BulletBody]) -> tuple[Array, Array]:
        """Read poses (B, 7) [m, 1] with the meshes' axes, and twists (B, 6) [m/s, rad/s], of one body or more."""
        placed, moving = [], []
        for body in bodies:
            position, orientation = self._call(pybullet.getBasePositionAndOrientation, body.unique_id)
            linear, angular = self._call(pybullet.getBaseVelocity, body.unique_id)
            placed.append(position + orientation)
            moving.append(linear + angular)
        pose = np.array(placed)
        pose[:, 3:] = turned(pose[:, 3:], np.array([body.to_mesh for body in bodies]))
        return pose, np.array(moving)

    def touching(self) -> set[tuple[int, int]]:
        """Return the unique ids of all pairs of bodies that were in contact in the last step."""
        return {contact[1:3] for contact in self._call(pybullet.getContactPoints)}

    def overlaps(self) -> dict[tuple[int, int], float]:
        """Return the depths [m] by which bodies overlap at their present places, by pairs of unique ids."""
        self._call(pybullet.performCollisionDetection)
        depths: dict[tuple[int, int], float] = {}
        for contact in self._call(pybullet.getContactPoints):
            pair = contact[1], contact[2]
            depths[pair] = max(depths.get(pair, 0.0), -contact[8])
        return depths

    def save(self) -> bytes:
        """Return the engine's whole state of its bodies' motion; equal for engines that go on equally."""
        return essence(self._file())

    def _file(self) -> bytes:
        """Return the engine's own file of its state."""
        with tempfile.TemporaryDirectory(prefix="oilsim-") as folder:
            path = Path(folder) / "state.bullet"
            self._call(pybullet.saveBullet, str(path))
            return path.read_bytes()

    def restore(self, content: bytes) -> None:
        """Restore the state that `save` returned; ValueError for a content that is damaged or of other bodies, see `engine_state`."""
        if self._own is None:
            self._own = self._file()
        content = rebuilt(content, self._own)
        with tempfile.TemporaryDirectory(prefix="oilsim-") as folder:
            path = Path(folder) / "state.bullet"
            path.write_bytes(content)
            self._call(pybullet.restoreState, fileName=str(path))

    def close(self) -> None:
        """Disconnect the client."""
        self._release()

    def _call(self, function: Callable, *arguments: object, **keywords: object):  # type: ignore[no-untyped-def]
        """Call a pybullet function with this client."""
        return function(*arguments, physicsClientId=self._client, **keywords)

    def _collision_shape(self, mesh: trimesh.Trimesh, axes: Array, *, is_free: bool) -> int:
        """Create the shape along principal axes: convex for a free body, because a moving concave one falls through others."""
        if is_free:
            if id(mesh) not in self._hulls:
                self._hulls[id(mesh)] = mesh, convex_vertices(mesh.vertices)
            vertices = self._hulls[id(mesh)][1] @ axes
            return self._call(pybullet.createCollisionShape, pybullet.GEOM_MESH, vertices=vertices.tolist())
        vertices, indices = (mesh.vertices @ axes).tolist(), mesh.faces.ravel().tolist()
        return self._call(pybullet.createCollisionShape, pybullet.GEOM_MESH, vertices=vertices, indices=indices)


def _disconnect(client: int) -> None:
    """Disconnect a client that nothing else uses."""
    if pybullet.isConnected(client):
        pybullet.disconnect(client)
