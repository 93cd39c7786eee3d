"""A robot's arm tilts a cup of water by 60 degrees: the cup keeps what lies below its lip."""

import math
import warnings

import numpy as np
import pybullet
import pybullet_data

from coupling import attach_fluid
from coupling.testkit import watch
from oilsim import Fluid, FluidConfig, Phase, block
from recordings import Recorder, draw_picture

SPACING, SIDE, TILT = 0.02, 0.16, math.radians(60.0)  # m, m inside the cup, rad


def open_box(inside, mass, place, wall=2.0 * SPACING):
    """Return a pybullet body of five plates, two spacings thick."""
    half, deep = [0.5 * length + wall for length in inside[:2]], 0.5 * inside[2]
    sizes = [[*half, 0.5 * wall], *[[0.5 * wall, half[1], deep]] * 2, *[[half[0], 0.5 * wall, deep]] * 2]
    x, y = half[0] - 0.5 * wall, half[1] - 0.5 * wall
    places = [[0, 0, -deep - 0.5 * wall], [-x, 0, 0], [x, 0, 0], [0, -y, 0], [0, y, 0]]
    kinds = [pybullet.GEOM_BOX] * 5
    shape = pybullet.createCollisionShapeArray(kinds, halfExtents=sizes, collisionFramePositions=places)
    return pybullet.createMultiBody(mass, shape, basePosition=place)


warnings.simplefilter("ignore")  # of meshes with holes: the arm is looked at, and does not meet the water
client = pybullet.connect(pybullet.DIRECT)
pybullet.setAdditionalSearchPath(pybullet_data.getDataPath())
pybullet.setGravity(0.0, 0.0, -9.81)
pybullet.setTimeStep(0.01)
arm = pybullet.loadURDF("kuka_iiwa/model.urdf", useFixedBase=True)
pose = np.array([0.0, 0.5, 0.0, -1.0, 0.0, 0.07, 0.0])
for joint, angle in enumerate(pose):
    pybullet.resetJointState(arm, joint, angle)
cup, tray = open_box((SIDE, SIDE, SIDE), 1.0, [0.87, 0.0, 0.76]), open_box((0.5, 0.3, 0.1), 0.0, [1.0, 0.0, 0.15])
hand = pybullet.invertTransform(*pybullet.getLinkState(arm, 6)[:2])
grip = pybullet.multiplyTransforms(*hand, *pybullet.getBasePositionAndOrientation(cup))
pybullet.createConstraint(arm, 6, cup, -1, pybullet.JOINT_FIXED, [0, 0, 0], grip[0], [0, 0, 0], grip[1])

water = Phase(name="water", rest_density=1000.0, dynamic_viscosity=1e-3)
fluid = Fluid(FluidConfig(particle_spacing=SPACING, phases=(water,), lower=(0.4, -0.4, 0.0), upper=(1.6, 0.4, 1.1)), 1)
lower, upper = np.array([0.87, 0.0, 0.76]) + 0.5 * SIDE * np.array([[-1.0], [1.0]])
fluid.add_particles(block(lower, upper, SPACING), phase="water")
full = fluid.particle_count

bodies = {"cup": cup, "tray": tray} | {f"arm-{link + 1}": (arm, link) for link in range(-1, 7)}
with watch(attach_fluid(client, fluid, [cup, tray]), bodies, name="arm that pours") as world:
    world.watch(Recorder("arm_that_pours.rrd"))
    for step in range(230):
        angles = pose + TILT * min(step / 150.0, 1.0) * np.eye(7)[5]  # the wrist turns
        pybullet.setJointMotorControlArray(arm, range(7), pybullet.POSITION_CONTROL, angles, forces=[300.0] * 7)
        world.step()
draw_picture("arm_that_pours.rrd", "arm_that_pours.png")

kept = (fluid.phase_positions("water")[:, 2] > 0.3).sum() / full  # above the tray
tilt = math.acos(pybullet.getMatrixFromQuaternion(pybullet.getBasePositionAndOrientation(cup)[1])[8])
below_lip, within = 0.5 / math.tan(tilt), 0.75 * SPACING / (SIDE * math.sin(tilt))  # 3/4 of a spacing over its surface
print(f"kept: {kept:.3f} of the water; below the lip: {below_lip:.3f} within {within:.3f}")
assert abs(kept - below_lip) < within
