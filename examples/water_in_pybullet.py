"""Water in a pybullet world: a wooden cube floats as deep as Archimedes says."""

import pybullet

from coupling import attach_fluid
from coupling.testkit import pool, watch
from recordings import Recorder, draw_picture

SIDE, DENSITY, SPACING = 0.2, 600.0, 0.05  # m, kg/m3, m

client = pybullet.connect(pybullet.DIRECT)
pybullet.setGravity(0.0, 0.0, -9.81)
pybullet.setTimeStep(0.01)
shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.5 * SIDE] * 3)
cube = pybullet.createMultiBody(DENSITY * SIDE**3, shape, basePosition=[0.3, 0.3, 0.3])  # 4 cm too high
pybullet.changeDynamics(cube, -1, linearDamping=0.0, angularDamping=0.0)  # water damps, pybullet need not

lower, upper = (0.0, 0.0, 0.0), (0.6, 0.6, 0.5)
fluid, tank = pool(client, [cube], lower=lower, upper=upper, depth=0.3, particle_spacing=SPACING)
with watch(attach_fluid(client, fluid, [cube]), {"cube": cube}, basin=tank, name="cube in a pybullet world") as world:
    world.watch(Recorder("water_in_pybullet.rrd"))
    world.run(1.5)  # instead of calls of pybullet.stepSimulation()
    readings = world.readings()
draw_picture("water_in_pybullet.rrd", "water_in_pybullet.png")

height = readings.body("cube").pose[-90:, 2].mean()  # of its middle, over a period of its heave
draft, archimedes = readings.level() - height + 0.5 * SIDE, DENSITY / 1000.0 * SIDE
print(f"draft of the cube: {draft:.4f} m; Archimedes: {archimedes:.4f} m within {0.3 * SPACING:.4f} m")
assert abs(draft - archimedes) < 0.3 * SPACING
