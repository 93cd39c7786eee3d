"""A scenario becomes an FMU: another program's master gets from it what oilsim's own gets, bit for bit."""

import matplotlib.pyplot as plt
import numpy as np
from fmpy import simulate_fmu

from scenarios import ScenarioRun, main

SPACING, STEP, TIME = 0.05, 0.02, 2.0  # m, s, s
CHANGES = [
    f"fluid.particle_spacing={SPACING}",
    f"run.communication_step={STEP}",
    "bodies.box.position=[0.45, 0.45, 0.5]",
]
ARCHIMEDES = 0.45 + 0.05 * 0.3**2 / 0.9**2  # m: half of it is in the water, which rises as the box comes down by 5 cm

options = [word for change in CHANGES for word in ("--set", change)]
assert main(["export-fmu", "floating-box", *options, "--threads", "1", "-o", "box.fmu"]) == 0
fmu = simulate_fmu("box.fmu", stop_time=TIME, step_size=STEP, output_interval=STEP, output=["bodies.box.z"])
with ScenarioRun("floating-box", *CHANGES) as run:
    run.run(TIME)
    own = run.readings().body("box")

figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
axes.plot(fmu["time"], 100.0 * fmu["bodies.box.z"], "o", markersize=3, label="the FMU, in FMPy")
axes.plot(own.time, 100.0 * own.pose[:, 2], linewidth=1, label="the run itself")
axes.axhline(100.0 * ARCHIMEDES, color="0.6", linestyle="--", label="Archimedes")
axes.set(title="A box that falls into water", xlabel="time [s]", ylabel="height of its middle [cm]")
axes.legend(frameon=False)
figure.savefig("fmu_out.png", dpi=120)

different = np.count_nonzero(fmu["bodies.box.z"] != own.pose[:, 2])
print(f"{len(own.time)} heights, {different} of them different between the FMU and the run")
assert different == 0
height = own.pose[-47:, 2].mean()  # over a period of its heave
print(f"height of the box: {height:.4f} m; Archimedes: {ARCHIMEDES:.4f} m within {0.3 * SPACING:.4f} m")
assert abs(height - ARCHIMEDES) < 0.3 * SPACING
