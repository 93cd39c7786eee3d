"""A recording becomes arrays of numpy: the front of a dam break beside the experiment of Martin and Moyce (1952)."""

import matplotlib.pyplot as plt
import numpy as np

from recordings import Recorder, Replay
from scenarios import ScenarioRun

WIDTH, SPACING = 0.5, 0.025  # m: of the column, and of the particles
MEASURED = np.array([[0.832, 1.217], [1.219, 1.474], [1.997, 2.292], [2.547, 2.995], [3.345, 4.134]])

with ScenarioRun("dam-break", f"fluid.particle_spacing={SPACING}") as run:
    run.watch(Recorder("replay_to_numpy.rrd"))
    run.run(0.5)

replay = Replay("replay_to_numpy.rrd")
frames = list(replay.phase_frames("water"))  # communication step, time [s], particles
times = np.array([time for _, time, _ in frames])
fronts = np.array([frame.position[:, 0].max() + 0.5 * SPACING for _, _, frame in frames])
level = replay.scalars["probes/gauge"]  # and any series: level.time, level.value
print(f"{len(frames)} frames of {len(frames[0][2].position)} particles, {len(level.value)} readings of the gauge")

scaled, reached = times * np.sqrt(2.0 * 9.81 / WIDTH), fronts / WIDTH
figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
axes.plot(scaled, reached, label="particles")
axes.plot(*MEASURED.T, "o", label="Martin and Moyce")
axes.set(title="Front of a dam break", xlabel="t √(2g / a)", ylabel="x / a")
axes.legend(frameon=False)
figure.savefig("replay_to_numpy.png", dpi=120)

# the front of the particles is ahead of the measured one, so the speeds are compared
runs = (reached > 2.0) & (reached < 3.9)
speed, measured = np.polyfit(scaled[runs], reached[runs], 1)[0], np.polyfit(*MEASURED[2:].T, 1)[0]
print(f"speed of the front: {speed:.3f} √(2ga); measured: {measured:.3f} √(2ga) within {0.1 * measured:.3f}")
assert abs(speed - measured) < 0.1 * measured
