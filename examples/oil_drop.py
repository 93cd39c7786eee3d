"""A drop of oil rises in water: at first it has to push as much water aside as it displaces."""

import matplotlib.pyplot as plt
import numpy as np

from oilsim import Fluid, FluidConfig, Phase, block, tank_walls

RADIUS, SPACING, OIL, WATER = 0.05, 0.008, 850.0, 1000.0  # m, m, kg/m3, kg/m3
LOWER, UPPER = (-0.2, -0.1, -0.15), (0.2, 0.1, 0.25)

phases = Phase(name="water", rest_density=WATER, dynamic_viscosity=1e-3), Phase(name="oil", rest_density=OIL)
room = {"lower": (-0.3, -0.2, -0.2), "upper": (0.3, 0.2, 0.4)}
fluid = Fluid(FluidConfig(particle_spacing=SPACING, dimension=2, phases=phases, **room), threads=1)
fluid.add_boundary(tank_walls(LOWER, UPPER, SPACING, sides=("-x", "+x", "-z"), dimension=2))
points = block(LOWER, UPPER, SPACING, dimension=2)
is_oil = np.hypot(points[:, 0], points[:, 2]) < RADIUS
fluid.add_particles(points[~is_oil], phase="water")
fluid.add_particles(points[is_oil], phase="oil")

figure, places = plt.subplots(1, 3, figsize=(9, 3.4), sharey=True, layout="constrained")
times, heights = np.arange(0.0, 0.61, 0.02), []
for time in times:
    if time > 0.0:
        fluid.advance(0.02)
    heights.append(fluid.phase_positions("oil")[:, 2].mean())
    if round(time, 2) in (0.0, 0.3, 0.6):
        axes = places[round(time / 0.3)]
        for phase, color in (("water", "#a9d3e6"), ("oil", "#3b2a1a")):
            x, _, z = 100.0 * fluid.phase_positions(phase).T
            axes.scatter(x, z, s=24, color=color, linewidths=0)
        axes.set(title=f"{time:.1f} s", xlabel="x [cm]", aspect="equal")
places[0].set_ylabel("z [cm]")
figure.savefig("oil_drop.png", dpi=120)

early = times < 0.17
acceleration = 2.0 * np.polyfit(times[early] ** 2, np.array(heights)[early], 1)[0]
carried = WATER * (0.2**2 + RADIUS**2) / (0.2**2 - RADIUS**2)  # water around a cylinder in a round tank of 0.2 m
theory = 9.81 * (WATER - OIL) / (OIL + carried)
print(
    f"acceleration of the drop: {acceleration:.3f} m/s2; lift over moved mass: {theory:.3f} m/s2 within {0.2 * theory:.3f}"
)
assert abs(acceleration - theory) < 0.2 * theory
