"""Random bodies of a pybullet client, as a user of the plugin makes or loads them, and a place for each."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pybullet
import pybullet_data
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tests.stress.random_scenes import TRIES, Dice

Array = NDArray[np.float64]

DATA = Path(pybullet_data.getDataPath())
URDFS = (
    "duck_vhacd.urdf",
    "cube_small.urdf",
    "sphere2.urdf",
    "teddy_vhacd.urdf",
    "r2d2.urdf",
    "jenga/jenga.urdf",
    "racecar/racecar.urdf",
)
JOINTS = (pybullet.JOINT_REVOLUTE, pybullet.JOINT_SPHERICAL, pybullet.JOINT_PRISMATIC, pybullet.JOINT_FIXED)
REACH = {pybullet.JOINT_REVOLUTE: 1.0, pybullet.JOINT_PRISMATIC: 0.01}  # [rad], [m] of motors


def loose_body(dice: Dice, client: int, spacing: float, size: Array) -> int:
    """A body of a random kind, some 4 spacings to half the tank across, at the origin."""
    across = dice.between(4.0, 0.55 * float(size.min()) / spacing) * spacing
    kind = dice.choice("primitive", "primitive", "primitive", "chain", "urdf", "mesh")
    if kind == "urdf":
        body = _loaded(dice, client, across)
    elif kind == "chain":
        body = _chain(dice, client, across)
    else:
        mass = dice.scale(20.0, 5000.0) * 0.3 * across**3
        shape = _primitive(dice, client, across) if kind == "primitive" else _mesh(dice, client, across)
        body = pybullet.createMultiBody(mass, shape, physicsClientId=client)
    # as the plugin asks for where joints of light links are held by motors
    pybullet.changeDynamics(body, -1, maxJointVelocity=1e9, physicsClientId=client)
    if dice.chance(0.6):
        pybullet.changeDynamics(body, -1, linearDamping=0.0, angularDamping=0.0, physicsClientId=client)
    return body


def _primitive(dice: Dice, client: int, across: float) -> int:
    kind = dice.choice(pybullet.GEOM_BOX, pybullet.GEOM_SPHERE, pybullet.GEOM_CYLINDER, pybullet.GEOM_CAPSULE)
    if kind == pybullet.GEOM_BOX:
        half = (0.5 * across * dice.random.uniform(0.3, 1.0, 3)).tolist()
        return pybullet.createCollisionShape(kind, halfExtents=half, physicsClientId=client)
    return pybullet.createCollisionShape(kind, radius=0.3 * across, height=0.4 * across, physicsClientId=client)


def _mesh(dice: Dice, client: int, across: float) -> int:
    """The duck (about one unit across), as pybullet's hull of it."""
    scale = (across * dice.random.uniform(0.5, 1.0, 3)).tolist()
    return pybullet.createCollisionShape(
        pybullet.GEOM_MESH, fileName=str(DATA / "duck_vhacd.obj"), meshScale=scale, physicsClientId=client
    )


def _loaded(dice: Dice, client: int, across: float) -> int:
    """A URDF file, scaled to be `across`, its masses with it."""
    name = dice.choice(*URDFS)
    body = pybullet.loadURDF(name, physicsClientId=client)
    lower, upper = _bounds(client, body)
    pybullet.removeBody(body, physicsClientId=client)
    body = pybullet.loadURDF(name, globalScaling=across / float((upper - lower).max()), physicsClientId=client)
    lower, upper = _bounds(client, body)
    density = dice.scale(50.0, 3000.0)
    links = range(-1, pybullet.getNumJoints(body, physicsClientId=client))
    total = sum(pybullet.getDynamicsInfo(body, link, physicsClientId=client)[0] for link in links)
    factor = density * 0.4 * float(np.prod(upper - lower)) / total
    for link in links:
        mass, _, moments, *_ = pybullet.getDynamicsInfo(body, link, physicsClientId=client)
        moments = (np.array(moments) * factor).tolist()
        pybullet.changeDynamics(body, link, mass=factor * mass, localInertiaDiagonal=moments, physicsClientId=client)
    return body


def _chain(dice: Dice, client: int, across: float) -> int:
    """Boxes in a row, joined in any way, `across` long."""
    links = dice.choice(1, 2, 3)
    edge = across / (1.2 * (links + 1))
    density = dice.scale(20.0, 3000.0)
    half = [0.5 * edge, 0.5 * edge * dice.between(0.5, 1.0), 0.5 * edge * dice.between(0.5, 1.0)]
    mass = density * 8.0 * math.prod(half)
    shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, physicsClientId=client)
    upright = [[0, 0, 0, 1]] * links
    return pybullet.createMultiBody(
        mass, shape, linkMasses=[mass] * links, linkCollisionShapeIndices=[shape] * links,
        linkVisualShapeIndices=[-1] * links, linkPositions=[[0.6 * edge if n == 0 else 1.2 * edge, 0, 0] for n in range(links)],
        linkOrientations=upright, linkInertialFramePositions=[[0.6 * edge, 0, 0]] * links,
        linkInertialFrameOrientations=upright, linkParentIndices=list(range(links)),
        linkJointTypes=[dice.choice(*JOINTS) for _ in range(links)],
        linkJointAxis=[dice.choice([0, 1, 0], [0, 0, 1], [1, 0, 0]) for _ in range(links)], physicsClientId=client,
    )  # fmt: skip


def placed(
    dice: Dice, client: int, body: int, others: list[int], size: Array, spacing: float, above: float = 0.0
) -> bool:
    """Put a body where it touches nothing, higher than `above` tank heights; it is removed where no place is found."""
    for _ in range(TRIES):
        place = (dice.random.uniform(size=3) * (1.0, 1.0, 1.5 - above) + (0.0, 0.0, above)) * size
        turn = Rotation.from_rotvec(dice.random.normal(0.0, 1.0, 3)).as_quat()
        pybullet.resetBasePositionAndOrientation(body, place, turn, physicsClientId=client)
        if _is_free(client, body, others, size, spacing):
            return True
    pybullet.removeBody(body, physicsClientId=client)
    return False


def _bounds(client: int, body: int) -> tuple[Array, Array]:
    """Corners of the box around all links."""
    links = range(-1, pybullet.getNumJoints(body, physicsClientId=client))
    boxes = np.array([pybullet.getAABB(body, link, physicsClientId=client) for link in links])
    boxes = boxes[(boxes[:, 1] > boxes[:, 0]).all(axis=1)]  # links without a shape have none
    return boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)


def _is_free(client: int, body: int, others: list[int], size: Array, spacing: float) -> bool:
    lower, upper = _bounds(client, body)
    if (lower < spacing).any() or (upper > size * (1.0, 1.0, 2.0) - spacing).any():
        return False
    for other in others:
        low, high = _bounds(client, other)
        if (lower < high + spacing).all() and (upper > low - spacing).all():
            return False
    return True


def drive(dice: Dice, client: int, body: int, joint: int, motor: str, reach: float) -> None:
    """Free a hinge or a slide, or let its motor keep a rate or go to a place, `reach` [rad or m] at most."""
    control = pybullet.POSITION_CONTROL if motor == "servo" else pybullet.VELOCITY_CONTROL
    options: dict[str, float] = {"force": 0.0} if motor == "none" else {}
    if motor == "rate":
        options["targetVelocity"] = dice.between(-10.0 * reach, 10.0 * reach)
    elif motor == "servo":
        options["targetPosition"] = dice.between(-reach, reach)
    pybullet.setJointMotorControl2(body, joint, control, **options, physicsClientId=client)
