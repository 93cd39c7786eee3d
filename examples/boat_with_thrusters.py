"""A boat with two thrusters in a pybullet world: what they push is the momentum of boat and water."""

import numpy as np
import pybullet

from coupling import attach_fluid
from coupling.testkit import watch
from oilsim import Fluid, FluidConfig, Phase, block, tank_walls
from recordings import Recorder, draw_picture

SIZE, SPACING, STEP = np.array([0.6, 0.3, 0.2]), 0.05, 0.01  # m, m, s
THRUST = {0.1: 6.0, -0.1: 3.0}  # N of each thruster by its place, m to port
LENGTH, BEAM, DEPTH = 1.6, 1.2, 0.3  # m of the water, which repeats to all sides: no wall takes momentum

client = pybullet.connect(pybullet.DIRECT)
pybullet.setGravity(0.0, 0.0, -9.81)
pybullet.setTimeStep(STEP)
shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=0.5 * SIZE)
boat = pybullet.createMultiBody(500.0 * SIZE.prod(), shape, basePosition=[0.5, 0.6, DEPTH])
pybullet.changeDynamics(boat, -1, linearDamping=0.0, angularDamping=0.0)

water = Phase(name="water", rest_density=1000.0, dynamic_viscosity=1e-3)
room = {"lower": (0.0, 0.0, -0.2), "upper": (LENGTH, BEAM, 0.8), "periodic": (True, True, False)}
fluid = Fluid(FluidConfig(particle_spacing=SPACING, phases=(water,), **room), threads=1)
floor = tank_walls((0, 0, 0), (LENGTH, BEAM, 0.6), SPACING, sides=("-z",), periodic=(True, True, False))
fluid.add_boundary(floor)
points = block((0, 0, 0), (LENGTH, BEAM, DEPTH), SPACING)
beside = (abs(points - [0.5, 0.6, DEPTH]) > 0.5 * SIZE).any(axis=1)
fluid.add_particles(points[beside], phase="water")

pushed = np.zeros(2)  # [N s] along x and y
with watch(attach_fluid(client, fluid, [boat]), {"boat": boat}, name="boat with thrusters") as world:
    world.watch(Recorder("boat_with_thrusters.rrd"))
    for _ in range(200):
        ahead = np.array(pybullet.getMatrixFromQuaternion(pybullet.getBasePositionAndOrientation(boat)[1])[0:7:3])
        for place, thrust in THRUST.items():
            pybullet.applyExternalForce(boat, -1, [thrust, 0, 0], [-0.3, place, 0], pybullet.LINK_FRAME)
            pushed += thrust * STEP * ahead[:2]
        world.step()
draw_picture("boat_with_thrusters.rrd", "boat_with_thrusters.png")

velocity, turning = pybullet.getBaseVelocity(boat)
moving = 500.0 * SIZE.prod() * np.array(velocity[:2]) + fluid.momentum()[:2]
impulse, error = np.linalg.norm(pushed), np.linalg.norm(moving - pushed)
print(f"the boat makes {np.hypot(*velocity[:2]):.2f} m/s and turns to starboard by {-turning[2]:.2f} rad/s")
assert turning[2] < -0.1  # the thruster at port pushes harder
print(
    f"momentum: {np.linalg.norm(moving):.3f} N s; impulse of the thrusters: {impulse:.3f} N s within {0.05 * impulse:.3f} N s"
)
assert error < 0.05 * impulse
